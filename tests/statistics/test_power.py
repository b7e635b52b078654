"""Sample sizes against published examples and a simulation."""

import numpy as np
import pytest

from jaxbiped.errors import InputError
from jaxbiped.statistics.paired import mcnemar
from jaxbiped.statistics.power import connor_sample_size, mcnemar_power, sample_size


def test_connors_formula_on_its_published_calculators():
    assert connor_sample_size(0.05, 0.45, power=0.9) == 29  # by hand: (1.9600 sqrt .5 + 1.2816 sqrt .34)^2 / .16
    assert connor_sample_size(0.45, 0.05) == 23  # powersamplesize.com, McNemar's Z-test, after Connor (1987)
    assert connor_sample_size(0.15, 0.30) == 155  # the same formula's example with odds 2


def test_exact_power_is_the_simulated_one():
    n, first, second = 120, 0.25, 0.10
    counts = np.random.default_rng(0).multinomial(n, [first, second, 1 - first - second], size=3000)
    simulated = np.mean([mcnemar(int(a), int(b)) <= 0.05 for a, b, _ in counts])
    assert mcnemar_power(n, first, second) == pytest.approx(simulated, abs=4 * np.sqrt(0.25 / 3000))


def test_sample_size_reaches_the_wanted_power():
    n = sample_size(0.16, 0.08, power=0.8)
    assert connor_sample_size(0.16, 0.08, power=0.8) <= n <= 1.15 * connor_sample_size(0.16, 0.08, power=0.8)
    assert mcnemar_power(n, 0.16, 0.08) >= 0.8


def test_tiny_effects_do_not_take_long():
    assert sample_size(0.0105, 0.01) > 500_000


def test_no_discordance_has_no_power():
    assert mcnemar_power(100, 0.0, 0.0) == 0.0


@pytest.mark.parametrize(
    ("arguments", "field"),
    [((0.1, 0.1), "first_only"), ((1.2, 0.1), "first_only"), ((0.7, 0.6), "second_only"), ((0.2, 0.1, 1.0), "power")],
)
def test_impossible_pilots_are_refused(arguments, field):
    with pytest.raises(InputError, match=field):
        sample_size(*arguments)
