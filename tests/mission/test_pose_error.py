"""What is said of a mission's pose, and of the landmarks that it saw."""

import json
from dataclasses import replace

import numpy as np
import pytest

from jaxbiped.mission.pose_error import pose_errors, pose_facts, pose_sentence
from tests.report.test_pictures import mission


def off(**changes):
    """A log of three moments whose pose is off by 0, 5 and 3 cm, and by nearly a whole turn at the end."""
    log = mission(3)
    moved = np.array([[0, 0, 0], [0.03, 0.04, 0.1], [0.0, 0.03, 2 * np.pi - 0.2]])
    return replace(log, estimated_xyyaw=log.true_xyyaw + moved, seen=np.array([0, 2, 2]), **changes)


def test_errors_are_distances_and_the_smaller_angles():
    np.testing.assert_allclose(pose_errors(off()), [[0, 0], [0.05, 0.1], [0.03, 0.2]], atol=1e-9)


def test_facts_are_json():
    facts = json.loads(json.dumps(pose_facts(off())))
    assert facts["pose_error_end"] == pytest.approx([0.03, 0.2])
    assert facts["pose_error_greatest"] == pytest.approx([0.05, 0.2])
    assert facts["landmarks"] == 2 and facts["landmarks_seen"] == 1
    assert pose_facts(replace(off(), seen=None))["landmarks_seen"] is None


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({}, "; landmarks seen in 1 of 2 measurements"),
        ({"seen": np.zeros(3, int)}, "; no landmark was seen"),
        ({"landmarks": ()}, "; the scene has no landmarks"),
        ({"seen": None}, ""),
    ],
)
def test_the_sentence_depends_on_what_was_seen(changes, said):
    log = replace(off(), **changes)
    assert pose_sentence(log) == f"pose error 3.0 cm and 11.5° at the end, 5.0 cm at most{said}"
