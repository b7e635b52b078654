"""Ground as heights on a square lattice: the height at points, and first hits of rays on the surface.

The surface is that of MuJoCo's height fields: between four vertices there are two triangles that share the diagonal
from the corner of smallest x and y to that of greatest. Everything below the surface is solid, so its rim is a wall.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int

from jaxbiped.errors import InputError

SLACK = 1e-3  # [m] margin above the highest and below the lowest vertex, where the walk of a ray begins and ends
PARALLEL = 1e-9  # [1/m] a ray that crosses fewer lattice lines per metre crosses none: in float32, 0 is reached


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class HeightField:
    """Heights at the vertices of a lattice; vertex (i, j) is at `origin_xy` + `pitch` (j, i). NaN is a hole.

    A triangle with a vertex in a hole is a hole, too. There are at least 2 x 2 vertices.
    """

    heights: Float[Array, "*B P Q"]  # [m] row i along y, column j along x
    origin_xy: Float[Array, "*B 2"]  # [m] position of vertex (0, 0)
    pitch: Float[Array, "*B"]  # [m] from one vertex to the next


def on_field(field: HeightField, x: Float[Array, "*S"], y: Float[Array, "*S"]) -> Bool[Array, "*S"]:
    """Whether points (x, y) [m] lie on the rectangle of one field, including its rim and its holes."""
    u, v = on_lattice(field, x, y)
    rows, columns = shape_of(field)
    return (u >= 0) & (u <= columns - 1) & (v >= 0) & (v <= rows - 1)


def surface_height(field: HeightField, x: Float[Array, "*S"], y: Float[Array, "*S"]) -> Float[Array, "*S"]:
    """Height [m] of one field at points (x, y) [m]; NaN in a hole, off the rectangle, and where a point is NaN.

    `grad` gives the slope of the triangle, and also works for the heights.
    """
    u, v = on_lattice(field, x, y)
    rows, columns = shape_of(field)
    inside = (u >= 0) & (u <= columns - 1) & (v >= 0) & (v <= rows - 1)
    i, j = cell_of(jnp.where(inside, v, 0.0), rows), cell_of(jnp.where(inside, u, 0.0), columns)
    corners = tuple(field.heights[i + a, j + b] for a in (0, 1) for b in (0, 1))
    along, across = u - j, v - i
    return jnp.where(inside, triangle_height(corners, along, across, along >= across), jnp.nan)


def cast_rays(
    field: HeightField,
    origin: Float[Array, "... 3"],
    direction: Float[Array, "... 3"],
    reach: Float[Array, ""] | float = jnp.inf,
) -> Float[Array, "..."]:
    """Distance along each ray, in lengths of its direction, to its first hit on one field; inf if there is none.

    Exact: each ray walks from cell to cell, and in each triangle the hit is where the ray's height above the surface,
    which is linear there, becomes 0. So a ray neither leaks between two triangles nor skips a thin peak. It
    walks through at most as many cells as a straight line can cross, P + Q - 3.

    A ray hits the surface from above and from below, and the solid below it at the rim and at the borders of holes;
    it passes through holes. From within the solid it hits where it leaves through the surface. An origin on
    the surface gives 0. Directions that are 0, and values that are not finite, hit nothing.

    The walk is a `while_loop`: for derivatives by `grad`, use `surface_height`; forward ones (`jvp`) work.

    Args:
      origin: [m]; broadcast against `direction`.
      direction: of any length.
      reach: [lengths of the direction] hits beyond this are ignored.
    """
    rows, columns = shape_of(field)
    origin, direction = jnp.broadcast_arrays(origin, direction)
    shape = direction.shape[:-1]
    origin, direction = (jnp.moveaxis(values.reshape(-1, 3), -1, 0) for values in (origin, direction))
    largest = jnp.max(jnp.abs(direction), axis=0)  # first, so that squares neither vanish nor overflow
    length = largest * jnp.sqrt(jnp.sum(jnp.square(direction / largest), axis=0))
    good = (length > 0) & jnp.isfinite(length) & jnp.all(jnp.isfinite(origin), axis=0)
    direction = jnp.where(good, direction / jnp.where(good, length, 1.0), 0.0)
    origin = jnp.where(good, origin, 0.0)

    (u, v), z = on_lattice(field, origin[0], origin[1]), origin[2]
    du, dv, dz = direction[0] / field.pitch, direction[1] / field.pitch, direction[2]
    rim, leave = (
        combine(first, second)
        for combine, first, second in zip(
            (jnp.maximum, jnp.minimum), slab(u, du, columns - 1), slab(v, dv, rows - 1), strict=True
        )
    )
    known = jnp.isfinite(field.heights)
    top = jnp.max(field.heights, initial=-jnp.inf, where=known) + SLACK
    bottom = jnp.min(field.heights, initial=jnp.inf, where=known) - SLACK
    sinks, rises = dz < -PARALLEL, dz > PARALLEL
    into = jnp.where(sinks, (top - z) / dz, jnp.where(~rises & (z > top), jnp.inf, -jnp.inf))
    start = jnp.maximum(jnp.maximum(rim, into), 0.0)
    # A ray below the lowest vertex at the rim hits the rim: it ends there, and not before.
    last = jnp.where(sinks, jnp.maximum((bottom - z) / dz, start), jnp.where(rises, (top - z) / dz, jnp.inf))
    last = jnp.minimum(jnp.minimum(leave, last), reach * length)
    walks = good & (start <= last) & (start < jnp.inf)

    # From here on the ray begins where it enters: a distant origin costs no precision within the field.
    begin = jnp.where(walks, start, 0.0)
    u, v, z = jnp.clip(u + du * begin, 0, columns - 1), jnp.clip(v + dv * begin, 0, rows - 1), z + dz * begin
    ray = Ray(u, v, z, du, dv, dz, jnp.where(walks, last - begin, 0.0))
    squares = jnp.stack([field.heights[a : rows - 1 + a, b : columns - 1 + b] for a in (0, 1) for b in (0, 1)], axis=-1)
    squares = squares.reshape(-1, 4)
    walk = Walk(
        i=cell_of(v, rows),
        j=cell_of(u, columns),
        at=jnp.zeros_like(u),
        over=jnp.full_like(u, jnp.nan),
        empty=rim > 0,
        met=jnp.full_like(u, jnp.inf),
        walks=walks,
        steps=jnp.int32(0),
    )

    def goes_on(walk: Walk) -> Bool[Array, ""]:
        return jnp.any(walk.walks) & (walk.steps < rows + columns)

    walk = jax.lax.while_loop(goes_on, lambda walk: next_cell(walk, ray, squares, (rows, columns)), walk)
    return ((walk.met + begin) / jnp.where(good, length, 1.0)).reshape(shape)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Ray:
    """Rays in units of the lattice, from where they enter the field; the parameter is their length [m]."""

    u: Float[Array, "R"]  # [pitch] along x
    v: Float[Array, "R"]  # [pitch] along y
    z: Float[Array, "R"]  # [m]
    du: Float[Array, "R"]
    dv: Float[Array, "R"]
    dz: Float[Array, "R"]
    last: Float[Array, "R"]  # [m] where they end


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Walk:
    """The progress of rays."""

    i: Int[Array, "R"]  # the current cell of each
    j: Int[Array, "R"]
    at: Float[Array, "R"]  # [m] where it entered the cell
    over: Float[Array, "R"]  # [m] its height above the surface there; NaN if there was none before
    empty: Bool[Array, "R"]  # whether it did not come from solid: it is outside, or in a hole
    met: Float[Array, "R"]  # [m] where it hit the surface; inf: not yet
    walks: Bool[Array, "R"]
    steps: Int[Array, ""]


def next_cell(walk: Walk, ray: Ray, squares: Float[Array, "C 4"], shape: tuple[int, int]) -> Walk:
    """Advance each ray by one cell: through one of its triangles or both."""
    rows, columns = shape
    corners = tuple(jnp.moveaxis(squares[walk.i * (columns - 1) + walk.j], -1, 0))
    cross_u, cross_v = crossing(ray.u, ray.du, walk.j), crossing(ray.v, ray.dv, walk.i)
    begin = walk.at
    end = jnp.maximum(jnp.minimum(jnp.minimum(cross_u, cross_v), ray.last), begin)

    def inside(at):
        return tuple(
            jnp.clip(a + rate * at - cell, 0, 1) for a, rate, cell in ((ray.u, ray.du, walk.j), (ray.v, ray.dv, walk.i))
        )

    (x0, y0), (x1, y1) = inside(begin), inside(end)
    side0, side1 = x0 - y0, x1 - y1  # of the diagonal
    crosses = side0 * side1 < 0
    part = jnp.where(crosses, side0 / jnp.where(crosses, side0 - side1, 1.0), 1.0)
    middle = begin + part * (end - begin)
    xm, ym = x0 + part * (x1 - x0), y0 + part * (y1 - y0)
    first = jnp.where(crosses, side0, side0 + side1) >= 0
    second = first ^ crosses

    met, over, empty = walk.met, walk.over, walk.empty
    for a, b, (xa, ya), (xb, yb), lower in (
        (begin, middle, (x0, y0), (xm, ym), first),
        (middle, end, (xm, ym), (x1, y1), second),
    ):
        here = ray.z + ray.dz * a - triangle_height(corners, xa, ya, lower)
        there = ray.z + ray.dz * b - triangle_height(corners, xb, yb, lower)
        there = jnp.where(jnp.isfinite(here), there, jnp.nan)
        solid = jnp.isfinite(there)
        comes = jnp.isnan(over)
        # The height at an edge is that of the previous triangle: with one value per edge nothing can leak.
        here = jnp.where(comes, here, over)
        wall = solid & comes & empty & (here < 0)
        through = solid & (((here >= 0) & (there <= 0)) | ((here <= 0) & (there >= 0)))
        apart = jnp.where(here != there, here - there, 1.0)
        point = jnp.where(wall, a, a + (b - a) * jnp.clip(here / apart, 0, 1))
        met = jnp.where((wall | through) & (met == jnp.inf) & walk.walks, point, met)
        over, empty = jnp.where(solid, there, jnp.nan), empty | ~solid
    along_u = cross_u <= cross_v
    j = walk.j + jnp.where(along_u, jnp.sign(ray.du), 0).astype(jnp.int32)
    i = walk.i + jnp.where(along_u, 0, jnp.sign(ray.dv)).astype(jnp.int32)
    inside_field = (i >= 0) & (i < rows - 1) & (j >= 0) & (j < columns - 1)
    walks = walk.walks & (met == jnp.inf) & (end < ray.last) & inside_field
    i, j = jnp.where(walks, i, walk.i), jnp.where(walks, j, walk.j)
    return Walk(i, j, end, over, empty, met, walks, walk.steps + 1)


def crossing(place: Float[Array, "R"], rate: Float[Array, "R"], cell: Int[Array, "R"]) -> Float[Array, "R"]:
    """Where [m] rays leave their cells along one axis; inf for those parallel to its lines."""
    moves = jnp.abs(rate) > PARALLEL
    return jnp.where(moves, (cell + (rate > 0) - place) / jnp.where(moves, rate, 1.0), jnp.inf)


def slab(place: Float[Array, "R"], rate: Float[Array, "R"], size: int) -> tuple[Float[Array, "R"], Float[Array, "R"]]:
    """Where rays enter and leave the range [0, size] of one axis; from inf to -inf if they are never in it."""
    moves = jnp.abs(rate) > PARALLEL
    rate = jnp.where(moves, rate, 1.0)
    ends = (0 - place) / rate, (size - place) / rate
    inside = (place >= 0) & (place <= size)
    enter = jnp.where(moves, jnp.minimum(*ends), jnp.where(inside, -jnp.inf, jnp.inf))
    return enter, jnp.where(moves, jnp.maximum(*ends), jnp.where(inside, jnp.inf, -jnp.inf))


def triangle_height(
    corners: tuple[Float[Array, "*S"], ...],
    along: Float[Array, "*S"],
    across: Float[Array, "*S"],
    lower: Bool[Array, "*S"],
) -> Float[Array, "*S"]:
    """Height [m] on one of the two triangles of cells.

    Args:
      corners: heights [m] at (0, 0), (1, 0), (0, 1) and (1, 1), as (x, y) within the cell.
      along, across: position within the cell, 0 to 1 along x and y.
      lower: whether the triangle of smallest y, with (1, 0), else that with (0, 1).
    """
    low, right, up, high = corners
    return low + jnp.where(
        lower, along * (right - low) + across * (high - right), across * (up - low) + along * (high - up)
    )


def height_range(field: HeightField) -> tuple[float, float]:
    """Lowest and highest vertex [m] of a field, on the host; 0 if all are holes. Its heights are concrete."""
    heights = np.asarray(field.heights)
    known = heights[np.isfinite(heights)]
    return (float(known.min()), float(known.max())) if known.size else (0.0, 0.0)


def on_lattice(
    field: HeightField, x: Float[Array, "*S"], y: Float[Array, "*S"]
) -> tuple[Float[Array, "*S"], Float[Array, "*S"]]:
    """Points (x, y) [m] in units of the lattice, from vertex (0, 0)."""
    return (x - field.origin_xy[0]) / field.pitch, (y - field.origin_xy[1]) / field.pitch


def cell_of(place: Float[Array, "*S"], vertices: int) -> Int[Array, "*S"]:
    """Index of the cell of a position on an axis; the last one includes both of its ends."""
    return jnp.clip(jnp.floor(place), 0, vertices - 2).astype(jnp.int32)


def shape_of(field: HeightField) -> tuple[int, int]:
    """(P, Q) of one field.

    Raises:
      InputError: another rank, or fewer than 2 x 2 vertices.
    """
    shape = field.heights.shape
    if len(shape) != 2 or min(shape) < 2:
        raise InputError("must be [P, Q], 2 x 2 or more", field="heights", value=shape)
    return shape
