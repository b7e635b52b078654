"""Perfect knowledge: the oracle plan, and missions of the robot that sees everything."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas.families import FAMILIES, SIZE_X, SIZE_Y
from jaxbiped.arenas.scene import SceneConfig, to_arena
from jaxbiped.core.names import STRATEGIES
from jaxbiped.mission.arena_batch import draw
from jaxbiped.mission.batched_driver import stack
from jaxbiped.mission.oracle import oracle_plan
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.strategies import find_strategy
from jaxbiped.planning import Costs, Rules
from tests.mission.conftest import CONFIG, SPEC, pad, play, row
from tests.reference import mapping, motion, planning

POPULATION = 24


@pytest.fixture(scope="module")
def plans(population):
    """Oracle plans [strategy, arena] of the population."""
    points = jax.tree.map(jnp.asarray, stack([CONFIG.params(name) for name in STRATEGIES]))
    arenas = jax.tree.map(jnp.asarray, pad(population[0], POPULATION))
    return jax.device_get(oracle_plan(arenas, points, SPEC))


def true_grid(arena):
    boxes = arena.boxes
    rows = zip(boxes.x, boxes.y, boxes.yaw, boxes.half_x, boxes.half_y, boxes.bottom, boxes.top, boxes.overhead,
               boxes.used, strict=True)  # fmt: skip
    body = jax.device_get(CONFIG.params("full")).body
    return mapping.truth_grid([box[:-1] for box in rows if box[-1]], SPEC.grid, body)


def test_costs_are_those_of_dijkstra_on_the_true_grid(population, plans):
    for k in range(0, POPULATION, 2):
        arena = population[0][k]
        classes, levels = true_grid(arena)
        start, goal = (motion.cell_of(*at, SPEC.grid) for at in (arena.start_xyyaw[:2], arena.goal_xy))
        for p, strategy in enumerate(map(find_strategy, STRATEGIES)):
            if strategy.blind:
                continue
            edges = planning.edge_costs(classes, levels, Costs(), Rules(bumps=strategy.bumps, gates=strategy.gates))
            cost = planning.dijkstra(edges, goal, start)[start[0] + 1, start[1] + 1]
            assert plans.cost[p, k] == pytest.approx(cost, rel=1e-5)


def test_plans_are_the_same_in_any_batch():
    """To the last bit: a length that is summed would depend on how a batch of its size is added up."""
    points = jax.tree.map(jnp.asarray, stack([CONFIG.params(name) for name in ("full", "floor_only")]))
    arenas, _ = draw(jax.random.key(0), jnp.arange(48), FAMILIES)
    whole = jax.device_get(oracle_plan(arenas, points, SPEC))
    part = jax.device_get(oracle_plan(jax.tree.map(lambda leaf: leaf[:3], arenas), points, SPEC))
    jax.tree.map(lambda a, b: np.testing.assert_array_equal(a, b[:, :3]), part, whole)


def test_more_daring_never_costs_more(plans):
    cost = dict(zip(STRATEGIES, np.where(plans.reachable, plans.cost, np.inf), strict=True))
    for bolder, shyer in (("full", "bump_aware"), ("full", "gate_aware"), ("bump_aware", "floor_only"),
                          ("gate_aware", "floor_only"), ("floor_only", "blind_stop")):  # fmt: skip
        assert np.all(cost[bolder] <= cost[shyer] * (1 + 1e-6)), (bolder, shyer)
    assert np.all(np.isfinite(plans.cost) == plans.reachable)


def test_blind_way_is_reachable_only_over_floor():
    """A thing beside the straight way does not bar it, a thing on it does, be it only a bump."""
    beside, on_it = {"centre": (0.9, 1.1), "size": (0.2, 0.2)}, {"centre": (0.9, 0.68), "size": (0.2, 0.2)}
    boxes = [], [{**beside, "top": 0.5}], [{**on_it, "top": 0.5}], [{**on_it, "top": 0.03}]
    scenes = [
        to_arena(SceneConfig(name="test", start=(0.375, 0.675, 0.0), goal=(1.425, 0.675), boxes=each)) for each in boxes
    ]
    points = jax.tree.map(jnp.asarray, stack([CONFIG.params(name) for name in STRATEGIES]))
    arenas = jax.tree.map(jnp.asarray, pad([jax.device_get(scene) for scene in scenes], POPULATION))
    plan = jax.device_get(oracle_plan(arenas, points, SPEC))
    blind, full = (list(STRATEGIES).index(name) for name in ("blind_stop", "full"))
    assert plan.reachable[blind, :4].tolist() == [True, True, False, False]
    assert plan.reachable[full, :4].all()
    np.testing.assert_allclose(plan.length[blind, :2], 1.05, rtol=1e-5)


def test_robot_that_sees_everything_reaches_what_can_be_reached():
    """All but one in twenty: a cell that a box only grazes may be classed otherwise than in the true grid."""
    config = MissionConfig(sensor="oracle")
    spec = mission_spec(config, (SIZE_X, SIZE_Y))
    names = ("full", "bump_aware", "gate_aware", "floor_only")
    points = [config.params(name) for name in names]
    batch, seeds = draw(jax.random.key(3), jnp.arange(24), FAMILIES)
    plan = jax.device_get(oracle_plan(batch, jax.tree.map(jnp.asarray, stack(points)), spec))
    solvable = np.argwhere(plan.reachable)
    point, arena = solvable[np.linspace(0, len(solvable) - 1, 32).astype(int)].T
    batch, seeds, points = jax.device_get((batch, seeds, points))
    result = play([row(batch, k) for k in arena], [points[p] for p in point], list(seeds[arena]), spec)
    failed = [(int(k), names[p], Code(int(c)).name) for k, p, c in zip(arena, point, result.code, strict=True) if c]
    assert len(failed) <= 2, failed
    assert set(point.tolist()) == {0, 1, 2, 3}
