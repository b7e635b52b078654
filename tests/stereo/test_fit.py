"""Fits of the noise model against matchers whose noise is known."""

import numpy as np
import pytest

from jaxbiped.arenas.arena import CIRCLE, SQUARE
from jaxbiped.sensing.presets import PRESETS
from jaxbiped.stereo import fit
from jaxbiped.stereo.landmark_fit import Sight, fit_landmarks

RENDERED, LANDMARKS = PRESETS["rendered"].stereo, PRESETS["rendered"].landmarks
HEIGHT, WIDTH, MOST = 384, 512, 159.0


def scene():
    """Disparities of a floor that recedes, a wall before it, and nothing above; and what the right camera sees too."""
    v, u = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    floor = np.where(v > 100, 0.3 * (v - 100) + 4, 0).astype(np.float32)
    wall = (u > 300) & (u < 400) & (v > 60) & (v < 300)
    true = np.where(wall, np.float32(80), floor)
    common = (true > 0) & (u - true >= 0) & ~(~wall & (u < 300) & (u > 300 - (80 - true)) & (v > 60) & (v < 300))
    return true, common


def smooth(rng, lag):
    """Normal noise of a standard deviation of 1 whose neighbours `lag` px apart are correlated by 0.33."""
    white = rng.standard_normal((HEIGHT + 1 + lag, WIDTH + 1 + lag))
    c = 0.3765  # c / (1 + c^2) = 0.33
    mixed = white[:, :-lag] + c * white[:, lag:]
    mixed = mixed[:-lag] + c * mixed[lag:]
    return (mixed / (1 + c * c))[:HEIGHT, :WIDTH]


def test_known_noise_is_found_again():
    true, common = scene()
    watched = []
    for seed in range(6):
        rng = np.random.default_rng(seed)
        across = np.zeros_like(true)
        error = 0.07 + 0.2 * smooth(rng, fit.LAG) * (1 + 2.0 * across)
        found = np.where(common & (rng.random(true.shape) > 0.1), true + error, 0)
        hidden = ~common & (true > 0)
        wild = np.where(rng.random(true.shape) < 0.25, 140.0, 0.0)
        found = np.where(hidden, wild, found).astype(np.float32)
        watched.append(fit.thinned(true, found, common, MOST))
    w = fit.together(watched)
    noise = fit.fit_noise(w, RENDERED)
    # A few per mille of the pixels beside an edge count as smooth; standard errors are smaller.
    assert noise.bias == pytest.approx(0.07, abs=0.005)
    assert noise.sd == pytest.approx(0.2, rel=0.03)
    assert noise.correlation == pytest.approx(0.33, abs=0.03)
    assert noise.drop_plain == pytest.approx(0.1, abs=0.005)
    assert noise.phantom_hidden == pytest.approx(0.25, abs=0.02)
    assert noise.edge_jump == RENDERED.edge_jump and noise.attitude_sd == RENDERED.attitude_sd
    quality = fit.quality(w)
    assert quality.measured == pytest.approx(0.9, abs=0.005) and quality.wrong < 0.001
    assert quality.bias == pytest.approx(0.07, abs=0.005)


def test_growth_with_the_slope_is_found_again():
    rng = np.random.default_rng(0)
    across = rng.uniform(0, 0.6, 200_000)
    sd, gain = fit.spread(0.14 * (1 + 2 * across) * rng.standard_normal(len(across)), across)
    assert sd == pytest.approx(0.14 * 1.02, rel=0.05) and gain == pytest.approx(2.0, abs=0.2)


def test_what_is_lost_by_stretch_is_found_again():
    rng = np.random.default_rng(0)
    stretch = rng.uniform(0, 3, 50_000).astype(np.float32)
    lost = rng.random(len(stretch)) < np.maximum(0.9 * np.clip((stretch - 0.5) / 0.7, 0, 1), 0.02)
    found = fit.losses(stretch, lost)
    assert found["stretch_kept"] == pytest.approx(0.5, abs=0.06)
    assert found["stretch_lost"] == pytest.approx(1.2, abs=0.06)
    assert found["drop_grazing"] == pytest.approx(0.9, abs=0.021)
    assert fit.losses(0 * stretch, lost) == {}  # nothing tells


def test_what_both_cameras_see():
    """A wall of disparity 40 before ground of 20: it hides 20 px to its left, and the left border is out of view."""
    true = np.full((30, 120), 20, np.float32)
    true[:, 70:90] = 40
    right = np.full((30, 120), 20, np.float32)
    right[:, 30:50] = 40
    common = fit.seen_by_both(true, 1000 / true, 1000 / right)
    assert not common[:, :20].any() and common[:, 21:49].all()
    assert not common[:, 51:69].any() and common[:, 70:].all()
    assert not fit.seen_by_both(0 * true, np.full_like(true, np.inf), 1000 / right).any()


def test_rims():
    true, _ = scene()
    far = fit.far_from_rims(true)
    assert not far[150:160, 290:310].any() and far[150:160, 340:360].all() and far[350, 100]
    assert not far[:100, :250].any()


def test_landmark_errors_and_limits_are_found_again():
    rng = np.random.default_rng(0)
    sights = []
    for _ in range(4000):
        kind, distance = int(rng.integers(2)), float(rng.uniform(0.1, 2.0))
        reach = 1.3 if kind == CIRCLE else 0.8
        sd = 0.001 + 0.004 * distance
        error = tuple(rng.normal(0, sd, 2)) if 0.25 < distance < reach and rng.random() < 0.8 else None
        sights.append(Sight(kind, distance, error))
    fitted = fit_landmarks(sights, LANDMARKS)
    assert fitted.sd == pytest.approx(0.001, abs=0.0004) and fitted.sd_per_metre == pytest.approx(0.004, rel=0.15)
    assert fitted.furthest_circle == pytest.approx(1.3, abs=0.02) and fitted.furthest_square == pytest.approx(
        0.8, abs=0.02
    )
    assert fitted.nearest == pytest.approx(0.25, abs=0.02)


def test_too_few_landmarks_leave_the_base():
    assert fit_landmarks([], LANDMARKS) == LANDMARKS
    assert fit_landmarks([Sight(SQUARE, 0.5, None)] * 40, LANDMARKS) == LANDMARKS
