"""The reproduction's figures, by hand and by plain NumPy: no mission is played here."""

import numpy as np
import pytest

from jaxbiped.arenas import load_scene
from jaxbiped.errors import InputError
from jaxbiped.mapping import Cell
from jaxbiped.mission.log import MissionLog
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.recorded_driver import Mission, Played
from jaxbiped.motion.config import DurationConfig
from jaxbiped.reproduction import EXPERIMENTS, PUBLISHED, SAVED, TABLE_1, expected, fit_measuring, typical
from jaxbiped.reproduction.account import KINDS, Part, Record, other_reading, parts, record, walked
from jaxbiped.reproduction.staging import load_scenes
from jaxbiped.reproduction.table_1 import SCENES, right

DURATIONS = DurationConfig()


def a_record(number, moving, measurements, code=Code.REACHED):
    return Record(number, "full", 0, code, 1.0, moving, measurements, dict.fromkeys(KINDS, Part()))


def a_mission(*played, code=Code.REACHED):
    """A mission of (name, turn, length, time after it), that always believed to look along x."""
    count = len(played) + 1
    log = MissionLog(
        classes=np.zeros((count, 2, 2), np.int8), levels=np.zeros((count, 2, 2), np.int8),
        true_xyyaw=np.zeros((count, 3)), estimated_xyyaw=np.zeros((count, 3)), plan=(np.zeros((0, 2)),) * count,
        time=np.zeros(count), action=("",) * count, pitch=0.05, origin_xy=np.zeros(2), size_xy=np.ones(2),
        goal_xy=np.ones(2),
    )  # fmt: skip
    decisions = tuple(Played(*each) for each in played)
    return Mission(code, 0.9, decisions[-1].time, len(decisions), decisions, log)


def test_published_figures_are_those_of_tables_3_and_4():
    assert {item.number: item.minutes for item in PUBLISHED} == {3: 16.8, 4: 17.0, 5: 10.0, 6: 9.2}
    assert pytest.approx((0.48, 7.0)) == SAVED
    assert [item.strategy for item in EXPERIMENTS] == ["full", "full", "full", "floor_only", "full", "full"]


def test_table_2_explains_the_paper_s_fifth_experiment_with_ten_seconds():
    """15 straight cells of 16 s, two edges of 96 s, 17 measurements: 602 s, and the paper has 600."""
    assert expected(EXPERIMENTS[4], 10.0).total == pytest.approx(15 * 16 + 2 * 96 + 17 * 10)
    assert expected(EXPERIMENTS[0], 10.0) is None


def test_parts_sum_to_the_mission():
    mission = a_mission(
        ("Straight-forward", 0.0, 0.05, 26.0),
        ("Straight-forward", np.pi / 4, 0.05 * np.sqrt(2), 26.0 + 10 + 5 + 16 * np.sqrt(2)),
        ("Look-down", 0.0, 0.0, 73.62741699796952),
        ("Step-up-bump", 0.0, 0.05, 179.62741699796952),
        ("Stay", 0.0, 0.0, 199.22741699796952),  # 3 cm to the side
        ("Pass-gate", -np.pi / 2, 0.05, 267.2274169979695),
        ("Straight-forward", 0.0, -0.05, 293.2274169979695),
    )
    found = parts(mission, DURATIONS)
    assert sum(part.seconds for part in found.values()) == pytest.approx(mission.time)
    assert {kind: part.count for kind, part in found.items() if part.count} == {
        "straight": 1, "diagonal": 1, "aside and back": 2, "step up": 1, "gate": 1, "turn": 2, "measure": 7,
    }  # fmt: skip
    assert found["gate"].seconds == pytest.approx(48) and found["turn"].seconds == pytest.approx(15)
    made = record(EXPERIMENTS[4], "full", 3, mission, DURATIONS)
    assert made.time(10.0) == pytest.approx(mission.time) and made.time(0.0) == pytest.approx(mission.time - 70)


@pytest.mark.parametrize(
    ("degrees", "kind"), [(0, "straight"), (89, "straight"), (-170, "straight"), (45, "diagonal"), (-140, "diagonal")]
)
def test_kind_of_walk(degrees, kind):
    assert walked(np.radians(degrees), 0.05) == kind
    assert walked(np.radians(degrees), -0.05) == "aside and back"


def test_fit_is_least_squares():
    rng = np.random.default_rng(0)
    records = [
        a_record(item.number, rng.uniform(300, 700), int(rng.integers(15, 35))) for item in PUBLISHED for _ in range(3)
    ]
    shown = {item.number: next(each for each in records if each.number == item.number) for item in PUBLISHED}
    wanted = {item.number: 60 * item.minutes for item in PUBLISHED}
    theirs, *_ = np.linalg.lstsq(
        np.array([[each.measurements] for each in records]),
        np.array([wanted[each.number] - each.moving for each in records]),
    )
    fit = fit_measuring([*records, a_record(4, 1.0, 1, Code.FELL), a_record(1, 1.0, 1)], PUBLISHED, shown)
    assert fit.seconds == pytest.approx(max(theirs[0], 0)) and fit.missions == len(records)
    for number, each in shown.items():
        assert each.time(fit.alone[number]) == pytest.approx(wanted[number])
        assert fit.residuals[number] == pytest.approx(each.time(fit.seconds) - wanted[number])


def test_fit_of_nothing_and_of_too_slow_missions():
    assert fit_measuring([a_record(3, 1.0, 1, Code.FELL)], PUBLISHED, {}) is None
    slow = a_record(6, 1e4, 20)
    assert fit_measuring([slow], PUBLISHED, {6: slow}).seconds == 0.0


def test_other_reading_of_the_gate_takes_a_third_of_its_time():
    gate = Part(6, 0.30, 288.0)
    changed = other_reading(
        Record(6, "full", 0, Code.REACHED, 1.0, 500.0, 20, dict.fromkeys(KINDS, Part()) | {"gate": gate})
    )
    assert changed.moving == pytest.approx(500 - 192) and changed.parts["gate"] == Part(6, 0.30, pytest.approx(96.0))
    assert other_reading(a_record(5, 500.0, 20)).moving == 500.0


def test_typical_is_the_median_of_those_that_arrived():
    some = [a_record(3, moving, 20) for moving in (500.0, 300.0, 400.0)]
    assert typical([a_record(3, 1.0, 1, Code.FELL), *some]).moving == 400.0
    assert typical(some[:2]).moving == 300.0
    lost = [a_record(3, 2.0, 1, Code.FELL), a_record(3, 1.0, 1, Code.STUCK)]
    assert typical(lost) is lost[0]


def test_right_counts_a_cell_beside_but_not_what_was_not_measured():
    truth = np.full((6, 6), Cell.FLOOR)
    truth[:, 2:4] = Cell.BUMP
    seen = np.where(truth == Cell.BUMP, Cell.FLOOR, truth)
    assert right(seen, truth, Cell.BUMP) == 0.0
    seen[:, 3] = Cell.BUMP
    assert right(seen, truth, Cell.BUMP) == 1.0
    seen[:, :] = Cell.UNMEASURED
    seen[0, 2] = Cell.BUMP
    assert right(seen, truth, Cell.BUMP) == 0.0  # nearly all of it was never measured
    assert right(truth, truth, Cell.GATE) == 0.0


def test_scenes_are_there(request):
    folder = request.config.rootpath / "configs/scenes"
    names = (*(item.scene for item in EXPERIMENTS), *SCENES)
    assert set(load_scenes(folder, names)) == set(names)
    for name in names:
        assert load_scene(folder / f"{name}.toml")[0] == name
    assert len(TABLE_1) == 5 and all(len(said) == 4 for _, said in TABLE_1.values())
    with pytest.raises(InputError, match="configs/scenes"):
        load_scenes(folder / "missing", names)
