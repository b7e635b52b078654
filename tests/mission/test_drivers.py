"""One mission, however it is run: stepped or compiled, in any batch, slot, place of the queue, or thread."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.mission.batched_driver import stack
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.recorded_driver import run_logged
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.study.queues import run_all
from jaxbiped.study.workload import Workload
from tests.mission.conftest import SPEC, pad, play, row

# A program for another number of slots may sum in another order: a hundred roundings of a float32.
OTHER_PROGRAM = 1e-5


def assert_same(ours, theirs, tolerance=0.0):
    """Bit for bit, or within a relative tolerance."""
    for name in ("code", "decisions"):
        np.testing.assert_array_equal(getattr(ours, name), getattr(theirs, name), err_msg=name)
    for name in ("distance", "time"):
        np.testing.assert_allclose(getattr(ours, name), getattr(theirs, name), tolerance, err_msg=name)


def test_stepped_driver_gives_the_missions_of_the_queue(played, stepped):
    assert_same(stack([log.world for log in stepped]), played, OTHER_PROGRAM)


@pytest.mark.parametrize("k", [0, 3])
def test_logged_mission_is_that_of_the_queue(population, played, k):
    arena, setting, seed = (jax.tree.map(jnp.asarray, part[k]) for part in population[:3])
    mission = run_logged(MissionSetup(arena, setting, SPEC), seed)
    assert mission.code == played.code[k]
    assert mission.distance == pytest.approx(played.distance[k], OTHER_PROGRAM)
    assert mission.time == mission.played[-1].time == pytest.approx(played.time[k], OTHER_PROGRAM)
    assert mission.measurements == played.measurements[k] == len(mission.played)
    assert len(mission.log.time) == len(mission.played) + 1


def test_place_in_the_queue_and_neighbours_do_not_matter(population, played):
    arenas, params, seeds, _ = population
    order = np.random.default_rng(0).permutation(len(arenas))[:11]
    some = play([arenas[k] for k in order], [params[k] for k in order], [seeds[k] for k in order])
    assert_same(some, row(played, order))


def test_slots_workers_and_batch_do_not_matter(population, played):
    arenas, params, seeds, _ = population
    points = list({id(setting): setting for setting in params}.values())
    ended = []
    batch = jax.tree.map(jnp.asarray, pad(arenas, len(arenas)))
    workload = Workload(batch, jnp.asarray(seeds), stack(points), len(arenas), SPEC)
    everything = run_all(workload, ended.append, workers=3, slots=5)
    for k, setting in enumerate(params):
        point = next(p for p, q in enumerate(points) if q is setting)
        assert_same(row(everything, (point, k)), row(played, k), OTHER_PROGRAM)
    assert not np.any(everything.code == Code.RUNNING)
    assert ended[-1].ended == max(tally.ended for tally in ended) == everything.code.size
    assert ended[-1].reached == np.sum(everything.code == Code.REACHED)


def test_every_mission_ends_with_a_code_and_sound_numbers(played):
    assert set(played.code.tolist()) <= set(Code) - {Code.RUNNING}
    assert np.all(np.isfinite([played.distance, played.time, played.goal_distance]))
    reached = played.code == Code.REACHED
    assert np.all((played.goal_distance <= 0.1) == reached)
    assert np.all(played.time >= 10.0 * played.measurements)
    np.testing.assert_array_equal(played.measurements, played.decisions)
