"""How many arenas a comparison of success rates needs."""

from __future__ import annotations

from math import ceil, sqrt

import numpy as np
from scipy import stats

from jaxbiped.errors import InputError


def mcnemar_power(n: int, first_only: float, second_only: float, alpha: float = 0.05) -> float:
    """The power of McNemar's exact test on `n` arenas, summed over the possible numbers of discordant arenas.

    Args:
      first_only, second_only: probabilities that only the first or only the second strategy reaches the goal.
    """
    discordance = first_only + second_only
    if discordance == 0:
        return 0.0
    low, high = stats.binom.ppf([1e-12, 1 - 1e-12], n, discordance)  # counts outside are negligible
    counts = np.arange(low, high + 1)
    # The test rejects at k or fewer of one kind: the greatest k with a one-sided tail of at most alpha / 2.
    critical = stats.binom.ppf(alpha / 2, counts, 0.5)
    critical -= stats.binom.cdf(critical, counts, 0.5) > alpha / 2
    share = first_only / discordance
    rejects = stats.binom.cdf(critical, counts, share) + stats.binom.sf(counts - critical - 1, counts, share)
    return float(np.sum(stats.binom.pmf(counts, n, discordance) * rejects))


def connor_sample_size(first_only: float, second_only: float, power: float = 0.8, alpha: float = 0.05) -> int:
    """Pairs for the asymptotic McNemar test (Connor, 1987, Biometrics 43, 207-211)."""
    discordance, difference = first_only + second_only, first_only - second_only
    if difference == 0:
        raise InputError("a sample size needs two probabilities that differ", field="first_only", value=first_only)
    spread = stats.norm.ppf(1 - alpha / 2) * sqrt(discordance)
    spread += stats.norm.ppf(power) * sqrt(discordance - difference**2)
    return ceil((spread / difference) ** 2)


def sample_size(first_only: float, second_only: float, power: float = 0.8, alpha: float = 0.05) -> int:
    """Number of arenas for a given power of McNemar's exact test, from a pilot's discordant shares.

    The search starts at Connor's count and increases in steps of half a percent until the exact power is reached.
    """
    for name, value in (("first_only", first_only), ("second_only", second_only)):
        if not 0 <= value <= 1:
            raise InputError("must be a probability, 0 to 1", field=name, value=value)
    if not 0 < power < 1:
        raise InputError("must be above 0 and below 1", field="power", value=power)
    if first_only + second_only > 1:
        raise InputError("the two shares must not add up to more than 1", field="second_only", value=second_only)
    n = connor_sample_size(first_only, second_only, power, alpha)
    while mcnemar_power(n, first_only, second_only, alpha) < power:
        n += max(1, n // 200)
    return n
