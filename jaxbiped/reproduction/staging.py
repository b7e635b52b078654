"""Single missions in scenes, at any fidelity, with their logs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp

from jaxbiped.arenas import Arena, load_scene
from jaxbiped.errors import InputError
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.recorded_driver import Mission, Recorder, turn_once
from jaxbiped.mission.sensor_rig import SensorRig
from jaxbiped.mission.setup import MissionSetup
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
    return play_one(arena, config, config.params(strategy), noise_of(seed), rig=rig)


def play_changing(
    arena_at: Callable[[int], Arena], config: MissionConfig, strategy: str, seed: int, rig: SensorRig | None = None
) -> Mission:
    """As `play`, in an arena that changes after some decisions; not for simulated bipeds.

    Args:
      arena_at: the arena before each decision, counted from 0. Shapes, start and goal stay.
    """
    arena, params = arena_at(0), config.params(strategy)
    spec = mission_spec(config, tuple(round(float(v), 6) for v in arena.size_xy))
    setup = MissionSetup(arena, params, spec)
    world, agent = jax.tree.map(lambda leaf: leaf[None], start(setup, noise_of(seed)))
    recorder = Recorder(params, spec, lambda _: None, rig)
    while world.code[0] == Code.RUNNING:
        setup = replace(setup, arena=arena_at(int(world.decisions[0])))
        now = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], setup)
        before = world
        seen = rig.see(world, agent, now) if rig else None
        world, agent, _, command, thought = turn_once(world, agent, now, seen)
        recorder.decided(0, before, command, thought)
        recorder.concluded(0, world, agent)
    return recorder.mission(arena_at(int(world.decisions[0])), world)
