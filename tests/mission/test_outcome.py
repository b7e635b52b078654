"""What a mission and its code print as."""

import json

import numpy as np

from jaxbiped.mission.outcome import Code
from jaxbiped.mission.recorded_driver import Mission


def test_a_code_prints_as_its_label_and_counts_as_a_number():
    assert str(Code.NO_PATH) == f"{Code.NO_PATH}" == "no_path" and f"{Code.NO_PATH:>8}" == " no_path"
    assert repr(Code.NO_PATH) == "<Code no_path>" and repr([Code.FELL]) == "[<Code fell>]"
    assert Code.NO_PATH == 1 and np.array([Code.NO_PATH]).dtype.kind == "i" and json.dumps(Code.NO_PATH) == "1"


def test_a_mission_prints_in_a_line():
    mission = Mission(Code.REACHED, 1.25, 600.0, 12, (), None)
    assert str(mission) == "Mission(code=<Code reached>, distance=1.25, time=600.0, measurements=12)"
