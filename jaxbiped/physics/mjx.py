"""MuJoCo XLA: the same batches in JAX, on a GPU, a TPU or a CPU, in single precision.

One function steps a block of up to `block` steps, and is compiled once per (model, batch size): tables of any length,
any `record_every` and `hold`, and living batches all run through it. It is compiled again only if a field that the
option `fields` did not name differs by simulation for the first time. JAX keeps compiled programs between processes
in the folder that the environment variable JAX_COMPILATION_CACHE_DIR names: a second process then only waits for the
tracing (3.9 s instead of 16.5 s, measured on a hopper).
"""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator, Mapping
from typing import Any, Literal

import jax
import jax.numpy as jnp
import numpy as np
import pydantic
from jaxtyping import Array, Float, Float64, Int
from mujoco.batch import Batch

from jaxbiped.errors import InputError
from jaxbiped.physics import inputs
from jaxbiped.physics.backend import WARNINGS, Rollout, State
from jaxbiped.physics.engine import Engine
from jaxbiped.physics.fields import Fields
from jaxbiped.physics.model import Watched, load
from jaxbiped.physics.options import Common

# Values that MuJoCo derives from a model's inertias and frames and MJX reads; and the fields that do not affect them.
DERIVED = ("body_subtreemass", "body_invweight0", "dof_invweight0", "tendon_invweight0", "actuator_acc0")
UNDERIVED = ("geom_", "pair_", "site_", "opt.")


class Options(Common):
    """Options of `physics.make("mjx", ...)`."""

    device: Literal["cpu", "gpu", "tpu"] | None = None
    """None: JAX's default."""
    impl: Literal["jax", "warp"] = "jax"
    """Implementation: MJX's own JAX, or MuJoCo Warp if the package warp-lang is installed."""
    block: pydantic.PositiveInt = 32
    """Most steps in one call to the device. The results do not depend on it."""
    contacts: pydantic.PositiveInt = 32
    """With impl="warp", room for this many contacts per simulation, on average over the batch."""


class Mjx:
    """See `Backend`. Results depend on the device and, in the last bits, on the batch size."""

    name = "mjx"

    def __init__(self, model: Any, batch_size: int, options: Options):
        self.batch_size = inputs.size("batch_size", batch_size, most=inputs.MOST_SIMULATIONS)
        self.model = load(model, free_joint=options.free_joint, watch=options.watch, work=options.work)
        self.watched = Watched.of(self.model, options.watch, options.work)
        self.watches = self.watched.names
        self.options = options
        self.engine = Engine(self.model, self.batch_size, options.impl, options.device, options.contacts)
        self.names: tuple[str, ...] = ()  # fields that differ by simulation in the compiled function
        self.add_names(options.fields)
        # The fields of the living batch, and of rollouts, which leave it unchanged.
        self.living: Fields | None = None
        self.scratch: Fields | None = None
        self.overrides: dict[str, Array] | None = None  # of the living batch; None: to be made
        self.traces = 0  # of the one function that is expensive to compile
        self.block = jax.jit(self.traced_block)
        self.start = jax.jit(self.traced_start)
        self.keep = jax.jit(self.traced_keep)
        with jax.default_device(self.engine.device):
            data = jax.jit(jax.vmap(self.engine.at))(np.tile(self.model.qpos0, (self.batch_size, 1)))
            # Bound to the device, like all outputs of a block: otherwise XLA would compile the block again.
            self.data = jax.device_put(data, self.engine.device)
            self.warned = self.unwarned()
        self.steps = np.zeros(self.batch_size, np.int64)  # since each reset

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
        self.add_names(values)
        if self.names:
            self.scratch = self.scratch or Fields(Batch(self.model, self.batch_size))
            self.scratch.only(values)
        data = self.start(np.ones(self.batch_size, bool), self.data, *start)
        count = table.shape[1] * hold // every
        nq, nqv, width = self.model.nq, self.model.nq + self.model.nv, self.row_width()
        records = np.empty((self.batch_size, count, width), self.data.qpos.dtype)
        warned, depth, work = self.unwarned(), self.untouched(), self.no_work()
        overrides, waiting = self.overridden(self.scratch), None
        for begin, steps, block in self.blocks(table, hold):
            data, warned, depth, work, rows = self.block(
                self.engine.model, overrides, data, warned, depth, work, block, np.int32(steps)
            )
            # The device runs this block while the records of the previous one are copied.
            self.collect(records, every, waiting)
            waiting = begin, steps, rows
        self.collect(records, every, waiting)
        warned, depth = np.asarray(warned), np.asarray(depth)
        return Rollout(
            time=np.arange(1, count + 1) * (every * self.model.opt.timestep),
            qpos=records[..., :nq],
            qvel=records[..., nq:nqv],
            sensordata=records[..., nqv:],
            valid=~warned.any(axis=1),
            warnings=warned,
            touched=depth >= 0,
            depth=np.maximum(depth, 0.0),
            work=np.asarray(work),
        )

    def reset(self, mask: Any = None, qpos: Any = None, qvel: Any = None) -> State:
        """See `Backend.reset`."""
        chosen = inputs.chosen(mask, self.batch_size)
        start = inputs.state(qpos, qvel, self.batch_size, self.model, chosen)
        self.data = self.start(chosen, self.data, *start)
        self.warned = jnp.where(chosen[:, None], 0, self.warned)
        self.steps = np.where(chosen, 0, self.steps)
        return self.state(self.untouched(), self.no_work())

    def set_fields(self, fields: Mapping[str, Any], mask: Any = None) -> None:
        """See `Backend.set_fields`."""
        chosen = inputs.chosen(mask, self.batch_size)
        values = inputs.fields(fields, self.batch_size, self.model, chosen)
        self.add_names(values)
        self.living = self.living or Fields(Batch(self.model, self.batch_size))
        self.living.write(values, np.flatnonzero(chosen))
        self.overrides = None

    def advance(self, controls: Any, hold: int = 1, mask: Any = None) -> State:
        """See `Backend.advance`."""
        table = inputs.controls(controls, self.batch_size, self.model)
        steps, hold = inputs.every(table.shape[1], None, hold)
        chosen = inputs.chosen(mask, self.batch_size)
        depth, work, data, warned = self.untouched(), self.no_work(), self.data, self.warned
        if self.overrides is None:
            self.overrides = self.overridden(self.living)
        for _, count, block in self.blocks(table, hold):
            self.data, self.warned, depth, work, _ = self.block(
                self.engine.model, self.overrides, self.data, self.warned, depth, work, block, np.int32(count)
            )
        if not chosen.all():
            others = (self.warned, warned), (depth, self.untouched()), (work, self.no_work())
            self.data, self.warned, depth, work = self.keep(chosen, self.data, data, *others)
        self.steps = self.steps + steps * chosen
        return self.state(depth, work)

    def compile(self) -> float:
        """See `Backend.compile`."""
        begin = time.perf_counter()
        block = np.zeros((self.options.block, self.batch_size, self.model.nu), np.float32)
        told = self.warned, self.untouched(), self.no_work()
        out = self.block(self.engine.model, self.overridden(self.living), self.data, *told, block, np.int32(0))
        jax.block_until_ready(out)
        return time.perf_counter() - begin

    def add_names(self, names: Iterable[str]) -> None:
        """Let these fields differ by simulation; those derived from them do too."""
        for name in names:
            inputs.field_name(self.model, name)
            if not isinstance(self.engine.field(name), jax.Array):
                raise InputError("is the same in all simulations of an mjx batch", field=f"fields.{name}")
        wanted = set(names) - set(self.names)
        if not wanted:
            return
        if any(not name.startswith(UNDERIVED) for name in wanted):
            wanted |= {name for name in DERIVED if isinstance(self.engine.field(name), jax.Array)}
        self.names = tuple(sorted(wanted | set(self.names)))
        self.overrides = None

    def overridden(self, fields: Fields | None) -> dict[str, Array]:
        """The fields that differ by simulation, on the device."""
        if not self.names:
            return {}
        source = fields or Fields(Batch(self.model, self.batch_size))
        out = {}
        for name in self.names:
            like = self.engine.field(name)
            rows = source.rows(name).astype(like.dtype).reshape(self.batch_size, *like.shape)
            out[name] = jax.device_put(rows, self.engine.device)
        return out

    def blocks(
        self, table: Float64[np.ndarray, "B T nu"], hold: int
    ) -> Iterator[tuple[int, int, Float[np.ndarray, "L B nu"]]]:
        """A table in blocks of equal length: first step, number of steps, controls padded with zeros."""
        length, steps = self.options.block, table.shape[1] * hold
        for begin in range(0, steps, length):
            count = min(length, steps - begin)
            block = np.zeros((length, self.batch_size, self.model.nu), np.float32)
            block[:count] = np.swapaxes(table[:, np.arange(begin, begin + count) // hold], 0, 1)
            yield begin, count, block

    @staticmethod
    def collect(
        records: Float[np.ndarray, "B R row"], every: int, block: tuple[int, int, Float[Array, "L B row"]] | None
    ) -> None:
        """Copy the values to record from a block of steps, if there is one."""
        if block is None:
            return
        begin, count, rows = block
        keep = np.arange(-(begin + 1) % every, count, every)
        if len(keep):
            records[:, (begin + 1 + keep) // every - 1] = np.swapaxes(np.asarray(rows)[keep], 0, 1)

    def traced_block(
        self,
        model: Any,
        overrides: dict[str, Array],
        data: Any,
        warned: Int[Array, "B 8"],
        depth: Float[Array, "B W"],
        work: Float[Array, "B nw"],
        controls: Float[Array, "L B nu"],
        steps: Int[Array, ""],
    ) -> tuple[Any, Int[Array, "B 8"], Float[Array, "B W"], Float[Array, "B nw"], Float[Array, "L B row"]]:
        """Step a batch `steps` times: its data, warnings, deepest contacts, work, and a record of each step."""
        self.traces += 1

        def one(own: dict[str, Array], data: Any, control: Float[Array, "nu"]) -> tuple[Any, ...]:
            data, sensed = self.engine.step(model, own, data, control), self.watched
            row = jnp.concatenate([data.qpos, data.qvel, data.sensordata[: sensed.own]])
            seen = sensed.depths(data.sensordata, jnp), sensed.power(data.sensordata, jnp)
            return data, self.engine.flags(data), *seen, row

        def step(k: Array, carry: tuple) -> tuple:
            data, warned, depth, work, rows = carry
            valid = ~jnp.any(warned, axis=1)
            data, flags, touching, power, row = jax.vmap(one)(overrides, data, controls[k])
            warned = warned + flags * valid[:, None]  # its first warnings only, as in the C engine
            valid = ~jnp.any(warned, axis=1)[:, None]
            depth = jnp.where(valid, jnp.maximum(depth, touching), depth)
            work = work + jnp.where(valid, power * model.opt.timestep, jnp.nan)
            return data, warned, depth, work, rows.at[k].set(jnp.where(valid, row, jnp.nan))

        rows = jnp.zeros((controls.shape[0], self.batch_size, self.row_width()), data.qpos.dtype)
        return jax.lax.fori_loop(0, steps, step, (data, warned, depth, work, rows))

    def traced_start(self, mask: Array, data: Any, qpos: Float[Array, "B nq"], qvel: Float[Array, "B nv"]) -> Any:
        """The data of a batch, with the simulations of a mask at their initial states."""
        fresh = self.engine.initial() | {"qpos": qpos, "qvel": qvel}

        def choose(name: str, value: Array) -> Array:
            old = getattr(data, name)
            return jnp.where(mask.reshape(-1, *[1] * (old.ndim - 1)), jnp.asarray(value, old.dtype), old)

        return data.replace(**{name: choose(name, value) for name, value in fresh.items()})

    def traced_keep(self, mask: Array, new: Any, old: Any, *others: tuple[Array, Array]) -> tuple:
        """The data of a batch in which only the simulations of a mask have advanced; likewise arrays [B, ...]."""

        def choose(a: Array, b: Array) -> Array:
            return jnp.where(mask.reshape(-1, *[1] * (a.ndim - 1)), a, b)

        data = new.replace(**{name: choose(getattr(new, name), getattr(old, name)) for name in self.engine.initial()})
        return data, *(choose(a, b) for a, b in others)

    def state(self, depth: Float[Array, "B W"], work: Float[Array, "B nw"]) -> State:
        """A copy of the living batch."""
        warned, depth = np.asarray(self.warned), np.asarray(depth)
        valid = ~warned.any(axis=1)
        blank = np.where(valid, 0.0, np.nan)[:, None].astype(self.data.qpos.dtype)
        return State(
            time=self.steps * self.model.opt.timestep,
            qpos=np.asarray(self.data.qpos) + blank,
            qvel=np.asarray(self.data.qvel) + blank,
            sensordata=np.asarray(self.data.sensordata)[:, : self.watched.own] + blank,
            valid=valid,
            warnings=warned,
            touched=depth >= 0,
            depth=np.maximum(depth, 0.0),
            work=np.asarray(work) + blank,
        )

    def row_width(self) -> int:
        """Numbers in the record of a step."""
        return self.model.nq + self.model.nv + self.watched.own

    def unwarned(self) -> Int[Array, "B 8"]:
        """No warnings yet."""
        return jnp.zeros((self.batch_size, len(WARNINGS)), jnp.int32, device=self.engine.device)

    def no_work(self) -> Float[Array, "B nw"]:
        """None yet."""
        return jnp.zeros((self.batch_size, len(self.watched.forces)), self.data.qpos.dtype, device=self.engine.device)

    def untouched(self) -> Float[Array, "B W"]:
        """No contacts yet."""
        return jnp.full((self.batch_size, len(self.watches)), -np.inf, jnp.float32, device=self.engine.device)
