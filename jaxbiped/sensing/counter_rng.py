"""Random numbers from a counter hash: cheap enough to draw a few for every ray of every view.

Each number is a pure function of (seed, counter), so that it depends neither on the batch nor on the order of
evaluation. Integer arithmetic is 32-bit and wraps, hence NumPy and JAX give the same bits; floats agree to float32
rounding. Every function takes either kind of array. This is not a cryptographic generator: threefry costs a hundred
times more, and sensor noise does not need it.

The mixer is the two-round xor-shift-multiply bijection `lowbias32` (C. Wellons, hash-prospector, public domain).
"""

from __future__ import annotations

import jax
import numpy as np
from jaxtyping import Array, Float, Int, Key, UInt, UInt32

Word = UInt32[Array, "..."] | UInt32[np.ndarray, "..."] | np.uint32
Counter = Int[Array, "..."] | UInt[Array, "..."] | Int[np.ndarray, "..."] | UInt[np.ndarray, "..."] | np.integer | int
Real = Float[Array, "..."] | Float[np.ndarray, "..."] | np.floating

GOLDEN = np.uint32(0x9E3779B9)

# Four bytes summed, minus their mean, over their standard deviation: normal but for an excess kurtosis of -0.3, which a
# Cornish-Fisher term removes (its gain fits the distribution function best). NORMAL_SCALE brings the
# variance of the corrected value back to exactly one.
BYTES_SD = 4 * 5461.25
KURTOSIS = 0.015
NORMAL_SCALE = 1.0041058
GREATEST_NORMAL = 3.93  # no draw of `normal` is larger in magnitude


def mix(word: Word) -> Word:
    """A bijection of 32-bit words in which each input bit flips each output bit about half the time."""
    with np.errstate(over="ignore"):  # wrapping is intended; NumPy warns about it for scalars
        word = word ^ (word >> np.uint32(16))
        word = word * np.uint32(0x7FEB352D)
        word = word ^ (word >> np.uint32(15))
        word = word * np.uint32(0x846CA68B)
        return word ^ (word >> np.uint32(16))


def word(counter: Counter) -> Word:
    """`counter` as a 32-bit word, modulo 2^32."""
    return np.uint32(counter & 0xFFFFFFFF) if isinstance(counter, int) else counter.astype(np.uint32)


def fold(seed: Word, *counters: Counter) -> Word:
    """A new seed from `seed` and each of `counters` in turn (arena, step, channel, ...); order matters."""
    for counter in counters:
        with np.errstate(over="ignore"):
            seed = mix(seed ^ mix(word(counter) + GOLDEN))
    return seed


def from_key(key: Key[Array, ""] | UInt32[Array, "2"]) -> UInt32[Array, ""]:
    """The hash seed of a JAX key; consumes the key."""
    return jax.random.bits(key, dtype=np.uint32)


def bits(seed: Word, counter: Counter) -> Word:
    """32 random bits for each counter, with the broadcast shape of `seed` and `counter`.

    Streams of different seeds are independent, so give each use its own `fold(seed, channel)`. With a NumPy
    counter, the inner hash is computed while tracing.
    """
    return mix(seed ^ mix(word(counter)))


def unit(bits: Word) -> Real:
    """Bits as a float32 in [0, 1), from their upper 24 bits."""
    return (bits >> np.uint32(8)).astype(np.float32) * np.float32(2**-24)


def uniform(seed: Word, counter: Counter, channel: Counter = 0) -> Real:
    """Uniform in [0, 1), float32, one per counter; channels of a seed are independent."""
    return unit(bits(fold(seed, channel), counter))


def normal(seed: Word, counter: Counter, channel: Counter = 0) -> Real:
    """Mean 0, variance 1, float32, one per counter; channels of a seed are independent.

    Nearly Gaussian: the sum of four bytes with one Cornish-Fisher term. Its distribution function is within 0.001 of
    the normal one, and no value exceeds `GREATEST_NORMAL`; that costs one hash, and no logarithm or cosine.
    """
    return normal_of(bits(fold(seed, channel), counter))


def normal_of(bits: Word) -> Real:
    """The normal number for 32 random bits."""
    low, high = bits & np.uint32(0x00FF00FF), (bits >> np.uint32(8)) & np.uint32(0x00FF00FF)
    pairs = low + high  # two sums of two bytes, 16 bits apart
    total = (pairs & np.uint32(0xFFFF)) + (pairs >> np.uint32(16))
    value = (total.astype(np.int32) - np.int32(510)).astype(np.float32) * np.float32(BYTES_SD**-0.5)
    gain = np.float32(NORMAL_SCALE * KURTOSIS)
    return value * (gain * value * value + np.float32(NORMAL_SCALE * (1 - 3 * KURTOSIS)))
