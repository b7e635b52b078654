"""When two missions count as ended alike."""

import pytest

from jaxbiped.fitting.sensor_agreement import Outcome, same
from jaxbiped.mission.outcome import Code

REACHED = Outcome(Code.REACHED, 1.0, 600.0)


@pytest.mark.parametrize(
    ("other", "alike"),
    [
        (Outcome(Code.REACHED, 1.0, 600.0), True),
        (Outcome(Code.REACHED, 1.1, 545.0), True),
        (Outcome(Code.REACHED, 1.12, 600.0), False),
        (Outcome(Code.REACHED, 1.0, 530.0), False),
        (Outcome(Code.COLLIDED, 1.0, 600.0), False),
    ],
)
@pytest.mark.parametrize("lost", [False, True])
def test_of_what_reached_its_goal_distance_and_time_count(other, alike, lost):
    assert same(REACHED, other, lost) == same(other, REACHED, lost) == alike


def test_what_did_not_may_be_asked_for_its_code_alone():
    one, other = Outcome(Code.NO_PATH, 0.0, 70.0), Outcome(Code.NO_PATH, 0.05, 108.0)
    assert same(one, other, lost=False) and not same(one, other)
    assert not same(one, Outcome(Code.STUCK, 0.0, 70.0), lost=False)
