"""MuJoCo's own batch on CPU threads: fast, and bit for bit the result of a loop over `mj_step`."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from typing import Any, Literal

import mujoco
import numpy as np
import pydantic
from jaxtyping import Bool, Float64, Int, Integer
from mujoco.batch import Batch, SimulationError

from jaxbiped.physics import inputs
from jaxbiped.physics.backend import LIMIT, WARNINGS, Rollout, State
from jaxbiped.physics.fields import Fields
from jaxbiped.physics.model import Watched, load
from jaxbiped.physics.options import Common

CHUNK = 2**22  # most numbers recorded for a chunk of steps: 32 MB
BROKEN = (WARNINGS.index("bad_qpos"), WARNINGS.index("bad_qvel"))
STATE = mujoco.mjtState.mjSTATE_TIME | mujoco.mjtState.mjSTATE_QPOS | mujoco.mjtState.mjSTATE_QVEL


class Options(Common):
    """Options of `physics.make("native", ...)`."""

    device: Literal["cpu"] | None = None
    threads: pydantic.NonNegativeInt = 0
    """Threads, including this one; 0: one per logical CPU. The results do not depend on it."""


class Native:
    """See `Backend`. Deterministic: neither the threads nor the other simulations of the batch change a bit."""

    name = "native"

    def __init__(self, model: Any, batch_size: int, options: Options):
        self.batch_size = inputs.size("batch_size", batch_size, most=inputs.MOST_SIMULATIONS)
        self.model = load(model, free_joint=options.free_joint, watch=options.watch, work=options.work)
        # A diverged simulation must stay so, and not restart from its default with status 0.
        self.model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
        for name in options.fields:
            inputs.field_name(self.model, name)
        self.watched = Watched.of(self.model, options.watch, options.work)
        self.watches = self.watched.names
        self.options = options
        self.living = Pool(self.model, self.batch_size, self.watched, options.threads)
        self.scratch: Pool | None = None  # rollouts have their own pool, so that the living one is not disturbed

    def rollout(
        self,
        controls: Any,
        qpos: Any = None,
        qvel: Any = None,
        fields: Mapping[str, Any] | None = None,
        record_every: int = 1,
        hold: int = 1,
    ) -> Rollout:
        """See `Backend.rollout`."""
        table = inputs.controls(controls, self.batch_size, self.model)
        start = inputs.state(qpos, qvel, self.batch_size, self.model)
        values = inputs.fields(fields, self.batch_size, self.model)
        every, hold = inputs.every(table.shape[1], record_every, hold)
        if self.scratch is None:
            self.scratch = Pool(self.model, self.batch_size, self.watched, self.options.threads)
        pool = self.scratch
        pool.fields.only(values)
        pool.reset(np.ones(self.batch_size, bool), *start)
        times, records, depth, work = pool.run(table, hold, every, np.ones(self.batch_size, bool))
        nq, ns = 1 + self.model.nq, 1 + self.model.nq + self.model.nv
        return Rollout(
            time=times,
            qpos=records[..., 1:nq],
            qvel=records[..., nq:ns],
            sensordata=records[..., ns:],
            valid=pool.valid,
            warnings=pool.warnings,
            touched=depth >= 0,
            depth=np.maximum(depth, 0.0),
            work=work,
        )

    def reset(self, mask: Any = None, qpos: Any = None, qvel: Any = None) -> State:
        """See `Backend.reset`."""
        chosen = inputs.chosen(mask, self.batch_size)
        self.living.reset(chosen, *inputs.state(qpos, qvel, self.batch_size, self.model, chosen))
        return self.living.state(np.full((self.batch_size, len(self.watches)), -np.inf), self.living.no_work())

    def set_fields(self, fields: Mapping[str, Any], mask: Any = None) -> None:
        """See `Backend.set_fields`."""
        chosen = inputs.chosen(mask, self.batch_size)
        values = inputs.fields(fields, self.batch_size, self.model, chosen)
        self.living.fields.write(values, np.flatnonzero(chosen))

    def advance(self, controls: Any, hold: int = 1, mask: Any = None) -> State:
        """See `Backend.advance`."""
        table = inputs.controls(controls, self.batch_size, self.model)
        steps, hold = inputs.every(table.shape[1], None, hold)
        _, _, depth, work = self.living.run(table, hold, steps, inputs.chosen(mask, self.batch_size))
        return self.living.state(depth, work)

    def compile(self) -> float:
        """See `Backend.compile`: nothing to do."""
        return 0.0


@contextlib.contextmanager
def unprinted_warnings() -> Iterator[None]:
    """Keep the engine from printing warnings and writing them to a file in the working directory: they are counted."""
    handler = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lambda text: None)
    try:
        yield
    finally:
        mujoco.set_mju_user_warning(handler)


class Pool:
    """A `mujoco.batch.Batch`, and which of its simulations are still valid."""

    def __init__(self, model: mujoco.MjModel, batch_size: int, watched: Watched, threads: int):
        self.model, self.watched = model, watched
        self.batch = Batch(model, batch_size, threads)
        self.fields = Fields(self.batch)
        # Bound before the first step: a field that is bound later reads zero until the next step.
        self.qpos, self.qvel, self.time = (self.batch.bind(name) for name in ("qpos", "qvel", "time"))
        self.sensordata = self.batch.bind("sensordata") if model.nsensordata else np.zeros((batch_size, 0))
        self.errors = np.zeros(batch_size, np.int32)
        self.bad = np.zeros((batch_size, len(WARNINGS)), np.int32)  # found by us, not by the engine

    @property
    def warnings(self) -> Int[np.ndarray, "B 8"]:
        """Counts since each simulation's reset."""
        return np.concatenate([self.batch.warning[..., 1], self.errors[:, None]], axis=1) + self.bad

    @property
    def valid(self) -> Bool[np.ndarray, "B"]:
        """No warning since its reset."""
        return ~self.warnings.any(axis=1)

    def reset(self, mask: Bool[np.ndarray, "B"], qpos: Float64[np.ndarray, "B nq"], qvel: Float64[np.ndarray, "B nv"]):
        """Set the state of some simulations, with no warnings."""
        ids = np.flatnonzero(mask)
        if len(ids):
            self.batch.reset(ids, stage=mujoco.mjtStage.mjSTAGE_NONE)
        self.qpos[mask], self.qvel[mask] = qpos[mask], qvel[mask]
        self.batch.warning[mask] = 0
        self.errors[mask], self.bad[mask] = 0, 0

    def run(
        self, controls: Float64[np.ndarray, "B T nu"], hold: int, every: int, mask: Bool[np.ndarray, "B"]
    ) -> tuple[
        Float64[np.ndarray, "R"],
        Float64[np.ndarray, "B R row"],
        Float64[np.ndarray, "B W"],
        Float64[np.ndarray, "B nw"],
    ]:
        """Play a table in the simulations of a mask.

        Returns:
          Record times, records (time, qpos, qvel, own sensors), deepest contacts of the watches, and work.
        """
        model, count, steps = self.model, len(controls), controls.shape[1] * hold
        width = 1 + model.nq + model.nv
        out = np.full((count, steps // every, width + self.watched.own), np.nan)
        depth, work = np.full((count, len(self.watched.names)), -np.inf), self.no_work()
        chunk = max(1, CHUNK // (count * (width + model.nsensordata)))
        for begin in range(0, steps, chunk):
            end = min(begin + chunk, steps)
            ids = np.flatnonzero(self.valid & mask)
            if not len(ids):
                break
            table = controls if len(ids) == count else controls[ids]
            table = table[:, begin:end] if hold == 1 else table[:, np.arange(begin, end) // hold]
            states, sensors, good = self.chunk(ids, table)
            keep = slice(-(begin + 1) % every, None, every)
            rows = np.concatenate([states[:, keep], sensors[:, keep, : self.watched.own]], axis=2)
            out[ids, begin // every : end // every] = np.where(good[:, keep, None], rows, np.nan)
            if depth.shape[1]:
                touching = np.where(good[..., None], self.watched.depths(sensors, np), -np.inf)
                depth[ids] = np.maximum(depth[ids], touching.max(axis=1))
            if work.shape[1]:
                power = np.where(good[..., None], self.watched.power(sensors, np), np.nan)
                work[ids] += power.sum(axis=1) * model.opt.timestep
        return np.arange(1, steps // every + 1) * (every * model.opt.timestep), out, depth, work

    def no_work(self) -> Float64[np.ndarray, "B nw"]:
        """No work yet."""
        return np.zeros((len(self.qpos), len(self.watched.forces)))

    def chunk(
        self, ids: Integer[np.ndarray, "n"], controls: Float64[np.ndarray, "n S nu"]
    ) -> tuple[Float64[np.ndarray, "n S w"], Float64[np.ndarray, "n S ns"], Bool[np.ndarray, "n S"]]:
        """Step some simulations; return their states, sensors, and which of those records are valid."""
        n, steps = controls.shape[:2]
        states = np.empty((n, steps, 1 + self.model.nq + self.model.nv))
        sensors = np.empty((n, steps, self.model.nsensordata))
        out = {int(STATE): states} | ({"sensordata": sensors} if sensors.size else {})
        before = self.time[ids]
        try:
            with unprinted_warnings():
                self.batch.rollout(steps, controls, record=list(out), ids=ids.astype(np.int32), out=out)
        except SimulationError as error:
            self.errors[error.ids] += 1
        good = np.ones((n, steps), bool)
        warned = ~self.valid[ids]
        for row in np.flatnonzero(warned):
            good[row, self.good_steps(states[row], before[row], bool(self.errors[ids[row]])) :] = False
        # The engine detects a failure in the last step only at the next step, which may not come.
        split = self.model.nq
        last = np.abs(states[:, -1, 1:]) < LIMIT
        broke = ~np.stack([last[:, :split].all(axis=1), last[:, split:].all(axis=1)], axis=1) & ~warned[:, None]
        self.bad[ids[:, None], BROKEN] += broke
        good[:, -1] &= ~broke.any(axis=1)
        return states, sensors, good

    @staticmethod
    def good_steps(states: Float64[np.ndarray, "S w"], before: float | np.floating, error: bool) -> int:
        """Number of good steps of a simulation with a warning.

        The engine stops at the first warning and repeats its last record; the step of the warning is bad too. An error
        resets the state to the beginning of the call, and its records cannot be told apart.
        """
        if error:
            return 0
        times = np.concatenate([[before], states[:, 0]])
        stopped = np.flatnonzero(~(np.diff(times) > 0))
        went = stopped[0] if len(stopped) else len(states)
        broken = np.flatnonzero(~(np.abs(states) < LIMIT).all(axis=1))
        return int(min([max(went - 1, 0), *broken[:1]]))

    def state(self, depth: Float64[np.ndarray, "B W"], work: Float64[np.ndarray, "B nw"]) -> State:
        """A copy of the current state."""
        valid = self.valid
        blank = np.where(valid, 0.0, np.nan)[:, None]
        return State(
            time=self.time.copy(),
            qpos=self.qpos + blank,
            qvel=self.qvel + blank,
            sensordata=self.sensordata[:, : self.watched.own] + blank,
            valid=valid,
            warnings=self.warnings,
            touched=depth >= 0,
            depth=np.maximum(depth, 0.0),
            work=work + blank,
        )
