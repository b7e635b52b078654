"""The noise model of the ray-cast sensor, fitted to a matcher on rendered pairs.

The renderer knows each pixel's depth, hence the disparity that the matcher should have found. Surfaces are classified
as in the noise model (`sensing.noise`): by differences of disparity over as many pixels as lie between two rays.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass, fields

import cv2
import numpy as np
from jaxtyping import Bool, Float, Float32

from jaxbiped.sensing.config import NoiseConfig
from jaxbiped.sensing.noise import LEAST_WIDTH
from jaxbiped.stereo.measure import StereoSensor

LAG = 8  # [px] over which slopes and edges are measured: from one ray to the next
THIN = 3  # one in so many pixels across and down is kept
CORE = 1.0  # [px] beyond which a disparity is wrong, not noisy
SAME_DEPTH = 0.01  # relative: points that both cameras see within this belong to the same surface
KEPT, OVER = np.arange(0.1, 1.55, 0.05), np.arange(0.05, 2.05, 0.05)  # stretches tried: start, and extent
SHARES = np.arange(0.7, 0.99, 0.02)  # share of the most stretched surfaces that may be lost
BIN, STRETCHED = 0.02, 4.0  # bin width of a histogram of stretches, and its end
OFF = 100.0  # [px/px] slope above which only stretch causes losses
FLAT = 0.02  # [px/px] slope of surfaces that face the camera
RIM, CREASE = 14, 0.02  # [px] reach of a rim's own texture; second difference of disparity at a rim
FEWEST = 200  # fewest pixels of a kind for an estimate


@dataclass(frozen=True)
class Watched:
    """Pixels of one or of many views, and the matcher's result for them."""

    true: Float32[np.ndarray, "N"]  # [px] disparity; 0 where there is nothing to see
    found: Float32[np.ndarray, "N"]  # [px]; 0 where not measured
    slope: Float32[np.ndarray, "N"]  # [px/px] across the image
    stretch: Float32[np.ndarray, "N"]  # share by which one image shows the surface wider than the other
    bend: Float32[np.ndarray, "N"]  # [px] second difference
    beyond: Float32[np.ndarray, "N"]  # [px] difference to the other side of an edge
    common: Bool[np.ndarray, "N"]  # whether both cameras see it
    near: Bool[np.ndarray, "N"]  # whether it is nearer than the search range
    inner: Bool[np.ndarray, "N"]  # whether it is on one face, and far from its rims
    error_right: Float32[np.ndarray, "N"]  # [px] error of the pixel `LAG` to the right; NaN if it is not noise
    error_down: Float32[np.ndarray, "N"]  # [px]


def watch(sensor: StereoSensor, origin: Float[np.ndarray, "3"], basis: Float[np.ndarray, "3 3"], seed: int) -> Watched:
    """Run the matcher on the arena that the sensor shows, from one place."""
    camera = sensor.camera
    pair = sensor.renderer.pair(origin, basis, camera.image_noise, seed, depth=True)
    found = sensor.match(pair).value
    far_right = sensor.renderer.depth(
        np.asarray(origin, float) + np.asarray(basis, float)[:, 0] * camera.baseline, basis
    )
    true = (camera.focal * camera.baseline / pair.depth).astype(np.float32)  # 0 where the depth is infinite
    return thinned(true, found, seen_by_both(true, pair.depth, far_right), float(camera.num_disparities - 1))


def seen_by_both(
    true: Float32[np.ndarray, "H W"], depth: Float32[np.ndarray, "H W"], right: Float32[np.ndarray, "H W"]
) -> Bool[np.ndarray, "H W"]:
    """Pixels of the left image whose surface is visible in the right one, from the depth images of both."""
    width = true.shape[1]
    column = np.arange(width) - true
    at = np.clip(np.round(column).astype(int), 0, width - 1)
    there = np.take_along_axis(right, at, axis=1)
    there, here = (np.where(np.isfinite(values), values, 0.0) for values in (there, depth))
    return (true > 0) & (column >= 0) & (there > 0) & (np.abs(there - here) <= SAME_DEPTH * here)


def thinned(
    true: Float32[np.ndarray, "H W"], found: Float32[np.ndarray, "H W"], common: Bool[np.ndarray, "H W"], most: float
) -> Watched:
    """A subset of the pixels, with their surroundings."""
    n = LAG
    d = true[n:-n, n:-n]
    to_left, to_right = true[n:-n, : -2 * n] - d, true[n:-n, 2 * n :] - d
    to_up, to_down = true[: -2 * n, n:-n] - d, true[2 * n :, n:-n] - d
    across = slope(to_left, to_right) / n
    bend_across, bend_along = np.abs(to_left + to_right), np.abs(to_up + to_down)
    further_across = np.where(np.abs(to_left) > np.abs(to_right), to_left, to_right)
    further_along = np.where(np.abs(to_up) > np.abs(to_down), to_up, to_down)
    error = np.where((found > 0) & common & (np.abs(found - true) < CORE), found - true, np.nan)
    parts = (
        d,
        found[n:-n, n:-n],
        across,
        across / np.where(to_right > 0, np.maximum(1 - across, LEAST_WIDTH), 1),
        np.maximum(bend_across, bend_along),
        np.where(bend_across > bend_along, further_across, further_along),
        common[n:-n, n:-n],
        d > most,
        far_from_rims(true)[n:-n, n:-n],
        error[n:-n, 2 * n :],
        error[2 * n :, n:-n],
    )
    return Watched(*(part[::THIN, ::THIN].ravel() for part in parts))


def far_from_rims(true: Float32[np.ndarray, "H W"]) -> Bool[np.ndarray, "H W"]:
    """Pixels that are at least `RIM` away from bends of disparity, and from empty space."""
    bent = true <= 0
    bent[:, 1:-1] |= np.abs(true[:, 2:] + true[:, :-2] - 2 * true[:, 1:-1]) > CREASE
    bent[1:-1] |= np.abs(true[2:] + true[:-2] - 2 * true[1:-1]) > CREASE
    return ~cv2.dilate(bent.astype(np.uint8), np.ones((2 * RIM + 1,) * 2, np.uint8)).astype(bool)


def slope(before: Float32[np.ndarray, "H W"], after: Float32[np.ndarray, "H W"]) -> Float32[np.ndarray, "H W"]:
    """As `noise.slope`, on the host."""
    return np.where(before * after < 0, np.minimum(np.abs(before), np.abs(after)), np.float32(0))


def together(watched: Sequence[Watched]) -> Watched:
    """All pixels of many views."""
    return Watched(*(np.concatenate([getattr(w, field.name) for w in watched]) for field in fields(Watched)))


@dataclass(frozen=True)
class Quality:
    """How well a matcher measures textured surfaces that both cameras see."""

    bias: float  # [px] mean error of disparities within `CORE`
    sd: float  # [px]
    measured: float  # share of what both cameras see, except nearer than the search range
    wrong: float  # share of those with an error above `CORE`
    phantoms: float  # share of what only the left camera sees that is matched, with an error above `CORE`


def quality(w: Watched) -> Quality:
    """The quality over all pixels."""
    visible = w.common & ~w.near
    measured = visible & (w.found > 0)
    error = (w.found - w.true)[measured]
    core = error[np.abs(error) < CORE]
    hidden = ~w.common & ~w.near & (w.true > 0)
    wild = (w.found > 0) & (np.abs(w.found - w.true) > CORE)
    return Quality(
        bias=float(np.mean(core)),
        sd=float(np.std(core)),
        measured=share(measured, visible),
        wrong=float(np.mean(np.abs(error) >= CORE)),
        phantoms=share(wild & hidden, hidden),
    )


def share(
    part: Bool[np.ndarray, "N"], whole: Bool[np.ndarray, "N"], least: int = FEWEST, otherwise: float = 0.0
) -> float:
    """The share of a mask within another; `otherwise` if that has too few pixels."""
    count = int(whole.sum())
    return float((part & whole).sum() / count) if count >= least else otherwise


def fit_noise(w: Watched, base: NoiseConfig) -> NoiseConfig:
    """The noise with which the ray-cast sensor measures like the matcher; `base` has what pictures cannot tell.

    `base` provides the quantum, the threshold of edges, the attitude error, the range, and the lowest contrast. Losses
    by slope are modelled by stretch alone: a slope down the image causes no losses.
    """
    visible, measured = w.common & ~w.near, w.found > 0
    edge = w.bend > base.edge_jump
    stretched = losses(w.stretch[visible & ~edge], ~measured[visible & ~edge])
    even = w.stretch < stretched.get("stretch_kept", np.inf)
    plain = visible & ~edge & even
    error = w.found - w.true
    smooth = visible & ~edge & measured & (np.abs(error) < CORE)
    noisy = smooth & even
    sd, gain = spread(error[smooth], w.slope[smooth])
    swapped = np.abs(error) > np.abs(error - w.beyond)
    hidden = ~w.common & ~w.near & (w.true > 0)
    wild = measured & (np.abs(error) > CORE)
    found = {
        "bias": float(np.mean(error[noisy])),
        "sd": sd,
        "slope_gain": gain,
        "correlation": float(np.clip(correlation(w, noisy, error), 0.0, 0.5)),
        "drop_plain": share(~measured, plain),
        "drop_edge": share(~measured, visible & edge & even),
        "edge_swap": share(swapped, visible & edge & measured),
        "phantom_hidden": share(wild, hidden),
        "phantom_near": share(wild, w.near, otherwise=base.phantom_near),
    }
    found |= stretched
    return base.model_copy(update={name: round(value, 4) for name, value in found.items()})


def losses(stretch: Float[np.ndarray, "N"], lost: Bool[np.ndarray, "N"]) -> dict[str, float]:
    """Maximum-likelihood range of stretches over which surfaces get lost, and the largest share; {} if undetermined.

    The model has a constant share that is lost, and another that grows in proportion between two stretches.
    """
    if (stretch > KEPT[0]).sum() < FEWEST:
        return {}
    bins = np.arange(0, STRETCHED + BIN, BIN)
    number, _ = np.histogram(np.minimum(stretch, STRETCHED), bins)
    gone, _ = np.histogram(np.minimum(stretch[lost], STRETCHED), bins)
    least = max(gone.sum(where=bins[1:] <= KEPT[0]) / max(number.sum(where=bins[1:] <= KEPT[0]), 1), 1e-4)
    best, likeliest = {}, -np.inf
    for kept, over in itertools.product(KEPT, OVER):
        ramp = np.clip((bins[:-1] + BIN / 2 - kept) / over, 0, 1)
        chance = np.maximum(SHARES[:, None] * ramp, least)
        likelihood = np.sum(gone * np.log(chance) + (number - gone) * np.log1p(-chance), axis=1)
        if likelihood.max() > likeliest:
            share, likeliest = float(SHARES[likelihood.argmax()]), likelihood.max()
            best = {"stretch_kept": float(kept), "stretch_lost": float(kept + over), "drop_grazing": share}
    return best | {"grazing_slope": OFF, "grazing_rise": OFF}


def spread(error: Float[np.ndarray, "N"], across: Float[np.ndarray, "N"]) -> tuple[float, float]:
    """Standard deviation [px] on a surface without slope, and its growth: sd (1 + gain slope)."""
    flat = across < FLAT
    sd = float(np.std(error[flat])) if flat.sum() >= FEWEST else float(np.std(error))
    edges = np.quantile(across[~flat], np.linspace(0, 1, 9)) if (~flat).sum() >= 8 * FEWEST else []
    rows = []
    for low, high in itertools.pairwise(edges):
        here = (across >= low) & (across <= high) & ~flat
        rows.append((float(np.mean(across[here])), float(np.std(error[here]))))
    if not rows:
        return sd, 0.0
    x, y = np.array(rows).T
    gain = float(np.sum(x * (y / sd - 1)) / np.sum(x * x))
    return sd, max(gain, 0.0)


def correlation(w: Watched, noisy: Bool[np.ndarray, "N"], error: Float[np.ndarray, "N"]) -> float:
    """Correlation of the errors of pixels `LAG` apart, across and down."""
    found = []
    for other in (w.error_right, w.error_down):
        both = noisy & np.isfinite(other)
        if both.sum() >= FEWEST:
            found.append(np.corrcoef(error[both], other[both])[0, 1])
    return float(np.mean(found)) if found else 0.0
