"""The output of the reproduction: its page, all figures as JSON and Parquet, and the logs of the missions shown."""

from __future__ import annotations

import dataclasses
import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import polars as pl

from jaxbiped.files import new_folder, write_whole
from jaxbiped.mission.recording import FILE, save_log
from jaxbiped.report.pictures import save_figure
from jaxbiped.reproduction.account import Record
from jaxbiped.reproduction.findings import Findings
from jaxbiped.reproduction.page import PAGE, answer, build
from jaxbiped.reproduction.paper import EXPERIMENTS
from jaxbiped.reproduction.population import COLUMNS, population_figure
from jaxbiped.reproduction.robot import strip

FIGURES, MISSIONS = "reproduction.json", "missions.parquet"


def write(out: Path, found: Findings, args: dict[str, Any], facts: dict[str, str], command: str) -> list[str]:
    """Write a folder that must not exist; return the names of its files.

    Raises:
      InputError: it exists, or cannot be written.
    """
    fidelity = f"sensor {args['sensor']}, executor {args['executor']}"
    page = build(found, seed=args["seed"], fidelity=fidelity, facts=facts, commands=(command,), config=args)
    texts = {PAGE: page, FIGURES: json.dumps(figures(found) | {"command": command, "facts": facts}, indent=2) + "\n"}
    with new_folder(out) as folder:
        for name, text in texts.items():
            write_whole(folder / name, saver(text.encode()))
        buffer = io.BytesIO()
        missions(found).write_parquet(buffer)
        write_whole(folder / MISSIONS, saver(buffer.getvalue()))
        for each in found.populations:
            buffer = io.BytesIO()
            each.both.write_parquet(buffer)
            write_whole(folder / f"saved_{each.executor}.parquet", saver(buffer.getvalue()))
        pictures = save_pictures(folder, found)
        config = found.config.model_dump(mode="json")
        for item in EXPERIMENTS:
            (folder / item.scene).mkdir()
            facts_of_one = {"scene": item.scene, "args": args, "config": config}
            save_log(folder / item.scene / FILE, found.logs[item.number], facts_of_one)
    others = [f"saved_{each.executor}.parquet" for each in found.populations]
    return [*texts, MISSIONS, *others, *pictures, f"{EXPERIMENTS[0].scene} to {EXPERIMENTS[-1].number}"]


def save_pictures(folder: Path, found: Findings) -> list[str]:
    """Write the robot and each population as separate pictures; return their names."""
    names = []
    robot = strip(found.logs, found.config.walk.biped)
    if robot is not None:
        names.append("robot.png")
        write_whole(folder / names[-1], lambda file: robot.save(file, format="PNG"))
    for each in found.populations:
        if not each.both.is_empty():
            names.append(f"saved_{each.executor}.png")
            save_figure(population_figure(each, found.measure), folder / names[-1])
    return names


def saver(data: bytes) -> Callable[[Any], object]:
    """A function that writes bytes to an open file."""
    return lambda file: file.write(data)


def figures(found: Findings) -> dict[str, Any]:
    """All figures of the page, as JSON."""
    return {
        "answer": answer(found),
        "measure": {"default": found.default, "fitted": dataclasses.asdict(found.fit) if found.fit else None},
        "experiments": [
            {
                "number": item.number,
                "paper": {"distance": item.distance, "minutes": item.minutes, "straight": item.straight},
                "shortest": found.shortest.get(item.number),
                "shown": mission(found.shown[item.number], found),
                "missions": [mission(each, found) for each in found.experiments[item.number]],
            }
            for item in EXPERIMENTS
        ],
        "table_1": [
            {"strategy": strategy, "scene": scene, **dataclasses.asdict(each)}
            for (strategy, scene), each in found.table_1.items()
        ],
        "table_2": [dataclasses.asdict(each) for each in found.table_2],
        "populations": [
            {
                "executor": each.executor,
                "arenas": each.arenas,
                "solved_by_both": len(each.both),
                "percentile": {name: each.percentile(*COLUMNS[name]) for name in COLUMNS},
                "pair": dataclasses.asdict(each.pair),
            }
            for each in found.populations
        ],
        "what_cannot_work": [
            {"name": each.mishap.name, "code": each.mission.code.label, "named": each.named} for each in found.endings
        ],
    }


def mission(each: Record, found: Findings) -> dict[str, Any]:
    """One mission of an experiment."""
    row = dataclasses.asdict(each) | {"code": each.code.label}
    return row | {"time": each.time(found.measure), "time_at_default": each.time(found.default)}


def missions(found: Findings) -> pl.DataFrame:
    """A row for each mission of the experiments, and each kind of action."""
    rows = []
    for records in found.experiments.values():
        for each in records:
            row = mission(each, found)
            for kind, part in row.pop("parts").items():
                row |= {f"{kind.replace(' ', '_')}_{name}": value for name, value in part.items()}
            rows.append(row)
    return pl.DataFrame(rows)
