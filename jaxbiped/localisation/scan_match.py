"""The robot's pose from previously measured walls: iterated closest points against a map of lines.

The map is a grid of normal distributions (Biber and Strasser, 2003): each cell keeps the first two moments, in plan,
of the points of all views that were measured on upright surfaces in it. If these lie on a line, the line's normal and
the spread along that are known, and a point of a new view in the cell has a distance from the line. The pose that
minimises these distances is found by Gauss-Newton steps (points to lines: Chen and Medioni, 1992), with the belief as
the prior: what lines do not determine, such as the position along a single wall, stays as believed. Floor, bumps and
tops of boxes are not used. Not in the paper, where localisation without landmarks is future work.

Written for one arena.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.core.signatures import checked
from jaxbiped.errors import InputError
from jaxbiped.geometry.pose import Pose, to_world, wrap_angle
from jaxbiped.geometry.small import matrix, product
from jaxbiped.localisation.kalman_filter import GATE_POSE, Belief, inverse
from jaxbiped.mapping.grid import GridSpec
from jaxbiped.sensing.view import View

STEP = 8  # [px] between two compared points in a picture's column
UPRIGHT = 1.5  # slope (rise over run) from which a surface counts as upright
LOWEST = 0.015  # [m] above the base floor: anything lower is floor
NEAR_SD, DEPTH_SD = 0.002, 0.006  # [m, m/m^2] spread of a measured point: constant, and per squared range
MOST = 384  # most points of a view that are matched
LEAST_WEIGHT = 6.0  # least number of points for a line, weighted relative to one with spread `NEAR_SD`
THIN = 0.12  # largest ratio of a line's variance across to that along
LEAST_LENGTH = 0.008  # [m] smallest standard deviation along a line
REACH = 0.06  # [m] from a line's middle within which a point may belong to it
WIDE = 3.0  # standard deviations beyond which a point does not belong to it
ROUNDS = 5
INDEPENDENT = 12.0  # independent points that a view counts as: their errors, and the map's, are correlated
LEAST_POINTS = 8.0  # fewest points on lines for a match


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Outlines:
    """Moments of the points on upright surfaces, cell by cell, from the cell's centre [m], weighted by precision."""

    weight: Float[Array, "*B H W"]
    first: Float[Array, "*B H W 2"]  # of x and y
    second: Float[Array, "*B H W 3"]  # of xx, xy and yy


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Walls:
    """Points of one view on upright surfaces, in the robot frame."""

    x: Float[Array, "N"]  # [m]
    y: Float[Array, "N"]  # [m]
    variance: Float[Array, "N"]  # [m^2] of each, along its range
    good: Bool[Array, "N"]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Lines:
    """The line in each cell of a map, through (x, y) [m] in the world frame, with a normal."""

    x: Float[Array, "H W"]
    y: Float[Array, "H W"]
    normal_x: Float[Array, "H W"]
    normal_y: Float[Array, "H W"]
    variance: Float[Array, "H W"]  # [m^2] across
    known: Bool[Array, "H W"]


def no_outlines(spec: GridSpec) -> Outlines:
    """The map before the first view."""
    return Outlines(jnp.zeros(spec.shape), jnp.zeros((*spec.shape, 2)), jnp.zeros((*spec.shape, 3)))


@checked()
def find_walls(view: View, shape: tuple[int, int], step: int, ground: Float[Array, ""]) -> Walls:
    """The points of a level view on upright surfaces: those above or below a neighbour, not behind it.

    Args:
      shape: static; rows and columns of the picture from which the points come, in the order of `view`.
      step: static; rows from a point to the neighbours with which it is compared.
      ground: [m] height of the surface under the robot above the base floor.

    Raises:
      InputError: an argument of another rank, shape or type, a `shape` for another number of points, or a `step` that
        is not within its rows.
    """
    if math.prod(shape) != view.x.shape[0] or min(shape) < 1:
        raise InputError(f"must be rows and columns of {view.x.shape[0]} points", field="shape", value=shape)
    if not 1 <= step < max(shape[0], 2):
        raise InputError(f"must be from 1 to {shape[0] - 1} rows", field="step", value=step)
    x, y, z = (v.reshape(shape) for v in (view.x, view.y, view.z))
    range_squared = x * x + y * y
    run = jnp.sqrt(range_squared)
    known = (view.weight > 0).reshape(shape) & jnp.isfinite(x + y + z)
    rise, back = jnp.abs(z[step:] - z[:-step]), jnp.abs(run[step:] - run[:-step])
    pair = known[step:] & known[:-step] & (rise > UPRIGHT * back)
    none = jnp.zeros((step, shape[1]), bool)
    good = known & (jnp.concatenate([none, pair]) | jnp.concatenate([pair, none])) & (z + ground > LOWEST)
    sd = NEAR_SD + DEPTH_SD * (range_squared + z * z)
    walls = Walls(*(jnp.where(good, v, 0.0).reshape(-1) for v in (x, y)), (sd * sd).reshape(-1), good.reshape(-1))
    return thinned(walls, shape)


def thinned(walls: Walls, shape: tuple[int, int]) -> Walls:
    """At most about `MOST` of the good points, evenly spread over the picture."""
    count = jnp.sum(walls.good)
    every = jnp.maximum(jnp.ceil(count / MOST), 1.0)
    turn = jnp.cumsum(walls.good) - 1
    taken = walls.good & (jnp.mod(turn, every) == 0) & (turn < every * MOST)
    place = jnp.where(taken, turn / every, MOST).astype(jnp.int32)
    return jax.tree.map(lambda v: jnp.zeros(MOST, v.dtype).at[place].set(v, mode="drop"), walls)


@checked()
def add_walls(outlines: Outlines, walls: Walls, pose: Pose, spec: GridSpec) -> Outlines:
    """The map with the points of one more view, measured from `pose`."""
    x, y = to_world(pose, walls.x, walls.y)
    i, j, inside = cells(x, y, spec)
    good = walls.good & inside & jnp.isfinite(x + y)
    weight = jnp.where(good, NEAR_SD**2 / walls.variance, 0.0)
    dx, dy = (jnp.where(good, v, 0.0) for v in (x - (j + 0.5) * spec.pitch, y - (i + 0.5) * spec.pitch))
    second = jnp.stack([dx * dx, dx * dy, dy * dy], axis=1)
    return Outlines(
        outlines.weight.at[i, j].add(weight),
        outlines.first.at[i, j].add(weight[:, None] * jnp.stack([dx, dy], axis=1)),
        outlines.second.at[i, j].add(weight[:, None] * second),
    )


def cells(
    x: Float[Array, "N"], y: Float[Array, "N"], spec: GridSpec
) -> tuple[Int[Array, "N"], Int[Array, "N"], Bool[Array, "N"]]:
    """Row and column of the cell of each point (the nearest for points outside), and whether it is inside."""
    height, width = spec.shape
    i, j = jnp.floor(y / spec.pitch), jnp.floor(x / spec.pitch)
    inside = (i >= 0) & (i < height) & (j >= 0) & (j < width)
    return *(jnp.where(inside, v, 0.0).astype(jnp.int32) for v in (i, j)), inside


def find_lines(outlines: Outlines, spec: GridSpec) -> Lines:
    """The lines of a map. A cell without one takes that of the best-known neighbour, across or along."""
    weight = jnp.maximum(outlines.weight, 1e-12)
    mx, my = outlines.first[..., 0] / weight, outlines.first[..., 1] / weight
    xx, xy, yy = (outlines.second[..., k] / weight for k in range(3))
    xx, xy, yy = xx - mx * mx, xy - mx * my, yy - my * my
    half, gap = (xx + yy) / 2, jnp.sqrt(jnp.square((xx - yy) / 2) + xy * xy)
    along, across = half + gap, jnp.maximum(half - gap, 0.0)
    angle = jnp.arctan2(2 * xy, xx - yy) / 2  # of the direction of greatest variance
    known = (outlines.weight >= LEAST_WEIGHT * NEAR_SD**2 / (NEAR_SD + DEPTH_SD) ** 2) & (across < THIN * along)
    known = known & (along > LEAST_LENGTH**2)
    rows, columns = (jnp.arange(n) + 0.5 for n in spec.shape)
    x, y = columns * spec.pitch + mx, rows[:, None] * spec.pitch + my
    lines = Lines(x, y, -jnp.sin(angle), jnp.cos(angle), across, known)
    score = jnp.where(known, outlines.weight, 0.0)
    best, found = score, lines
    for axis in (0, 1):
        for way in (1, -1):
            theirs = jax.tree.map(lambda v, way=way, axis=axis: shifted(v, way, axis), (score, lines))
            better = ~known & (theirs[0] > best)
            best, found = jax.tree.map(lambda a, b, better=better: jnp.where(better, a, b), theirs, (best, found))
    return found


def shifted(values: Array, way: int, axis: int) -> Array:
    """An array moved by one cell, zeros entering."""
    moved = jnp.roll(values, way, axis)
    edge = 0 if way > 0 else -1
    index = (edge, slice(None)) if axis == 0 else (slice(None), edge)
    return moved.at[index].set(jnp.zeros((), values.dtype))


@checked()
def match(belief: Belief, walls: Walls, outlines: Outlines, spec: GridSpec) -> Belief:
    """The belief after the points of a view were matched to the lines of the map.

    It is unchanged if fewer than `LEAST_POINTS` points lie on lines, if the pose would move by more than `GATE_POSE`
    (squared Mahalanobis distance), or if anything is not finite.
    """
    lines = find_lines(outlines, spec)
    prior = inverse(belief.cov + 1e-10 * jnp.eye(3))
    zero = jnp.zeros(3)

    def once(shift: Float[Array, "3"], _):
        H, b, count = normal_equations(pushed(belief.pose, shift), walls, lines, spec)
        scale = jnp.minimum(1.0, INDEPENDENT / jnp.maximum(count, 1.0))
        information = prior + scale * H
        step = -solve(information, scale * b + jnp.sum(prior * shift, axis=1))
        return shift + step, (information, count)

    shift, (information, counts) = jax.lax.scan(once, zero, length=ROUNDS)
    cov = inverse(information[-1])
    far = jnp.sum(shift * jnp.sum(prior * shift, axis=1))
    good = (counts[-1] >= LEAST_POINTS) & (far <= GATE_POSE) & jnp.all(jnp.isfinite(cov)) & jnp.all(jnp.isfinite(shift))
    found = Belief(pushed(belief.pose, shift), (cov + cov.T) / 2)
    return jax.tree.map(lambda new, old: jnp.where(good, new, old), found, belief)


def normal_equations(
    pose: Pose, walls: Walls, lines: Lines, spec: GridSpec
) -> tuple[Float[Array, "3 3"], Float[Array, "3"], Float[Array, ""]]:
    """Information and gradient of the distances of points from lines, by (x, y, yaw) of the pose, and how many count.

    Weights are Tukey's, relative to each distance's own spread.
    """
    x, y = to_world(pose, walls.x, walls.y)
    i, j, inside = cells(x, y, spec)
    line = jax.tree.map(lambda v: v[i, j], lines)
    dx, dy = x - line.x, y - line.y
    distance = line.normal_x * dx + line.normal_y * dy
    variance = jnp.maximum(walls.variance, NEAR_SD**2) + line.variance
    near = inside & walls.good & line.known & (dx * dx + dy * dy < REACH**2) & jnp.isfinite(x + y)
    weight = jnp.square(jnp.maximum(1 - distance * distance / (WIDE**2 * variance), 0.0))
    weight = jnp.where(near, weight, 0.0)
    turn = line.normal_y * (x - pose.x) - line.normal_x * (y - pose.y)
    J = [jnp.where(near, v, 0.0) for v in (line.normal_x, line.normal_y, turn)]
    w = weight / variance
    H = matrix(tuple(tuple(jnp.sum(w * a * b) for b in J) for a in J))
    b = jnp.stack([jnp.sum(w * a * jnp.where(near, distance, 0.0)) for a in J])
    return H, b, jnp.sum(weight)


def pushed(pose: Pose, shift: Float[Array, "3"]) -> Pose:
    """A pose moved by (x, y, yaw) of the world."""
    return Pose(pose.x + shift[0], pose.y + shift[1], pose.z, wrap_angle(pose.yaw + shift[2]))


def solve(A: Float[Array, "3 3"], b: Float[Array, "3"]) -> Float[Array, "3"]:
    """A^-1 b of a symmetric positive matrix."""
    return product(inverse(A), b[:, None])[:, 0]


def picture_shape(points: int, width: int, height: int) -> tuple[tuple[int, int], int]:
    """Rows and columns of a picture with this many points that represent width x height pixels, and the `step` in
    rows."""
    stride = np.sqrt(width * height / points)
    rows = round(height / stride)
    return (rows, points // rows), max(1, round(STEP / stride))
