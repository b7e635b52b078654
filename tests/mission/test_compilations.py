"""What is compiled anew when numbers change: nothing."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped import planning
from jaxbiped.mission.batched_driver import COMPILED, SLOTS, stack
from jaxbiped.mission.oracle import oracle_plan
from jaxbiped.mission.recorded_driver import run_bare
from jaxbiped.mission.setup import MissionSetup
from tests.mission.conftest import POINTS, SPEC, pad, play

EVENTS = []
jax.monitoring.register_event_duration_secs_listener(lambda event, *_, **__: EVENTS.append(event))


def traced_or_compiled():
    """Traces and compilations of this process so far."""
    return [event for event in EVENTS if event.startswith("/jax/core/compile/")]


def vectors(setting, count, seed):
    """Parameters with random costs."""
    draws = np.random.default_rng(seed).uniform(0.1, 30, (count, 5)).astype(np.float32)
    return [replace(setting, costs=planning.Costs(*draw)) for draw in draws]


@pytest.fixture(scope="module")
def warm(population, played):
    """A setting, with everything compiled once."""
    setting = population[1][0]
    return setting


def test_sweep_over_64_cost_vectors_compiles_nothing(population, warm):
    arenas, _, seeds, _ = population
    play(arenas[:POINTS], vectors(warm, POINTS, 9), seeds[:POINTS])
    before = len(traced_or_compiled())
    outcomes = []
    for part in range(64 // POINTS):
        outcomes.append(play(arenas[:POINTS], vectors(warm, POINTS, part), seeds[:POINTS]))
    assert traced_or_compiled()[before:] == []
    assert len({tuple(outcome.time.tolist()) for outcome in outcomes}) > 1  # the costs did count


def test_other_numbers_compile_nothing(population, warm):
    """Strategy, noise, thresholds, limits, body, camera: all are traced."""
    arenas, params, seeds, _ = population
    before = len(traced_or_compiled())
    other = jax.tree.map(lambda leaf: leaf if leaf.dtype == bool else (leaf * leaf.dtype.type(1)), warm)
    other = replace(
        other,
        body=replace(other.body, radius=np.float32(0.09)),
        camera=replace(other.camera, pitch=np.float32(0.6)),
        mapping=replace(other.mapping, view_points=np.float32(6)),
        limits=replace(other.limits, max_decisions=np.int32(9)),
        odometry=replace(other.odometry, forward=np.float32(0.01)),
    )
    result = play(arenas[:8], [other] * 4 + params[:4], seeds[:8])
    assert traced_or_compiled()[before:] == []
    assert result.decisions[:4].max() <= 9


def test_oracle_plan_and_field_compile_once(population, warm):
    arenas = jax.tree.map(jnp.asarray, pad(population[0], 24))
    field = jax.jit(planning.field)
    classes = jnp.ones((4, 6, 7), jnp.int8)

    def both(seed):
        points = jax.tree.map(jnp.asarray, stack(vectors(warm, 4, seed)))
        plan = oracle_plan(arenas, points, SPEC)
        costs = jax.tree.map(jnp.asarray, points.costs)
        return plan.cost, field(classes, classes * 0, costs, planning.Rules(), jnp.zeros((4, 2), jnp.int32)).cost

    first = both(0)
    before = len(traced_or_compiled())
    second = both(1)
    assert traced_or_compiled()[before:] == []
    assert not np.allclose(first[0], second[0]) and not np.allclose(first[1], second[1])


@pytest.mark.parametrize("batch", [SLOTS, 33])
def test_planning_of_a_full_set_of_slots_compiles_inside_a_program(batch):
    """As in the compiled loop, whose own compilation at this size is left to the benchmark."""
    rules = planning.Rules(*jnp.ones((3, batch), bool))

    @jax.jit
    def plan(classes, levels, costs, goal_ij, ij):
        cost = planning.field(classes, levels, costs, rules, goal_ij).cost
        return planning.next_step(cost, classes, levels, costs, rules, ij, jnp.zeros(batch, jnp.int32))

    classes = jnp.ones((batch, *SPEC.grid.shape), jnp.int8)
    costs = planning.Costs(*jnp.ones((5, batch)))
    far = jnp.full((batch, 2), 20, jnp.int32)
    assert plan(classes, classes * 0, costs, far, far * 0)[:, 0].tolist() == [1] * batch


def test_a_script_with_other_settings_of_jax_gets_the_same_missions_and_compiles_nothing(population, played):
    before = set(COMPILED)
    with jax.enable_x64(True), jax.numpy_rank_promotion("raise"), jax.default_prng_impl("rbg"):
        again = play(*population[:3])
    jax.tree.map(np.testing.assert_array_equal, again, played)
    assert set(COMPILED) == before


@pytest.mark.slow  # compiles three programs
def test_a_mission_of_one_robot_is_the_same_in_a_script_that_has_x64_on(population):
    arena, setting = jax.tree.map(jnp.asarray, (population[0][0], population[1][0]))
    seed = jnp.asarray(population[2][0])
    plain = run_bare(MissionSetup(arena, setting, SPEC), seed), oracle_plan(pad([arena], 1), pad([setting], 1), SPEC)
    with jax.enable_x64(True):
        wide = jax.tree.map(lambda leaf: leaf.astype("float64") if leaf.dtype == "float32" else leaf, arena)
        again = run_bare(MissionSetup(wide, setting, SPEC), seed), oracle_plan(pad([wide], 1), pad([setting], 1), SPEC)
    jax.tree.map(np.testing.assert_array_equal, again, plain)
    assert {leaf.dtype.itemsize for leaf in jax.tree.leaves(again)} <= {1, 4}
