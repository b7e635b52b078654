"""The counter hash: the same numbers in NumPy and JAX, and numbers that look random."""

import jax
import jax.numpy as jnp
import numpy as np
from scipy import stats

from jaxbiped.sensing import counter_rng

N = 200_000
COUNTERS = np.arange(N, dtype=np.uint32)


def test_same_numbers_in_numpy_and_jax():
    @jax.jit
    def draw(seed, step):
        folded = counter_rng.fold(seed, step, 7)
        return (
            folded,
            counter_rng.bits(folded, COUNTERS),
            counter_rng.uniform(folded, COUNTERS, 1),
            counter_rng.normal(folded, COUNTERS),
        )

    seed = counter_rng.fold(np.uint32(5), 11, 7)
    found = draw(jnp.uint32(5), jnp.int32(11))
    expected = (
        seed,
        counter_rng.bits(seed, COUNTERS),
        counter_rng.uniform(seed, COUNTERS, 1),
        counter_rng.normal(seed, COUNTERS),
    )
    for a, b in zip(found[:3], expected[:3], strict=True):
        assert np.array_equal(a, b)
    assert np.allclose(found[3], expected[3], rtol=1e-6, atol=1e-7)  # products may be fused with sums
    assert expected[2].dtype == expected[3].dtype == np.float32


def test_counters_may_be_of_any_kind():
    seed = np.uint32(3)
    kinds = (np.int64(9), np.uint8(9), np.array(9), jnp.int32(9), jnp.uint32(9))
    assert len({int(counter_rng.fold(seed, kind)) for kind in (9, *kinds)}) == 1
    assert int(counter_rng.fold(seed, -1)) == int(counter_rng.fold(seed, np.int32(-1)))
    assert int(counter_rng.fold(seed, 1, 2)) != int(counter_rng.fold(seed, 2, 1))


def test_seed_from_key():
    key = jax.random.key(0)
    assert counter_rng.from_key(key).dtype == jnp.uint32
    assert int(counter_rng.from_key(key)) != int(counter_rng.from_key(jax.random.fold_in(key, 1)))


def test_mix_is_a_bijection():
    assert len(np.unique(counter_rng.mix(COUNTERS))) == N


def test_uniform_is_uniform():
    """Ten streams of neighbouring seeds: the least of ten p-values is below 1e-4 once in 1,000."""
    p = [stats.kstest(counter_rng.uniform(np.uint32(seed), COUNTERS), "uniform").pvalue for seed in range(10)]
    assert min(p) > 1e-4
    u = counter_rng.uniform(np.uint32(0), COUNTERS)
    assert u.min() >= 0 and u.max() < 1


def test_streams_are_independent():
    """Correlations of 200,000 pairs have a standard deviation of 0.0022; 40 of them stay below 4.5 of those."""
    base = counter_rng.uniform(np.uint32(1), COUNTERS)
    others = [counter_rng.uniform(np.uint32(1), COUNTERS, channel) for channel in range(1, 15)]
    others += [counter_rng.uniform(np.uint32(seed), COUNTERS) for seed in range(2, 15)]
    others += [np.roll(base, shift) for shift in range(1, 14)]
    assert max(abs(np.corrcoef(base, other)[0, 1]) for other in others) < 4.5 / np.sqrt(N)


def test_pairs_fill_the_square():
    u = counter_rng.uniform(np.uint32(2), COUNTERS)
    counts, *_ = np.histogram2d(u[:-1], u[1:], bins=32)
    assert stats.chisquare(counts.ravel()).pvalue > 1e-4


def test_normal_is_normal():
    """Moments within four standard errors, the distribution function within 0.001 of the normal one plus sampling."""
    x = np.concatenate([counter_rng.normal(np.uint32(seed), COUNTERS).astype(float) for seed in range(5)])
    n = len(x)
    assert abs(x.mean()) < 4 / np.sqrt(n)
    assert abs(x.var() - 1) < 4 * np.sqrt(2 / n)
    assert abs(stats.skew(x)) < 4 * np.sqrt(6 / n)
    assert abs(stats.kurtosis(x)) < 0.1  # -0.06: tails end at 3.93
    assert stats.kstest(x, "norm").statistic < 0.001 + 1.95 / np.sqrt(n)
    assert np.abs(x).max() <= counter_rng.GREATEST_NORMAL
