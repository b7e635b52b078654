"""`jaxbiped run`: one mission in a scene, with its log, a picture and an animation."""

from __future__ import annotations

import json
import math
import sys
from pathlib import Path

from jaxbiped.arenas import load_scene, scene_warnings
from jaxbiped.commands.options.run import RunArgs
from jaxbiped.config import config_hash
from jaxbiped.files import new_folder, refuse_existing, write_whole
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.pose_error import pose_facts, pose_sentence
from jaxbiped.mission.recorded_driver import Mission
from jaxbiped.mission.recording import FILE, save_log
from jaxbiped.mission.strategies import find_strategy
from jaxbiped.report.animation import save_gif
from jaxbiped.report.pictures import save_mission
from jaxbiped.study.runner import check_mission, noise_of, play_one, seeing, spec_of

NOT_REACHED = 1  # exit status


def main(args: RunArgs) -> int:
    """Run the command.

    Returns:
      Exit status: 0 if the goal was reached, else 1.

    Raises:
      InputError: a bad scene, a pitch that does not divide its area, a biped that cannot be simulated, a folder that
        exists or cannot be written.
    """
    identity = config_hash(args.model_copy(update={"out": None}))
    out = args.out or Path("results") / f"run-{args.scene.stem}-{args.strategy.replace(':', '.')}-{identity}"
    refuse_existing(out)
    name, arena = load_scene(args.scene)
    spec = spec_of(args.mission, arena)
    for text in scene_warnings(arena, args.mission.robot, spec.grid.level_height):
        print(f"jaxbiped: warning: {args.scene}: {text}", file=sys.stderr)
    strategy = find_strategy(args.strategy)
    check_mission(args.mission)
    with seeing(args.mission) as rig:
        print(
            f"{name}, {strategy.name}, sensor {args.mission.sensor}, executor {args.mission.executor}, seed {args.seed}"
        )
        print("   time   turn   ahead  primitive")
        mission = play_one(
            arena,
            args.mission,
            args.mission.params(strategy),
            noise_of(args.seed),
            lambda p: print(f"{p.time:6.0f}s {math.degrees(p.turn):+5.0f}° {100 * p.length:5.1f}cm  {p.name}"),
            rig,
        )
    with new_folder(out) as folder:
        title = f"{name}, {args.strategy}: {sentence(mission)}"
        save_mission(folder / "map.png", mission.log, title=title)
        save_gif(folder / "mission.gif", mission.log, title=f"{name}, {args.strategy}")
        facts = summary(args, name, mission)
        write_whole(folder / "mission.json", lambda file: file.write((json.dumps(facts, indent=2) + "\n").encode()))
        save_log(folder / FILE, mission.log, facts)
    print(sentence(mission))
    print(pose_sentence(mission.log))
    print(f"written {out}: map.png, mission.gif, mission.json, {FILE}")
    return 0 if mission.code == Code.REACHED else NOT_REACHED


def sentence(mission: Mission) -> str:
    """The outcome, as text."""
    minutes = mission.time / 60
    return (
        f"{mission.code.label.replace('_', ' ')}: {100 * mission.distance:.0f} cm in {mission.time:.0f} s "
        f"({minutes:.1f} min), {mission.measurements} measurements"
    )


def summary(args: RunArgs, name: str, mission: Mission) -> dict:
    """The mission as JSON."""
    return {
        "scene": name,
        "strategy": args.strategy,
        "seed": args.seed,
        "config": args.mission.model_dump(mode="json"),
        "code": mission.code.label,
        "distance": mission.distance,
        "time": mission.time,
        "measurements": mission.measurements,
        **pose_facts(mission.log),
        "played": [vars(played) for played in mission.played],
    }
