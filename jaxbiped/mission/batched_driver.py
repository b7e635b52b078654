"""The compiled driver: a queue of missions processed by a fixed number of slots.

Missions differ in length by a factor of ten, and a batch that waits for its longest member idles most of its slots. So
a slot whose mission has ended takes the next job at once, inside the compiled loop. What a slot computes does not
depend on its neighbours, so a mission's result depends neither on the number of slots nor on its place in the queue.
With several devices, each processes its own list of jobs.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax.sharding import Mesh
from jaxtyping import Array, Float, Int, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.core.ready_programs import ready
from jaxbiped.devices import ALL, EACH, on_each, placed
from jaxbiped.executors.world_state import Planned, WorldState
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mission.mission_step import step
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import AgentState, start

SLOTS = 64  # missions at once: the maps of this many arenas fit in the cache of one core
TURNS = 32  # decisions between two checks of the queue by the host


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Jobs:
    """`N` missions to run: their arenas, parameters and noise."""

    arena: Int[Array, "N"]  # index into the arenas
    point: Int[Array, "N"]  # index into the parameters
    seed: UInt32[Array, "N"]
    count: Int[Array, ""]  # jobs from here on are padding


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Result:
    """How each mission ended."""

    code: Int[Array, "N"]  # Code; RUNNING if it has not ended
    distance: Float[Array, "N"]  # [m] walked
    time: Float[Array, "N"]  # [s]
    measurements: Int[Array, "N"]
    decisions: Int[Array, "N"]
    goal_distance: Float[Array, "N"]  # [m] distance from the goal at the end
    pose_error: Float[Array, "N"]  # [m] distance from the believed position at the end
    yaw_error: Float[Array, "N"]  # [rad] the same for yaw
    planned: Planned
    metrics: tuple = ()  # state of each metric at the end


def ending(world: WorldState, goal_xy: Float[Array | np.ndarray, "*N 2"]) -> Result:
    """The results of missions with these worlds, in arenas with these goals."""
    away = jnp.hypot(goal_xy[..., 0] - world.pose.x, goal_xy[..., 1] - world.pose.y)
    done = world.code, world.distance, world.time, world.measurements, world.decisions
    return Result(*done, away, world.pose_error, world.yaw_error, world.planned, world.metrics)


def no_results(*shape: int, metrics: tuple = ()) -> Result:
    """Zeros, on the host.

    Args:
      metrics: arrays, or their shapes and types, of the states of one mission's metrics.
    """
    kinds = int, float, float, int, int, float, float, float
    planned = Planned(*(np.zeros(shape, kind) for kind in (float, int, float)))
    remembered = jax.tree.map(lambda leaf: np.zeros((*shape, *leaf.shape), leaf.dtype), metrics)
    return Result(*(np.zeros(shape, kind) for kind in kinds), planned, remembered)


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Queue:
    """The state between two segments of the loop."""

    world: WorldState  # [S]
    agent: AgentState  # [S]
    job: Int[Array, "S"]  # job of the slot; count or more: idle
    next_job: Int[Array, ""]
    result: Result


@dataclass(frozen=True)
class Tally:
    """Progress of a queue."""

    ended: int  # missions
    reached: int  # of these, reached

    def __add__(self, other: Tally) -> Tally:
        return Tally(self.ended + other.ended, self.reached + other.reached)


def tally(code: Int[np.ndarray, "N"]) -> Tally:
    """The tally of a queue's codes so far."""
    return Tally(int(np.sum(code != Code.RUNNING)), int(np.sum(code == Code.REACHED)))


OnProgress = Callable[[Tally], None]
Work = Callable[[MissionSetup, Jobs, OnProgress], Result]


@with_own_settings
def compile_queue(setup: MissionSetup, jobs: Jobs, slots: int = SLOTS, mesh: Mesh | None = None) -> Work:
    """Compile the driver for arguments of these shapes.

    Args:
      setup: arenas with the leading axis [A] and parameters with [P], which the jobs [N] combine. One compilation for
        each (spec, slots, A, P, N), shared by later calls.
      slots: static; slots per device.
      mesh: static; devices, each with its own list of jobs, `fill` and `segment`: leaves of jobs, including count, and
        of results then have another leading axis [D].

    Returns:
      A function of (setup, jobs, on_progress) that processes the queue and returns results in the order of the
      jobs; padding stays RUNNING. Several threads may call it at once. `on_progress` is called on the host with the
      tally of the jobs, every `TURNS` decisions.
    """
    signature = (slots, mesh, jax.tree.structure((setup, jobs)), *shapes((setup, jobs)))
    if signature not in COMPILED:
        begun, turned = partial(fill, slots=slots), segment
        if mesh is None:
            begun, turned = jax.jit(begun), jax.jit(turned, donate_argnums=0)
        else:
            begun = on_each(on_row(begun, 1), mesh, (ALL, EACH))
            turned = on_each(on_row(turned, 0, 2), mesh, (EACH, ALL, EACH), donate_argnums=0)
        queue = jax.eval_shape(begun, setup, jobs)
        given, going = (setup, jobs), (queue, setup, jobs)
        if mesh is None:
            static = slots, TURNS
            COMPILED[signature] = (
                ready("queue.fill", given, static, lambda: begun.lower(*given)),
                ready("queue.segment", going, static, lambda: turned.lower(*going), wide),
            )
        else:
            COMPILED[signature] = begun.lower(*given).compile(), wide(turned.lower(*going))
    first, further = COMPILED[signature]

    @with_own_settings
    def work(setup: MissionSetup, jobs: Jobs, on_progress: OnProgress) -> Result:
        if mesh is not None:
            setup, jobs = placed(setup, mesh, ALL), placed(jobs, mesh, EACH)
        count = np.asarray(jobs.count)[..., None]
        queue = first(setup, jobs)
        while True:
            queue = further(queue, setup, jobs)
            code, job = jax.device_get((queue.result.code, queue.job))
            on_progress(tally(code))
            if np.all(job >= count):
                return queue.result

    return work


COMPILED: dict = {}


def on_row(function: Callable, *which: int) -> Callable:
    """`function` with a leading axis of size 1 on some arguments, and then on the result."""

    def call(*arguments):
        arguments = [
            jax.tree.map(lambda leaf: leaf[0], argument) if k in which else argument
            for k, argument in enumerate(arguments)
        ]
        return jax.tree.map(lambda leaf: leaf[None], function(*arguments))

    return call


def wide(lowered: jax.stages.Lowered) -> jax.stages.Compiled:
    """Compile with 512-bit vectors where a CPU has them; the default of half that is a few per cent slower."""
    try:
        return lowered.compile(compiler_options={"xla_cpu_prefer_vector_width": 512})
    except jax.errors.JaxRuntimeError:  # a compiler without this option
        return lowered.compile()


def shapes(tree) -> list:
    """Shape and type of each leaf."""
    return [(leaf.shape, str(leaf.dtype)) for leaf in jax.tree.leaves(tree)]


def fill(setup: MissionSetup, jobs: Jobs, slots: int) -> Queue:
    """The queue with its first jobs in the slots."""
    job = jnp.arange(slots, dtype=jnp.int32)
    world, agent = begin(setup, jobs, job)
    zero, none = jnp.zeros(jobs.arena.shape), jnp.zeros(jobs.arena.shape, jnp.int32)
    planned = Planned(zero, none, zero)
    metrics = jax.tree.map(lambda leaf: jnp.zeros((*zero.shape, *leaf.shape[1:]), leaf.dtype), world.metrics)
    result = Result(none + Code.RUNNING, zero, zero, none, none, zero, zero, zero, planned, metrics)
    return Queue(world, agent, job, jnp.int32(slots), result)


def segment(queue: Queue, setup: MissionSetup, jobs: Jobs) -> Queue:
    """Run up to `TURNS` decisions of every slot."""

    def unfinished(carry: tuple[Array, Queue]):
        turns, queue = carry
        return (turns < TURNS) & jnp.any(queue.job < jobs.count)

    def turn(carry: tuple[Array, Queue]):
        turns, queue = carry
        mine = setup_of(setup, jobs, queue.job)
        world, agent, *_ = step(queue.world, queue.agent, mine)
        return turns + 1, advance(Queue(world, agent, queue.job, queue.next_job, queue.result), mine.arena)

    def advance(queue: Queue, arena: Arena) -> Queue:
        """Record the missions that have ended, and give their slots the next jobs."""
        world = queue.world
        ended = (queue.job < jobs.count) & (world.code != Code.RUNNING)
        last = ending(world, arena.goal_xy)
        row = jnp.where(ended, queue.job, jobs.arena.shape[0])
        result = jax.tree.map(lambda all, new: all.at[row].set(new, mode="drop"), queue.result, last)
        job = jnp.where(ended, queue.next_job + jnp.cumsum(ended) - 1, queue.job).astype(jnp.int32)
        fresh_world, fresh_agent = begin(setup, jobs, job)

        def renew(new, old):
            return jnp.where(ended.reshape(-1, *[1] * (new.ndim - 1)), new, old)

        world = jax.tree.map(renew, fresh_world, world)
        # The map is left as it is: a fresh agent does not read it, and clearing it here would cost a pass over it.
        grid_map = queue.agent.grid_map
        agent = jax.tree.map(renew, replace(fresh_agent, grid_map=None), replace(queue.agent, grid_map=None))
        agent = replace(agent, grid_map=grid_map)
        return Queue(world, agent, job, queue.next_job + jnp.sum(ended, dtype=jnp.int32), result)

    return jax.lax.while_loop(unfinished, turn, (jnp.int32(0), queue))[1]


def setup_of(setup: MissionSetup, jobs: Jobs, job: Int[Array, "S"]) -> MissionSetup:
    """The setups of some jobs; beyond the last one, that of the last."""
    at = jnp.minimum(job, jobs.arena.shape[0] - 1)
    return replace(setup, arena=pick(setup.arena, jobs.arena[at]), params=pick(setup.params, jobs.point[at]))


def begin(setup: MissionSetup, jobs: Jobs, job: Int[Array, "S"]) -> tuple[WorldState, AgentState]:
    """Fresh missions for the jobs of all slots; a slot without a job gets one that has ended."""
    at = jnp.minimum(job, jobs.arena.shape[0] - 1)
    world, agent = jax.vmap(start)(setup_of(setup, jobs, job), jobs.seed[at])
    return replace(world, code=jnp.where(job < jobs.count, world.code, Code.REACHED)), agent


def pick(tree, index: Int[Array, "S"]):
    """Rows `index` of every leaf."""
    return jax.tree.map(lambda leaf: leaf[index], tree)


def stack(trees: list):
    """Stack pytrees of the same kind into one, with a new leading axis."""
    return jax.tree.map(lambda *leaves: np.stack([np.asarray(leaf) for leaf in leaves]), *trees)
