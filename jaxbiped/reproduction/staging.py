"""Single missions in scenes, at any fidelity, with their logs."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import jax
import jax.numpy as jnp

from jaxbiped.arenas import Arena, load_scene
from jaxbiped.errors import InputError
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.recorded_driver import Mission, Recorder, turn_once
from jaxbiped.mission.sensor_rig import SensorRig
from jaxbiped.mission.settings import MissionConfig, program
from jaxbiped.mission.state import start
from jaxbiped.study.runner import noise_of, play_one


def load_scenes(folder: Path, names: tuple[str, ...]) -> dict[str, Arena]:
    """Scenes of a folder by name.

    Raises:
      InputError: no such folder, or a scene that is missing or wrong.
    """
    if not folder.is_dir():
        message = "must be a folder with the paper's scenes; in the source tree they are in configs/scenes"
        raise InputError(message, field="--scenes", value=str(folder))
    return {name: load_scene(folder / f"{name}.toml")[1] for name in names}


def play(arena: Arena, config: MissionConfig, strategy: str, seed: int, rig: SensorRig | None = None) -> Mission:
    """One mission, with its log. Consumes `jax.random.key(seed)`."""
    return play_one(arena, config, strategy, noise_of(seed), rig=rig)


def play_changing(
    arena_at: Callable[[int], Arena], config: MissionConfig, strategy: str, seed: int, rig: SensorRig | None = None
) -> Mission:
    """As `play`, in an arena that changes after some decisions; not for simulated bipeds.

    Args:
      arena_at: the arena before each decision, counted from 0. Shapes, start and goal stay.
    """
    arena, settings = arena_at(0), config.settings(strategy)
    static = program(config, tuple(round(float(v), 6) for v in arena.size_xy))
    noise = noise_of(seed)
    world, mind = jax.tree.map(lambda leaf: leaf[None], start(arena, settings, noise, static.spec))
    points = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], settings)
    recorder = Recorder(settings, static, lambda _: None, rig)
    while world.code[0] == Code.RUNNING:
        now = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], arena_at(int(world.decisions[0])))
        before = world
        seen = rig.see(world, mind, now, points) if rig else None
        world, mind, _, command, thought = turn_once(world, mind, now, points, static, seen)
        recorder.decided(0, before, command, thought)
        recorder.concluded(0, world, mind)
    return recorder.mission(arena_at(int(world.decisions[0])), world)
