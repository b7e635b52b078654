"""Choosing two sides of stored results, and pairing their arenas."""

import polars as pl
import pytest

from jaxbiped.config import Model
from jaxbiped.errors import InputError
from jaxbiped.statistics import compare
from jaxbiped.study import StudyHeader, create
from jaxbiped.study.stored_series import choose, compare_sides, open_stored, side_by_side
from tests.study.synthetic import rows

PAIR = ("full", "floor_only")


class Config(Model):
    seed: int = 0


def stored(folder, *, seed=0, arenas=60, points=1, strategies=("full", "bump_aware", "floor_only"), change=None):
    """A folder of made-up results; later points are other missions on the same arenas."""
    frames = [
        rows(arenas, strategies=strategies).with_columns(point=pl.lit(point, pl.Int32))
        if point == 0
        else other(rows(arenas, strategies=strategies), point)
        for point in range(points)
    ]
    frame = pl.concat(frames)
    frame = change(frame) if change else frame
    table = pl.DataFrame(
        {"point": range(points), "mission.costs.c3": [float(10 * k) for k in range(points)], "pitch": [0.05] * points},
        schema={"point": pl.Int32, "mission.costs.c3": pl.Float64, "pitch": pl.Float64},
    )
    kind = {"points": table} if points > 1 else {}
    header = StudyHeader(Config(), seed=seed, arenas=arenas, command=f"jaxbiped compare --seed {seed}", **kind)
    with create(folder, header) as results:
        results.append(frame)
        results.finish(compile_time=1.0)
    return folder


def other(frame: pl.DataFrame, point: int) -> pl.DataFrame:
    """The same arenas, everything slower."""
    slower = [pl.col(name) + 30.0 * point for name in ("time", "elapsed")]
    return frame.with_columns(pl.lit(point, pl.Int32).alias("point"), *slower)


def test_two_strategies_are_what_compare_says_of_them(tmp_path):
    folder = open_stored(stored(tmp_path / "r"))
    comparison, frame = compare_sides(*choose([folder], PAIR), resamples=50)
    direct = compare(folder.frame, pairs=[PAIR], resamples=50)
    assert comparison.pair(*PAIR) == direct.pair(*PAIR)
    assert comparison.question == PAIR and set(frame["strategy"]) == set(PAIR)


def test_two_points_differ_by_what_was_changed(tmp_path):
    sides = choose([open_stored(stored(tmp_path / "r", points=3))], ("full", None), (2, 1))
    assert [side.name for side in sides] == ["full (c3 20)", "full (c3 10)"]
    comparison, _ = compare_sides(*sides, resamples=50)
    pair = comparison.pair("full (c3 20)", "full (c3 10)")
    assert pair.success.estimate == 0 and pair.time.mean.estimate == pytest.approx(30.0)
    assert comparison.strata("family") and comparison.strata("difficulty")


def test_two_folders_are_compared_where_both_have_arenas(tmp_path):
    folders = [open_stored(stored(tmp_path / name, arenas=arenas)) for name, arenas in (("a", 60), ("b", 30))]
    sides = choose(folders)
    assert [side.name for side in sides] == ["full (a)", "full (b)"]
    frame = side_by_side(*sides)
    assert frame["arena"].n_unique() == 30 and len(frame) == 60


@pytest.mark.parametrize(
    ("strategies", "points", "expected"),
    [
        ((None, None), (None, None), ("bump_aware", 0, "floor_only", 0)),
        (("full", None), (None, None), ("full", 0, "floor_only", 0)),
        ((None, "bump_aware"), (None, None), ("floor_only", 0, "bump_aware", 0)),
        (("floor_only", None), (None, None), ("floor_only", 0, "full", 0)),
        ((None, None), (1, 2), ("full", 1, "full", 2)),
        ((None, "floor_only"), (None, 1), ("floor_only", 0, "floor_only", 1)),
        (("full", "floor_only"), (2, None), ("full", 2, "floor_only", 2)),
    ],
)
def test_what_is_not_said_is_guessed(tmp_path, strategies, points, expected):
    sides = choose([open_stored(stored(tmp_path / "r", points=3))], strategies, points)
    assert (sides[0].strategy, sides[0].point, sides[1].strategy, sides[1].point) == expected


@pytest.mark.parametrize(
    ("strategies", "points", "said"),
    [
        (("gate_aware", None), (None, None), "first: must be one of full, bump_aware, floor_only .*gate_aware"),
        (("full", "full"), (None, None), "must differ from the first side"),
        ((None, None), (0, 3), "second-point: must be a sweep point of the folder, 0 to 2"),
        ((None, None), (-1, None), "first-point"),
    ],
)
def test_sides_that_are_not_there(tmp_path, strategies, points, said):
    with pytest.raises(InputError, match=said):
        choose([open_stored(stored(tmp_path / "r", points=3))], strategies, points)


def test_only_one_strategy_has_no_second(tmp_path):
    with pytest.raises(InputError, match="must differ from the first side"):
        choose([open_stored(stored(tmp_path / "r", strategies=("full",)))])


def test_other_arenas_are_refused_with_the_difference(tmp_path):
    folder = open_stored(stored(tmp_path / "a"))
    seeded = open_stored(stored(tmp_path / "b", seed=7))
    with pytest.raises(InputError, match=r"seeds differ, and so do the arenas: 0 in .*a, 7 here"):
        side_by_side(*choose([folder, seeded]))
    moved = open_stored(stored(tmp_path / "c", change=lambda frame: frame.with_columns(family=pl.lit("bump"))))
    with pytest.raises(InputError, match=r"families differ: arena 0 is obstacles of difficulty 0\.\d+ in .*a, bump"):
        side_by_side(*choose([folder, moved]))
    apart = open_stored(stored(tmp_path / "d", change=lambda frame: frame.with_columns(pl.col("arena") + 1000)))
    with pytest.raises(InputError, match="has no arena in common with"):
        side_by_side(*choose([folder, apart]))


def test_folders_with_other_metrics_are_compared(tmp_path):
    """One from before there were metrics, one that has some, and one that has them in another order."""
    half, whole = pl.lit(0.5).alias("spl"), pl.lit(1.0).alias("clearance")
    changes = {
        "none": None,
        "two": lambda f: f.with_columns(half, whole),
        "turned": lambda f: f.with_columns(whole, half),
    }
    folders = {name: open_stored(stored(tmp_path / name, change=change)) for name, change in changes.items()}
    for first, second, both in (("none", "two", 0), ("two", "turned", 60)):
        comparison, frame = compare_sides(*choose([folders[first], folders[second]]), resamples=50)
        pair = comparison.pair(*comparison.question)
        assert pair.metrics["spl"].n == both and pair.success.n == 60
        assert {"spl", "clearance"} <= set(frame.columns)
