"""Missions that see on the host: the same as those that see inside the compiled loop, whatever they see with."""

from contextlib import nullcontext
from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas.scene import load_scene
from jaxbiped.errors import InputError
from jaxbiped.mission.batched_driver import stack
from jaxbiped.mission.mission_step import sense, step
from jaxbiped.mission.params import MissionConfig
from jaxbiped.mission.sensor_rig import rig_for, where
from jaxbiped.mission.sensors import RayCast
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import start
from jaxbiped.sensing import camera as cameras
from jaxbiped.study.hosted import run_on_host
from jaxbiped.study.workload import Workload
from tests.mission.conftest import CONFIG, SPEC

by_ray_cast = jax.jit(jax.vmap(partial(sense, body_pose=None)))


class Mirror:
    """SensorRig that measure on the host what the ray-cast sensor would inside the loop."""

    def see(self, world, agent, setup, body_pose=None, count=None):
        return jax.device_get(by_ray_cast(world, agent, setup))

    def picture(self):
        return None


@pytest.mark.slow
def test_missions_that_are_given_what_they_see(population, played):
    """Two missions, each in a thread, as a study runs them: those of the queue."""
    batch, seeds = jax.tree.map(lambda *rows: jnp.asarray(np.stack(rows)), *population[0][:2]), population[2][:2]
    points = stack(population[1][:1])
    ended = []
    opened = lambda: nullcontext(Mirror())  # noqa: E731
    result = run_on_host(Workload(batch, jnp.asarray(seeds), points, 2, SPEC), ended.append, opened)
    for k in np.flatnonzero([setting is population[1][0] for setting in population[1][:2]]):
        for name in ("code", "measurements", "decisions"):
            assert getattr(result, name)[0, k] == getattr(played, name)[k], name
        for name in ("distance", "time", "goal_distance"):
            assert getattr(result, name)[0, k] == pytest.approx(getattr(played, name)[k], 1e-5), name
    assert [tally.ended for tally in ended] == [1, 2]


def test_eyes_that_cannot_be_opened_end_all_missions(first_look):
    setup = first_look[2]
    tried = []

    def broken():
        tried.append(1)
        raise InputError("nothing can be rendered", field="sensor")

    batch = jax.tree.map(lambda leaf: jnp.repeat(leaf, 9, axis=0), setup.arena)
    with pytest.raises(InputError, match="nothing can be rendered"):
        run_on_host(Workload(batch, jnp.zeros(9, jnp.uint32), setup.params, 9, SPEC), print, broken)
    assert 1 <= len(tried) <= 2


def test_loop_does_not_stand_in_for_a_sensor_on_the_host(first_look):
    world, agent, setup = first_look
    with pytest.raises(ValueError, match="given their views"):
        jax.eval_shape(step, world, agent, replace(setup, spec=replace(SPEC, sensor="stereo")))


def test_rendered_stereo_has_a_rule_for_far_walls_of_its_own():
    """What is given wins; other sensors keep the map of the published studies."""
    parts = {"stereo": {}, "fewer": {"mapping": {"below_points": 20}}, "none": {"mapping": {"below_points": None}}}
    found = {name: MissionConfig(sensor="stereo", **part).mapping.below_points for name, part in parts.items()}
    assert found == {"stereo": 50, "fewer": 20, "none": None}
    assert MissionConfig().params("full").mapping.below_points is None
    cast = MissionConfig(sensor="stereo").model_copy(update={"sensor": "raycast"})  # as `fit-sensor` compares them
    assert cast.params("full").mapping.below_points == 50


def test_jax_sensors_need_no_eyes():
    assert rig_for(CONFIG) is None and rig_for(MissionConfig(sensor="oracle")) is None


@pytest.fixture(scope="module")
def first_look(request):
    """World, agent and setup of one mission before its first measurement."""
    _, arena = load_scene(request.config.rootpath / "configs" / "scenes" / "experiment_6.toml")
    params = MissionConfig(sensor="stereo").params("full")
    setup = MissionSetup(arena, params, SPEC)
    return jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], (*start(setup, jnp.uint32(7)), setup))


def test_camera_is_where_the_ray_cast_sensor_has_it(first_look):
    """Place, tilt and seed are those that `sense` uses: the centre of a robot upright, turned by at most a few sd."""
    world, agent, setup = first_look
    origin, basis, at, _ = where(world, agent, setup.params, None)
    pose, at = jax.tree.map(lambda v: v[0], (world.pose, at))
    level = cameras.placed(pose, at, 0 * at.pitch, 0 * at.pitch)
    np.testing.assert_allclose(origin[0], level[0], atol=0.365 * 4 * np.deg2rad(0.3))
    turned = np.arccos(np.clip((np.trace(np.asarray(basis[0]).T @ np.asarray(level[1])) - 1) / 2, -1, 1))
    assert 0 < turned < 6 * np.deg2rad(0.3)


def test_rendered_view_agrees_with_the_ray_cast_one(first_look):
    """Heights of the floor and the walls, as both sensors see them in one place with the same tilt."""
    rig = rig_for(MissionConfig(sensor="stereo"))
    try:
        seen, _ = rig.see(*first_look)
        again, _ = rig.see(*first_look)
    finally:
        rig.close()
    world, agent, setup = first_look
    cast, _ = by_ray_cast(world, agent, replace(setup, params=replace(setup.params, sensor=RayCast())))
    assert np.array_equal(seen.z, again.z)
    for view in (seen, cast):
        near = (np.asarray(view.weight[0]) > 0) & (np.abs(view.x[0] - 0.35) < 0.05) & (np.abs(view.y[0]) < 0.1)
        assert abs(np.median(np.asarray(view.z[0])[near])) < 0.01
    shares = [np.sum(view.weight) / (512 * 384) for view in (seen, cast)]
    assert abs(shares[0] - shares[1]) < 0.1
