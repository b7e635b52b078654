"""The sentences of a sweep depend on where which strategy is ahead."""

from dataclasses import replace

import pytest

from jaxbiped.report.answer_text import SUCCESS, TIME
from jaxbiped.report.sweep_answer import idle_sentence, measure_sentence, sentences
from jaxbiped.statistics import Estimate, compare
from jaxbiped.statistics.idle_axes import IdleSpan
from jaxbiped.statistics.sweep_points import PointResult, SweepResult
from tests.study.synthetic import rows

PAIR = compare(rows(30, strategies=("full", "floor_only")), resamples=20).pair("full", "floor_only")
UP, DOWN, OPEN = Estimate(0.2, 0.1, 0.3), Estimate(-0.2, -0.3, -0.1), Estimate(0.01, -0.1, 0.1)
NONE = Estimate(0.0)
ZERO = "At 1 the interval includes zero."
TOO_FEW = "At 1 there is no interval: too few arenas were solved, or all are alike."


def lead(c3):
    """Where `full` leads most."""
    return f"The greatest lead is at costs.c3 = {c3}: +20.0 [+10.0, +30.0] points."


def deficit(c3):
    """Where it is behind most."""
    return f"The greatest deficit is at costs.c3 = {c3}: -20.0 [-30.0, -10.0] points."


def result(*values, strategies=("full", "floor_only")):
    """A sweep over c3 whose points have these differences in success."""
    points = [
        PointResult(k, {"costs.c3": 5.0 * (k + 1)}, {}, replace(PAIR, success=value), {})
        for k, value in enumerate(values)
    ]
    return SweepResult(strategies, tuple(points), None, 0.95, 0, 20)


@pytest.mark.parametrize(
    ("values", "said"),
    [
        ((UP, UP, UP), ["full is ahead of floor_only at all 3 points.", lead(5)]),
        ((UP, UP), ["full is ahead of floor_only at both points.", lead(5)]),
        ((DOWN,), ["full is behind floor_only at the only point.", deficit(5)]),
        ((OPEN, OPEN), ["no difference between full and floor_only is shown at any of the 2 points."]),
        ((OPEN, NONE), ["no difference between full and floor_only is shown at any of the 2 points.", TOO_FEW]),
        ((UP, NONE), ["full is ahead of floor_only at 1 of 2 points.", TOO_FEW, lead(5)]),
        ((OPEN, UP, DOWN), ["full is ahead of floor_only at 1 and behind it at 1 of 3 points.", ZERO, lead(10)]),
        ((OPEN, DOWN), ["full is behind floor_only at 1 of 2 points.", ZERO, deficit(10)]),
    ],
)  # fmt: skip
def test_each_case_has_its_words(values, said):
    assert measure_sentence(result(*values), SUCCESS, "full", "floor_only") == f"Success: {' '.join(said)}"


def test_less_time_is_ahead():
    slower = replace(PAIR, time=replace(PAIR.time, mean=Estimate(60.0, 30.0, 90.0)))
    swept = replace(result(UP), points=(PointResult(0, {"costs.c3": 5.0}, {}, slower, {}),))
    assert "full is behind floor_only at the only point" in measure_sentence(swept, TIME, "full", "floor_only")


def test_a_sweep_of_one_strategy_says_only_what_changes_nothing():
    span = IdleSpan("costs.c3", 20.0, 40.0, 3, False)
    said = "costs.c3 changes nothing from 20 to 40: every mission is the same at these 3 values."
    assert sentences(result(UP, strategies=("full",)), (span,)) == (said,) == (idle_sentence(span),)
    assert idle_sentence(replace(span, whole=True)).endswith(
        "changes nothing: every mission is the same at all 3 values."
    )


def test_points_without_a_pair_are_not_counted():
    swept = replace(result(UP), points=(PointResult(0, {"costs.c3": 5.0}, {}, None, {}),))
    assert measure_sentence(swept, SUCCESS, "full", "floor_only").startswith("Success: no point has missions of both")
