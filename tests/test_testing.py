"""The fixture for other packages' unit tests."""

import numpy as np

import jaxbiped as jb
from jaxbiped.testing import tiny_mission


def test_it_is_the_same_each_time_and_takes_any_planner():
    first, second = tiny_mission(), tiny_mission()
    assert first.code == "reached" and (first.distance, first.time) == (second.distance, second.time)
    np.testing.assert_array_equal(first.log.classes, second.log.classes)
    assert 0.4 < first.distance < 1.0
    straight = tiny_mission(jb.StraightLine())
    assert straight.strategy == "StraightLine" and straight.code == "no_path"  # there is a block in its way
