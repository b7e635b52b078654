"""Single missions in a sweep script."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

from jaxbiped.api.registration import named
from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.scene import SceneConfig, load_scene, to_arena, to_terrain
from jaxbiped.files import new_folder, write_whole
from jaxbiped.mission.params import MissionConfig
from jaxbiped.mission.recorded_driver import Mission, Played
from jaxbiped.mission.strategies import Strategy, find_strategy
from jaxbiped.planning.planners import Planner
from jaxbiped.study.runner import check_mission, noise_of, play_one, seeing


@dataclass(frozen=True)
class PlayedMission:
    """One mission that has ended, with its log."""

    name: str  # of the scene
    strategy: str
    mission: Mission

    @property
    def code(self) -> str:
        """How it ended, such as "reached"."""
        return self.mission.code.label

    @property
    def distance(self) -> float:
        """[m] Distance walked."""
        return self.mission.distance

    @property
    def time(self) -> float:
        """[s] Time taken."""
        return self.mission.time

    @property
    def log(self):
        """Maps, poses and plans of every decision (`MissionLog`)."""
        return self.mission.log

    def __str__(self) -> str:
        minutes = self.time / 60
        return (
            f"{self.name}, {self.strategy}: {self.code.replace('_', ' ')}, {100 * self.distance:.0f} cm in "
            f"{self.time:.0f} s ({minutes:.1f} min), {self.mission.measurements} measurements"
        )

    def save(self, folder: str | Path) -> tuple[Path, ...]:
        """Write `map.png`, `mission.gif`, `mission.json` and the log into a new folder; return the files.

        Raises:
          InputError: a folder that exists or cannot be written.
        """
        from jaxbiped.mission.pose_error import pose_facts
        from jaxbiped.mission.recording import FILE, save_log
        from jaxbiped.report.animation import save_gif
        from jaxbiped.report.pictures import save_mission

        facts = {"scene": self.name, "strategy": self.strategy, "code": self.code, "distance": self.distance}
        facts |= {"time": self.time, "measurements": self.mission.measurements} | pose_facts(self.log)
        with new_folder(Path(folder)) as new:
            save_mission(new / "map.png", self.log, title=str(self))
            save_gif(new / "mission.gif", self.log, title=f"{self.name}, {self.strategy}")
            text = json.dumps(facts, indent=2) + "\n"
            write_whole(new / "mission.json", lambda file: file.write(text.encode()))
            save_log(new / FILE, self.log, facts)
        return tuple(sorted(Path(folder).iterdir()))


def play(
    scene: str | Path | Arena | SceneConfig,
    strategy: str | Strategy | Planner = "full",
    mission: MissionConfig | None = None,
    *,
    seed: int = 0,
    on_decision: Callable[[Played], None] = lambda _: None,
) -> PlayedMission:
    """Play one mission in a scene, with a log of everything.

    Consumes `jax.random.key(seed)`.

    Args:
      scene: a TOML file, a scene, or an arena.
      strategy: a name, or a strategy, planner or function of your own.

    Raises:
      InputError: a bad scene, an unknown strategy, something that cannot run on this machine.
    """
    if isinstance(scene, SceneConfig):
        name, arena = scene.name, replace(to_arena(scene), terrain=to_terrain(scene, Path()))
    else:
        name, arena = ("arena", scene) if isinstance(scene, Arena) else load_scene(scene)
    config = MissionConfig() if mission is None else mission
    chosen = find_strategy(strategy) if isinstance(strategy, str) else named(strategy)
    check_mission(config)
    with seeing(config) as rig:
        played = play_one(arena, config, config.params(chosen), noise_of(seed), on_decision, rig)
    return PlayedMission(name, chosen.name, played)
