"""Physics backends refuse what they cannot use, and are right about the rest: in a child process, as they are in C."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped import physics
from jaxbiped.errors import InputError
from tests import fuzzing
from tests.fuzzing import close, same
from tests.physics.models import HOPPER, PENDULUM, WATCH

B, T = 2, 4


def test_bad_arguments_are_refused_and_odd_ones_are_right():
    fuzzing.run(__name__)


def cases():
    tried = {}

    def refused(name, function, *given, **wrong):
        tried[f"{len(tried)}: {name}({', '.join(map(str, given))}{wrong})"[:200]] = lambda: function(*given, **wrong)

    for backend, options in (("native", {"threads": 1}), ("mjx", {"device": "cpu"})):
        made = physics.make(backend, PENDULUM, B, **options)
        for name, function, arguments in (
            ("rollout", made.rollout, {"controls": bad_tables(T)}),
            ("advance", made.advance, {"controls": bad_tables(T), "mask": BAD_MASKS}),
            ("reset", made.reset, {"mask": BAD_MASKS}),
        ):
            for argument, values in arguments.items():
                for value in values:
                    others = {"controls": np.zeros((B, T, 1))} if name != "reset" else {}
                    refused(f"{backend}.{name}", function, **others | {argument: value})
        for argument in ("qpos", "qvel"):
            for value in bad_rows():
                refused(f"{backend}.reset", made.reset, **{argument: value})
                refused(f"{backend}.rollout", made.rollout, np.zeros((B, T, 1)), **{argument: value})
        for value in (0, -1, 1.5, True, "2", 10**10, 2**70, np.ones(2), 3):
            refused(f"{backend}.rollout", made.rollout, np.zeros((B, T, 1)), record_every=value)
        for value in (0, -1, 1.5, True, None, "2", 10**10, 2**70, np.ones(2)):
            refused(f"{backend}.rollout", made.rollout, np.zeros((B, T, 1)), hold=value)
            refused(f"{backend}.advance", made.advance, np.zeros((B, T, 1)), hold=value)
        for fields in BAD_FIELDS:
            refused(f"{backend}.rollout", made.rollout, np.zeros((B, T, 1)), fields=fields)
            refused(f"{backend}.set_fields", made.set_fields, fields)
        for mask in BAD_MASKS:
            refused(f"{backend}.set_fields", made.set_fields, {"body_mass": np.ones((B, 2))}, mask)
        for size in (0, -1, 1.5, True, None, "2", 2**31, 2**70, np.ones(2)):
            refused(f"make {backend}", physics.make, backend, PENDULUM, size)
        for wrong in (
            {"watch": 3}, {"watch": {"x": 3}}, {"watch": {"x": [("a",)]}}, {"fields": 3}, {"fields": ("nothing",)},
            {"free_joint": "maybe"}, {"device": "abacus"}, {"nothing": 1}, {"free_joint": True},
            {"fields": ["geom_type"]},
        ):  # fmt: skip
            refused(f"make {backend}", physics.make, backend, PENDULUM, B, **wrong)
        for model in (None, 3, "", "nowhere.xml", "<", "<mujoco/", b"<mujoco/>", np.zeros(3), [], "/"):
            refused(f"make {backend}", physics.make, backend, model, B)
    for name in (None, 3, "", "warp", ["native"], np.array(["native", "mjx"])):
        refused("make", physics.make, name, PENDULUM, B)
    for warnings in (None, 3, [], [0] * 7, np.zeros((2, 8), int), "no warning", [[0] * 8]):
        refused("explain", physics.explain, warnings)
    return tried | {
        "a table traced by jit is refused": tracers,
        "numbers of other types are the same numbers": other_types,
        "strange but finite numbers end in a warning, not in a crash": great_numbers,
        "what is refused has not been done in part": half_done,
        "empty fields and masks change nothing": nothing_asked,
        "warnings in words": lambda: physics.explain(np.arange(8) // 7) == "engine_error x1",
    }


def bad_tables(steps):
    table = np.zeros((B, steps, 1))
    spoiled = [np.where(np.arange(steps)[:, None] == 2, value, table) for value in (np.nan, np.inf, -np.inf)]
    return [
        *spoiled, table[0], table[None], table[:1], table[..., :0], table[:, :0], np.zeros((B, steps, 2)), 0.0, None,
        "x", np.full(table.shape, "1"), table.astype(complex), object(),
        [[[0.0]], [[0.0], [1.0]]], table.astype("M8[s]"), [[[10**400]], [[0]]], {}, np.zeros((0, steps, 1)),
    ]  # fmt: skip


def bad_rows():
    row = np.zeros((B, 1))
    return [row - np.nan, row + np.inf, row[0], row[None], row[:1], row[:, :0], 0.0, "x", row.astype(complex),
            [[0.0], [0.0, 1.0]], np.full((B, 1), "1"), object()]  # fmt: skip


BAD_MASKS = [np.ones(B), np.ones(B + 1, bool), np.ones((B, 1), bool), True, 0, "x", [[True], [True, False]],
             np.arange(B), object()]  # fmt: skip
GREAT = ("body_mass", "body_inertia", "geom_size", "geom_pos", "geom_quat", "geom_friction", "body_quat", "jnt_axis",
         "jnt_range", "actuator_gainprm", "dof_damping", "opt.gravity", "geom_solref", "geom_rbound", "qpos0",
         "body_ipos", "geom_margin", "actuator_ctrlrange")  # fmt: skip
BAD_FIELDS = [
    3, ["body_mass"], "body_mass", {"nothing": np.ones(B)}, {3: np.ones(B)}, {None: 1}, {"body_mass": np.ones(2)},
    {"body_mass": np.ones((B, 3))}, {"body_mass": np.full((B, 2), np.nan)}, {"body_mass": None}, {"body_mass": "x"},
    {"geom_type": np.ones((B, 1), int)}, {"opt.timestep": np.ones(B)}, {"opt.nothing": np.ones(B)}, {"nq": np.ones(B)},
    {"names": np.ones(B)}, {"opt.gravity": np.ones(B)}, {"body_mass": np.ones((B, 2), complex)}, {"__class__": 1},
    {"body_mass": -np.ones((B, 2))}, {"geom_size": np.full((B, 1, 3), -1e-9)},
]  # fmt: skip


def pendulum():
    return physics.make("native", PENDULUM, B, threads=1)


def tracers():
    made = pendulum()
    return jax.jit(lambda table: made.rollout(table).qpos)(jnp.zeros((B, T, 1)))


def other_types():
    made = pendulum()
    table = [[[1], [0], [1], [1]]] * B
    given = (
        table,
        np.array(table, np.int8),
        np.array(table, bool),
        jnp.array(table, jnp.bfloat16),
        np.array(table, ">f4"),
    )
    tables = [*given, np.asfortranarray(np.array(table, float))]
    rolled = [
        made.rollout(table, qpos=[[0], [1]], qvel=np.zeros((B, 1), np.float16), hold=np.int64(2)) for table in tables
    ]
    return same(*rolled) and bool(rolled[0].valid.all())


def great_numbers():
    """Controls, states and fields that are finite and beyond all physics: no simulation may be valid and not finite."""
    hopper = physics.make("native", HOPPER, B, watch=WATCH, threads=1)
    model = hopper.model
    for name in GREAT:
        own = np.asarray(model.opt.gravity if name == "opt.gravity" else getattr(model, name), float)
        for value in (0.0, -1.0, 1e12, -1e300, 5e-324):
            fields = {name: np.broadcast_to(np.full_like(own, value), (B, *own.shape))}
            try:
                rolled = hopper.rollout(np.zeros((B, T, 1)), fields=fields)
            except InputError:
                continue
            if not all(np.isfinite(rolled.qpos[k]).all() for k in np.flatnonzero(rolled.valid)):
                return name, value
    for value in (1e300, -1e300, 5e-324):
        rolled = hopper.rollout(np.full((B, T, 1), value), np.full((B, model.nq), value), np.full((B, model.nv), value))
        if not all(np.isfinite(rolled.qpos[k]).all() for k in np.flatnonzero(rolled.valid)):
            return value
    return True


def half_done():
    """A call that is refused for its mask has not stepped anything."""
    made = physics.make("mjx", PENDULUM, B, device="cpu")
    try:
        made.advance(np.ones((B, T, 1)), mask=np.ones(B))
    except InputError:
        return same(made.data.qpos, np.zeros((B, 1))) and made.traces == 0


def nothing_asked():
    made = pendulum()
    table = np.ones((B, T, 1))
    before = made.advance(table)
    made.set_fields({})
    made.set_fields({"body_mass": np.full((B, 2), np.nan)}, np.zeros(B, bool))
    after = made.advance(table, mask=np.zeros(B, bool))
    return same((before.qpos, before.time), (after.qpos, after.time)) and close(made.reset().time, np.zeros(B))
