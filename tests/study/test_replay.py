"""Which arenas are looked at again, and that they are played as they were."""

import polars as pl
import pytest

from jaxbiped.errors import InputError
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.replay import examples, mission_of, play_again
from jaxbiped.study.stored_series import open_stored
from tests.study.synthetic import rows
from tests.study.test_stored_series import stored

FRAME = rows(120, strategies=("full", "floor_only"))
PAIR = ("full", "floor_only")


def test_kinds_of_difference_take_turns_and_the_greatest_come_first():
    found = examples(FRAME, *PAIR, 9)
    arenas = [example.arena for example in found]
    assert len(arenas) == len(set(arenas)) == 9
    sides = [FRAME.filter(pl.col("strategy") == name).sort("arena") for name in PAIR]
    gap = (sides[0]["time"] - sides[1]["time"]).abs()
    assert found[0].arena == sides[0]["arena"][gap.arg_max()]
    assert "is faster by" in found[0].why
    only = [example for example in found if example.why.startswith("only full arrives; floor_only: ")]
    walked = [sides[1]["walked"][example.arena] for example in only]
    assert len(only) >= 3 and walked == sorted(walked, reverse=True)
    assert all(sides[0]["success"][e.arena] and not sides[1]["success"][e.arena] for e in only)


def test_where_nothing_differs_there_are_none():
    same = [FRAME.filter(pl.col("strategy") == "full").with_columns(strategy=pl.lit(name)) for name in PAIR]
    assert examples(pl.concat(same), *PAIR, 3) == ()


def test_a_config_of_something_else_is_refused(tmp_path):
    manifest = open_stored(stored(tmp_path / "r")).manifest
    with pytest.raises(InputError, match="holds no config of missions"):
        play_again(manifest, 0, {}, "full", [0])


def test_the_mission_of_a_sweep_point(tmp_path):
    manifest = open_stored(stored(tmp_path / "r")).manifest
    config = StudyConfig(families=("bump",)).model_dump(mode="json")
    manifest = manifest.model_copy(update={"config": config})
    mission, families, population = mission_of(manifest, 3, {"costs.c3": 7.0, "population.bump_width": 0.3})
    assert mission.costs.c3 == 7.0 and mission.costs.c2 == 5.0
    assert families == ("bump",) and population.bump_width == 0.3
    mission, _, population = mission_of(manifest, 0, {})
    assert mission == StudyConfig().mission and population == StudyConfig().population


@pytest.mark.slow
def test_missions_are_played_as_they_were(tmp_path):
    from jaxbiped.study.run_study import compute_study

    compute_study(tmp_path / "r", StudyConfig(arenas=12, strategies=PAIR))
    kept = open_stored(tmp_path / "r")
    for name in PAIR:
        for arena, mission in zip((3, 7), play_again(kept.manifest, 0, {}, name, (3, 7)), strict=True):
            row = kept.frame.row(by_predicate=(pl.col("arena") == arena) & (pl.col("strategy") == name), named=True)
            assert row["code"] == mission.code.label
            # Times and places of two programs differ by the rounding of single precision.
            assert row["walked"] == pytest.approx(mission.distance, abs=1e-4)
            assert row["elapsed"] == pytest.approx(mission.time, abs=1e-2)
