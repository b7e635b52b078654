"""The second search, for what one image shows much wider than the other, against disparities in closed form."""

import numpy as np
import pytest

from jaxbiped.stereo import MatchParams, match
from jaxbiped.stereo.slanted import search_slanted
from tests.stereo.pairs import SHAPE, ramp

PARAMS = MatchParams(num_disparities=160)
BLIND = PARAMS.model_copy(update={"slanted": False})
SHARP = 0.3  # [px] standard deviation of what is found; of what the first search finds of it, 0.44 and more


def wall(slope, axis, seed=0):
    """A plane whose disparity is nothing at a column, `axis` of the width, and what of it can be measured."""
    left, right, disparity = ramp(-slope * axis * SHAPE[1], slope, 0.02, seed=seed)
    there = (disparity > 8) & (disparity < 150) & (np.arange(SHAPE[1]) - disparity > 8)
    there[:, -12:] = there[:12] = there[-12:] = False
    return left, right, disparity, there


@pytest.mark.parametrize("slope", [0.5, 0.6, 0.65, -1.0, -1.1, -1.3, -1.5])
@pytest.mark.parametrize("aside", [-0.1, 0.0, 0.2])
@pytest.mark.parametrize("seed", [0, 1])
def test_a_wall_beside_the_way(slope, aside, seed):
    """One image shows it 1.9 to 2.9 times as wide as the other: the first search is lost or wrong there."""
    left, right, disparity, there = wall(slope, 0.5 + (aside if slope < 0 else -aside), seed)
    found, before = match(left, right, PARAMS), match(left, right, BLIND)
    assert found.valid[there].mean() > 0.85
    error = (found.value - disparity)[there & found.valid]
    core = error[np.abs(error) < 1]
    assert abs(core.mean()) < 0.1 and core.std() < SHARP and (np.abs(error) > 1).mean() < 0.015
    right_before = before.valid & (np.abs(before.value - disparity) < 1)
    assert right_before[there].mean() < 0.8


def test_what_faces_the_camera_is_left_to_the_first_search():
    for across, down in ((0.0, 0.0), (0.0, 0.25), (0.1, 0.1), (-0.08, 0.1), (-0.3, 0.0)):
        left, right, _ = ramp(60.0 if across < -0.1 else 30.0, across, down)
        assert search_slanted(left, right, PARAMS)[1].mean() < 0.005
        one, other = match(left, right, PARAMS), match(left, right, BLIND)
        assert (one.value != other.value).mean() < 0.005


@pytest.mark.parametrize("noise", [0.5, 1.5, 3.0])
def test_noise_alone_is_no_wall(noise):
    rng = np.random.default_rng(0)
    pair = [np.clip(np.round(120 + noise * rng.normal(size=SHAPE)), 0, 255).astype(np.uint8) for _ in range(2)]
    assert search_slanted(*pair, PARAMS)[1].mean() < 0.005
    assert not match(*pair, PARAMS).valid.any()


def test_two_pictures_that_have_nothing_in_common():
    left, right = ramp(seed=0)[0], ramp(seed=5)[0]
    assert search_slanted(left, right, PARAMS)[1].mean() < 0.01


@pytest.mark.parametrize("shape", [(1, 1), (9, 9), (2, 400), (191, 255), (64, 65), (30, 700)])
@pytest.mark.parametrize("least", [-32, 0, 48])
def test_images_of_any_size(shape, least):
    rng = np.random.default_rng(1)
    left, right = (rng.integers(0, 256, shape, dtype=np.uint8) for _ in range(2))
    value, valid = search_slanted(left, right, MatchParams(num_disparities=64, min_disparity=least))
    assert value.shape == valid.shape == shape and np.isfinite(value).all() and not value[~valid].any()


@pytest.mark.parametrize("slope", [0.5, -1.1])
def test_cameras_that_squint(slope):
    """The same wall, the right image shifted by 20 px: disparities from -32 on, and 20 less."""
    left, right, disparity, there = wall(slope, 0.5)
    shifted = np.roll(right, 20, axis=1)
    value, valid = search_slanted(left, shifted, MatchParams(num_disparities=160, min_disparity=-32))
    there &= np.arange(SHAPE[1]) - disparity < SHAPE[1] - 32
    assert valid[there].mean() > 0.8
    assert np.median(np.abs(value - (disparity - 20))[there & valid]) < SHARP
