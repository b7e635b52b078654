"""Sightings against plain NumPy, and on scenes with a known answer."""

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped.arenas.arena import SQUARE
from jaxbiped.sensing import LandmarkConfig, sight_landmarks
from tests.reference import sensing as reference
from tests.sensing.scenes import CAMERA, IMAGE, as_numpy, make, pose, random_scene, stack

NOISE = LandmarkConfig().traced()


@jax.jit
def sight_all(arenas, poses, seeds, look, noise):
    return jax.vmap(lambda a, p, s, f: sight_landmarks(a, p, CAMERA, noise, IMAGE, s, f))(arenas, poses, seeds, look)


def sight(scenes, look=False, noise=NOISE):
    n = len(scenes)
    arenas, poses = (stack(part) for part in zip(*scenes, strict=True))
    return as_numpy(sight_all(arenas, poses, jnp.arange(n, dtype=jnp.uint32), jnp.full(n, look), noise))


def test_agrees_with_plain_numpy():
    scenes = [random_scene(seed) for seed in range(64)]
    found = sight(scenes)
    count = 0
    for k, (arena, where) in enumerate(scenes):
        args = (arena, where, as_numpy(CAMERA), as_numpy(NOISE), IMAGE, np.uint32(k))
        expected = reference.sight_landmarks(*args)
        assert np.array_equal(found.seen[k], expected.seen)
        for name in ("x", "y", "sd"):
            assert np.allclose(getattr(found, name)[k], getattr(expected, name), atol=1e-5)
        count += expected.seen.sum()
    assert count > 30


def test_range_view_and_kind_decide():
    marks = [(0.9, 0.7), (1.2, 0.7, SQUARE), (1.6, 0.7), (0.4, 0.7), (0.1, 0.7)]
    found = sight([(make((), marks), pose())])  # 0.6 m; 0.9 m, a square; 1.3 m; 0.1 m; behind
    assert found.seen.tolist() == [[True, False, False, False, False]]
    assert sight([(make((), [(0.9, 0.7, SQUARE)]), pose())]).seen[0, 0]


def test_boxes_hide_and_cover():
    marks = [(1.0, 0.7)]
    seen = lambda *box: sight([(make([box], marks), pose())]).seen[0, 0]  # noqa: E731
    assert not seen(0.6, 0.7, 0, 0.05, 0.1, 0, 0.5)  # before it
    assert not seen(1.0, 0.7, 0, 0.1, 0.1, 0, 0.03)  # on it
    assert seen(0.6, 0.7, 0, 0.05, 0.1, 0.37, 0.5)  # a lintel above the line of sight
    assert seen(1.3, 0.7, 0, 0.05, 0.1, 0, 0.5)  # behind it


def test_looking_down_loses_far_landmarks():
    scene = [(make((), [(1.45, 0.7)]), pose())]
    assert sight(scene).seen[0, 0] and sight(scene, look=True).seen.sum() <= 1


def test_errors_have_the_stated_deviation():
    """1,000 draws: within 12 %, five standard errors."""
    noise = LandmarkConfig(sd=0.002, sd_per_metre=0.01).traced()
    found = sight([(make((), [(0.9, 0.7)]), pose())] * 1000, noise=noise)
    assert np.allclose(found.sd[:, 0], 0.008)
    assert abs(found.x[:, 0].std() / 0.008 - 1) < 0.12 and abs(found.y[:, 0].std() / 0.008 - 1) < 0.12
    assert abs(found.x[:, 0].mean() - 0.6) < 0.001 and abs(np.corrcoef(found.x[:, 0], found.y[:, 0])[0, 1]) < 0.15


def test_nothing_is_seen_from_a_pose_that_is_not_finite():
    arena = make((), [(0.9, 0.7)])
    found = sight([(arena, pose(x=np.nan)), (arena, pose(yaw=np.nan)), (arena, pose(z=np.inf))])
    assert not found.seen.any() and all(np.all(np.isfinite(leaf)) for leaf in (found.x, found.y, found.sd))
