"""The page of the reproduction, from findings that are made up: what it says, and that it needs nothing else."""

import json

import numpy as np
import pytest

from jaxbiped.mapping import Cell
from jaxbiped.mission.log import MissionLog, Outline, Walk
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig
from jaxbiped.mission.recorded_driver import Mission
from jaxbiped.motion.config import RobotConfig
from jaxbiped.reproduction import EXPERIMENTS, TABLE_1, fit_measuring
from jaxbiped.reproduction.account import KINDS, Part, Record
from jaxbiped.reproduction.files import FIGURES, MISSIONS, write
from jaxbiped.reproduction.findings import Findings
from jaxbiped.reproduction.making import c_obstacles
from jaxbiped.reproduction.mishaps import MISHAPS, Ending
from jaxbiped.reproduction.page import PAGE, answer, build
from jaxbiped.reproduction.reasons import distance_reason, time_reason
from jaxbiped.reproduction.robot import moments
from jaxbiped.reproduction.scenery import frames_of, nearest_to
from jaxbiped.reproduction.table_1 import SCENES, Shown
from jaxbiped.reproduction.table_2 import Verified
from jaxbiped.reproduction.tables import ended
from tests.report.html_reader import Reader

ROOM = 8, 10  # cells


def a_log(outcome="reached", moments=4, walk=None):
    """A wall in the middle of a small room, floor elsewhere."""
    classes = np.full((moments, *ROOM), Cell.FLOOR, np.int8)
    classes[:, 3:5, 4:6] = Cell.OBSTACLE
    voxels = np.zeros((moments, *ROOM, 15), bool)
    voxels[..., 0] = True
    voxels[:, 3, 4, 1:8] = True
    way = np.linspace([0.05, 0.05, 0.0], [0.45, 0.35, 0.0], moments)
    box = np.array([[0.2, 0.15], [0.3, 0.15], [0.3, 0.25], [0.2, 0.25]])
    return MissionLog(
        classes=classes, levels=np.zeros_like(classes), true_xyyaw=way, estimated_xyyaw=way,
        plan=(way[:, :2],) * moments, time=np.arange(moments, dtype=float),
        action=("Start", "Step-up-bump", *("Straight-forward",) * (moments - 2)), pitch=0.05, origin_xy=np.zeros(2),
        size_xy=np.array([0.5, 0.4]), goal_xy=np.array([0.45, 0.35]), outlines=(Outline(box, "obstacle", 0.0, 0.4),),
        outcome=outcome, points=(np.random.default_rng(0).random((500, 3), np.float32),) * moments, voxels=voxels,
        walk=walk,
    )  # fmt: skip


def a_record(number, minutes, distance, measurements=20, code=Code.REACHED, gate=0.0):
    """A mission that takes so long with 10 s a measurement."""
    moving = 60 * minutes - 10 * measurements
    parts = dict.fromkeys(KINDS, Part()) | {
        "straight": Part(10, distance, moving - gate), "gate": Part(6, 0.30, gate), "measure": Part(measurements, 0, 0),
    }  # fmt: skip
    return Record(number, EXPERIMENTS[number - 1].strategy, 0, code, distance, moving, measurements, parts)


@pytest.fixture(scope="module")
def found():
    shown = {
        1: a_record(1, 11.0, 1.29), 2: a_record(2, 5.0, 0.4, code=Code.FELL), 3: a_record(3, 13.9, 0.97),
        4: a_record(4, 14.3, 1.57), 5: a_record(5, 10.1, 0.87), 6: a_record(6, 12.2, 0.95, gate=288.0),
    }  # fmt: skip
    codes = {item.number: shown[item.number].code.label for item in EXPERIMENTS}
    blank = a_log()
    endings = [Ending(m, Mission(Code.NO_PATH, 0.1, 30.0, 3, (), blank)) for m in MISHAPS]
    return Findings(
        config=MissionConfig(executor="native", sensor="stereo"),
        experiments={number: (each,) for number, each in shown.items()},
        shown=shown,
        logs={number: a_log(code) for number, code in codes.items()},
        shortest=dict.fromkeys(shown, 1.41),
        gate_depth=0.05,
        fit=fit_measuring(list(shown.values()), [item for item in EXPERIMENTS if item.minutes], shown),
        table_1={(s, scene): Shown(s == "full", "no_path", True, 0.9) for s in TABLE_1 for scene in SCENES},
        table_2=(Verified("step_up", 96.0, (0.1, 0.0, 0.0), 0.03, (0.001, 0.0, 0.01), 32, 31, 0.024, 0.016),),
        endings=tuple(endings),
    )


@pytest.fixture(scope="module")
def read(found):
    return Reader(build(found, seed=3, fidelity="x", facts={}, commands=("jaxbiped reproduce",), config={"a": "<b>"}))


def test_it_needs_nothing_else(read):
    addresses = [value for _, each in read.elements for name, value in each.items() if name in ("src", "href")]
    assert addresses and all(value.startswith(("data:image/", "#")) for value in addresses)
    assert not {"script", "link"} & {tag for tag, _ in read.elements}


def test_it_has_the_paper_s_figures_beside_ours(read):
    tables = [{row[0][1]: [cell[1] for cell in row[1:]] for row in table if row} for table in read.tables]
    cells = next(table for table in tables if "4, round the bump, on floor only" in table)
    assert cells["4, round the bump, on floor only"][:4] == ["1 of 1", "157", "133", "+18"]
    assert "133" in read.text and "17.0" in read.text and "9.2" in read.text and "104 straight" in read.text
    primitives = next(table for table in tables if "Step-up-bump" in table)
    assert primitives["Step-up-bump"][:3] == ["96", "96", "10 cm, 3 cm up"]


def test_it_says_first_what_did_not_reach_its_goal(read, found):
    assert "Experiment 2 (round an obstacle taller than the camera) did not reach its goal: fell." in read.text
    assert "5 of the paper's 6 experiments reach their goal." in read.text
    assert answer(found)[0].startswith("5 of")


def test_it_says_how_missions_that_cannot_go_well_ended(read):
    for mishap in MISHAPS:
        assert mishap.what in read.text
    table = next(table for table in read.tables if table[0][0][1] == "what is wrong")
    named = {row[0][1]: (row[1][1], row[2][1]) for row in table[1:]}
    assert named[MISHAPS[0].what] == ("no path", "yes") and named[MISHAPS[3].what] == ("no path", "no")


def test_what_went_wrong_in_every_experiment_is_said_without_figures(found):
    lost = {n: a_record(n, 5.0, 0.4, code=Code.STUCK) for n in range(1, 7)}
    changed = {"shown": lost, "experiments": {n: (each,) for n, each in lost.items()}, "fit": None}
    page = build(
        Findings(**{**vars(found), **changed}), seed=0, fidelity="x", facts={}, commands=(), config={}
    )  # fmt: skip
    text = Reader(page).text
    assert "0 of the paper's 6 experiments reach their goal." in text and "0 of 1, 1 stuck" in text
    assert "nan" not in text


def test_reasons_are_only_given_where_figures_differ():
    near, far = EXPERIMENTS[4], EXPERIMENTS[5]
    assert time_reason(near, a_record(5, 10.5, 0.87), 10.0, 0.0, 0.125) is None
    assert time_reason(EXPERIMENTS[0], a_record(1, 11.0, 1.3), 10.0, 0.0, 0.125) is None
    assert time_reason(far, a_record(6, 12.2, 0.95, code=Code.FELL), 10.0, 0.05, 0.125) is None
    said = time_reason(far, a_record(6, 12.2, 0.95, gate=288.0), 10.0, 0.05, 0.125)
    assert "12.2 min is 3.0 min more than the paper's 9.2" in said
    assert "+4.0 min in the gate (6.0 cells instead of one)" in said
    assert "lintel is 5 cm deep; grown by the robot's radius of 12.5 cm on both sides, it makes a gate of 30 cm" in said
    assert distance_reason(near, a_record(5, 10.5, 0.87), 0.91) is None
    said = distance_reason(EXPERIMENTS[3], a_record(4, 14.3, 1.57), 1.41)
    assert "157 cm is 24 cm more than the paper's 133" in said
    assert "+8 cm of the difference is due to our layout" in said and "+16 cm arose on the way" in said


def test_how_missions_ended_is_counted():
    records = [a_record(4, 10, 1.0, code=code) for code in (Code.REACHED, Code.FELL, Code.REACHED, Code.NO_PATH)]
    assert ended(records) == "2 of 4, 1 fell, 1 no path" and ended(records[:1]) == "1 of 1"


def test_c_obstacles_are_the_wall_grown_by_the_radius():
    """Against a plain loop: a cell is filled where its centre is nearer than the radius to an occupied one's square."""
    log, robot = a_log(), RobotConfig(radius=0.12)
    grown = c_obstacles(log, 0, robot)
    wanted = log.voxels[0].copy()
    for i, j, k in np.ndindex(grown.shape):
        for p, q in np.argwhere(log.voxels[0][..., k]) if k >= 2 else ():
            gap = np.maximum(np.abs([i - p, j - q]) - 0.5, 0) * 0.05
            wanted[i, j, k] |= bool(np.hypot(*gap) < 0.12)
    np.testing.assert_array_equal(grown, wanted)


def test_moments_of_the_robot():
    """Eight states: two before each of four moments."""
    qpos = np.zeros((6, 19), np.float32)
    qpos[:, :3] = np.linspace([0.0, 0.2, 0.2], [0.5, 0.2, 0.3], 6)
    qpos[:, 3] = 1.0
    log = a_log(walk=Walk(qpos, np.array([0.0, 0.5, 1.0, 1.5, 2.0, 2.5], np.float32)))
    assert frames_of(log, "Step-up-bump") == [0, 1] and frames_of(log, "Pass-gate") == []
    number, away = nearest_to(log, "obstacle")
    assert number in (2, 3) and away == pytest.approx(0.05, abs=0.001)
    assert list(moments(EXPERIMENTS[4], log).values()) == [0, 0, 0, 5]
    assert list(moments(EXPERIMENTS[0], log).values()) == [number]


def test_files(found, tmp_path):
    args = {"sensor": "stereo", "executor": "native", "seed": 3}
    names = write(tmp_path / "out", found, args, {}, "jaxbiped reproduce")
    assert names[:3] == [PAGE, FIGURES, MISSIONS]
    told = json.loads((tmp_path / "out" / FIGURES).read_text())
    assert told["experiments"][3]["shown"]["distance"] == 1.57 and told["experiments"][1]["shown"]["code"] == "fell"
    assert told["measure"]["fitted"]["seconds"] == pytest.approx(found.fit.seconds)
    assert (tmp_path / "out/experiment_6/mission.npz").is_file()
