"""Foot placement: from the planned path to commands that bring the feet to the right place before a step over an edge.

The map is accurate to half a cell, but a step over an edge needs a few millimetres. So the robot walks its path on
cells until an edge is near, turns perpendicular to it, walks up to it along its normal, looks at it once more, and
steps. Each command starts from the measured position of the edge, which corrects the error of the previous one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.geometry.pose import to_world, wrap_angle
from jaxbiped.mapping.grid import Cell, GridSpec
from jaxbiped.motion.edge import crossing_direction
from jaxbiped.motion.local_map import LocalMap
from jaxbiped.motion.primitives import Command, Primitive
from jaxbiped.motion.robot import Footing
from jaxbiped.motion.selection import cell_of
from jaxbiped.planning import DIRECTIONS
from jaxbiped.sensing.edges import Edge, prior_cov

FORESIGHT = 0.30  # [m] length of path that is searched for an edge
NEAR = 0.165  # [m] from the edge, the robot leaves its path for the edge's normal
STAGE = 0.12  # [m] from the edge, it stops and measures again if the measurement is poor
ASKEW = 0.05  # [rad] deviation from the normal above which it turns before it walks to the edge
RESIDUAL = 0.025  # [rad] a smaller turn is not worth playing before a step
LARGE = 0.2  # [rad] turns above this sweep the feet over the ground beside them
SIDESTEP = 0.015  # [m] a smaller sidestep is not worth playing
SURE_DISTANCE, SURE_ANGLE = 0.0028, 0.035  # [m, rad] standard deviations below which an edge is crossed without a look
SLACK = 0.01  # [m] distance kept between the feet and an edge that they do not cross
LANES = np.array([0.0, 0.025, -0.025, 0.05, -0.05, 0.075, -0.075, 0.10, -0.10], np.float32)  # [m] to the side, as tried
SAME_PLACE, SAME_ANGLE = 0.08, 1.0  # [m, rad] largest deviation of the map's edge from its measured position
IN_VIEW = 1.0  # [rad] angle from the heading within which an edge is visible when the robot looks down
STEADY = 0.09  # [rad] standard deviation of an edge's angle above which it is measured again before a turn


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Crossing:
    """The next edge on the path, according to the map."""

    edge: Edge  # the line, in the robot frame; `known` if there is one within FORESIGHT
    along: Float[Array, "*B"]  # [m] to the left of the robot, along the edge, where the path crosses it


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class NearEdges:
    """Edges that the robot measured, in its frame."""

    measured: Edge  # the next one on the path; if not known, the map's is used
    held: Edge  # the one that it was about to cross at its last decision, which its path may have left
    behind: Edge  # the one that it crossed; it does not turn much before its feet are clear of it


def foresight(spec: GridSpec) -> int:
    """Number of moves of the path that are examined."""
    return max(1, round(FORESIGHT / spec.pitch))


def next_crossing(local: LocalMap, directions: Int[Array, "n"]) -> Crossing:
    """The first edge that a path crosses before it enters unmeasured cells.

    Args:
      directions: first moves of the path, indices into DIRECTIONS; -1 after its end.
    """
    classes, levels, ij, pose, spec = local.classes, local.levels, local.ij, local.pose, local.grid
    steps = jnp.where((directions >= 0)[:, None], jnp.asarray(DIRECTIONS)[jnp.maximum(directions, 0)], 0)
    cells = jnp.concatenate([ij[None], ij[None] + jnp.cumsum(steps, axis=0)])
    kinds, heights = classes[cells[:, 0], cells[:, 1]], levels[cells[:, 0], cells[:, 1]].astype(jnp.int32)
    rises = heights[1:] - heights[:-1]
    walked = (kinds[1:] != Cell.UNMEASURED) & (kinds[1:] != Cell.OBSTACLE)
    reached = jnp.cumprod((walked & (directions >= 0)).astype(jnp.int32)).astype(bool)
    over = reached & (rises != 0)
    k = jnp.argmax(over)
    step_ij, rise = steps[k], jnp.clip(rises[k], -1, 1)
    normal = crossing_direction(classes, levels, cells[k], step_ij, rise, spec.pitch)
    middle = (cells[k] + 0.5 * step_ij + 0.5) * spec.pitch
    dx, dy = middle[1] - pose.x, middle[0] - pose.y
    cos, sin = jnp.cos(normal), jnp.sin(normal)
    edge = Edge(dx * cos + dy * sin, wrap_angle(normal - pose.yaw), prior_cov(), rise, jnp.any(over))
    return Crossing(edge, dy * cos - dx * sin)


def remembered(edge: Edge, crossing: Crossing) -> Edge:
    """An edge measured before, known only if it is the one that the path crosses."""
    there = crossing.edge
    turned = wrap_angle(there.angle - edge.angle)
    # Distance of the path's crossing from the line.
    off = there.distance * jnp.cos(turned) - crossing.along * jnp.sin(turned) - edge.distance
    same = (edge.rise == there.rise) & (jnp.abs(turned) < SAME_ANGLE) & (jnp.abs(off) < SAME_PLACE)
    return replace(edge, known=edge.known & there.known & same)


def approach(
    command: Command,
    local: LocalMap,
    crossing: Crossing,
    edges: NearEdges,
    looked: Bool[Array, ""],
    footing: Footing,
) -> Command:
    """The command that takes the robot along its path, and over an edge only from the right place before it.

    Args:
      command: the command from `selection.select`; it is played as long as no edge is near.
      crossing: the next edge on the path, according to the map.
      edges: edges that were measured, that one among them.
      looked: the robot has just looked down from here.
    """
    measured = edges.measured
    edge = jax.tree.map(lambda m, c: jnp.where(measured.known, m, c), measured, crossing.edge)
    s, angle, up = edge.distance, edge.angle, edge.rise > 0
    near = crossing.edge.known & (s < NEAR)
    stand = jnp.where(up, footing.before_up, footing.before_down)
    gap = s - stand
    sd_s, sd_angle = jnp.sqrt(edge.cov[0, 0]), jnp.sqrt(edge.cov[1, 1])
    sure = measured.known & (sd_s < SURE_DISTANCE) & (sd_angle < SURE_ANGLE)
    lane = best_lane(local, edge, footing)

    askew = jnp.abs(angle) > ASKEW
    room = turning_room(angle, up, footing)
    cos = jnp.where(jnp.cos(angle) < 0, -1.0, 1.0) * jnp.maximum(jnp.abs(jnp.cos(angle)), 0.5)
    retreat = jnp.clip((s - room) / cos, -0.06, 0.06)
    tight = askew & (s < room - 0.003)
    # Once perpendicular to it, the robot walks as far as it trusts the line.
    vague = ~measured.known | (sd_angle > STEADY)
    ahead = jnp.where(vague & askew, 0.0, jnp.where(sure | (s < STAGE + 0.02), gap, s - STAGE))
    aside = ~askew & (jnp.abs(lane) > SIDESTEP) & (measured.known | looked)
    off = jnp.abs(gap) > footing.tolerance
    ready = ~askew & ~aside & ~off & (sure | looked)
    look = ~askew & ~aside & ~off & ~sure & ~looked
    # Before it relies on a line that only the map knows, it looks.
    look = look | (~measured.known & ~looked & (jnp.abs(angle) < IN_VIEW))

    turn = jnp.where((askew & ~look) | (ready & (jnp.abs(angle) > RESIDUAL)), angle, 0.0)
    turn = jnp.where(tight, 0.0, turn)
    length = jnp.where(jnp.abs(ahead) > footing.tolerance, ahead, 0.0)
    length = jnp.where(aside, 0.0, length)
    length = jnp.where(tight, retreat, length)
    length = jnp.where(ready, footing.length, jnp.where(look, 0.0, length))
    step = jnp.where(up, Primitive.STEP_UP_BUMP, Primitive.STEP_DOWN_BUMP)
    in_gate = local.classes[local.ij[0], local.ij[1]] == Cell.GATE
    walk = jnp.where(in_gate, Primitive.PASS_GATE, Primitive.STRAIGHT_FORWARD)
    walk = jnp.where(length == 0, Primitive.NONE, walk)
    near_command = Command(
        turn=turn,
        primitive=jnp.where(ready, step, jnp.where(look, Primitive.LOOK, walk)).astype(jnp.int32),
        length=length,
        rise=jnp.where(ready, edge.rise, 0).astype(jnp.int32),
        squat=in_gate & ~ready & ~look,
        left=jnp.where(aside & ~look, lane, 0.0),
    )
    far_command = short_of(crossing, s, angle, command)
    chosen = jax.tree.map(lambda a, b: jnp.where(near, a, b), near_command, far_command)
    chosen = clear_of(edges.behind, chosen, local, footing)
    return back_off(edges.held, chosen, footing)


def turning_room(angle: Float[Array, ""], up: Bool[Array, ""], footing: Footing) -> Float[Array, ""]:
    """Distance [m] before an edge at which the robot must stand to turn by `angle` to its normal.

    Before a rising edge no corner of a foot may reach it, before a falling one no ankle.
    """
    cos, sin = jnp.abs(jnp.cos(angle)), jnp.abs(jnp.sin(angle))
    toes = footing.foot_length / 2 * cos + footing.foot_outside * sin + SLACK
    ankles = footing.hip_offset * sin + SLACK
    return jnp.where(up, toes, ankles)


def best_lane(local: LocalMap, edge: Edge, footing: Footing) -> Float[Array, ""]:
    """How far [m] to the left the robot should cross the edge: as little as the map allows."""
    classes, levels, ij = local.classes, local.levels, local.ij
    here, along = levels[ij[0], ij[1]].astype(jnp.int32), jnp.asarray(LANES)
    landing = footing.length - jnp.where(edge.rise > 0, footing.before_up, footing.before_down)
    before = jnp.where(edge.rise > 0, jnp.array([-0.07, -0.04]), jnp.array([-0.04, -0.04]))
    after = jnp.where(edge.rise > 0, jnp.array([0.04, 0.06]), jnp.array([0.06, 0.11]))

    def cells(u, v):
        """Class and level at `u` beyond the edge and `v` to the left."""
        cos, sin = jnp.cos(edge.angle), jnp.sin(edge.angle)
        u = u + edge.distance
        i, j = cell_of(*to_world(local.pose, u * cos - v * sin, u * sin + v * cos), local.grid)
        return classes[i, j], levels[i, j].astype(jnp.int32)

    bad = jnp.zeros(along.shape)
    for side in (-2.0, -1.4, 0.0, 1.4, 2.0):
        v = along + side * footing.hip_offset
        for points, level in ((before, here), (after, here + edge.rise)):
            for k in range(2):
                _, ground = cells(points[k] + 0 * v, v)
                bad = bad + (ground != level)
    for u in (-0.10, -0.05, 0.0):
        kind, _ = cells(u + 0 * along, along)
        bad = bad + 3.0 * (kind == Cell.OBSTACLE)
    kind, _ = cells(landing + 0 * along, along)
    bad = bad + 3.0 * ((kind == Cell.OBSTACLE) | (kind == Cell.UNMEASURED))
    return along[jnp.argmin(bad + jnp.abs(along))]


def clear_of(behind: Edge, command: Command, local: LocalMap, footing: Footing) -> Command:
    """The command, or a straight walk away from the edge behind if the command turns too close to it."""
    classes, levels, pose, spec = local.classes, local.levels, local.pose, local.grid
    clear = jnp.where(behind.rise > 0, footing.clear_up, footing.clear_down)
    short = jnp.clip(clear + behind.distance, 0.0, 0.06)
    turns = (jnp.abs(command.turn) > LARGE) & (command.primitive != Primitive.LOOK)
    # Where it would end, and where its toes would be.
    ahead = jnp.stack([short, short + 0.05])
    i, j = cell_of(*to_world(pose, ahead, jnp.zeros_like(ahead)), spec)
    level = jnp.round(pose.z / spec.level_height)
    walkable = (classes[i, j] == Cell.FLOOR) | (classes[i, j] == Cell.BUMP)
    free = jnp.all(walkable & (levels[i, j] == level))
    leave = behind.known & turns & (short > footing.tolerance) & free & (jnp.abs(behind.angle) < 0.5)
    return replace(
        command,
        turn=jnp.where(leave, 0.0, command.turn),
        primitive=jnp.where(leave, Primitive.STRAIGHT_FORWARD, command.primitive).astype(jnp.int32),
        length=jnp.where(leave, short, command.length),
        rise=jnp.where(leave, 0, command.rise).astype(jnp.int32),
        squat=command.squat & ~leave,
    )


def back_off(held: Edge, command: Command, footing: Footing) -> Command:
    """The command, or some steps backward if it turns too close to an edge ahead that it does not cross."""
    turns = (jnp.abs(command.turn) > LARGE) & (command.primitive != Primitive.LOOK)
    ends = wrap_angle(held.angle - command.turn)
    room = jnp.maximum(turning_room(ends, held.rise > 0, footing), turning_room(held.angle, held.rise > 0, footing))
    short = jnp.clip((room - held.distance) / jnp.maximum(jnp.cos(held.angle), 0.5), 0.0, 0.06)
    close = held.known & (held.distance > 0) & (jnp.abs(held.angle) < 0.8) & (short > footing.tolerance)
    leave = close & turns
    return replace(
        command,
        turn=jnp.where(leave, 0.0, command.turn),
        primitive=jnp.where(leave, Primitive.STRAIGHT_FORWARD, command.primitive).astype(jnp.int32),
        length=jnp.where(leave, -short, command.length),
        rise=jnp.where(leave, 0, command.rise).astype(jnp.int32),
        squat=command.squat & ~leave,
    )


def short_of(crossing: Crossing, s: Float[Array, ""], angle: Float[Array, ""], command: Command) -> Command:
    """The command, shortened so that a skewed approach ends well before the next edge."""
    towards = jnp.cos(wrap_angle(angle - command.turn))
    most = jnp.where(crossing.edge.known & (towards > 0.1), (s - 0.10) / jnp.maximum(towards, 0.1), jnp.inf)
    straight = command.primitive == Primitive.STRAIGHT_FORWARD
    return replace(
        command, length=jnp.where(straight, jnp.minimum(command.length, jnp.maximum(most, 0.0)), command.length)
    )
