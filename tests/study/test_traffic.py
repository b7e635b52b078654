"""Studies of arenas that move: what they refuse, and that the speed of obstacles is what decides."""

import polars as pl
import pydantic
import pytest

from jaxbiped.study.config import StudyConfig
from jaxbiped.study.evaluation import evaluate


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"mission": {"executor": "native"}}, "the family traffic moves"),
        ({"mission": {"executor": "mjx"}}, "the family traffic moves"),
        ({"mission": {"sensor": "stereo"}}, "the family traffic moves"),
        ({"families": ("bump",), "population": {"obstacle_speed": 0.01}}, "needs the family traffic"),
        ({"population": {"bump_width": 0.2}}, "needs the family bump"),
        ({"population": {"obstacle_speed": -0.01}}, "greater than or equal to 0"),
        ({"mission": {"mapping": {"fade": 0.0}}}, "greater than 0"),
    ],
)
def test_what_cannot_move_is_refused(options, said):
    with pytest.raises(pydantic.ValidationError, match=said):
        StudyConfig(**({"families": ("traffic",)} | options))


@pytest.mark.slow
def test_blocks_that_stand_are_gone_round_and_fast_ones_collide():
    shares = {}
    for speed in (0.0, 0.02):
        config = StudyConfig(
            arenas=48,
            families=("traffic",),
            strategies=("full",),
            population={"obstacle_speed": speed},
            mission={"mapping": {"fade": 30.0}},
        )
        rows = pl.concat([frame for _, frame in evaluate(config)])
        assert set(rows["family"]) == {"traffic"}
        assert set(rows["code"]) <= {"reached", "collided", "no_path"}
        shares[speed] = rows["success"].mean()
    assert shares[0.0] > 0.95 and shares[0.02] < 0.6
