"""All commands that store something, each with what takes long in it replaced by what is made up."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from PIL import Image
from skimage import data

from jaxbiped.commands import compare, fit_sensor, plan, reproduce, run, scenario, sweep
from jaxbiped.commands.plan import Plan
from jaxbiped.fitting.ray_sensor_fit import Fit
from jaxbiped.formats.moving_ai import load_map, load_scenario
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.recorded_driver import Mission
from jaxbiped.reproduction import EXPERIMENTS
from jaxbiped.reproduction.findings import Findings
from jaxbiped.reproduction.mishaps import MISHAPS, Ending
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.study.store import read_manifest
from tests.commands.test_classify import ROOM
from tests.commands.test_stereo import CAMERA
from tests.report.test_pictures import mission
from tests.reproduction.test_reproduction_page import a_log, a_record
from tests.study.test_stored_series import stored

DATA = Path(__file__).parent.parent / "data"
ROOMS, SCEN = DATA / "rooms.map", DATA / "rooms.map.scen"
SCENE = "configs/scenes/experiment_5.toml"
SWEEP = "arenas = 12\n[[axes]]\nfield = 'costs.c3'\nvalues = [0, 10, 20]\n"


@dataclass(frozen=True)
class Case:
    """A command line, in a working folder that `prepare(folder, monkeypatch)` has made ready."""

    argv: tuple[str, ...]
    prepare: Callable
    said: str  # in the first thing that it prints of its result
    stored: tuple[str, ...]  # what must be there before that


def nothing(here, monkeypatch):
    """All of it is real."""


def a_path(here, monkeypatch):
    cells = np.array([[4, 4], [4, 5], [4, 6]])
    monkeypatch.setattr(plan, "find", lambda *_: Plan(cells, np.arange(3.0), 2.0, 0, 0.0, 0.0))


def right_lengths(here, monkeypatch):
    optimal = load_scenario(SCEN, load_map(ROOMS, 0.05)).optimal
    monkeypatch.setattr(scenario, "lengths", lambda *_, **__: np.asarray(optimal, float))


def a_mission(here, monkeypatch):
    played = Mission(Code.REACHED, 0.3, 104.0, 5, (), mission())
    monkeypatch.setattr(run, "play_one", lambda *_, **__: played)


def a_study(module, points):
    def prepare(here, monkeypatch):
        (here / "sweep.toml").write_text(SWEEP)
        (here / "configs").symlink_to(Path(__file__).parents[2] / "configs")

        def compute_study(folder, *_, **__):
            return read_manifest(stored(folder, arenas=12, points=points))

        monkeypatch.setattr(module, "compute_study", compute_study)

    return prepare


def results(points):
    return lambda here, monkeypatch: stored(here / "r", arenas=12, points=points)


def a_cloud(here, monkeypatch):
    np.savez(here / "cloud.npz", points=ROOM)


def a_pair(here, monkeypatch):
    for name, image in zip(("left", "right"), data.stereo_motorcycle(), strict=False):
        Image.fromarray(image).save(here / f"{name}.png")


def a_fit(here, monkeypatch):
    class SensorRig:
        def __init__(self, camera: CameraConfig):
            pass

        def close(self):
            pass

    made = {"StereoRig": SensorRig, "worlds": lambda *_: iter(()), "fit": lambda *_: object.__new__(Fit)}
    made |= {"sentences": lambda *_: ["matcher"], "compared": lambda *_: ["maps"]}
    made["sensor_toml"] = lambda _, heading: "\n".join(f"# {line}" for line in heading)
    for name, value in made.items():
        monkeypatch.setattr(fit_sensor, name, value)


def a_reproduction(here, monkeypatch):
    (here / "configs").symlink_to(Path(__file__).parents[2] / "configs")
    shown = {item.number: a_record(item.number, 10.0, 1.0) for item in EXPERIMENTS}
    blank = a_log()

    def gather(args, arenas, config, console):
        return Findings(
            config=config, experiments={n: [one] for n, one in shown.items()}, shown=shown,
            logs=dict.fromkeys(shown, blank), shortest=dict.fromkeys(shown, 1.0), gate_depth=0.3, fit=None, table_1={},
            table_2=(), endings=tuple(Ending(m, Mission(Code.NO_PATH, 0.1, 30.0, 3, (), blank)) for m in MISHAPS),
            populations=(),
        )  # fmt: skip

    monkeypatch.setattr(reproduce, "gather", gather)


def with_configs(prepare):
    def both(here, monkeypatch):
        (here / "configs").symlink_to(Path(__file__).parents[2] / "configs")
        prepare(here, monkeypatch)

    return both


OUT = ("--out", "out")
FEW = ("--resamples", "50")
TWO = ("--start", "4", "4", "--goal", "6", "4")
CASES = {
    "plan": Case(("plan", str(ROOMS), *TWO, *OUT), a_path, "cost ", ("out/path.csv", "out/map.png")),
    "scenario": Case(
        ("plan", str(ROOMS), "--scenario", str(SCEN), *OUT), right_lengths, "equal ", ("out/queries.csv",)
    ),
    "run": Case(
        ("run", SCENE, *OUT), with_configs(a_mission), "reached: 30 cm", ("out/mission.json", "out/mission.npz")
    ),
    "compare": Case(("compare", *OUT), a_study(compare, 1), "Strategies on", ("out/rows", "out/report.html")),
    "stored": Case(("compare", "r", *FEW, *OUT), results(1), "Strategies on", ("out/comparison.md", "out/report.html")),
    "points": Case(
        ("compare", "r", "--first-point", "2", "--second-point", "0", *FEW, *OUT),
        results(3), "Strategies on", ("out/comparison.md", "out/report.html"),
    ),
    "sweep": Case(("sweep", "sweep.toml", *OUT), a_study(sweep, 3), "Success at each", ("out/rows", "out/report.html")),
    "report": Case(("report", "r", "--examples", "0"), results(1), "Strategies on", ("r/report.html", "r/summary.md")),
    "report of a sweep": Case(
        ("report", "r", "--examples", "0"), results(3), "Success at each", ("r/report.html", "r/sweep.png")
    ),
    "tune": Case(("tune", "--from-durations", "table", *OUT), nothing, "Costs from", ("out/costs.toml",)),
    "classify": Case(("classify", "cloud.npz", *OUT), a_cloud, "cloud ", ("out/classes.npz", "out/classify.json")),
    "stereo": Case(
        ("stereo", "left.png", "right.png", "--camera", str(CAMERA), "--pitch", "0.1", "--max-range", "4", *OUT),
        a_pair, "pair ", ("out/classes.npz", "out/stereo.json"),
    ),
    "primitives": Case(
        ("primitives", "--pace", "fast", "--only", "stand", "--draws", "1", "--no-videos", *OUT),
        nothing, "Success", ("out/library.toml", "out/summary.md"),
    ),
    "fit-sensor": Case(("fit-sensor", "--out", "s.toml"), a_fit, "matcher", ("s.toml",)),
    "reproduce": Case(
        ("reproduce", "--executor", "kinematic", *OUT), a_reproduction, "written out", ("out/reproduction.html",)
    ),
}  # fmt: skip
