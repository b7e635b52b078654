"""Maps of whole clouds: against the truth of the boxes that they were sampled from, and plain counting."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.ndimage import binary_dilation

from jaxbiped.arenas import sample
from jaxbiped.errors import InputError
from jaxbiped.mapping import cover
from jaxbiped.mapping.cover import CUBE, cover_voxels
from jaxbiped.mapping.grid import Cell, GridSpec
from jaxbiped.mapping.scan_map import SCAN, lay_out, make_chart
from jaxbiped.mapping.truth import truth_grid
from tests.mapping.scenes import BODY
from tests.mapping.surfaces import sample_surfaces

ARENAS = 6  # one of each family
AREA = (0.0, 1.8, 0.0, 1.4)


def chart_of(points, area=AREA, **kwargs):
    spec, origin = lay_out(points, 0.05, area=area)
    return make_chart(points, spec, origin, BODY, SCAN, **kwargs)


@pytest.fixture(scope="module")
def worlds():
    """Random arenas on the host, and their true classes."""
    spec = GridSpec()

    def make(k):
        arena = sample(jax.random.key(5), k)
        return arena, truth_grid(arena, spec, BODY)[0]

    return jax.tree.map(np.asarray, jax.jit(jax.vmap(make))(jnp.arange(ARENAS)))


def world(worlds, k):
    return jax.tree.map(lambda leaf: leaf[k], worlds[0])


def test_clouds_of_boxes_are_read_as_they_are(worlds):
    truth = worlds[1]
    found = np.stack([chart_of(sample_surfaces(world(worlds, k))).grid.classes for k in range(ARENAS)])
    near = np.ones((1, 3, 3), bool)
    measured = found != Cell.UNMEASURED
    assert measured.mean() > 0.98  # the middle of wide obstacles is not
    assert (found == truth)[measured].mean() > 0.985  # 0.995 on 18 arenas
    for cell, least in ((Cell.FLOOR, 0.995), (Cell.BUMP, 0.995), (Cell.OBSTACLE, 0.995), (Cell.GATE, 0.9)):
        true, said = truth == cell, found == cell  # of gates there are few cells
        assert binary_dilation(said, near)[true & measured].mean() >= least, cell
        assert binary_dilation(true, near)[said].mean() >= least, cell


def test_density_and_duplicates_do_not_matter(worlds):
    """The same surfaces, four times as dense near one corner, and every point twice."""
    points = sample_surfaces(world(worlds, 4))
    near = points[np.hypot(points[:, 0], points[:, 1]) < 0.7]
    rng = np.random.default_rng(0)
    more = np.concatenate([points, points, near, near + 1e-4 * rng.normal(size=near.shape)])
    assert (chart_of(points).grid.classes == chart_of(more).grid.classes).mean() > 0.99


@pytest.mark.parametrize("spacing", [0.018, 0.025])
def test_a_sparse_scan_is_read_too(worlds, spacing):
    """8 and 4 points a cell."""
    truth = worlds[1]
    clouds = [sample_surfaces(world(worlds, k), spacing=spacing, noise=0.003) for k in (0, 4)]
    found = np.stack([chart_of(points, sparse=True).grid.classes for points in clouds])
    measured = found != Cell.UNMEASURED
    assert measured.mean() > 0.97 and (found == truth[[0, 4]])[measured].mean() > 0.97


def test_a_cell_whose_ground_was_not_seen_is_unmeasured():
    rng = np.random.default_rng(0)
    table = np.column_stack([rng.uniform(0, 0.5, (20000, 2)), np.full(20000, 0.36)])
    made = chart_of(table, area=(0.0, 0.5, 0.0, 0.5))
    assert set(np.unique(made.grid.classes)) <= {Cell.UNMEASURED, Cell.OBSTACLE}


@settings(max_examples=30, deadline=None)
@given(arrays(np.float32, (20, 3), elements=st.floats(-0.25, 0.625, width=32)), st.floats(-1e3, 1e3))
def test_covered_surface_is_counted_cube_by_cube(points, away):
    spec = GridSpec(size_x=0.2, size_y=0.15)
    got = cover_voxels(points + np.array([away, 0, 0]), spec, (away, 0.0))
    seen = set()
    for x, y, z in (points + np.array([away, 0, 0])) - np.array([away, 0, 0]):
        i, j, k = np.floor(y / CUBE), np.floor(x / CUBE), np.floor((z + 0.045) / CUBE)
        if 0 <= i < 15 and 0 <= j < 20 and 0 <= k < 48:
            seen.add((int(i), int(j), int(k)))
    want = np.zeros((*spec.shape, spec.levels))
    for i, j, k in seen:
        want[i // 5, j // 5, k // 3] += 1
    # A coordinate within rounding of a cube's face may fall on either side of it.
    edge = np.abs(points.astype(float) / CUBE - np.round(points.astype(float) / CUBE))
    edge[:, 2] = np.abs((points[:, 2].astype(float) + 0.045) / CUBE - np.round((points[:, 2] + 0.045) / CUBE))
    assert np.abs(got - want).sum() <= 2 * (edge < 1e-6).any(1).sum()


def test_many_points_are_counted_a_part_at_a_time(monkeypatch):
    rng = np.random.default_rng(1)
    points = rng.uniform([0, 0, -0.1], [1.8, 1.4, 0.6], (5000, 3))
    points[::7] = np.nan
    points[3], points[4] = np.inf, -np.inf
    whole = cover_voxels(points, GridSpec(), (0.0, 0.0))
    monkeypatch.setattr(cover, "AT_ONCE", 999)
    np.testing.assert_array_equal(cover_voxels(points, GridSpec(), (0.0, 0.0)), whole)


def test_the_grid_covers_the_cloud():
    points = np.array([[-0.31, 2.0, 0.0], [1.2, 2.43, 0.3], [50.0, 60.0, 3.0]])  # the last one is far above
    spec, origin = lay_out(points, 0.05)
    assert origin == pytest.approx((-0.35, 2.0)) and spec.shape == (9, 32)
    spec, origin = lay_out(points[:1], 0.05)
    assert spec.shape == (1, 1) and origin == pytest.approx((-0.35, 2.0))
    assert lay_out(points, 0.1, area=(0.05, 1.0, -1.0, 1.0))[0].shape == (20, 10)


def test_what_cannot_be_laid_out():
    points = np.array([[0.0, 0.0, 0.0], [1000.0, 500.0, 0.1]])
    with pytest.raises(InputError, match=r"pitch: must give at most 4,000,000 cells on the 1000.05 x 500.05 m"):
        lay_out(points, 0.05)
    with pytest.raises(InputError, match="none is there"):
        lay_out(points + np.array([0, 0, 5]), 0.05)
    for area in ((1.0, 0.0, 0.0, 1.0), (0.0, 1.0, 0.0, np.nan), (0.0, 0.0, 0.0, 1.0)):
        with pytest.raises(InputError, match="area: must be finite, X0 < X1"):
            lay_out(points, 0.05, area=area)
