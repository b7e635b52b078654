"""The closed loop for one arena at a time, in plain NumPy with a heapq planner.

The oracle of the compiled loop, decision by decision, and its peer in `sweeps/benchmarks/mission.py`. It uses the
package's words, constants and random numbers (same seed, same noise), and none of its kernels. Arguments are the
package's pytrees with NumPy leaves (`jax.device_get`). The ray-cast sensor and the kinematic executor only.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from types import SimpleNamespace

import numpy as np

from jaxbiped.geometry.pose import Pose
from jaxbiped.localisation import Belief
from jaxbiped.mapping.grid import Cell
from jaxbiped.mission.decision import LOOK_AROUND
from jaxbiped.mission.goal import MARGIN
from jaxbiped.mission.mission_step import SENSE
from jaxbiped.mission.outcome import Code
from jaxbiped.motion.primitives import Primitive
from jaxbiped.motion.selection import stride
from jaxbiped.planning import DIRECTIONS
from jaxbiped.sensing.counter_rng import fold
from tests.reference import mapping, motion, planning, sensing

f32 = np.float32


@dataclass(frozen=True)
class Step:
    """One decision, for comparing."""

    classes: np.ndarray
    levels: np.ndarray
    votes: np.ndarray  # [H, W, 4]
    pose: np.ndarray  # believed x, y, yaw
    command: SimpleNamespace
    verdict: int


@dataclass(frozen=True)
class Mission:
    """How a mission went."""

    code: int
    distance: float
    time: float
    decisions: int
    goal_distance: float
    steps: tuple[Step, ...]


def run(arena, params, seed, spec, keep=False) -> Mission:
    """One mission from start to end; with `keep` every decision is kept."""
    world, agent = start(arena, params, seed, spec.grid)
    steps = []
    while world.code == Code.RUNNING:
        step = cycle(world, agent, arena, params, spec)
        if keep:
            steps.append(step)
    away = math.hypot(arena.goal_xy[0] - world.pose.x, arena.goal_xy[1] - world.pose.y)
    return Mission(int(world.code), world.distance, world.time, world.decisions, away, tuple(steps))


def start(arena, params, seed, grid):
    """The referee's and the robot's side before the first measurement."""
    x, y, yaw = arena.start_xyyaw
    pose = Pose(x, y, f32(motion.ground_height(arena.boxes, x, y)), yaw)
    away = math.hypot(arena.goal_xy[0] - x, arena.goal_xy[1] - y)
    code = Code.REACHED if away <= params.limits.goal_radius else Code.RUNNING
    code = code if math.isfinite(away) and math.isfinite(yaw) else Code.INVALID
    world = SimpleNamespace(pose=pose, squat=False, distance=0.0, time=0.0, decisions=0, code=code, seed=seed)
    agent = SimpleNamespace(
        belief=Belief(pose, np.diag(params.limits.start_variance)),
        z=pose.z if math.isfinite(away) else f32(0),
        grid_map=None,
        squat=False,
        look=False,
        tries=0,
    )
    return world, agent


def cycle(world, agent, arena, params, spec) -> Step:
    """Sense, decide, execute; changes `world` and `agent`."""
    seed = fold(world.seed, SENSE, world.decisions)
    view = sensing.measure_raycast(
        arena, world.pose, params.camera, params.stereo, spec.image, seed, agent.look, world.squat
    )
    marks = sensing.sight_landmarks(
        arena, world.pose, params.camera, params.landmarks, spec.image, seed, agent.look, world.squat
    )
    classes, levels, ij = perceive(agent, view, marks, arena, params, spec.grid)
    goal_ij = tuple(map(int, goal_cell(arena.goal_xy, classes, params, spec.grid)))
    pose = sensing.mean_of(agent.belief)
    command, verdict = decide(agent, classes, levels, ij, goal_ij, params, spec.grid)
    conclude(world, agent, command, verdict, arena, params)
    return Step(classes, levels, agent.grid_map.votes, pose, command, int(verdict))


def perceive(agent, view, marks, arena, params, grid):
    """Localise and update the map: classes, levels, and the robot's cell."""
    agent.belief = sensing.correct(agent.belief, arena.landmarks, marks)
    x, y, yaw = sensing.mean_of(agent.belief)
    if agent.grid_map is None:
        radius = params.limits.body_radius
        agent.grid_map = mapping.mark_footprint(mapping.empty(grid), f32(x), f32(y), agent.z, radius, grid)
    ij = motion.cell_of(x, y, grid)
    agent.z = mapping.ground_height(agent.grid_map, ij, agent.z, grid)
    pose, level = Pose(f32(x), f32(y), agent.z, f32(yaw)), int(np.round(agent.z / f32(grid.level_height)))
    agent.grid_map = mapping.update(agent.grid_map, view, pose, params.body, params.mapping, grid)
    classes, levels = mapping.classify(agent.grid_map, params.mapping, grid)
    if classes[ij] != Cell.GATE:
        classes[ij] = Cell.BUMP if level else Cell.FLOOR
    levels[ij] = level
    return classes, levels, ij


def goal_cell(goal_xy, classes, params, grid):
    """The nearest cell that is not blocked and whose centre lies well within the goal's circle; else the goal's."""
    own, rules = motion.cell_of(*goal_xy, grid), params.strategy
    blocked = classes == Cell.OBSTACLE
    blocked |= (classes == Cell.BUMP) & (not rules.bumps)
    blocked |= (classes == Cell.GATE) & (not rules.gates)
    x, y = ((np.arange(n, dtype=f32) + f32(0.5)) * f32(grid.pitch) for n in (grid.shape[1], grid.shape[0]))
    away = np.hypot(x[None, :] - goal_xy[0], y[:, None] - goal_xy[1])
    away[own] = 0.0
    near = (away <= params.limits.goal_radius - MARGIN) & (~blocked | bool(rules.blind))
    return np.unravel_index(np.where(near, away, np.inf).argmin(), grid.shape) if near.any() else own


def decide(agent, classes, levels, ij, goal_ij, params, grid):
    """Plan and select: the command, and the code with which the robot gives up (else RUNNING)."""
    still = SimpleNamespace(turn=0.0, primitive=Primitive.NONE, length=0.0, rise=0, squat=agent.squat)
    agent.look, looked = False, agent.look
    if ij == goal_ij:
        agent.tries = 0
        return still, Code.STUCK
    moves = plan(agent.belief.pose.yaw, classes, levels, ij, goal_ij, params, grid)
    if moves[0] < 0:
        agent.tries += 1
        still.turn = LOOK_AROUND
        return still, Code.NO_PATH if agent.tries >= int(params.limits.max_looks) else Code.RUNNING
    agent.tries = 0
    ahead = ij[0] + DIRECTIONS[moves[0]][0], ij[1] + DIRECTIONS[moves[0]][1]
    known_floor = classes[ahead] in (Cell.FLOOR, Cell.UNMEASURED) and levels[ahead] == levels[ij]
    if params.strategy.blind and not known_floor:
        return still, Code.STUCK
    command = motion.select(sensing.mean_of(agent.belief), ij, moves, classes, levels, looked, grid)
    agent.look = command.primitive == Primitive.LOOK
    if agent.look:
        command.squat = agent.squat
    agent.squat = command.squat
    return command, Code.RUNNING


def plan(yaw, classes, levels, ij, goal_ij, params, grid):
    """The first moves of the cheapest path; the first is -1 where there is none."""
    rules = params.strategy
    if rules.blind:
        classes, levels = np.full_like(classes, Cell.FLOOR), np.zeros_like(levels)
        rules = replace(rules, bumps=False, gates=False)
    edges = planning.edge_costs(classes, levels, params.costs.at_pitch(grid.pitch), rules)
    field = planning.dijkstra(edges, goal_ij, ij)
    heading = min(range(8), key=lambda k: abs(motion.wrap(math.atan2(*DIRECTIONS[k]) - yaw)))
    return planning.next_moves(field, edges, ij, heading, stride(grid))


def conclude(world, agent, command, verdict, arena, params):
    """Execute, count odometry, and let the referee look."""
    limits = params.limits
    world.decisions += 1
    world.time += float(params.durations.measure)
    code = Code.OUT_OF_STEPS if world.decisions >= limits.max_decisions else Code.RUNNING
    if verdict != Code.RUNNING:
        code = verdict
    else:
        world.decisions -= 1  # the executor's noise is that of this decision
        done = motion.kinematic(arena, world, command, params)
        world.decisions += 1
        world.pose = Pose(*(f32(v) for v in done.pose))
        world.squat = command.squat
        world.distance += command.length
        world.time += float(done.time)
        agent.belief = sensing.predict(agent.belief, *done.moved, done.variances)
        agent.z = f32(agent.z + command.rise * f32(params.limits.rise))
    away = math.hypot(arena.goal_xy[0] - world.pose.x, arena.goal_xy[1] - world.pose.y)
    if away <= limits.goal_radius:
        code = Code.REACHED
    if verdict == Code.RUNNING:
        for happened, name in (
            (done.outside, Code.OUT_OF_BOUNDS),
            (done.fell, Code.FELL),
            (done.collided, Code.COLLIDED),
        ):
            code = name if happened else code
    if not np.isfinite([away, world.time, world.pose.yaw, *sensing.mean_of(agent.belief)]).all():
        code = Code.INVALID
    world.code = code
