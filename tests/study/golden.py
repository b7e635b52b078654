"""Golden rows: missions of every strategy, sensor, executor, planner and way of localisation, as they were.

They guard a refactoring bit for bit. `python -m tests.study.golden NAME ...` writes those of the named kinds anew, by
default all: where a change of behaviour is wanted, and the commit that brings it says which rows changed, and why.
"""

from __future__ import annotations

import platform
import sys
from pathlib import Path

import polars as pl

from jaxbiped.study.config import StudyConfig
from jaxbiped.study.evaluation import evaluate

FOLDER = Path(__file__).parents[1] / "data" / "golden"
EVERY = {"arenas": 12}
FEW = {"arenas": 6, "strategies": ("full",)}
KINDS = {  # a study each; those of `QUICK` in the quick suite
    "raycast": EVERY | {"mission": {}},
    "oracle": EVERY | {"mission": {"sensor": "oracle"}},
    "sampled": EVERY | {"mission": {"executor": "sampled"}, "strategies": ("full", "floor_only")},
    "heading": EVERY | {"mission": {"planner": "heading"}, "strategies": ("full", "gate_aware")},
    "pitch": EVERY | {"mission": {"pitch": 0.1}, "strategies": ("full", "bump_aware")},
    "traffic": FEW | {"mission": {"mapping": {"fade": 60.0}}, "families": ("traffic",)},
    "real": FEW | {"mission": {"preset": "real"}},
    "odometry": FEW | {"mission": {"localisation": "odometry"}},
    "visual": FEW | {"mission": {"localisation": "visual"}},
    "icp": FEW | {"mission": {"localisation": "icp"}},
    "both": FEW | {"mission": {"localisation": "both", "foot_placement": True}},
    "stereo": FEW | {"arenas": 3, "mission": {"sensor": "stereo"}},
    "native": FEW | {"arenas": 4, "mission": {"executor": "native"}},
    "mjx": FEW | {"arenas": 2, "mission": {"executor": "mjx"}},
}
QUICK = ("raycast",)
# Programs for processors of other kinds round otherwise; rows of another kind are compared within this share.
ELSEWHERE = 1e-4


def play(kind: str) -> pl.DataFrame:
    """The rows of one kind of study, in the order of their keys."""
    frames = (frame for _, frame in evaluate(StudyConfig(**KINDS[kind])))
    return pl.concat(frames).sort("arena", "strategy")


def machine() -> str:
    """What the last bit of a row may depend on: the kind of processor and what it can do."""
    features = {}
    if Path("/proc/cpuinfo").exists():
        lines = Path("/proc/cpuinfo").read_text().splitlines()
        features = dict(line.split("\t:", 1) for line in reversed(lines) if "\t:" in line)
        features = {name.strip(): value.strip() for name, value in features.items()}
    return f"{platform.machine()} {features.get('model name', '')} {features.get('flags', '')}"


def main() -> None:
    """Write golden rows."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    for kind in sys.argv[1:] or KINDS:
        rows = play(kind)
        rows.write_parquet(FOLDER / f"{kind}.parquet")
        (FOLDER / f"{kind}.machine").write_text(machine() + "\n")
        print(kind, rows["code"].value_counts().rows(), flush=True)


if __name__ == "__main__":
    main()
