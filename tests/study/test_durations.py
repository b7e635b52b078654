"""Costs from durations: the paper's from Table 2, the normal equations, and measured primitives by hand."""

import numpy as np
import pytest

from jaxbiped.executors.motion_library import load_library
from jaxbiped.motion.config import DurationConfig
from jaxbiped.study.durations import fit, table_2

PAPER = [1.0, 1.0, 5.0, 10.0]
ROOT = np.sqrt(2)


def test_table_2_gives_the_papers_costs_back():
    """8 s a unit. A step of 96 s is 12 units, which leaves 11 for C3; the paper took 10."""
    found = fit(DurationConfig(), diagonal=False)
    np.testing.assert_allclose(found.costs, [1, 1, 5, 11], rtol=1e-9)
    assert found.seconds == pytest.approx(8) and np.allclose(found.costs[:3], PAPER[:3])
    np.testing.assert_allclose(found.fitted, found.measured)


def test_oblique_moves_by_the_normal_equations():
    design = np.zeros((8, 4))
    design[:, 0] = np.tile([1, ROOT], 4)
    design[[0, 1], 1] = design[[2, 3], 2] = design[4:, 3] = 1
    seconds = np.array([16, 16 * ROOT, 48, 48 * ROOT, 96, 96, 96, 96]) + 10
    solved = np.linalg.solve(design.T @ design, design.T @ seconds)
    found = fit(DurationConfig(), measuring=True)
    np.testing.assert_allclose(found.measured, seconds, rtol=1e-6)  # a float32 clock
    np.testing.assert_allclose(found.costs * found.seconds, solved, rtol=1e-5)
    np.testing.assert_allclose(found.fitted, design @ solved, rtol=1e-5)


def test_costs_do_not_depend_on_the_unit_of_time_and_are_never_negative():
    slow = DurationConfig(straight=48, turn=15, step_up=288, step_down=288, pass_gate=144, measure=30)
    for options in ({}, {"diagonal": False}, {"measuring": True}):
        ours, theirs = fit(DurationConfig(), **options), fit(slow, **options)
        np.testing.assert_allclose(theirs.costs, ours.costs, rtol=1e-5, atol=1e-6)
        assert theirs.seconds == pytest.approx(3 * ours.seconds) and ours.costs.min() >= 0
    quick_gates = fit(DurationConfig(pass_gate=0, step_up=0, step_down=0))
    assert quick_gates.costs.min() >= 0


def test_floor_that_takes_no_time():
    with pytest.raises(ValueError, match="must take time"):
        fit(DurationConfig(straight=0), diagonal=False)


def test_measured_primitives_in_the_units_of_table_2():
    library = load_library()
    found = table_2(library)
    entry = library.primitives
    assert found.straight == entry["straight"].duration  # of 5 cm
    # ten centimetres: what a step and a diagonal cell do not cover is walked
    assert found.step_up == pytest.approx(entry["step_up"].duration - (2 - ROOT) * found.straight)
    assert found.pass_gate == pytest.approx(entry["gate"].duration / 3)
    assert found.turn == pytest.approx(entry["turn"].duration, rel=1e-5)
    without = library.model_copy(update={"primitives": {k: v for k, v in entry.items() if k != "gate"}})
    assert table_2(without).pass_gate == entry["squat_straight"].duration
