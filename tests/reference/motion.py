"""Behaviour selection, the kinematic executor and its referee, for one arena in plain Python and NumPy."""

from __future__ import annotations

import math
from types import SimpleNamespace

import numpy as np

from jaxbiped.executors.execution import CHECKS, ODOMETRY, TOUCH
from jaxbiped.mapping.grid import Cell
from jaxbiped.motion.edge import WINDOW
from jaxbiped.motion.grid_units import CELL, EIGHTH
from jaxbiped.motion.primitives import Primitive
from jaxbiped.motion.selection import SHORTEST, TURN_DEADBAND
from jaxbiped.planning import DIRECTIONS
from jaxbiped.sensing.counter_rng import fold
from tests.reference import sensing


def wrap(angle):
    """An angle in (-pi, pi]."""
    return -((-angle + math.pi) % (2 * math.pi) - math.pi)


def cell_of(x, y, spec):
    """(i, j) of the cell that holds a point, or of the nearest one; in single precision, as the package."""
    rows, columns = spec.shape
    i, j = (int(np.floor(np.float32(v) / np.float32(spec.pitch))) for v in (y, x))
    return min(max(i, 0), rows - 1), min(max(j, 0), columns - 1)


def crossing_direction(classes, levels, ij, step, rise, pitch):
    """Direction square to a bump's edge: from the centre of what lies on this side of it to that beyond."""
    half = max(1, round(WINDOW / pitch))
    rows, columns = classes.shape
    signs, places = [], []
    for di in range(-half, half + 1):
        for dj in range(-half, half + 1):
            i, j = ij[0] + di, ij[1] + dj
            from_edge = di - 0.5 * step[0], dj - 0.5 * step[1]
            if not (0 <= i < rows and 0 <= j < columns) or math.hypot(*from_edge) > half:
                continue
            if classes[i, j] in (Cell.UNMEASURED, Cell.OBSTACLE):
                continue
            relative = int(levels[i, j]) - int(levels[tuple(ij)])
            if relative in (0, rise):
                signs.append(1 if relative == rise else -1)
                places.append(from_edge)
    ahead = math.atan2(*step)
    if not signs or abs(sum(signs)) == len(signs):
        return ahead
    weights = np.array(signs) - np.mean(signs)
    normal = math.atan2(*(weights @ np.array(places)))
    return normal if abs(wrap(normal - ahead)) < math.radians(50) else ahead


def select(pose, ij, moves, classes, levels, looked, spec):
    """The next command, as `jaxbiped.motion.selection.select`; `pose` is (x, y, yaw)."""
    step = [int(d) for d in DIRECTIONS[moves[0]]]
    here = int(levels[ij])
    kind, height = int(classes[ij[0] + step[0], ij[1] + step[1]]), int(levels[ij[0] + step[0], ij[1] + step[1]])
    rise = min(max(height - here, -1), 1)
    count = 1
    while count < len(moves) and moves[count] == moves[0]:
        i, j = ij[0] + (count + 1) * step[0], ij[1] + (count + 1) * step[1]
        if (int(classes[i, j]), int(levels[i, j])) != (kind, height):
            break
        count += 1
    dx = (ij[1] + count * step[1] + 0.5) * spec.pitch - pose[0]
    dy = (ij[0] + count * step[0] + 0.5) * spec.pitch - pose[1]
    length = math.hypot(dx, dy)
    direction = math.atan2(dy, dx) if length > SHORTEST else math.atan2(*step)
    primitive, squat, climbs = Primitive.STRAIGHT_FORWARD, False, 0
    if kind == Cell.GATE or classes[ij] == Cell.GATE:
        primitive, squat = Primitive.PASS_GATE, True
    if rise and kind != Cell.UNMEASURED:
        direction = crossing_direction(classes, levels, ij, step, rise, spec.pitch)
        length = dx * math.cos(direction) + dy * math.sin(direction)
        primitive, climbs = (Primitive.STEP_UP_BUMP if rise > 0 else Primitive.STEP_DOWN_BUMP), rise
    length = min(max(length, SHORTEST), 1.6 * math.sqrt(2) * max(spec.pitch, CELL))
    if kind == Cell.UNMEASURED and not looked:
        primitive, length, squat, climbs = Primitive.LOOK, 0.0, False, 0
    turn = wrap(direction - pose[2])
    turn = 0.0 if abs(turn) < TURN_DEADBAND else turn
    return SimpleNamespace(turn=turn, primitive=primitive, length=length, rise=climbs, squat=squat)


def duration(command, durations):
    """Seconds that a command takes (Table 2)."""
    cells = command.length / CELL
    beyond = max(cells - math.sqrt(2), 0) * durations.straight
    played = {
        Primitive.STRAIGHT_FORWARD: cells * durations.straight,
        Primitive.STEP_UP_BUMP: durations.step_up + beyond,
        Primitive.STEP_DOWN_BUMP: durations.step_down + beyond,
        Primitive.PASS_GATE: cells * durations.pass_gate,
    }
    return abs(command.turn) / EIGHTH * durations.turn + played.get(command.primitive, 0)


def kinematic(arena, world, command, settings):
    """What comes of a command; rules of the referee as in the package."""
    limits, body, boxes = settings.limits, settings.body, arena.boxes
    yaw = wrap(world.pose.yaw + command.turn)
    start = np.array([world.pose.x, world.pose.y])
    end = start + command.length * np.array([math.cos(yaw), math.sin(yaw)])
    expected = world.pose.z + command.rise * settings.limits.rise

    grounds = [ground_height(boxes, *(end + s * limits.edge_tolerance * _heading(yaw))) for s in (-1, 0, 1)]
    error = np.abs(np.float32(grounds) - np.float32(expected))
    z = grounds[int(error.argmin())]
    fell = error.min() > limits.height_tolerance

    head = body.squatting if command.squat else body.standing
    foot = max(world.pose.z, expected)
    between = boxes.used & (boxes.top > foot + body.step + TOUCH) & (boxes.bottom < foot + head - TOUCH)
    collided = any((between & (plan_distance(boxes, start + part * (end - start)) < limits.body_radius)).any()
                   for part in CHECKS)  # fmt: skip
    outside = not ((end >= 0) & (end <= arena.size_xy)).all()
    nominal = command.length * math.cos(command.turn), command.length * math.sin(command.turn), command.turn
    moved, variances = sensing.drift(nominal, settings.odometry, fold(world.seed, ODOMETRY, world.decisions))
    return SimpleNamespace(
        pose=(*end, z, yaw), moved=moved, variances=variances, time=duration(command, settings.durations),
        collided=collided, fell=fell and not collided, outside=outside,
    )  # fmt: skip


def _heading(yaw):
    return np.array([math.cos(yaw), math.sin(yaw)])


def in_box_frames(boxes, xy):
    """A point in the frame of every box: distances from the centre along and across."""
    cos, sin = np.cos(boxes.yaw), np.sin(boxes.yaw)
    dx, dy = xy[0] - boxes.x, xy[1] - boxes.y
    return np.abs(cos * dx + sin * dy), np.abs(cos * dy - sin * dx)


def ground_height(boxes, x, y):
    """Highest top of the floor-standing boxes at a point."""
    along, across = in_box_frames(boxes, (x, y))
    here = boxes.used & ~boxes.overhead & (along <= boxes.half_x) & (across <= boxes.half_y)
    return boxes.top[here].max(initial=0.0)


def plan_distance(boxes, xy):
    """Distance in plan from a point to each box."""
    along, across = in_box_frames(boxes, xy)
    return np.hypot(np.maximum(along - boxes.half_x, 0), np.maximum(across - boxes.half_y, 0))
