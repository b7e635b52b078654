"""The height field against MuJoCo's own and against every triangle in plain NumPy, and at its corners and holes."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from jaxbiped.errors import InputError
from jaxbiped.geometry.height_field import HeightField, cast_rays, on_field, surface_height
from tests.geometry.triangles import cast_all, height_at, triangles

NEAR = 1e-3  # [m] that a hit may lie off MuJoCo's: asked for; float32 over 5 m is a thousandth of that
CAST = jax.jit(cast_rays)
BASE = 4.0  # [m] that MuJoCo's solid reaches below its lowest vertex


def rough(shape, seed, height=0.3, holes=0.0):
    """Smooth hills and a step, with noise of a tenth; some vertices are holes."""
    rng = np.random.default_rng(seed)
    i, j = np.indices(shape)
    hills = np.sin(i * rng.uniform(0.2, 1)) * np.cos(j * rng.uniform(0.2, 1)) + (j > shape[1] // 2)
    heights = height * (hills + 0.1 * rng.normal(size=shape))
    heights[rng.random(shape) < holes] = np.nan
    return heights.astype(np.float32)


KINDS = {
    "rough": rough((23, 31), 0),
    "thin": rough((2, 40), 1),
    "smallest": rough((2, 2), 2),
    "flat": np.full((9, 7), 0.25, np.float32),
    "stairs": np.repeat(np.arange(8, dtype=np.float32) * 0.03, 5)[None].repeat(20, 0),
    "towers": np.random.default_rng(3).choice([0.0, 1.0], (16, 16), p=[0.9, 0.1]).astype(np.float32),
}


def field_of(heights, origin=(0.3, -0.2), pitch=0.05):
    return HeightField(jnp.asarray(heights), jnp.array(origin, jnp.float32), jnp.float32(pitch))


def rays(field, count, seed):
    """From above and from beside the field: to points on it, level, upright, and along its axes and diagonals."""
    rng = np.random.default_rng(seed)
    heights = np.asarray(field.heights, float)
    size = (np.array(heights.shape[::-1]) - 1) * float(field.pitch)
    low, high = np.nanmin(heights), np.nanmax(heights)
    start = rng.uniform([-1, -1, low], [*(size + 1), high + 1.5], (count, 3))
    kind = rng.integers(0, 10, count)
    # along a line of the lattice, but for the rim: whether a ray in that plane is on the field is up to rounding
    onto = (kind == 5) & (heights.shape[1] > 2)
    line = np.clip(np.round(start[onto, 0] / float(field.pitch)), 1, heights.shape[1] - 2)
    start[onto, 0] = line * float(field.pitch)
    over = (start[:, :2] > 0).all(1) & (start[:, :2] < size).all(1)
    start[over, 2] = rng.uniform(high + 0.01, high + 1.5, over.sum())
    aim = rng.uniform([0, 0, low], [*size, high], (count, 3))
    aim[::2, 2] = height_at(heights, float(field.pitch), *aim[::2, :2].T)
    to = aim - start
    to[kind == 0, 2] = 0
    to[kind == 1, 0] = 0
    to[kind == 2, 1] = 0
    to[kind == 3] = [0, 0, -1]
    to[kind == 4] = np.array([1, 1, -0.1]) * rng.choice([-1, 1], (count, 3))[kind == 4]
    to[onto, 0] = 0
    to[np.abs(to).max(1) == 0] = [0, 0, -1]
    to /= np.linalg.norm(to, axis=1, keepdims=True)
    origin = np.append(np.asarray(field.origin_xy, float), 0.0)
    return (start + origin).astype(np.float32), to.astype(np.float32)


def cast(field, origin, direction, *reach):
    """Of arrays, lists or numbers."""
    return np.asarray(CAST(field, *(jnp.asarray(value, jnp.float32) for value in (origin, direction, *reach))))


def heights_of(field, x, y):
    return np.asarray(jax.jit(surface_height)(field, jnp.asarray(x, jnp.float32), jnp.asarray(y, jnp.float32)))


def mujoco_hits(field, start, to):
    """Distance [m] by `mj_ray`; inf for none."""
    heights = np.asarray(field.heights, float)
    rows, columns = heights.shape
    low, high = heights.min(), heights.max()
    rise = max(high - low, 1e-3)
    size = (np.array([columns, rows]) - 1) * float(field.pitch) / 2
    spec = mujoco.MjSpec()
    spec.add_hfield(
        name="h", nrow=rows, ncol=columns, size=[*size, rise, BASE], userdata=((heights - low) / rise).ravel().tolist()
    )
    place = [*(np.asarray(field.origin_xy, float) + size), low]
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="h", pos=place)
    model = spec.compile()
    # the compiler scales the data to 0..1 by its own extremes; here they are so already, but for flat ground
    model.hfield_data[:] = ((heights - low) / rise).ravel()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    geom = np.zeros(1, np.int32)
    found = [
        mujoco.mj_ray(model, data, a, b, None, 1, -1, geom)
        for a, b in zip(start.astype(float), to.astype(float), strict=True)
    ]
    return np.where(np.array(found) < 0, np.inf, found)


@pytest.mark.parametrize("kind", KINDS)
def test_rays_are_mujocos(kind):
    """10,000 rays: hits within 1 mm. A ray that grazes an edge may pass in one and be met in the other: at most 1."""
    field = field_of(KINDS[kind])
    start, to = rays(field, 10_000, seed=len(kind))
    found = cast(field, start, to)
    expected = mujoco_hits(field, start, to)
    assert np.isfinite(expected).sum() > 2000 and np.isinf(expected).sum() > 200
    either = np.isfinite(found) != np.isfinite(expected)
    both = np.isfinite(found) & np.isfinite(expected)
    off = np.abs(found[both] - expected[both])
    assert (off > NEAR).sum() + either.sum() <= 1, (np.sort(off)[-5:], np.flatnonzero(either)[:5])


@pytest.mark.parametrize("seed", range(6))
def test_rays_with_holes_are_those_of_all_triangles(seed):
    """The surface itself, from above and below, with a quarter of holes; walls at the borders of holes apart."""
    heights = rough((13, 17), seed, holes=0.12)
    field = field_of(heights, pitch=0.1)
    start, to = rays(field, 2000, seed)
    start[:, 0] += 1e-4  # no ray goes along the border of a hole, where either answer is right
    found = cast(field, start, to)
    origin = np.append(np.asarray(field.origin_xy, float), 0)
    expected = cast_all(triangles(heights.astype(float), float(field.pitch)), start.astype(float) - origin, to)
    same = np.isclose(found, expected, atol=NEAR) | (found == expected)
    # where they differ, the ray met a wall below the surface before: it is within the solid there
    wall = found < expected
    inward = start[wall] + (found[wall, None] + 1e-4) * to[wall]
    height = height_at(heights.astype(float), float(field.pitch), *(inward - origin)[:, :2].T)
    assert (same | wall).sum() >= len(start) - 2
    assert (inward[:, 2] < height + 1e-4).mean() > 0.99 and same.mean() > 0.5 and wall.sum() > 20


def test_rays_from_within_the_solid_come_out_through_the_surface():
    heights = rough((13, 17), 5)
    field = field_of(heights, origin=(0, 0), pitch=0.1)
    rng = np.random.default_rng(0)
    start = rng.uniform([0.01, 0.01, -1], [1.59, 1.19, -0.7], (3000, 3)).astype(np.float32)
    to = rng.normal(size=(3000, 3)).astype(np.float32)
    found = cast(field, start, to)
    expected = cast_all(triangles(heights.astype(float), 0.1), start.astype(float), to.astype(float))
    agree = np.isclose(found, expected, atol=NEAR) | (found == expected)
    assert (~agree).sum() <= 2 and np.isfinite(expected).sum() > 200


def test_heights_are_those_of_the_triangles_and_of_upright_rays():
    heights = rough((13, 17), 7, holes=0.1)
    field = field_of(heights, pitch=0.1)
    rng = np.random.default_rng(1)
    x, y = rng.uniform(-0.2, 2.0, (2, 4000)).astype(np.float32)
    found = heights_of(field, x, y)
    expected = height_at(heights.astype(float), 0.1, x.astype(float) - 0.3, y.astype(float) + 0.2)
    known = np.isfinite(expected)
    assert (np.isfinite(found) != known).sum() <= 2
    np.testing.assert_allclose(found[known & np.isfinite(found)], expected[known & np.isfinite(found)], atol=1e-5)
    start = np.stack([x, y, np.full_like(x, 3.0)], axis=1)
    down = 3.0 - cast(field, start, [0, 0, -1])
    np.testing.assert_allclose(down[known], found[known], atol=1e-5)
    inside = np.asarray(on_field(field, jnp.asarray(x), jnp.asarray(y)))
    assert np.isinf(down[~known & ~inside]).all() and not inside[~known].all()


def test_lattice_points_have_their_heights():
    """On the vertices themselves, the rim included, and on the rim's far corner."""
    heights = rough((5, 8), 3)
    field = field_of(heights, origin=(-2.0, 4.0), pitch=0.25)  # binary fractions: places are exact
    j, i = np.meshgrid(np.arange(8), np.arange(5))
    np.testing.assert_array_equal(heights_of(field, -2.0 + 0.25 * j, 4.0 + 0.25 * i), heights)


def test_nothing_leaks_at_vertices_and_edges():
    """Rays aimed at each vertex, and at the middle of each edge and diagonal, of a solid surface all meet it."""
    heights = rough((9, 9), 11)
    field = field_of(heights, origin=(0, 0), pitch=0.125)
    v, u = np.meshgrid(np.arange(0.5, 8, 0.5), np.arange(0.5, 8, 0.5), indexing="ij")
    aim = np.stack([u.ravel(), v.ravel(), np.zeros(u.size)], axis=1) * 0.125
    aim[:, 2] = height_at(heights.astype(float), 0.125, aim[:, 0], aim[:, 1])
    for eye in ([0.5, 0.5, 3.0], [0.0, 0.0, 2.0], [0.47, 0.31, 1.5], [1.0, 0.5, 5.0]):
        to = aim - eye
        found = cast(field, eye, to)
        assert (found < 1 + 1e-4).all()


def test_peaks_of_one_vertex_are_not_skipped():
    heights = np.zeros((3, 400), np.float32)
    heights[1, 200] = 1.0
    field = field_of(heights, origin=(0, 0), pitch=0.01)
    found = cast(field, [-1.0, 0.01, 0.999], [[1.0, 0, 0], [0.5, 0, 0]])
    np.testing.assert_allclose(found, [3.0 - 1e-5, 6.0 - 2e-5], atol=1e-5)


def test_what_is_no_ray_meets_nothing():
    field = field_of(KINDS["rough"], origin=(0, 0))
    over = [0.5, 0.5, 2.0]
    nan, inf = jnp.nan, jnp.inf
    nothing = [[0, 0, 0], [nan, 0, -1], [0, 0, -inf], [0, 0, 1], [0, 0, nan]]
    assert np.isinf(cast(field, over, nothing)).all()
    down = [0, 0, -1]
    for origin in ([nan, 0.5, 2], [0.5, 0.5, inf], [0.5, 0.5, nan], [-inf, 0, 2], [-0.01, 0.5, 2], [0.5, 1e9, 2]):
        assert np.isinf(cast(field, origin, down)).all(), origin
    holes = field_of(np.full((4, 4), np.nan, np.float32), origin=(0, 0))
    assert np.isinf(cast(holes, [0.1, 0.1, 2.0], down))


@pytest.mark.parametrize("length", [1e-30, 1e-3, 1.0, 1e6, 1e30])
def test_length_of_the_direction_is_the_unit(length):
    field = field_of(KINDS["flat"], origin=(0, 0))
    found = cast(field, [0.1, 0.2, 1.25], [0, 0, -length])
    np.testing.assert_allclose(found * length, 1.0, rtol=1e-6)


def test_reach_ends_rays():
    field = field_of(KINDS["flat"], origin=(0, 0))
    found = [cast(field, [0.1, 0.2, 1.25], [0, 0, -2], reach) for reach in (0.49, 0.51)]
    assert found[0] == np.inf and found[1] == pytest.approx(0.5)


def test_a_ray_along_flat_ground_meets_it():
    """In the plane of the surface, and from the rim at its own height."""
    field = field_of(KINDS["flat"], origin=(0, 0))
    starts = [[0.1, 0.2, 0.25], [-1.0, 0.2, 0.25], [-1.0, 0.2, 0.26], [-1.0, 0.2, 0.2]]
    np.testing.assert_allclose(cast(field, starts, [1, 0, 0]), [0, 1, np.inf, 1], atol=1e-6)


def test_jit_vmap_and_batches_agree():
    fields = [field_of(rough((9, 12), seed), origin=(seed * 0.1, 0), pitch=0.05 + 0.01 * seed) for seed in range(3)]
    starts, tos = zip(*(map(jnp.asarray, rays(field, 200, 3)) for field in fields), strict=True)
    together = jax.tree.map(lambda *leaves: jnp.stack(leaves), *fields)
    found = jax.jit(jax.vmap(cast_rays))(together, jnp.stack(starts), jnp.stack(tos))
    for k, field in enumerate(fields):
        np.testing.assert_allclose(found[k], cast(field, starts[k], tos[k]), rtol=2e-6)


def test_slopes_are_the_derivatives():
    heights = np.add.outer(0.2 * np.arange(4), 0.5 * np.arange(5)).astype(np.float32)
    field = field_of(heights, origin=(0, 0), pitch=1.0)
    slope = jax.grad(surface_height, argnums=(1, 2))(field, jnp.float32(1.3), jnp.float32(2.6))
    np.testing.assert_allclose(slope, (0.5, 0.2), rtol=1e-5)


@pytest.mark.parametrize("shape", [(1, 5), (5, 1), (1, 1), (0, 4), (2, 3, 3)])
def test_fewer_than_two_by_two_vertices_are_refused(shape):
    field = field_of(np.zeros(shape, np.float32))
    for call in (
        lambda: surface_height(field, jnp.zeros(1), jnp.zeros(1)),
        lambda: cast_rays(field, jnp.zeros(3), jnp.ones(3)),
    ):
        with pytest.raises(InputError, match="2 x 2 or more"):
            call()
