"""What the optimiser finds is better than what it started from, within every limit, and walks in C MuJoCo."""

import numpy as np
import pytest

from jaxbiped.biped import request as ask
from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.gait import generate, home_table
from jaxbiped.biped.optimiser import optimise
from jaxbiped.biped.trial import Tolerance, play
from jaxbiped.errors import InputError

ROBOT = RobotModelConfig()
START = ask.straight(0.05).lasting(3.0)


def walks(table):
    outcome = play(table, ROBOT)
    assert outcome.success(Tolerance())
    assert np.hypot(*outcome.error[:2]) < 0.005 and abs(outcome.error[2]) < np.radians(1.5)


def test_a_shorter_primitive_is_found():
    table = optimise(START, ROBOT, "duration", steps=25)
    assert table.duration < 0.85 * START.duration
    assert table.margin >= 0.012
    assert table.peak_speed <= np.deg2rad(ROBOT.servo.speed)
    np.testing.assert_allclose(table.q[-1], home_table(ROBOT, False).q[-1], atol=1e-4)
    walks(table)


@pytest.mark.slow
def test_a_wider_margin_is_found_in_the_same_time():
    table, before = optimise(START, ROBOT, "margin", steps=60), generate(START, ROBOT)
    assert table.duration == pytest.approx(START.duration)
    assert table.margin > before.margin + 0.003
    walks(table)


def test_a_movement_on_both_feet_has_no_pressure_points_to_move():
    table, before = optimise(ask.squat().lasting(3.0), ROBOT, "duration", steps=25), ask.squat().lasting(3.0)
    assert table.duration < before.duration
    walks(table)


def test_an_impossible_start_is_refused():
    with pytest.raises(InputError, match="no time"):
        optimise(START.lasting(0.4), ROBOT)
