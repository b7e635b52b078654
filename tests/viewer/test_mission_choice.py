"""What a results folder has to show: recorded missions, and those of a study, which are played again."""

import polars as pl
import pytest

from jaxbiped.errors import InputError
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig
from jaxbiped.mission.recorded_driver import Mission
from jaxbiped.mission.recording import save_log
from jaxbiped.viewer import mission_choice as room
from jaxbiped.viewer.mission_choice import Files, Study, choices, missions
from jaxbiped.viewer.server import serving
from tests.study.synthetic import rows
from tests.study.test_stored_series import stored
from tests.viewer.test_viewer import seen


def test_the_missions_worth_a_look():
    frame = rows(60, strategies=("full",))
    found = choices(frame)
    arrived = frame.filter(pl.col("success"))
    times = dict(arrived.select("arena", "time").iter_rows())
    assert [choice.label.split(":")[0] for choice in found[:3]] == ["median", "best", "worst"]
    median, best, worst = (times[choice.arena] for choice in found[:3])
    assert best == min(times.values()) and worst == max(times.values())
    assert sorted(times.values())[(len(times) - 1) // 2] == median
    failed = frame.filter(~pl.col("success"))
    assert {choice.arena for choice in found[3:]} == set(failed["arena"]) and len(failed) > 3
    codes = [choice.label.split(":")[0] for choice in found[3:]]
    assert codes == sorted(codes)
    assert choices(failed)[0].arena in set(failed["arena"]) and choices(frame.head(0)) == ()


@pytest.fixture
def study(tmp_path, monkeypatch):
    """A stored sweep of two points whose missions are played by a stand-in; and what was asked to be played."""
    played = []

    def play_again(manifest, point, values, strategy, arenas):
        played.append((point, values["mission.costs.c3"], strategy, *arenas))
        return [Mission(Code.REACHED, 0.25, 104.0, 4, (), seen())]

    monkeypatch.setattr(room, "play_again", play_again)
    monkeypatch.setattr(room, "mission_of", lambda *_: (MissionConfig(), ("bump",), None))
    return missions(stored(tmp_path / "r", points=2)), played


def test_a_study_plays_what_is_asked_for_once(study):
    found, played = study
    assert isinstance(found, Study)
    assert found.strategies == ("full", "bump_aware", "floor_only")
    assert found.points == ("0: c3 0, pitch 0.05", "1: c3 10, pitch 0.05")
    shown = found.open("floor_only", 1, 7)
    assert shown is found.open("floor_only", 1, 7) and played == [(1, 10.0, "floor_only", 7)]
    assert shown.title == "arena 7, floor_only"
    assert shown.ending == "reached: 25 cm in 104 s (1.7 min), 4 measurements"
    assert "point 1: c3 10" in shown.note and "kinematic" in shown.note
    for arena in range(room.KEPT + 3):
        found.open("full", 0, arena)
    assert len(found.kept) == room.KEPT


def test_what_ends_otherwise_is_said(study):
    found, _ = study
    rows = found.stored.frame.filter((pl.col("strategy") == "full") & (pl.col("point") == 0))
    failed = rows.filter(~pl.col("success")).row(0, named=True)
    assert (
        f"ended as {failed['code'].replace('_', ' ')} when it was stored" in found.open("full", 0, failed["arena"]).note
    )


@pytest.mark.parametrize(
    ("place", "said"),
    [
        (("full", 0, 60), "arena: must be an arena that was stored, 0 to 59 (got 60)"),
        (("blind_stop", 0, 1), "must be one of full, bump_aware, floor_only"),
        (("full", 2, 1), "must be a sweep point of the folder, 0 to 1"),
    ],
)
def test_what_is_not_there_is_named(study, place, said):
    with pytest.raises(InputError) as caught:
        study[0].open(*place)
    assert said in str(caught.value)


def test_recorded_missions_of_a_folder(tmp_path):
    for name in ("b", "a"):
        (tmp_path / name).mkdir()
        save_log(
            tmp_path / name / "mission.npz", seen(), {"scene": name, "strategy": "full", "seed": 3, "distance": 0.3}
        )
    found = missions(tmp_path)
    assert isinstance(found, Files) and [choice.label for choice in found.choices()] == ["a", "b"]
    assert found.open("", 0, 1).title == "b, full" and found.open().ending == "reached: 30 cm in 104 s (1.7 min)"
    assert found.open().note == "sensor raycast, executor kinematic, seed 3"
    one = missions(tmp_path / "a")
    assert [choice.label for choice in one.choices()] == ["a"] and missions(tmp_path / "a/mission.npz").open().title
    with pytest.raises(InputError, match="arena: must be 0 to 1: a, b"):
        found.open("", 0, 2)


def test_how_a_reproduction_was_made_is_read(tmp_path):
    save_log(
        tmp_path / "mission.npz", seen(), {"scene": "s", "args": {"sensor": "oracle", "executor": "native", "seed": 5}}
    )
    assert missions(tmp_path).open().note == "sensor oracle, executor native, seed 5"


def test_the_picker_shows_another_mission(study):
    pytest.importorskip("viser")
    found, played = study
    with serving(found.open("full", 0, 0), "127.0.0.1", 0, found, ("full", 0, 0)) as page:
        picker = page.picker
        assert picker.list.options[1].startswith("median: arena ")
        picker.list.value = picker.list.options[2]
        picker.pick()
        best = picker.choices[1].arena
        assert page.mission.title == f"arena {best}, full" and picker.number.value == best
        picker.strategy.value, picker.point.value = "floor_only", found.points[1]
        picker.relist()
        assert page.mission.title == f"arena {best}, floor_only" and played[-1] == (1, 10.0, "floor_only", best)
        picker.open(1000)
        assert "must be an arena that was stored" in picker.said.content
        assert page.mission.title == f"arena {best}, floor_only"
        find = page.server.scene.get_handle_by_name
        assert find("/robot/torso") is not None and find("/map").visible
