"""The class grid of terrain against plain NumPy: every place looked up by itself, every cell counted by itself."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.geometry.height_field import HeightField
from jaxbiped.mapping import Cell, GridSpec, terrain_grid
from jaxbiped.motion.config import RobotConfig
from tests.geometry.triangles import height_at
from tests.reference import mapping as reference

SAMPLES, LEAST_SHARE = 5, 0.05
BODY = RobotConfig().body()
PLAIN_BODY = jax.tree.map(np.asarray, BODY)
SPEC = GridSpec(size_x=1.0, size_y=0.8, lowest=0, levels=32, ground_levels=24)


def terrain(heights, pitch, origin=(0.0, 0.0)):
    return HeightField(jnp.asarray(heights, jnp.float32), jnp.array(origin, jnp.float32), jnp.float32(pitch))


def classed(heights, pitch, spec=SPEC, origin=(0.0, 0.0)):
    made = jax.jit(partial(terrain_grid, spec=spec))(terrain(heights, pitch, origin), body=BODY)
    return tuple(np.asarray(values) for values in made)


def plain(heights, pitch, spec=SPEC, origin=(0.0, 0.0)):
    """The same, place by place."""
    rows, columns = spec.shape
    sub = (np.arange(SAMPLES) + 0.5) / SAMPLES
    px = ((np.arange(columns)[:, None] + sub).ravel() * spec.pitch)[None].repeat(rows * SAMPLES, 0)
    py = ((np.arange(rows)[:, None] + sub).ravel() * spec.pitch)[:, None].repeat(columns * SAMPLES, 1)
    found = height_at(np.asarray(heights, float), pitch, px.ravel() - origin[0], py.ravel() - origin[1])
    found = found.reshape(rows, SAMPLES, columns, SAMPLES).swapaxes(1, 2).reshape(rows, columns, -1)
    occupied = np.zeros((rows, columns, 32), bool)
    level, own, top, holes = (
        np.zeros((rows, columns), int),
        np.zeros((rows, columns)),
        np.full((rows, columns), -np.inf),
        np.zeros((rows, columns), bool),
    )
    for i, j in np.ndindex(rows, columns):
        known = found[i, j][np.isfinite(found[i, j])]
        at = np.maximum(np.round(known / spec.level_height), 0).astype(int)
        counts = [(at >= k).sum() for k in range(32)]
        counts[0] = SAMPLES**2  # the base floor is everywhere
        occupied[i, j] = np.array(counts) / SAMPLES**2 > LEAST_SHARE
        walkable = np.array([(at == k).sum() for k in range(spec.ground_levels)])
        if walkable.sum() >= SAMPLES**2 / 2:
            level[i, j] = max(k for k in range(spec.ground_levels) if walkable[k] == walkable.max())
        own[i, j] = level[i, j] * spec.level_height
        if (at == level[i, j]).any():
            own[i, j] = known[at == level[i, j]].mean()
        tops = [known[at == k].max() for k in range(spec.ground_levels) if walkable[k] / SAMPLES**2 > LEAST_SHARE]
        top[i, j] = max(tops, default=-np.inf)
        holes[i, j] = len(known) <= SAMPLES**2 / 2
    relief = (own.astype(np.float32), np.zeros_like(own, np.float32), top.astype(np.float32))
    classes, levels = reference.classify_cells(occupied, level, relief, PLAIN_BODY, 0.0, spec)
    return np.where(holes, Cell.UNMEASURED, classes), np.where(holes, 0, levels)


def hills(seed, shape=(30, 38), height=0.05, holes=0.0, steps=True):
    rng = np.random.default_rng(seed)
    i, j = np.indices(shape)
    smooth = height * (1.2 + np.sin(i * rng.uniform(0.05, 0.3)) + np.cos(j * rng.uniform(0.05, 0.3)))
    made = np.round(smooth / 0.03) * 0.03 if steps else smooth
    made = made + rng.normal(0, 0.002, shape)
    made[rng.random(shape) < holes] = np.nan
    return made.astype(np.float32)


@pytest.mark.parametrize(
    "heights, pitch, origin",
    [
        (hills(0), 0.0271, (0.0, 0.0)),
        (hills(1, steps=False), 0.0271, (-0.11, 0.13)),
        (hills(2, holes=0.15), 0.0271, (0.0, 0.0)),
        (hills(3, height=0.4), 0.0271, (0.0, 0.0)),  # most is too high to stand on
        (hills(4) - 0.1, 0.0271, (0.0, 0.0)),  # pits below the base floor
        (hills(5, (4, 5), holes=0.1), 0.31, (-0.203, -0.1017)),  # triangles larger than cells
        (hills(6, (160, 200), holes=0.02), 0.00513, (0.0, 0.0)),  # and smaller ones than the places' spacing
        (hills(7, (9, 9)), 0.0271, (0.2, 0.3)),  # most of the grid is not covered
    ],
)
def test_is_that_of_plain_numpy(heights, pitch, origin):
    """Equal in all cells but where a height lies, to float32, between two levels or at a limit: at most 1 of 320.

    No place lies on a line of the lattice, where either of two triangles is right.
    """
    found, expected = classed(heights, pitch, origin=origin), plain(heights, pitch, origin=origin)
    differ = (found[0] != expected[0]) | (found[1] != expected[1])
    assert differ.sum() <= 1, np.argwhere(differ)


def test_stairs_by_hand():
    """Three treads of 25 cm and steps of 3 cm, then a wall: 10 cm, the body's radius, before it is obstacle."""
    x = np.arange(0, 1.001, 0.01)
    height = np.select([x < 0.25, x < 0.5, x <= 0.75], [0, 0.03, 0.06], 0.9)
    classes, levels = classed(np.tile(height, (81, 1)), 0.01)
    F, B, X = Cell.FLOOR, Cell.BUMP, Cell.OBSTACLE
    np.testing.assert_array_equal(classes, np.tile([F] * 5 + [B] * 8 + [X] * 7, (16, 1)))
    np.testing.assert_array_equal(levels[0, :15], [0] * 5 + [1] * 5 + [2] * 5)


def test_steps_too_high_and_ground_off_its_level_are_obstacles():
    """A step of 6 cm is one, 10 cm to both sides on the low side alone; a plateau 1.4 cm high is one all over."""
    x = np.arange(0, 1.001, 0.01)
    classes, _ = classed(np.tile(np.where(x < 0.5, 0, 0.06), (81, 1)), 0.01)
    assert (classes[:, :8] == Cell.FLOOR).all() and (classes[:, 8:10] == Cell.OBSTACLE).all()
    assert (classes[:, 10:] == Cell.BUMP).all()
    classes, _ = classed(np.tile(np.where(x < 0.5, 0, 0.014), (81, 1)), 0.01)
    assert (classes[:, :10] == Cell.FLOOR).all() and (classes[:, 10:] == Cell.OBSTACLE).all()


def test_holes_and_what_is_not_covered_are_unmeasured():
    heights = np.zeros((81, 101), np.float32)
    heights[40:, :50] = np.nan
    classes, levels = classed(heights, 0.01, GridSpec(size_x=1.2, size_y=0.8, lowest=0, levels=32, ground_levels=24))
    unmeasured = np.zeros((16, 24), bool)
    unmeasured[8:, :10] = unmeasured[:, 20:] = True
    np.testing.assert_array_equal(classes, np.where(unmeasured, Cell.UNMEASURED, Cell.FLOOR))
    assert not levels.any()
