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


def run(arena, settings, seed, program, keep=False) -> Mission:
    """One mission from start to end; with `keep` every decision is kept."""
    world, mind = start(arena, settings, seed, program.spec)
    steps = []
    while world.code == Code.RUNNING:
        step = cycle(world, mind, arena, settings, program)
        if keep:
            steps.append(step)
    away = math.hypot(arena.goal_xy[0] - world.pose.x, arena.goal_xy[1] - world.pose.y)
    return Mission(int(world.code), world.distance, world.time, world.decisions, away, tuple(steps))


def start(arena, settings, seed, spec):
    """The referee's and the robot's side before the first measurement."""
    x, y, yaw = arena.start_xyyaw
    pose = Pose(x, y, f32(motion.ground_height(arena.boxes, x, y)), yaw)
    away = math.hypot(arena.goal_xy[0] - x, arena.goal_xy[1] - y)
    code = Code.REACHED if away <= settings.limits.goal_radius else Code.RUNNING
    code = code if math.isfinite(away) and math.isfinite(yaw) else Code.INVALID
    world = SimpleNamespace(pose=pose, squat=False, distance=0.0, time=0.0, decisions=0, code=code, seed=seed)
    mind = SimpleNamespace(
        belief=Belief(pose, np.diag(settings.limits.start_variance)),
        z=pose.z if math.isfinite(away) else f32(0),
        grid_map=None,
        squat=False,
        look=False,
        tries=0,
    )
    return world, mind


def cycle(world, mind, arena, settings, program) -> Step:
    """Sense, decide, execute; changes `world` and `mind`."""
    seed = fold(world.seed, SENSE, world.decisions)
    view = sensing.measure_raycast(
        arena, world.pose, settings.camera, settings.stereo, program.image, seed, mind.look, world.squat
    )
    marks = sensing.sight_landmarks(
        arena, world.pose, settings.camera, settings.landmarks, program.image, seed, mind.look, world.squat
    )
    classes, levels, ij = perceive(mind, view, marks, arena, settings, program.spec)
    goal_ij = tuple(map(int, goal_cell(arena.goal_xy, classes, settings, program.spec)))
    pose = sensing.mean_of(mind.belief)
    command, verdict = decide(mind, classes, levels, ij, goal_ij, settings, program.spec)
    conclude(world, mind, command, verdict, arena, settings)
    return Step(classes, levels, mind.grid_map.votes, pose, command, int(verdict))


def perceive(mind, view, marks, arena, settings, spec):
    """Localise and update the map: classes, levels, and the robot's cell."""
    mind.belief = sensing.correct(mind.belief, arena.landmarks, marks)
    x, y, yaw = sensing.mean_of(mind.belief)
    if mind.grid_map is None:
        radius = settings.limits.body_radius
        mind.grid_map = mapping.mark_footprint(mapping.empty(spec), f32(x), f32(y), mind.z, radius, spec)
    ij = motion.cell_of(x, y, spec)
    mind.z = mapping.ground_height(mind.grid_map, ij, mind.z, spec)
    pose, level = Pose(f32(x), f32(y), mind.z, f32(yaw)), int(np.round(mind.z / f32(spec.level_height)))
    mind.grid_map = mapping.update(mind.grid_map, view, pose, settings.body, settings.mapping, spec)
    classes, levels = mapping.classify(mind.grid_map, settings.mapping, spec)
    if classes[ij] != Cell.GATE:
        classes[ij] = Cell.BUMP if level else Cell.FLOOR
    levels[ij] = level
    return classes, levels, ij


def goal_cell(goal_xy, classes, settings, spec):
    """The nearest cell that is not blocked and whose centre lies well within the goal's circle; else the goal's."""
    own, rules = motion.cell_of(*goal_xy, spec), settings.strategy
    blocked = classes == Cell.OBSTACLE
    blocked |= (classes == Cell.BUMP) & (not rules.bumps)
    blocked |= (classes == Cell.GATE) & (not rules.gates)
    x, y = ((np.arange(n, dtype=f32) + f32(0.5)) * f32(spec.pitch) for n in (spec.shape[1], spec.shape[0]))
    away = np.hypot(x[None, :] - goal_xy[0], y[:, None] - goal_xy[1])
    away[own] = 0.0
    near = (away <= settings.limits.goal_radius - MARGIN) & (~blocked | bool(rules.blind))
    return np.unravel_index(np.where(near, away, np.inf).argmin(), spec.shape) if near.any() else own


def decide(mind, classes, levels, ij, goal_ij, settings, spec):
    """Plan and select: the command, and the code with which the robot gives up (else RUNNING)."""
    still = SimpleNamespace(turn=0.0, primitive=Primitive.NONE, length=0.0, rise=0, squat=mind.squat)
    mind.look, looked = False, mind.look
    if ij == goal_ij:
        mind.tries = 0
        return still, Code.STUCK
    moves = plan(mind.belief.pose.yaw, classes, levels, ij, goal_ij, settings, spec)
    if moves[0] < 0:
        mind.tries += 1
        still.turn = LOOK_AROUND
        return still, Code.NO_PATH if mind.tries >= int(settings.limits.max_looks) else Code.RUNNING
    mind.tries = 0
    ahead = ij[0] + DIRECTIONS[moves[0]][0], ij[1] + DIRECTIONS[moves[0]][1]
    known_floor = classes[ahead] in (Cell.FLOOR, Cell.UNMEASURED) and levels[ahead] == levels[ij]
    if settings.strategy.blind and not known_floor:
        return still, Code.STUCK
    command = motion.select(sensing.mean_of(mind.belief), ij, moves, classes, levels, looked, spec)
    mind.look = command.primitive == Primitive.LOOK
    if mind.look:
        command.squat = mind.squat
    mind.squat = command.squat
    return command, Code.RUNNING


def plan(yaw, classes, levels, ij, goal_ij, settings, spec):
    """The first moves of the cheapest path; the first is -1 where there is none."""
    rules = settings.strategy
    if rules.blind:
        classes, levels = np.full_like(classes, Cell.FLOOR), np.zeros_like(levels)
        rules = replace(rules, bumps=False, gates=False)
    edges = planning.edge_costs(classes, levels, settings.costs.at_pitch(spec.pitch), rules)
    field = planning.dijkstra(edges, goal_ij, ij)
    heading = min(range(8), key=lambda k: abs(motion.wrap(math.atan2(*DIRECTIONS[k]) - yaw)))
    return planning.next_moves(field, edges, ij, heading, stride(spec))


def conclude(world, mind, command, verdict, arena, settings):
    """Execute, count odometry, and let the referee look."""
    limits = settings.limits
    world.decisions += 1
    world.time += float(settings.durations.measure)
    code = Code.OUT_OF_STEPS if world.decisions >= limits.max_decisions else Code.RUNNING
    if verdict != Code.RUNNING:
        code = verdict
    else:
        world.decisions -= 1  # the executor's noise is that of this decision
        done = motion.kinematic(arena, world, command, settings)
        world.decisions += 1
        world.pose = Pose(*(f32(v) for v in done.pose))
        world.squat = command.squat
        world.distance += command.length
        world.time += float(done.time)
        mind.belief = sensing.predict(mind.belief, *done.moved, done.variances)
        mind.z = f32(mind.z + command.rise * f32(settings.limits.rise))
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
    if not np.isfinite([away, world.time, world.pose.yaw, *sensing.mean_of(mind.belief)]).all():
        code = Code.INVALID
    world.code = code
