"""MJX against MuJoCo in C: the same primitives to a millimetre, and the same outcomes."""

import math

import numpy as np
import pytest

from jaxbiped.biped import request as ask
from jaxbiped.biped.agreement import CROSSING, Paths, outcomes, paths
from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.gait import generate
from jaxbiped.biped.primitive_catalogue import FIVE, catalogue
from jaxbiped.biped.trial import Tolerance
from jaxbiped.biped.verify import trials

ROBOT = RobotModelConfig()
APART = 1e-3  # [m] of soles and head; 0.28 to 0.37 mm were measured, of the step up 0.74


def test_backends_agree_on_getting_up():
    """The shortest primitive, because MJX takes long: feet at rest on the floor, all joints moving."""
    assert paths(generate(ask.stand(1.5), ROBOT), ROBOT).worst[0] < APART


def test_a_backend_agrees_with_itself():
    both = paths(generate(ask.stand(1.5), ROBOT), ROBOT, "native")
    assert both.worst[0] == 0.0 and len(both.time) == len(both.apart)


def test_what_is_not_valid_is_infinitely_far():
    distance, when = Paths(np.array([0.1, 0.2, 0.3]), np.array([1e-4, math.nan, 5.0])).worst
    assert math.isinf(distance) and when == 0.2


def test_a_third_of_the_hard_cases_fails():
    table = generate(catalogue("fast")["step_up"], ROBOT)
    good = trials(table, ROBOT, CROSSING.draws(64, 0), record=False).success(Tolerance())
    assert 16 <= (~good).sum() <= 28


@pytest.mark.slow
@pytest.mark.parametrize("name", FIVE)
def test_backends_agree_at_every_moment(name):
    assert paths(generate(catalogue("fast")[name], ROBOT), ROBOT).worst[0] < APART


@pytest.mark.slow
def test_hard_cases_end_alike():
    table = generate(catalogue("fast")["step_up"], ROBOT)
    native, other = outcomes(table, ROBOT, CROSSING.draws(64, 0))
    np.testing.assert_array_equal(native, other)
