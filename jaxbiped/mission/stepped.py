"""The driver on the host: one mission, one decision at a time, with a log of everything."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, UInt32

from jaxbiped import planning
from jaxbiped.arenas.arena import CIRCLE, Arena
from jaxbiped.mapping import Cell
from jaxbiped.mission.cycle import cycle
from jaxbiped.mission.decision import Thought, nearest_direction
from jaxbiped.mission.eyes import Eyes
from jaxbiped.mission.log import Mark, MissionLog, Outline, Picture
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.settings import Program, Settings
from jaxbiped.mission.state import Mind, World, start
from jaxbiped.motion.primitives import Command, Primitive

NAMES = {
    Primitive.NONE: "Stay",
    Primitive.STRAIGHT_FORWARD: "Straight-forward",
    Primitive.STEP_UP_BUMP: "Step-up-bump",
    Primitive.STEP_DOWN_BUMP: "Step-down-bump",
    Primitive.PASS_GATE: "Pass-gate",
    Primitive.LOOK: "Look-down",
}  # as in Table 2


@dataclass(frozen=True)
class Played:
    """One decision, as printed."""

    name: str
    turn: float  # [rad]
    length: float  # [m]
    time: float  # [s] after it, since the start


@dataclass(frozen=True)
class Mission:
    """A mission that has ended."""

    code: Code
    distance: float  # [m]
    time: float  # [s]
    measurements: int
    played: tuple[Played, ...]
    log: MissionLog


turn_once = partial(jax.jit, static_argnames=("program",))(cycle)


def run_logged(
    arena: Arena,
    settings: Settings,
    seed: UInt32[Array, ""],
    program: Program,
    on_decision: Callable[[Played], None] = lambda _: None,
    eyes: Eyes | None = None,
) -> Mission:
    """Run one mission (no batch axis) as the compiled driver would, and keep what it saw and thought.

    Args:
      eyes: what it sees with, where the program's sensor is no JAX.
    """
    recorder = Recorder(settings, program, on_decision, eyes)
    return recorder.mission(arena, run_bare(arena, settings, seed, program, eyes, recorder))


def run_bare(
    arena: Arena,
    settings: Settings,
    seed: UInt32[Array, ""],
    program: Program,
    eyes: Eyes | None = None,
    recorder: Recorder | None = None,
) -> World:
    """The end of one mission (no batch axis); its world has a leading axis of 1."""
    batch = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], (arena, settings))
    world, mind = jax.tree.map(lambda leaf: leaf[None], start(arena, settings, seed, program.spec))
    while world.code[0] == Code.RUNNING:
        before = world
        seen = eyes.see(world, mind, *batch) if eyes else None
        world, mind, _, command, thought = turn_once(world, mind, *batch, program, seen)
        if recorder:
            recorder.decided(0, before, command, thought)
            recorder.concluded(0, world, mind)
    return world


class Recorder:
    """Keeps what one mission saw and thought; worlds, minds and so on have a leading axis of 1."""

    def __init__(
        self, settings: Settings, program: Program, on_decision: Callable[[Played], None], eyes: Eyes | None = None
    ):
        self.settings, self.program, self.on_decision, self.eyes = settings, program, on_decision, eyes
        self.moments: list[dict] = []
        self.pictures: list[Picture] = []
        self.played: list[Played] = []
        self.action = "Start"
        self.end: World | None = None

    def decided(self, _: int, world: World, command: Command, thought: Thought) -> None:
        """One decision, before it is carried out."""
        self.moments.append(moment(world, thought, self.settings, self.program, self.action))
        if shot := self.eyes and self.eyes.picture():
            self.pictures.append(Picture(shot.left, shot.disparity))
        self.command = command

    def concluded(self, _: int, world: World, mind: Mind) -> None:
        """What came of it."""
        command = self.command
        record = Played(
            name=NAMES[Primitive(int(command.primitive[0]))],
            turn=float(command.turn[0]),
            length=float(command.length[0]),
            time=float(world.time[0]),
        )
        self.played.append(record)
        self.on_decision(record)
        self.action = record.name if record.length or not record.turn else "Turn-direction"
        self.end, self.mind = world, mind

    def mission(self, arena: Arena, world: World) -> Mission:
        """The whole of it.

        Args:
          world: as it began, for a mission that was over by then.
        """
        moments, world = list(self.moments), self.end or world
        if moments:
            last = dict(moments[-1])
            here, time = pose_of(world), float(world.time[0])
            last |= {"true_xyyaw": here, "estimated_xyyaw": mind_pose(self.mind), "time": time, "action": self.action}
            last["plan"] = np.zeros((0, 2))
            moments.append(last)
        else:
            moments.append(nothing(world, self.program))
        code = Code(int(world.code[0]))
        log = MissionLog(
            classes=np.stack([m["classes"] for m in moments]),
            levels=np.stack([m["levels"] for m in moments]),
            true_xyyaw=np.stack([m["true_xyyaw"] for m in moments]),
            estimated_xyyaw=np.stack([m["estimated_xyyaw"] for m in moments]),
            plan=tuple(m["plan"] for m in moments),
            time=np.array([m["time"] for m in moments]),
            action=tuple(m["action"] for m in moments),
            pitch=self.program.spec.pitch,
            origin_xy=np.zeros(2),
            size_xy=np.asarray(arena.size_xy, float),
            goal_xy=np.asarray(arena.goal_xy, float),
            outlines=outlines(arena),
            landmarks=marks(arena),
            pictures=(*self.pictures, *self.pictures[-1:]),
            outcome=code.label,
        )
        played = tuple(self.played)
        return Mission(code, float(world.distance[0]), float(world.time[0]), int(world.measurements[0]), played, log)


def moment(world: World, thought: Thought, settings: Settings, program: Program, action: str) -> dict:
    """What a log keeps of one decision."""
    return {
        "classes": np.asarray(thought.classes[0]),
        "levels": np.asarray(thought.levels[0]),
        "true_xyyaw": pose_of(world),
        "estimated_xyyaw": np.array([float(v[0]) for v in (thought.pose.x, thought.pose.y, thought.pose.yaw)]),
        "plan": planned_way(thought, settings, program),
        "time": float(world.time[0] + settings.durations.measure),
        "action": action,
    }


def nothing(world: World, program: Program) -> dict:
    """The one moment of a mission that ended before it began."""
    blank = np.zeros(program.spec.shape, np.int8)
    here = pose_of(world)
    return {
        "classes": blank,
        "levels": blank,
        "true_xyyaw": here,
        "estimated_xyyaw": here,
        "plan": np.zeros((0, 2)),
        "time": 0.0,
        "action": "Start",
    }


def pose_of(world: World) -> Float[np.ndarray, "3"]:
    """True (x, y, yaw) of the only mission of a batch."""
    return np.array([float(v[0]) for v in (world.pose.x, world.pose.y, world.pose.yaw)])


def mind_pose(mind) -> Float[np.ndarray, "3"]:
    """Believed (x, y, yaw) of the only mission of a batch."""
    pose = mind.belief.pose
    return np.array([float(v[0]) for v in (pose.x, pose.y, pose.yaw)])


def planned_way(thought: Thought, settings: Settings, program: Program) -> Float[np.ndarray, "n 2"]:
    """Cell centres [m] of the planned path, from the robot's cell on; empty where there is none."""
    spec = program.spec
    moves = np.asarray(way(thought, settings, program)[0])
    moves = moves[: np.argmax(moves < 0)] if np.any(moves < 0) else moves
    if len(moves) == 0:
        return np.zeros((0, 2))
    cells = np.asarray(thought.ij[0]) + np.vstack(
        [np.zeros((1, 2), int), np.cumsum(planning.DIRECTIONS[moves], axis=0)]
    )
    return (cells[:, ::-1] + 0.5) * spec.pitch


@partial(jax.jit, static_argnames=("program",))
def way(thought: Thought, settings: Settings, program: Program):
    """Moves of the planned path, as `decide` reads its first."""
    blind = settings.strategy.blind
    classes = jnp.where(blind, jnp.int8(Cell.FLOOR), thought.classes)
    levels = jnp.where(blind, jnp.int8(0), thought.levels)
    costs, rules = settings.costs.at_pitch(program.spec.pitch), settings.strategy.rules()
    heading = nearest_direction(thought.pose.yaw[0])[None]
    length = 3 * sum(program.spec.shape)
    return planning.next_step(thought.cost, classes, levels, costs, rules, thought.ij, heading, length=length)


def outlines(arena: Arena) -> tuple[Outline, ...]:
    """Footprints of the true boxes."""
    boxes = jax.device_get(arena.boxes)
    found = []
    for m in np.flatnonzero(boxes.used):
        cos, sin = np.cos(boxes.yaw[m]), np.sin(boxes.yaw[m])
        local = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [boxes.half_x[m], boxes.half_y[m]]
        corners = local @ np.array([[cos, sin], [-sin, cos]]) + [boxes.x[m], boxes.y[m]]
        kind = "gate" if boxes.overhead[m] else "bump" if boxes.top[m] <= 0.0601 else "obstacle"
        found.append(Outline(corners, kind))
    return tuple(found)


def marks(arena: Arena) -> tuple[Mark, ...]:
    """The landmarks."""
    known = jax.device_get(arena.landmarks)
    return tuple(
        Mark(
            (float(known.x[n]), float(known.y[n])),
            float(known.yaw[n]),
            "circle" if known.kind[n] == CIRCLE else "square",
        )
        for n in np.flatnonzero(known.used)
    )
