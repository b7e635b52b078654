"""Stepping speed: each backend's rollout against the bare engine below it, on the same model and batch, in one run.

    python -m sweeps.benchmarks.physics [--batch 64] [--steps 400] [--boxes 0 4] [--backends native mjx] [--device gpu]

The bare engines are `mujoco.batch.Batch.rollout`, recording qpos and qvel of every step, and a jitted scan over the
vmapped `mjx.step` that returns them. Both sides play the same tables on bipeds of which each has boxes of its own.
Runs of the two sides alternate, and the best of each counts. `overhead` is how much longer the backend takes than the
bare engine (wanted: at most 10 %); in brackets the same of the processors' time, which other programs disturb less.

Measured on 2 cores of x86_64 without a GPU, mujoco 4.0.0, mujoco-mjx 3.17.0, jax 0.10.2, Newton 10/20 iterations,
impratio 10, batch 64, with little other load:

    native   0 boxes   3.8 contacts        111,300 steps/s, bare 113,000: +1.5 % (+1.9 %)
    native   4 boxes   3.8 contacts        111,600 steps/s, bare 113,200: +1.4 % (+1.0 %)
    mjx      0 boxes   8 contact slots       5,760 steps/s, bare   6,060: +5.1 % (+6.4 %)
    mjx      4 boxes   17 contact slots      3,530 steps/s, bare   3,490: -1.2 % (-2.5 %)

mjx compiled in 12 to 17 s, bare in 12 to 16. A run beside other load said +13 % of native with 4 boxes, and a minute
later it was gone. Nothing was measured on a GPU.
"""

from __future__ import annotations

import argparse
import os
import platform
import time
from importlib.metadata import version

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
from mujoco.batch import Batch

from jaxbiped import physics
from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.gait import home_table
from jaxbiped.biped.model import add_terrain, home_qpos, robot_spec

RECORD = mujoco.mjtState.mjSTATE_QPOS | mujoco.mjtState.mjSTATE_QVEL
TREMBLE = 0.02  # [rad] of every joint target, so that contacts come and go


def scene(boxes: int, batch: int, steps: int, slots: int):
    """(spec, controls [B, T, nu], qpos [B, nq], fields): trembling bipeds, each among its own boxes."""
    robot = RobotModelConfig()
    spec = add_terrain(robot_spec(robot), boxes)
    if boxes and slots:
        spec.add_numeric(name="max_contact_points", data=[slots])
    model, home, rng = spec.compile(), home_table(robot, False), np.random.default_rng(0)
    targets = np.repeat(rng.uniform(-TREMBLE, TREMBLE, (batch, -(-steps // 20), model.nu)), 20, axis=1)[:, :steps]
    qpos = np.tile(home_qpos(model, home.pelvis[-1], home.q[-1]), (batch, 1))
    fields = {name: np.tile(getattr(model, name), (batch, 1, 1)) for name in ("geom_pos", "geom_size")} if boxes else {}
    for k in range(boxes):
        geom = model.geom(f"box_{k}").id
        fields["geom_size"][:, geom] = 0.1, 0.3, 0.05
        fields["geom_pos"][:, geom] = 0.18 + 0.2 * k, 0, -0.02
        fields["geom_pos"][:, geom, 0] += rng.uniform(0, 0.02, batch)
    return spec, home.ctrl[-1] + targets, qpos, fields


def bare_native(model: mujoco.MjModel, controls, qpos, fields):
    """(seconds to compile, contacts a simulation at the end, function that steps all)."""
    batch = Batch(model, len(controls))
    for name, value in fields.items():
        batch.expand(name)[:] = value
    if fields:
        batch.set_const()
    contacts = batch.bind("ncon")
    controls = np.ascontiguousarray(controls)

    def run():
        batch.reset(stage=mujoco.mjtStage.mjSTAGE_NONE)
        batch.bind("qpos")[:] = qpos
        return batch.rollout(controls.shape[1], controls, record=(int(RECORD),))

    run()
    return 0.0, float(contacts.mean()), run


def bare_mjx(engine, controls, qpos, fields):
    """The same in JAX, on the model as our engine puts it: what is compared is how it is stepped.

    MJX ignores margins, which that model has as size; without them feet lose and find contacts, which is other work.
    """
    from mujoco import mjx

    put, empty, device = engine.model, engine.empty, engine.device
    if "geom_size" in fields:
        fields = fields | {"geom_size": fields["geom_size"] + engine.growth}
    own = {name: jax.device_put(jnp.asarray(value, jnp.float32), device) for name, value in fields.items()}
    data = jax.jit(jax.vmap(lambda q: empty.replace(qpos=q)))(jax.device_put(jnp.asarray(qpos, jnp.float32), device))
    table = jax.device_put(jnp.asarray(np.swapaxes(controls, 0, 1), jnp.float32), device)

    @jax.jit
    def rollout(put, own, data, table):
        def one(own, data, control):
            return mjx.step(put.tree_replace(own) if own else put, data.replace(ctrl=control))

        def step(data, control):
            data = jax.vmap(one)(own, data, control)
            return data, (data.qpos, data.qvel)

        return jax.lax.scan(step, data, table)

    begin = time.perf_counter()
    compiled = rollout.lower(put, own, data, table).compile()
    taken = time.perf_counter() - begin

    def run():
        return jax.tree.map(np.asarray, compiled(put, own, data, table)[1])

    run()
    return taken, int(data._impl.ncon), run


def best(functions, repeats: int) -> tuple[list[float], list[float]]:
    """The least seconds of each by the clock, and of the processors; alternating, so that all meet the same machine."""
    taken = np.zeros((repeats, len(functions), 2))
    for k in range(repeats):
        for i, function in enumerate(functions):
            begin = time.perf_counter(), time.process_time()
            function()
            taken[k, i] = time.perf_counter() - begin[0], time.process_time() - begin[1]
    return taken[..., 0].min(axis=0).tolist(), taken[..., 1].min(axis=0).tolist()


def machine() -> str:
    devices = ", ".join(f"{len(jax.devices())} x {kind}" for kind in sorted({d.device_kind for d in jax.devices()}))
    return (
        f"{os.cpu_count()} cores {platform.machine()}, JAX sees {devices}; mujoco {version('mujoco')}, "
        f"mujoco-mjx {version('mujoco-mjx')}, jax {version('jax')}, Python {platform.python_version()}"
    )


def compare(name: str, boxes: int, options: argparse.Namespace) -> None:
    """One line: a backend against the bare engine."""
    spec, controls, qpos, fields = scene(boxes, options.batch, options.steps, options.slots)
    on = {"device": options.device} if name == "mjx" else {}
    made = physics.make(name, spec, options.batch, fields=tuple(fields), **on)
    taken = made.compile()
    if name == "native":
        bare_taken, contacts, bare = bare_native(made.model, controls, qpos, fields)
        unit = "contacts"
    else:
        bare_taken, contacts, bare = bare_mjx(made.engine, controls, qpos, fields)
        unit = "contact slots"
    valid = made.rollout(controls, qpos, fields=fields).valid.sum()
    clock, processors = best([lambda: made.rollout(controls, qpos, fields=fields), bare], options.repeats)
    count, option = options.batch * options.steps, made.model.opt
    solver = mujoco.mjtSolver(option.solver).name.split("_")[-1].title()
    ours, theirs = clock
    print(
        f"{name}, biped with {boxes} boxes, batch {options.batch}, {contacts:g} {unit}, {solver} "
        f"{option.iterations}/{option.ls_iterations} iterations, impratio {option.impratio:g}: "
        f"{count / ours:,.0f} steps/s, bare {count / theirs:,.0f}, overhead {100 * (ours / theirs - 1):+.1f} % "
        f"({100 * (processors[0] / processors[1] - 1):+.1f} %); compiled in {taken:.1f} s, bare {bare_taken:.1f} s; "
        f"valid {valid} of {options.batch}",
        flush=True,
    )


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--batch", type=int, default=64, help="simulations")
    parser.add_argument("--steps", type=int, default=400, help="steps of a rollout, 5 ms each")
    parser.add_argument("--boxes", type=int, nargs="+", default=[0, 4], help="boxes that each biped has")
    parser.add_argument("--slots", type=int, default=16, help="contacts of one dimension that mjx keeps; 0: all")
    parser.add_argument("--backends", nargs="+", choices=["native", "mjx"], default=["native", "mjx"])
    parser.add_argument("--device", help="that mjx is to use: cpu, gpu, tpu")
    parser.add_argument("--repeats", type=int, default=5, help="the best of so many runs counts")
    options = parser.parse_args()
    print(machine())
    for boxes in options.boxes:
        for name in options.backends:
            compare(name, boxes, options)


if __name__ == "__main__":
    main()
