"""The stereo noise model: its statistics, and what is hidden in scenes with a known answer."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.sensing import PRESETS, NoiseConfig
from jaxbiped.sensing.noise import hidden_from_right, match
from tests.sensing.scenes import CAMERA, IMAGE

N = 64  # views
SHAPE = (IMAGE.rows + 2, IMAGE.columns + 2)
IDEAL = PRESETS["ideal"].stereo


@jax.jit
def matched(disparity, textured, noise):
    one = lambda seed: match(disparity, textured, CAMERA, IMAGE, noise, seed)  # noqa: E731
    return jax.vmap(one)(jnp.arange(N, dtype=jnp.uint32))


def views(disparity, textured=True, **noise):
    """`N` views of one disparity image under the ideal preset but for `noise`."""
    traced = IDEAL.model_copy(update=noise).traced()
    textured = jnp.broadcast_to(jnp.asarray(textured), (IMAGE.rows, IMAGE.columns))
    return np.asarray(matched(jnp.asarray(disparity, jnp.float32), textured, traced))


def plane(disparity=20.0, slope=0.0, along=0.0):
    """Disparity that grows by `slope` px per px to the right, by `along` downwards."""
    column = (np.arange(SHAPE[1]) - SHAPE[1] / 2) * IMAGE.stride[0]
    row = (np.arange(SHAPE[0]) - SHAPE[0] / 2) * IMAGE.stride[1]
    return disparity + slope * column[None, :] + along * row[:, None]


def seen_columns(disparity=20.0):
    return disparity <= IMAGE.u  # left of that the right image ends


def test_ideal_measures_exactly_what_both_cameras_see():
    found = views(plane())
    assert np.all(found[:, :, seen_columns()] == 20) and np.all(found[:, :, ~seen_columns()] == 0)


def test_disparity_error_has_the_stated_moments():
    """64 x 48 x 61 correlated draws: means within 1e-3, deviations within 1 %."""
    error = views(plane(), sd=0.14, bias=0.05)[:, :, seen_columns(22)] - 20
    assert abs(error.mean() - 0.05) < 1e-3 and abs(error.std() / 0.14 - 1) < 0.01


def test_disparity_error_grows_with_slope():
    d = plane(60, slope=0.1)
    error = (views(d, sd=0.1, slope_gain=2) - d[1:-1, 1:-1])[:, :, 30:]
    assert abs(error.std() / 0.12 - 1) < 0.01
    steep = (views(plane(40, along=0.1), sd=0.1, slope_gain=2) - plane(40, along=0.1)[1:-1, 1:-1])[:, :, 10:]
    assert abs(steep.std() / 0.1 - 1) < 0.01  # the floor's slope, down the image, does not matter


def test_disparity_error_is_correlated_over_neighbours():
    error = views(plane(), sd=0.14, correlation=0.33)[:, :, seen_columns(22)] - 20
    lag = lambda a, b: np.corrcoef(a.ravel(), b.ravel())[0, 1]  # noqa: E731
    assert abs(lag(error[:, :, 1:], error[:, :, :-1]) - 0.33) < 0.01
    assert abs(lag(error[:, 1:], error[:, :-1]) - 0.33) < 0.01
    assert abs(lag(error[:, :, 2:], error[:, :, :-2])) < 0.01
    assert abs(lag(error[1:], error[:-1])) < 0.01  # views are independent


def test_disparity_comes_in_steps():
    found = views(plane(20.02), sd=0.14, quantum=1 / 16)
    assert np.array_equal(found * 16, np.round(found * 16)) and len(np.unique(found)) > 10


def lost(disparity, columns, **noise):
    return (views(disparity, **noise)[:, 4:-4, columns] == 0).mean()


def test_drops_are_as_often_as_stated():
    """Binomial: 64 x 40 x 20 draws of chance p have a standard error below 0.003."""
    inner = slice(30, 50)
    chances = {"drop_plain": 0.1, "drop_edge": 0.2, "drop_grazing": 0.4}
    assert abs(lost(plane(), inner, **chances) - 0.1) < 0.01
    assert abs(lost(plane(60, along=0.3), inner, **chances) - 0.1) < 0.01  # the floor is not grazing
    assert abs(lost(np.where(np.arange(SHAPE[0]) % 6 < 3, 40.0, 20.0)[:, None] * np.ones(SHAPE), inner, **chances)
               - (0.1 + 2 * 0.2) / 3) < 0.01  # fmt: skip
    grazing = plane(80, along=0.5)
    assert abs(lost(grazing, slice(50, 64), grazing_slope=0.4, **chances) - 0.4) < 0.015
    for slope, share in ((0.25, 0.4), (-0.25, 0.1)):  # only the first turns away from the right camera
        assert abs(lost(plane(60, slope=slope), inner, grazing_rise=0.2, **chances) - share) < 0.015


def test_what_one_image_shows_wider_is_lost_by_that():
    """Width 1 in the left image is 1 - slope in the right one: a rise of 0.5 and a fall of 1 both stretch by 1."""
    steep = {"grazing_slope": 100, "grazing_rise": 100, "drop_plain": 0.05, "drop_grazing": 0.8}
    chances = steep | {"stretch_kept": 0.5, "stretch_lost": 1.5}
    middle = np.flatnonzero(np.abs(IMAGE.u - IMAGE.centre[0]) < 60)  # where the plane is not cut
    for slope, share in ((0.5, 0.4), (-1.0, 0.4), (0.3, 0.05), (-0.4, 0.05), (0.75, 0.8)):
        found = lost(np.clip(plane(80, slope=slope), 1, 158), middle, **chances)
        assert abs(found - share) < 0.02, (slope, found)
    assert abs(lost(plane(80, along=0.4), slice(50, 64), **chances) - 0.05) < 0.015  # the same width in both


def test_a_thin_post_is_an_edge_and_not_grazing():
    d = plane()
    d[:, 40] = 60  # one ray wide
    assert abs(lost(d, slice(39, 40), drop_edge=0.2, drop_grazing=0.9) - 0.2) < 0.03


def test_edge_pixels_take_the_disparity_from_across():
    d = plane()
    d[:, 41:] = 40
    found = views(d, edge_swap=0.3)[:, :, [39, 40]]  # rays either side: the ray of column 40 of the image is d[:, 41]
    measured = found[..., 1]
    assert set(np.unique(measured)) == {20.0, 40.0}
    assert abs((measured == 20).mean() - 0.3) < 0.02


def test_occlusion_stripe_left_of_a_near_surface():
    """A surface of 40 px before one of 16 px hides 24 px to its left: three rays of 8 px."""
    d = np.full(SHAPE, 16.0)
    d[:, 31:] = 40  # from image column 30 on
    hidden = np.asarray(hidden_from_right(jnp.asarray(d, jnp.float32), IMAGE))
    assert np.array_equal(np.flatnonzero(hidden[0]), [27, 28, 29]) and np.all(hidden == hidden[0])
    assert not np.asarray(hidden_from_right(jnp.asarray(d[:, ::-1], jnp.float32), IMAGE)).any()  # its right is free


def test_nearer_than_the_search_range_is_unmatched():
    assert np.all(views(plane(160)) == 0) and np.all(views(plane(158.9))[:, :, 20:] > 0)


def test_plain_texture_and_empty_space_measure_nothing():
    noise = PRESETS["real"].stereo.model_dump()
    assert np.all(views(plane(), textured=False, **noise) == 0)
    assert np.all(views(np.zeros(SHAPE), **noise) == 0)


def test_phantoms_are_clumped_and_as_often_as_stated():
    found = views(plane(300), phantom_near=0.2)
    # A wild disparity d shows where u >= d only, so look at the right-most columns, where all of them do.
    right = found[:, :, IMAGE.u >= float(CAMERA.max_disparity)]
    assert abs((right > 0).mean() - 0.2) < 0.01
    assert len(np.unique(right[right > 0])) > 500 and right.max() <= float(CAMERA.max_disparity)
    # Blocks of 12 px hold one or two rays of 8 px each way: half of all neighbours share a block.
    both = (right[:, :, 1:] > 0) & (right[:, :, :-1] > 0)
    same = both & (right[:, :, 1:] == right[:, :, :-1])
    assert 0.6 < same.sum() / both.sum() < 0.95  # chance alone makes 0.2 of the other half doubly phantom


def test_nan_disparity_measures_nothing():
    d = plane()
    d[20:30] = np.nan
    found = views(d, **PRESETS["rendered"].stereo.model_dump())
    assert np.all(np.isfinite(found)) and np.all(found[:, 20:28] == 0) and found[:, 35:].any()


def test_traced_noise_compiles_once():
    before = matched._cache_size()
    for sd in (0.0, 0.1, 0.2):
        views(plane(), sd=sd)
    assert matched._cache_size() == max(before, 1)


def test_traced_is_in_radians_and_float32():
    noise = NoiseConfig(attitude_sd=1.0).traced()
    assert np.isclose(noise.attitude_sd, np.pi / 180)
    assert all(leaf.dtype == jnp.float32 and leaf.shape == () for leaf in jax.tree.leaves(replace(noise)))
