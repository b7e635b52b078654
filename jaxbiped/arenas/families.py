"""Random arenas: six static families and one with moving boxes, each with a difficulty from 0 (easy) to 1 (hard).

Every family lays its boxes out between a start on the left and a goal on the right of the area of the
paper's experiments (180 x 140 cm; paper, 3.1). Arena k is a pure function of (key, k): the same in
any batch, on any device.
"""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, PRNGKeyArray

from jaxbiped.arenas.arena import CIRCLE, SQUARE, Arena, Landmarks
from jaxbiped.arenas.moving_boxes import Movers
from jaxbiped.arenas.population import Population, given_or
from jaxbiped.core import checks
from jaxbiped.core.signatures import checked
from jaxbiped.errors import InputError
from jaxbiped.geometry.boxes import Boxes, footprint_extent, plan_distance

FAMILIES = ("obstacles", "bump", "stairs", "gate", "mixed", "clutter")  # static families
MOVING = ("traffic",)
KNOWN = FAMILIES + MOVING

MAX_BOXES = 12  # slots; every family fits
DRAWS = 12  # rows of `MAX_BOXES` random numbers per arena
SIZE_X, SIZE_Y = 1.80, 1.40  # [m]
BUMP = 0.03  # [m] one step of the robot (paper, Table 2)
LINTEL = 0.37  # [m] clearance of a gate (paper, Table 2)
TALL = 0.50  # [m] higher than the camera
WALKERS = 4
TRAFFIC_X = 0.18  # [m] range of moving blocks to both sides of the middle: clear of start and goal
TRAFFIC_SPEED = 0.02  # [m/s] greatest; the robot itself moves at 2 mm/s, including measurements
CLEARANCE = 0.22  # [m] kept free of obstacles around the start and the goal

# Discs and squares beside the path and behind the goal: from most poses facing the goal, two are in view.
LANDMARKS_X = (0.55, 0.55, 1.05, 1.05, 1.70, 1.70)
LANDMARKS_Y = (0.12, 1.28, 0.12, 1.28, 0.35, 1.05)
LANDMARKS_KIND = (SQUARE, SQUARE, CIRCLE, CIRCLE, CIRCLE, CIRCLE)


@checked()
def sample(
    key: PRNGKeyArray,
    index: Int[Array, ""] | int,
    families: tuple[str, ...] = FAMILIES,
    population: Population | None = None,
    turn: Int[Array, ""] | None = None,
) -> Arena:
    """Arena `index` of the population determined by `key`.

    Consumes `fold_in(key, index)`, never `key` itself. Families take turns (`index` modulo their number), so that
    strata are balanced in every block of arenas; difficulty is uniform on [0, 1].

    Args:
      families: static; which families take turns.
      population: measures that are fixed and not drawn; everything else in the arena stays the same.
      turn: index of its family; by default `index` modulo their number.

    Raises:
      InputError: not a key, an index below 0, no family, or an unknown one.
    """
    checks.integers("index", index, between=(0, np.iinfo(np.int32).max))
    unknown = [name for name in families if name not in LAYOUTS]
    if unknown or not families:
        raise InputError(f"must be of {', '.join(KNOWN)}", field="families", value=unknown[0] if unknown else ())
    turn = jnp.asarray(index) % len(families) if turn is None else turn
    # One draw feeds every part: each call of the generator costs compile time.
    u = jax.random.uniform(jax.random.fold_in(key, index), (DRAWS, MAX_BOXES))
    difficulty = u[0, 0]
    # Start on the left, facing right within 15 degrees; goal on the right.
    start = jnp.array([0.25, 0.70, 0.0]) + (2 * u[0, 1:4] - 1) * jnp.array([0.05, 0.20, 0.26])
    goal = jnp.array([1.45, 0.70]) + (2 * u[0, 4:6] - 1) * jnp.array([0.05, 0.20])
    middle = (start[:2] + goal) / 2
    fixed = {"bump": {"population": population}}  # the only family with measures to fix
    layouts = [LAYOUTS[name](u[4:], difficulty, middle, **fixed.get(name, {})) for name in families]
    boxes = replace(jax.tree.map(lambda *leaves: jnp.stack(leaves)[turn], *layouts), contrast=0.5 + 0.5 * u[1])
    boxes = _keep_ends_free(_keep_inside(boxes), start[:2], goal)
    if population is not None and "bump" in families:
        bar = (turn == families.index("bump")) & (jnp.arange(MAX_BOXES) == 0) & boxes.used
        boxes = replace(boxes, top=jnp.where(bar, given_or(population.bump_height, boxes.top), boxes.top))
    traffic = [name in MOVING for name in families]
    movers = _movers(u[4:], boxes, jnp.array(traffic)[turn], population) if any(traffic) else None
    return Arena(
        size_xy=jnp.array([SIZE_X, SIZE_Y]),
        boxes=boxes,
        landmarks=_landmarks(u[2:4], boxes),
        start_xyyaw=start,
        goal_xy=goal,
        floor_contrast=jnp.float32(1.0),
        family=jnp.array([KNOWN.index(name) for name in families])[turn],
        difficulty=difficulty,
        movers=movers,
    )


def _boxes(x, y, yaw, half_x, half_y, bottom, top, used=True) -> Boxes:
    """Boxes from rows of numbers or vectors, padded to `MAX_BOXES`."""
    rows = (x, y, yaw, half_x, half_y, bottom, top)
    rows = jnp.broadcast_arrays(*(jnp.atleast_1d(jnp.asarray(row, jnp.float32)) for row in rows))
    count = rows[0].shape[0]
    pad = (0, MAX_BOXES - count)
    rows = [jnp.pad(row, pad) for row in rows]
    used = jnp.pad(jnp.broadcast_to(jnp.asarray(used), (count,)), pad)
    return Boxes(*rows, overhead=rows[5] > 0, contrast=jnp.ones(MAX_BOXES), used=used)


def _obstacles(u, difficulty, middle, slots: int = 6) -> Boxes:
    """2 to `slots` blocks, half of them lower than the camera and half taller, the first near the straight path."""
    u = u[:6, :slots]
    near = jnp.array([1.0] + [0.0] * (slots - 1))
    spread_y = 0.60 - near * (0.60 - 0.15)
    x = middle[0] + (u[0] - 0.5) * (0.75 - 0.45 * near)
    y = middle[1] * near + 0.70 * (1 - near) + (2 * u[1] - 1) * spread_y
    half_x = 0.04 + u[2] * (0.06 + 0.06 * difficulty)
    half_y = 0.04 + u[3] * (0.06 + 0.12 * difficulty)
    top = jnp.where(u[4] < 0.5, 0.09 + 0.32 * u[4], TALL)
    used = jnp.arange(slots) < jnp.round(2 + (slots - 2) * difficulty)
    return _boxes(x, y, (u[5] - 0.5) * jnp.pi, half_x, half_y, 0.0, top, used)


def _bump(u, difficulty, middle, population: Population | None = None) -> Boxes:
    """A bar of 3 cm across the straight path, 15 to 45 cm wide, turned up to 30 degrees; harder: a longer detour."""
    u = 2 * u[6] - 1
    half_y = 0.18 + difficulty * 0.52 + 0.06 * u[0]
    half_x = 0.15 + 0.075 * u[1]
    if population is not None:
        half_x, half_y = given_or(population.bump_width / 2, half_x), given_or(population.bump_length / 2, half_y)
    return _boxes(middle[0] + 0.10 * u[2], middle[1] + 0.10 * u[3], 0.5 * u[4], half_x, half_y, 0.0, BUMP)


def _stairs(u, difficulty, middle) -> Boxes:
    """A step of 3 cm with one of 6 cm on it; ledges of 18 to 22 cm, to stand on clear of the upper step.

    On the sides the upper step ends with the lower one: a floor cell beside it faces a block of 6 cm.
    """
    u = 2 * u[6] - 1
    upper_x = 0.11 + 0.03 * u[0]
    ledge = 0.20 + 0.02 * u[1]
    half_y = 0.30 + 0.40 * difficulty
    x, y, yaw = middle[0] + 0.05 * u[2], middle[1] + 0.05 * u[3], 0.15 * u[4]
    return _boxes(x, y, yaw, jnp.stack([upper_x + ledge, upper_x]), half_y, 0.0, jnp.array([BUMP, 2 * BUMP]))


def _gate(u, difficulty, middle, shift: Float[Array, ""] | float = 0.0) -> Boxes:
    """Two walls with a gap of 42 to 51 cm and a lintel 37 cm above it; harder: longer walls, less space around them."""
    u = 2 * u[7] - 1
    gap = 0.49 - 0.05 * difficulty + 0.02 * u[0]
    reach = 0.10 + 0.60 * difficulty  # [m] length of each wall
    x, y, yaw = middle[0] + 0.10 * u[1] + shift, middle[1] + 0.08 * u[2], 0.10 * u[3]
    along = jnp.array([-0.5, 0.5, 0.0]) * (gap + reach)
    half_y = jnp.stack([reach / 2, reach / 2, gap / 2 + 0.02])
    bottom = jnp.array([0.0, 0.0, LINTEL])
    return _boxes(x - jnp.sin(yaw) * along, y + jnp.cos(yaw) * along, yaw, 0.025, half_y, bottom, TALL)


def _mixed(u, difficulty, middle) -> Boxes:
    """A gate, a bar of 3 cm before or behind it, and up to two blocks near the rims."""
    side = jnp.where(u[7, -1] < 0.5, 1.0, -1.0)
    gate = _gate(u, difficulty, middle, 0.25 * side)
    bump = _bump(u, difficulty, middle - jnp.array([0.22, 0.0]) * side)
    bump = replace(bump, yaw=0.3 * bump.yaw, half_x=0.7 * bump.half_x)
    blocks = _obstacles(u, difficulty, middle, slots=2)
    blocks = replace(blocks, y=jnp.where(blocks.y > 0.7, 1.22, 0.18))
    return jax.tree.map(lambda a, b, c: jnp.concatenate([a[:3], b[:1], c[:2], b[1:-5]]), gate, bump, blocks)


def _clutter(u, difficulty, middle) -> Boxes:
    """4 to 10 small boxes anywhere: a third of them 3 cm islands, the others blocks of 9 to 50 cm."""
    slots = 10
    u = u[:6, :slots]
    island = jnp.arange(slots) % 3 == 0
    half_x = jnp.where(island, 0.10 + 0.10 * u[2], 0.03 + 0.05 * u[2])
    half_y = jnp.where(island, 0.10 + 0.15 * u[3], 0.03 + 0.07 * u[3])
    top = jnp.where(island, BUMP, 0.09 + 0.41 * u[4])
    used = jnp.arange(slots) < jnp.round(4 + 6 * difficulty)
    x, y = 0.30 + 1.2 * u[0], 0.10 + 1.2 * u[1]
    return _boxes(x, y, (u[5] - 0.5) * jnp.pi, half_x, half_y, 0.0, top, used)


def _traffic(u, difficulty, middle) -> Boxes:
    """1 to 4 blocks of 8 to 14 cm that move back and forth across the path, every other one lower than the camera."""
    u = u[:4, :WALKERS]
    half, high = 0.04 + 0.03 * u[2], jnp.where(jnp.arange(WALKERS) % 2 == 0, TALL, 0.25)
    used = jnp.arange(WALKERS) < jnp.round(1 + (WALKERS - 1) * difficulty)
    x = middle[0] + TRAFFIC_X * (2 * u[0] - 1)
    return _boxes(x, 0.15 + 0.25 * u[1], (u[3] - 0.5) * jnp.pi, half, half, 0.0, high, used)


def _movers(u, boxes: Boxes, traffic: Bool[Array, ""], population: Population | None) -> Movers:
    """The paths of the boxes of `_traffic`, 0.75 to 1.1 m long; none for other families."""
    u = u[4:8]
    x = jnp.clip(boxes.x + 0.2 * (2 * u[0] - 1), SIZE_X / 2 - TRAFFIC_X, SIZE_X / 2 + TRAFFIC_X)
    speed = TRAFFIC_SPEED * u[2]
    if population is not None:
        speed = given_or(population.obstacle_speed, speed)
    on = traffic & boxes.used
    dx, dy, speed = (jnp.where(on, values, 0.0) for values in (x - boxes.x, 1.25 - 0.25 * u[1] - boxes.y, speed))
    return Movers(dx, dy, speed, phase=jnp.where(on, 2 * u[3], 0.0))


LAYOUTS = {
    "obstacles": _obstacles,
    "bump": _bump,
    "stairs": _stairs,
    "gate": _gate,
    "mixed": _mixed,
    "clutter": _clutter,
    "traffic": _traffic,
}


def _keep_inside(boxes: Boxes) -> Boxes:
    """Shorten and move boxes so that their footprints lie within the area.

    Only the long side shrinks: a bar stays as wide as it was drawn.
    """
    cos, sin = jnp.abs(jnp.cos(boxes.yaw)), jnp.abs(jnp.sin(boxes.yaw))
    lies_x = boxes.half_x > boxes.half_y  # whether the long side is the box's own x
    short = jnp.minimum(boxes.half_x, boxes.half_y)
    long_x, long_y = jnp.where(lies_x, cos, sin), jnp.where(lies_x, sin, cos)  # its components along world x, y
    room_x = (SIZE_X / 2 - long_y * short) / jnp.maximum(long_x, 1e-6)
    room_y = (SIZE_Y / 2 - long_x * short) / jnp.maximum(long_y, 1e-6)
    long = jnp.minimum(jnp.maximum(boxes.half_x, boxes.half_y), jnp.minimum(room_x, room_y))
    boxes = replace(boxes, half_x=jnp.where(lies_x, long, short), half_y=jnp.where(lies_x, short, long))
    extent_x, extent_y = footprint_extent(boxes)
    x, y = jnp.clip(boxes.x, extent_x, SIZE_X - extent_x), jnp.clip(boxes.y, extent_y, SIZE_Y - extent_y)
    return replace(boxes, x=x, y=y)


def _keep_ends_free(boxes: Boxes, start: Float[Array, "2"], goal: Float[Array, "2"]) -> Boxes:
    """Drop the boxes that would cover the robot or its goal."""
    near = jnp.minimum(plan_distance(boxes, start[0], start[1]), plan_distance(boxes, goal[0], goal[1]))
    free = near > jnp.where(boxes.top <= BUMP, 0.10, CLEARANCE)
    return replace(boxes, used=boxes.used & free)


def _landmarks(u: Float[Array, "2 M"], boxes: Boxes) -> Landmarks:
    """Landmarks near their nominal positions, left out where a box covers them."""
    count = len(LANDMARKS_X)
    u = 2 * u - 1
    x = jnp.array(LANDMARKS_X) + 0.05 * u[0, :count]
    y = jnp.array(LANDMARKS_Y) + 0.03 * u[1, :count]
    covered = jax.vmap(lambda px, py: jnp.any(boxes.used & (plan_distance(boxes, px, py) < 0.08)))(x, y)
    return Landmarks(x, y, jnp.pi / 4 * u[0, count:], jnp.array(LANDMARKS_KIND), ~covered)
