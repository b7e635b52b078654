"""The effects of stereo matching on true disparities: noise, holes and phantoms.

The model reproduces, ray by ray, rendered pairs matched by a semi-global matcher: sub-pixel noise that grows with the
slope of the surface and is correlated over neighbours, 1/16 px steps, surfaces that one camera cannot see, surfaces
nearer than the search range, holes at edges, at grazing incidence, where one image shows a surface wider than the
other, and on plain texture, foreground fattening at edges, and clumped phantoms where nothing can be matched.

On a plane, disparity is an affine function of the pixel. So first differences give the slope of a surface, and second
differences vanish except at edges: no normals or object numbers are needed.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, UInt32

from jaxbiped.sensing import counter_rng
from jaxbiped.sensing.camera import Camera, ImageSpec

MATCH, PHANTOM, ATTITUDE = 1, 2, 3  # channels of a view's seed
HIDING_REACH = 128  # [px] largest distance to the right at which something may hide a pixel
PHANTOM_BLOCK = 12  # [px] size of a clump of phantoms
LEAST_WIDTH = 1e-2  # [px] in the right image, per pixel in the left: surfaces that turn away more are not seen


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class StereoNoise:
    """All traced; see `NoiseConfig` for what each is."""

    bias: Float[Array, "*B"]
    sd: Float[Array, "*B"]
    slope_gain: Float[Array, "*B"]
    correlation: Float[Array, "*B"]
    quantum: Float[Array, "*B"]
    drop_plain: Float[Array, "*B"]
    drop_edge: Float[Array, "*B"]
    drop_grazing: Float[Array, "*B"]
    edge_jump: Float[Array, "*B"]
    grazing_slope: Float[Array, "*B"]
    grazing_rise: Float[Array, "*B"]
    edge_swap: Float[Array, "*B"]
    phantom_hidden: Float[Array, "*B"]
    phantom_near: Float[Array, "*B"]
    min_contrast: Float[Array, "*B"]
    max_range: Float[Array, "*B"]
    attitude_sd: Float[Array, "*B"]
    stretch_kept: Float[Array, "*B"] | None = None  # None, like the next: left out of the program
    stretch_lost: Float[Array, "*B"] | None = None


def attitude_error(noise: StereoNoise, seed: UInt32[Array, ""]) -> tuple[Float[Array, ""], Float[Array, ""]]:
    """Roll and pitch [rad] of the robot in the view of this seed."""
    draw = counter_rng.normal(seed, np.arange(2), ATTITUDE) * noise.attitude_sd
    return draw[0], draw[1]


def match(
    disparity: Float[Array, "padded_rows padded_columns"],
    textured: Bool[Array, "rows columns"],
    camera: Camera,
    image: ImageSpec,
    noise: StereoNoise,
    seed: UInt32[Array, ""],
) -> Float[Array, "rows columns"]:
    """Measured disparity [px] of each ray; 0 where nothing was measured.

    Args:
      disparity: the true one [px], with a margin of one ray on all sides; 0 where there is nothing to see.
      textured: whether the surface has enough texture.
      seed: seed of this view; the channels MATCH and PHANTOM are used.
    """
    shape = (image.rows, image.columns)
    d = disparity[1:-1, 1:-1]
    u = jnp.broadcast_to(image.u, shape)
    # Slopes and edges.
    left, right, up, down = disparity[1:-1, :-2], disparity[1:-1, 2:], disparity[:-2, 1:-1], disparity[2:, 1:-1]
    to_left, to_right, to_up, to_down = left - d, right - d, up - d, down - d
    across = slope(to_left, to_right) * (1 / image.stride[0])
    along = slope(to_up, to_down) * (1 / image.stride[1])
    bend_across, bend_along = jnp.abs(to_left + to_right), jnp.abs(to_up + to_down)
    edge = jnp.maximum(bend_across, bend_along) > noise.edge_jump
    turned = (to_right > 0) & (across > noise.grazing_rise)
    grazing = (jnp.maximum(across, along) > noise.grazing_slope) | turned
    # What can be matched.
    hidden = hidden_from_right(disparity, image)
    near = d > camera.max_disparity
    # Its noise.
    counters = np.arange(4 * image.rows * image.columns, dtype=np.uint32).reshape(4, *shape)
    match_seed = counter_rng.fold(seed, MATCH)
    chance = counter_rng.bits(match_seed, counters[0])
    lost = jnp.where(grazing, noise.drop_grazing, jnp.where(edge, noise.drop_edge, noise.drop_plain))
    if noise.stretch_kept is not None:
        over = (stretch(across, to_right) - noise.stretch_kept) / (noise.stretch_lost - noise.stretch_kept)
        lost = jnp.maximum(lost, noise.drop_grazing * jnp.minimum(over, 1.0))
    dropped = half(chance) < lost
    swapped = edge & (half(chance >> np.uint32(16)) < noise.edge_swap)
    beyond_across = jnp.where(jnp.abs(to_left) > jnp.abs(to_right), to_left, to_right)
    beyond_along = jnp.where(jnp.abs(to_up) > jnp.abs(to_down), to_up, to_down)
    beyond = jnp.where(bend_across > bend_along, beyond_across, beyond_along)
    error = noise.bias + noise.sd * (1 + noise.slope_gain * across) * correlated(match_seed, image, noise.correlation)
    measured = d + jnp.where(swapped, beyond, 0.0) + error
    # Phantoms: one chance and one random disparity for each clump.
    clump = counter_rng.bits(counter_rng.fold(seed, PHANTOM), clumps(image))
    wild = 1 + half(clump) * (camera.max_disparity - 1)
    share = jnp.where(near, noise.phantom_near, jnp.where(hidden, noise.phantom_hidden, 0.0))
    phantom = half(clump >> np.uint32(16)) < share
    measured = jnp.where(phantom, wild, measured)
    steps = jnp.where(noise.quantum > 0, 1 / noise.quantum, 0.0)
    measured = jnp.where(noise.quantum > 0, jnp.round(measured * steps) * noise.quantum, measured)
    matched = phantom | ~(hidden | near | dropped)
    in_reach = (measured > 0) & (measured <= camera.max_disparity) & (measured <= u)
    return jnp.where(matched & in_reach & textured & (d > 0), measured, 0.0)


def slope(before: Float[Array, "*s"], after: Float[Array, "*s"]) -> Float[Array, "*s"]:
    """Magnitude of the slope on which the differences to the previous and the next ray agree; 0 on a peak."""
    return jnp.where(before * after < 0, jnp.minimum(jnp.abs(before), jnp.abs(after)), 0.0)


def stretch(across: Float[Array, "*s"], to_right: Float[Array, "*s"]) -> Float[Array, "*s"]:
    """Share by which one image shows a surface wider than the other: 1 for twice as wide.

    One pixel in the left image is 1 - slope wide in the right one where disparity rises to the right by `across` per
    pixel, and 1 + slope where it falls. Windows of one size then no longer show the same surface.
    """
    return across / jnp.where(to_right > 0, jnp.maximum(1 - across, LEAST_WIDTH), 1.0)


def hidden_from_right(
    disparity: Float[Array, "padded_rows padded_columns"], image: ImageSpec
) -> Bool[Array, "rows columns"]:
    """Whether a nearer surface to the right of a pixel covers it in the right image.

    A pixel of column u is seen there at u - d. It is covered if a pixel farther to the right is seen there or
    left of there.
    """
    window = 1
    seen_at = image.u - disparity[1:-1, 1:-1]
    least = jnp.pad(seen_at[:, 1:], ((0, 0), (0, 1)), constant_values=np.inf)
    while window * image.stride[0] < HIDING_REACH:  # the minimum over the next 1, 2, 4, ... columns
        further = jnp.pad(least[:, window:], ((0, 0), (0, min(window, image.columns))), constant_values=np.inf)
        # Without the barrier, XLA fuses the steps and computes each element's tree of minima separately; a minimum
        # that propagates NaN, like `jnp.minimum`, is four times slower.
        least, window = jax.lax.optimization_barrier(jnp.where(further < least, further, least)), 2 * window
    return least <= seen_at


def correlated(
    seed: UInt32[Array, ""], image: ImageSpec, correlation: Float[Array, ""]
) -> Float[Array, "rows columns"]:
    """Normal noise in which neighbours across and down are correlated, diagonal ones by the square of that.

    A moving average of two, across and then down: white + c * next has a correlation of c / (1 + c^2).
    """
    r = jnp.maximum(correlation, 1e-6)
    c = (1 - jnp.sqrt(jnp.maximum(1 - 4 * r * r, 0.0))) / (2 * r)
    shape = (image.rows + 1, image.columns + 1)
    white = counter_rng.normal(seed, np.arange(shape[0] * shape[1], dtype=np.uint32).reshape(shape), 1)
    mixed = white[:, :-1] + c * white[:, 1:]
    return (mixed[:-1] + c * mixed[1:]) / (1 + c * c)


def clumps(image: ImageSpec) -> UInt32[np.ndarray, "rows columns"]:
    """Number of the phantom block of each ray."""
    across = image.width // PHANTOM_BLOCK + 1
    return ((image.v // PHANTOM_BLOCK)[:, None] * across + (image.u // PHANTOM_BLOCK)[None, :]).astype(np.uint32)


def half(bits: UInt32[Array, "*s"]) -> Float[Array, "*s"]:
    """The lower 16 bits as a number in [0, 1)."""
    return (bits & np.uint32(0xFFFF)).astype(jnp.int32).astype(jnp.float32) * np.float32(2**-16)
