"""The driver of simulated bipeds: a batch walks, each robot in its own arena, and those that are done decide.

Each slot has a tape of servo targets and its own position on it. The batch is stepped in short slices; after each,
the slots whose tape has ended (or that fell, or hit something) sense from the true positions of their cameras, and
decide together. None waits for another. A slot whose mission has ended takes the next job. In `native` physics a
mission depends, bit for bit, neither on the number of slots, nor on its neighbours or its place in the queue.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Protocol, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, UInt32

from jaxbiped import physics
from jaxbiped.arenas.ground import refuse_terrain
from jaxbiped.biped.gait import TIMESTEP
from jaxbiped.biped.model import robot_spec
from jaxbiped.errors import InputError
from jaxbiped.executors.config import WalkConfig
from jaxbiped.executors.primitive_schedule import FURTHEST_CLIMB, Move, requests, targets
from jaxbiped.executors.world_state import BodyPose, WorldState
from jaxbiped.geometry.pose import Pose
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mapping import GridSpec
from jaxbiped.mission.batched_driver import Jobs, OnProgress, Result, ending, no_results, tally
from jaxbiped.mission.decision import DecisionTrace
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import SIMULATED, MissionConfig
from jaxbiped.mission.recorded_driver import Mission, Played, Recorder
from jaxbiped.mission.sensor_rig import SensorRig
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.simulated_step import (
    Plan,
    PlanEnd,
    choose_rows,
    decide_next,
    fresh,
    gather,
    judge,
    judge_and_decide,
    no_plan,
    scatter,
)
from jaxbiped.mission.stage import Stage
from jaxbiped.mission.state import AgentState, start
from jaxbiped.motion.grid_units import CELL
from jaxbiped.motion.primitives import Command, Primitive

SLICE = 32  # steps (0.16 s) between two checks of which robots are done
SETTLE = 0.3  # [s] standing time before a measurement
LEVEL = GridSpec().level_height  # [m]
HEADROOM = 1e-4  # [m] by which the simulated head may exceed the map's, due to rounding
ROWS = 8  # robots that decide in one call: the same program, whatever the number of slots


@runtime_checkable
class Observer(Protocol):
    """Informed of missions as they proceed; all pytrees have a leading axis of 1."""

    def decided(self, job: int, world: WorldState, command: Command, thought: DecisionTrace, /) -> None: ...

    def concluded(self, job: int, world: WorldState, agent: AgentState, /) -> None: ...

    def moved(self, job: int, qpos: Float[np.ndarray, "nq"], /) -> None: ...


@with_own_settings
def walk(
    setup: MissionSetup,
    jobs: Jobs,
    config: WalkConfig,
    on_progress: OnProgress = lambda tally: None,
    observer: Observer | None = None,
    rig: SensorRig | None = None,
) -> Result:
    """Process a queue of missions; the executor of the spec names the physics.

    Args:
      setup: arenas with the leading axis [A] and parameters with [P], which the jobs [N] combine.
      on_progress: called with the tally of the jobs.
      rig: the robots' sensor, if the spec's sensor is not in JAX.

    Returns:
      Results in the order of the jobs, on the host; padding stays RUNNING.

    Raises:
      InputError: a missing device, a biped that cannot play its primitives, or arenas with terrain.
    """
    refuse_terrain(setup.arena, f"executor {setup.spec.executor}")
    return Walkers(setup, jobs, config, observer, rig).work(on_progress)


@with_own_settings
def walk_logged(
    setup: MissionSetup,
    seed: UInt32[Array, ""],
    config: WalkConfig,
    on_decision: Callable[[Played], None] = lambda _: None,
    rig: SensorRig | None = None,
) -> Mission:
    """One mission of a simulated biped, with a log of everything, like `recorded_driver.run_logged`."""
    batch, world = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], (setup, start(setup, seed)[0]))
    zero = jnp.zeros(1, jnp.int32)
    recorder = Recorder(setup.params, setup.spec, on_decision, rig)
    jobs = Jobs(zero, zero, jnp.asarray(seed)[None], jnp.int32(1))
    walk(batch, jobs, config, observer=recorder, rig=rig)
    return recorder.mission(setup.arena, world)


def rehearse(config: MissionConfig) -> None:
    """Reject what cannot be simulated, before anything is written, printed or compiled at length.

    Raises:
      InputError: a missing device or package, a biped that cannot play its primitives, or one that is taller than the
        robot that the map is made for.
    """
    if config.executor not in SIMULATED:
        return
    walk, robot = config.walk, config.robot
    for stance, height in (("standing", walk.biped.head_standing), ("squatting", walk.biped.head_squatting)):
        if getattr(robot, stance) < height - HEADROOM:
            message = f"must be at least the height of the simulated biped, {height:.3f} m"
            raise InputError(message, field=f"robot.{stance}", value=getattr(robot, stance))
    for squat, primitive in ((False, Primitive.STRAIGHT_FORWARD), (True, Primitive.PASS_GATE)):
        for request in requests(Move(math.pi / 4, primitive, CELL, 0, squat), not squat, LEVEL, walk.pace):
            targets(request, walk.biped)
    for rise, primitive in ((1, Primitive.STEP_UP_BUMP), (-1, Primitive.STEP_DOWN_BUMP)):
        for request in requests(Move(0.0, primitive, FURTHEST_CLIMB, rise, False), False, LEVEL, walk.pace):
            targets(request, walk.biped)
    physics.make(config.executor, robot_spec(walk.biped), 1, **walk.options(config.executor))


class Walkers:
    """The slots, and the queue that they process."""

    def __init__(self, setup: MissionSetup, jobs: Jobs, config: WalkConfig, observer=None, rig=None):
        arenas, params, physics_name = setup.arena, setup.params, setup.spec.executor
        self.setup, self.jobs, self.config, self.observer, self.rig = setup, jobs, config, observer, rig
        self.arena_of, self.point_of = np.asarray(jobs.arena), np.asarray(jobs.point)
        self.count = int(jobs.count)
        self.step, self.rise = np.asarray(params.body.step), np.asarray(params.limits.rise)
        size = max(1, min(config.slots, self.count))
        options = config.options(physics_name) | {"work": any(metric.of_servos for metric in params.metrics)}
        self.stage = Stage(physics_name, size, jax.device_get(arenas.boxes), config.biped, **options)
        self.job, self.next_job = np.arange(size), size
        self.squat = np.zeros(size, bool)
        self.tapes = [self.stage.rest(False)] * size
        self.place, self.length = np.zeros((2, size), int)  # position on the tape; beyond its end the last row is held
        jobs_in_all = len(self.arena_of)
        self.goals = np.asarray(arenas.goal_xy)
        self.world, self.agent = fresh(setup, jobs, jnp.asarray(self.job))
        self.result = no_results(jobs_in_all, metrics=jax.tree.map(lambda leaf: leaf[0], self.world.metrics))
        self.result.code[:] = Code.RUNNING
        self.plan = no_plan(size)
        self.enter(np.ones(size, bool))

    def work(self, on_progress: OnProgress) -> Result:
        """Run until the queue is empty."""
        while np.any(self.job < self.count):
            stopped = self.stage.fell | self.stage.collided | ~self.stage.state.valid
            ready = np.flatnonzero((self.job < self.count) & (stopped | (self.place >= self.length)))
            for first in range(0, len(ready), ROWS):
                self.turn(ready[first : first + ROWS])
            if len(ready):
                on_progress(tally(self.result.code))
            else:
                self.play()
        return self.result

    def play(self) -> None:
        """Step all robots that have a job by one slice."""
        ahead = [
            tape[np.minimum(np.arange(place, place + SLICE), len(tape) - 1)]
            for tape, place in zip(self.tapes, self.place, strict=True)
        ]
        self.stage.play(np.stack(ahead), self.job < self.count)
        self.place += SLICE
        if self.observer:
            for s in np.flatnonzero(self.job < self.count):
                self.observer.moved(int(self.job[s]), np.asarray(self.stage.state.qpos[s]))

    def turn(self, ids: Int[np.ndarray, "n"]) -> None:
        """Judge some robots' actions; those whose missions continue sense and decide, others take the next jobs."""
        stands = self.stage.stands(ids, self.squat[ids])
        rows = np.resize(ids, ROWS)
        feet, body = (jnp.asarray(np.resize(v, (ROWS, v.shape[1])).T, jnp.float32) for v in (stands.feet, stands.body))
        body_pose = BodyPose(Pose(*body[:4]), body[4], body[5])
        world, agent, plan = gather((self.world, self.agent, self.plan), rows)
        setup = replace(
            self.setup,
            arena=gather(self.setup.arena, self.arena_of[self.job[rows]]),
            params=gather(self.setup.params, self.point_of[self.job[rows]]),
        )
        done = world, agent, plan, PlanEnd(Pose(*feet), self.stage.fell[rows], self.stage.collided[rows])
        if self.rig:
            world, moved, times = judge(*done, setup)
            seen = self.rig.see(world, moved, setup, body_pose, len(ids))
            agent, following, thought = decide_next(world, moved, times, body_pose, setup, seen)
        else:
            world, moved, agent, following, thought = judge_and_decide(*done, body_pose, setup)
        mine = np.where(np.arange(ROWS) < len(ids), rows, len(self.job))
        slots = self.world, self.agent, self.plan
        self.world, self.agent, self.plan = scatter(slots, mine, (world, agent, following))
        if self.observer:
            self.tell(ids, plan, world, moved, following, thought)
        world, command, verdict = jax.device_get((world, following.command, following.verdict))
        ended = np.zeros(len(self.job), bool)
        for k, s in enumerate(ids):
            if world.code[k] != Code.RUNNING:
                self.write(s, row(world, k))
                ended[s] = True
            else:
                self.take(s, row(command, k), int(verdict[k]), stands.feet[k])
        if ended.any():
            self.renew(ended)

    def take(self, s: int | np.integer, command: Command, verdict: int, feet: Float[np.ndarray, "4"]) -> None:
        """Set up a robot's next tape."""
        point = self.point_of[self.job[s]]
        step, rise = self.step[point], self.rise[point]
        move = Move(
            turn=float(command.turn),
            primitive=Primitive(int(command.primitive)),
            length=float(command.length),
            rise=int(command.rise),
            squat=bool(command.squat),
            left=float(command.left),
        )
        asked = requests(move, bool(self.squat[s]), float(rise), self.config.pace) if verdict == Code.RUNNING else ()
        self.lay(s, [targets(request, self.config.biped) for request in asked], move.squat)
        self.stage.expect(s, feet, float(max(move.rise, 0) * rise + step))

    def lay(self, s: int | np.integer, tables: Sequence[Float[np.ndarray, "_ 12"]], squat: bool) -> None:
        """Put a robot at the start of a tape, which ends after some standing time; an empty one ends at once."""
        self.squat[s] = squat
        self.tapes[s] = np.concatenate([*tables, self.stage.rest(squat)])
        self.place[s] = 0
        self.length[s] = len(self.tapes[s]) + round(SETTLE / TIMESTEP) if tables else 0

    def write(self, s: int | np.integer, world: WorldState) -> None:
        """Record how the mission of a slot ended."""
        job = self.job[s]
        worked = np.float32(self.stage.work[s])
        metrics = zip(self.setup.params.metrics, world.metrics, strict=True)
        world = replace(world, metrics=tuple(worked if metric.of_servos else state for metric, state in metrics))
        last = ending(world, self.goals[self.arena_of[job]])
        for column, value in zip(jax.tree.leaves(self.result), jax.tree.leaves(last), strict=True):
            column[job] = value

    def renew(self, ended: Bool[np.ndarray, "S"]) -> None:
        """Give the slots of a mask the next jobs, or none if there are no more."""
        self.job[ended] = self.next_job + np.arange(ended.sum())
        self.next_job += int(ended.sum())
        begun = fresh(self.setup, self.jobs, jnp.asarray(self.job))
        none = no_plan(len(ended))
        self.world, self.agent, self.plan = choose_rows(ended, (*begun, none), (self.world, self.agent, self.plan))
        self.enter(ended)

    def enter(self, mask: Bool[np.ndarray, "S"]) -> None:
        """Place the robots of a mask at the starts of their arenas."""
        pose = jax.device_get(self.world.pose)
        arena = self.arena_of[np.minimum(self.job, len(self.arena_of) - 1)]
        self.stage.enter(mask, arena, np.stack([pose.x, pose.y, pose.z, pose.yaw], axis=1).astype(float))
        for s in np.flatnonzero(mask):
            self.lay(s, [self.stage.rest(False)], False)

    def tell(
        self, ids, plan: Plan, world: WorldState, moved: AgentState, following: Plan, thought: DecisionTrace
    ) -> None:
        """Inform the observer."""
        for k, s in enumerate(ids):
            job = int(self.job[s])
            at = slice(k, k + 1)
            if plan.some[k]:
                self.observer.concluded(job, row(world, at), row(moved, at))
            if world.code[k] == Code.RUNNING:
                self.observer.decided(job, row(world, at), row(following.command, at), row(thought, at))


def row(tree, index):
    """Row(s) `index` of every leaf."""
    return jax.tree.map(lambda leaf: leaf[index], tree)
