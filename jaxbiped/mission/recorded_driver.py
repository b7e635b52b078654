"""The driver on the host: one mission, one decision at a time, with a log of everything."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Float, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.core.ready_programs import ready_jit
from jaxbiped.executors.world_state import WorldState
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mission.decision import DecisionTrace
from jaxbiped.mission.log import MissionLog, Picture
from jaxbiped.mission.mission_step import step
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionParams, MissionSpec
from jaxbiped.mission.sensor_rig import SensorRig
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.snapshots import agent_pose, ground, marks, moment, nothing, outlines, pose_of, walk_of
from jaxbiped.mission.state import AgentState, start
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
    played: tuple[Played, ...] = field(repr=False)
    log: MissionLog = field(repr=False)


turn_once = ready_jit(step)


@ready_jit
def begin_once(setup: MissionSetup, seed: UInt32[Array, ""]):
    """The setup with a leading axis of 1, and world and agent before the first measurement."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], (setup, start(setup, seed)))


@with_own_settings
def run_logged(
    setup: MissionSetup,
    seed: UInt32[Array, ""],
    on_decision: Callable[[Played], None] = lambda _: None,
    rig: SensorRig | None = None,
) -> Mission:
    """Run one mission (no batch axis) like the compiled driver, and keep what the robot saw and thought.

    Args:
      rig: its sensor, if the spec's sensor is not in JAX.
    """
    recorder = Recorder(setup.params, setup.spec, on_decision, rig)
    return recorder.mission(setup.arena, run_bare(setup, seed, rig, recorder))


@with_own_settings
def run_bare(
    setup: MissionSetup,
    seed: UInt32[Array, ""],
    rig: SensorRig | None = None,
    recorder: Recorder | None = None,
) -> WorldState:
    """The end of one mission (no batch axis); its world has a leading axis of 1."""
    batch, (world, agent) = begin_once(setup, seed)
    while np.asarray(world.code)[0] == Code.RUNNING:
        before = world
        seen = rig.see(world, agent, batch) if rig else None
        world, agent, _, command, thought = turn_once(world, agent, batch, seen)
        if recorder:
            recorder.decided(0, before, command, thought)
            recorder.concluded(0, world, agent)
    return world


class Recorder:
    """Records what one mission saw and thought; worlds, agents and so on have a leading axis of 1."""

    def __init__(
        self,
        params: MissionParams,
        spec: MissionSpec,
        on_decision: Callable[[Played], None],
        rig: SensorRig | None = None,
    ):
        self.params, self.spec, self.on_decision, self.rig = params, spec, on_decision, rig
        self.moments: list[dict] = []
        self.pictures: list[Picture] = []
        self.played: list[Played] = []
        self.walked: list[list[np.ndarray]] = []  # states of a simulated biped, after each decision
        self.action = "Start"
        self.end: WorldState | None = None

    def decided(self, _: int, world: WorldState, command: Command, thought: DecisionTrace) -> None:
        """Record one decision, before it is executed."""
        self.moments.append(moment(world, thought, self.params, self.spec, self.action))
        if shot := self.rig and self.rig.picture():
            self.pictures.append(Picture(shot.left, shot.disparity))
        self.command = command
        self.walked.append([])

    def moved(self, _: int, qpos: Float[np.ndarray, "nq"]) -> None:
        """Record an intermediate state of a simulated biped."""
        if self.walked:
            self.walked[-1].append(qpos.astype(np.float32))

    def concluded(self, _: int, world: WorldState, agent: AgentState) -> None:
        """Record the outcome."""
        command, world = jax.device_get((self.command, world))
        record = Played(
            name=NAMES[Primitive(int(command.primitive[0]))],
            turn=float(command.turn[0]),
            length=float(command.length[0]),
            time=float(world.time[0]),
        )
        self.played.append(record)
        self.on_decision(record)
        self.action = record.name if record.length or not record.turn else "Turn-direction"
        self.end, self.agent = world, agent

    def mission(self, arena: Arena, world: WorldState) -> Mission:
        """The complete mission.

        Args:
          world: the initial world, for a mission that had already ended.
        """
        moments, world = list(self.moments), self.end or world
        if moments:
            last = dict(moments[-1])
            here, time = pose_of(world), float(world.time[0])
            last |= {"true_xyyaw": here, "estimated_xyyaw": agent_pose(self.agent), "time": time, "action": self.action}
            last |= {"z": float(world.pose.z[0]), "squat": bool(world.squat[0]), "plan": np.zeros((0, 2))}
            moments.append(last)
        else:
            moments.append(nothing(world, self.spec))
        code = Code(int(world.code[0]))
        log = MissionLog(
            classes=np.stack([m["classes"] for m in moments]),
            levels=np.stack([m["levels"] for m in moments]),
            true_xyyaw=np.stack([m["true_xyyaw"] for m in moments]),
            estimated_xyyaw=np.stack([m["estimated_xyyaw"] for m in moments]),
            plan=tuple(m["plan"] for m in moments),
            time=np.array([m["time"] for m in moments]),
            action=tuple(m["action"] for m in moments),
            pitch=self.spec.grid.pitch,
            origin_xy=np.zeros(2),
            size_xy=np.asarray(arena.size_xy, float),
            goal_xy=np.asarray(arena.goal_xy, float),
            outlines=outlines(arena),
            landmarks=marks(arena),
            terrain=ground(arena),
            pictures=(*self.pictures, *self.pictures[-1:]),
            outcome=code.label,
            true_z=np.array([m["z"] for m in moments]),
            squat=np.array([m["squat"] for m in moments]),
            seen=np.array([m["seen"] for m in moments]),
            points=tuple(m["points"] for m in moments),
            voxels=np.stack([m["voxels"] for m in moments]),
            level_height=self.spec.grid.level_height,
            walk=walk_of(self.walked),
        )
        played = tuple(self.played)
        return Mission(code, float(world.distance[0]), float(world.time[0]), int(world.measurements[0]), played, log)
