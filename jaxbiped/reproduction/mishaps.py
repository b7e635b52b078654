"""Missions that cannot succeed: each must end with a code that names what happened.

They move by nominal displacements, so that failures are caused by the scene alone; the requested sensor measures their
views.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from jaxbiped.arenas import Arena, SceneConfig, to_arena
from jaxbiped.mission.params import MissionConfig
from jaxbiped.mission.recorded_driver import Mission
from jaxbiped.mission.sensor_rig import SensorRig
from jaxbiped.reproduction.staging import play, play_changing

START, GOAL = (0.375, 0.675, 0.0), (1.375, 0.675)  # [m, m, rad], [m]
BESIDE = tuple(
    {"kind": "circle", "at": at} for at in ((1.05, 0.12), (1.05, 1.28), (1.70, 0.35), (1.70, 1.05), (0.55, 1.28))
)
BEHIND = ({"kind": "circle", "at": (0.12, 0.50)}, {"kind": "circle", "at": (0.12, 0.85)})
WALL = {"centre": (0.9, 0.70), "size": (0.10, 1.40), "top": 0.50}
BLOCK = {"centre": (0.9, 0.70), "size": (0.10, 0.30), "top": 0.50}
AROUND_GOAL = {"centre": (1.375, 0.70), "size": (0.40, 0.40), "top": 0.50}
DROPPED_AFTER = 3  # decisions


@dataclass(frozen=True)
class Mishap:
    """One such mission."""

    name: str
    what: str  # for people
    boxes: tuple[dict, ...]
    landmarks: tuple[dict, ...]
    ends: tuple[str, ...]  # codes that correctly name what happened
    contrast: float = 1.0  # of floor and boxes
    dropped: bool = False  # whether the boxes are absent at first


MISHAPS = (
    Mishap("no_solution", "a wall from rim to rim: there is no path", (WALL,), BESIDE, ("no_path",)),
    Mishap(
        "no_landmark", "landmarks only behind the robot: it never sees one", (BLOCK,), BEHIND,
        ("reached", "stuck", "collided"),
    ),
    Mishap(
        "no_texture", "a wall and a floor without texture: stereo measures nothing", (WALL,), BESIDE,
        ("collided", "no_path", "out_of_steps"), contrast=0.0,
    ),
    Mishap(
        "dropped", f"a block that falls into the planned path after {DROPPED_AFTER} decisions", (BLOCK,), BESIDE,
        ("reached",), dropped=True,
    ),
    Mishap("goal_inside", "the goal lies inside an obstacle", (AROUND_GOAL,), BESIDE, ("no_path",)),
)  # fmt: skip


@dataclass(frozen=True)
class Ending:
    """How a mishap ended."""

    mishap: Mishap
    mission: Mission

    @property
    def named(self) -> bool:
        """Whether the code correctly names what happened."""
        return self.mission.code.label in self.mishap.ends


def arena_of(mishap: Mishap) -> Callable[[int], Arena]:
    """Its arena before each decision."""
    empty, full = (to_arena(scene_of(mishap, boxes)) for boxes in ((), mishap.boxes))
    return lambda decisions: empty if mishap.dropped and decisions < DROPPED_AFTER else full


def scene_of(mishap: Mishap, boxes: tuple[dict, ...]) -> SceneConfig:
    """Its scene; unlike `load_scene`, which rejects a goal inside an obstacle."""
    held = tuple({**box, "contrast": mishap.contrast} for box in boxes)
    scene = {"name": mishap.name, "start": START, "goal": GOAL, "floor_contrast": mishap.contrast}
    return SceneConfig.model_validate(scene | {"boxes": held, "landmarks": mishap.landmarks})


def suffer(mishap: Mishap, config: MissionConfig, seed: int, rig: SensorRig | None = None) -> Ending:
    """Play one; `config` must not be for a simulated biped."""
    arena_at = arena_of(mishap)
    if mishap.dropped:
        return Ending(mishap, play_changing(arena_at, config, "full", seed, rig))
    return Ending(mishap, play(arena_at(0), config, "full", seed, rig))
