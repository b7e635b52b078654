"""Missions whose feet are placed: every step over an edge against where the edge really lies."""

from dataclasses import replace
from pathlib import Path

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import tests.mission.strict  # noqa: F401  (the executor)
from jaxbiped.arenas import load_scene
from jaxbiped.geometry.pose import Pose
from jaxbiped.mission.arena_batch import draw
from jaxbiped.mission.batched_driver import stack
from jaxbiped.mission.config import EXECUTORS
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.recorded_driver import turn_once
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import start
from tests.mission.conftest import CONFIG, SPEC, row
from tests.mission.strict import Strict, footfall

SCENES = [Path(__file__).parents[2] / "configs" / "scenes" / f"experiment_{k}.toml" for k in (3, 5)]
FAMILIES = ("bump", "stairs", "mixed")
ARENAS = 30
STRICT = replace(SPEC, footing=True, executor="strict")
TURNS = 80


@pytest.fixture(scope="module")
def walked():
    """Codes and decisions of all missions, and (rise, off [m], askew [rad], found) of every step over an edge."""
    arenas, seeds = jax.device_get(draw(jax.random.key(11), jnp.arange(ARENAS), FAMILIES))
    rows = [row(arenas, k) for k in range(ARENAS)] + [jax.device_get(load_scene(path)[1]) for path in SCENES]
    batch = jax.tree.map(jnp.asarray, stack(rows))
    setting = replace(CONFIG.params("full"), executor=Strict())
    params = jax.tree.map(lambda leaf: jnp.broadcast_to(leaf, (len(rows), *leaf.shape)), setting)
    seeds = jnp.asarray([*seeds, 7, 8], jnp.uint32)
    setup = MissionSetup(batch, params, SPEC)
    world, agent = jax.jit(jax.vmap(start))(setup, seeds)
    setup = replace(setup, spec=STRICT)
    look = jax.jit(jax.vmap(footfall, in_axes=(0, 0, 0, None)))
    steps = []
    for _ in range(TURNS):
        before = world
        world, agent, _, command, _ = turn_once(world, agent, setup)
        pose = before.pose
        fall = look(batch, Pose(pose.x, pose.y, pose.z, pose.yaw + command.turn), command.rise, setting.footing)
        running, command, fall = jax.device_get((before.code == Code.RUNNING, command, fall))
        for k in np.flatnonzero(running & (command.rise != 0)):
            steps.append((command.rise[k], fall.off[k], fall.askew[k], fall.found[k]))
        if not running.any():
            break
    return jax.device_get((world.code, world.decisions)), np.array(steps, float)


def test_edges_are_met_within_what_a_step_allows(walked):
    rise, off, askew, found = walked[1].T
    assert (rise > 0).sum() > 10 and (rise < 0).sum() > 10
    assert found.mean() > 0.97
    assert (found * (abs(off) < 0.008)).mean() > 0.95
    assert (found * (abs(off) < 0.012)).mean() > 0.97
    assert (found * (abs(askew) < np.deg2rad(6))).mean() > 0.95


def test_missions_succeed_before_a_strict_referee(walked):
    (code, decisions), _ = walked
    assert np.mean(code[:ARENAS] == Code.REACHED) > 0.8  # a tenth of these has no way, for any robot
    assert (code[ARENAS:] == Code.REACHED).all()
    assert np.median(decisions) < 40


def test_feet_are_placed_where_they_count():
    assert not SPEC.footing
    for name in EXECUTORS:
        config = MissionConfig(executor=name)
        assert mission_spec(config, (1.8, 1.4)).footing == (name != "kinematic")
