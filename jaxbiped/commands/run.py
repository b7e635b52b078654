"""`jaxbiped run`: one mission in a scene, with its log, a picture and an animation."""

from __future__ import annotations

import json
import math
import sys
from functools import partial
from pathlib import Path
from typing import Annotated, Literal

import jax
import pydantic
import tyro

from jaxbiped.arenas import load_scene, scene_warnings
from jaxbiped.arenas.ground import WITH_TERRAIN, refuse_terrain
from jaxbiped.config import Model, config_hash
from jaxbiped.files import new_folder, refuse_existing, write_whole
from jaxbiped.mission.eyes import eyes_for
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.recording import FILE, save_log
from jaxbiped.mission.settings import SIMULATED, MissionConfig, program
from jaxbiped.mission.stepped import Mission, run_logged
from jaxbiped.mission.strategies import STRATEGIES
from jaxbiped.report.animation import save_gif
from jaxbiped.report.pictures import save_mission
from jaxbiped.sensing.hashing import from_key

NOT_REACHED = 1  # exit status


class RunArgs(Model):
    """Run one mission in a scene: print what the robot plays, and write pictures of its map."""

    scene: tyro.conf.Positional[Path]
    """The scene, a TOML file; the paper's six are in configs/scenes."""
    strategy: Literal[tuple(STRATEGIES)] = "full"
    seed: Annotated[int, pydantic.Field(ge=0, lt=2**32)] = 0
    """Of all noise."""
    out: Path | None = None
    """Folder to write, which must not exist. Default: results/run-<scene>-<strategy>-<hash of these options>."""
    mission: Annotated[MissionConfig, tyro.conf.arg(name="")] = MissionConfig()


def main(args: RunArgs) -> int:
    """Run the command.

    Returns:
      Exit status: 0 when the goal was reached, else 1.

    Raises:
      InputError: a bad scene, a pitch that does not divide its area, a biped that cannot be simulated, a folder that
        exists or cannot be written.
    """
    identity = config_hash(args.model_copy(update={"out": None}))
    out = args.out or Path("results") / f"run-{args.scene.stem}-{args.strategy}-{identity}"
    refuse_existing(out)
    name, arena = load_scene(args.scene)
    for kind, choice in (("sensor", args.mission.sensor), ("executor", args.mission.executor)):
        if choice not in WITH_TERRAIN[kind]:
            refuse_terrain(arena, f"{kind} {choice}")
    static = program(args.mission, tuple(round(float(v), 6) for v in arena.size_xy), arena.terrain)
    for text in scene_warnings(arena, args.mission.robot, static.spec.level_height):
        print(f"jaxbiped: warning: {args.scene}: {text}", file=sys.stderr)
    play = run_logged
    if args.mission.executor in SIMULATED:
        from jaxbiped.mission.walking import rehearse, walk_logged  # loads MuJoCo

        rehearse(args.mission)
        play = partial(walk_logged, config=args.mission.walk)
    eyes = eyes_for(args.mission)
    print(f"{name}, {args.strategy}, sensor {args.mission.sensor}, executor {args.mission.executor}, seed {args.seed}")
    print("   time   turn   ahead  primitive")
    mission = play(
        arena,
        args.mission.settings(args.strategy),
        from_key(jax.random.key(args.seed)),
        static,
        on_decision=lambda p: print(f"{p.time:6.0f}s {math.degrees(p.turn):+5.0f}° {100 * p.length:5.1f}cm  {p.name}"),
        eyes=eyes,
    )
    with new_folder(out) as folder:
        title = f"{name}, {args.strategy}: {sentence(mission)}"
        save_mission(folder / "map.png", mission.log, title=title)
        save_gif(folder / "mission.gif", mission.log, title=f"{name}, {args.strategy}")
        facts = summary(args, name, mission)
        write_whole(folder / "mission.json", lambda file: file.write((json.dumps(facts, indent=2) + "\n").encode()))
        save_log(folder / FILE, mission.log, facts)
    print(sentence(mission))
    print(f"written {out}: map.png, mission.gif, mission.json, {FILE}")
    return 0 if mission.code == Code.REACHED else NOT_REACHED


def sentence(mission: Mission) -> str:
    """How it went, for people."""
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
        "played": [vars(played) for played in mission.played],
    }
