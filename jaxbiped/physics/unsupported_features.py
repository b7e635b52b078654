"""Features of a model that MJX does not support, by name: the feature and the element that has it."""

from __future__ import annotations

from collections.abc import Iterator

import mujoco
import numpy as np
from mujoco import mjx
from mujoco.mjx._src import collision_driver  # pinned with mujoco-mjx: it alone knows which pairs of geoms can collide

IGNORED = {  # fields that change the motion in MuJoCo, and that MJX does not read
    "geom": ("geom_surfacevel", "geom_adhesion"),
    "actuator": ("actuator_armature", "actuator_damping", "actuator_dampingpoly", "actuator_delay"),
    "jnt": ("jnt_springyield",),
    "tendon": ("tendon_springyield",),
    "pair": ("pair_adhesion",),
}
TYPES = (  # fields whose values MJX supports only in part: element, MuJoCo's names, MJX's
    ("actuator", "trntype", mujoco.mjtTrn, mjx.TrnType),
    ("actuator", "dyntype", mujoco.mjtDyn, mjx.DynType),
    ("actuator", "gaintype", mujoco.mjtGain, mjx.GainType),
    ("actuator", "biastype", mujoco.mjtBias, mjx.BiasType),
    ("eq", "type", mujoco.mjtEq, mjx.EqType),
    ("sensor", "type", mujoco.mjtSensor, mjx.SensorType),
)


def refusals(model: mujoco.MjModel) -> Iterator[str]:
    """Each feature of a model that `mjx` cannot step, or would step differently from MuJoCo; with its element."""
    yield from of_options(model)
    for kind, field, known, supported in TYPES:
        for i, value in enumerate(getattr(model, f"{kind}_{field}")):
            if int(value) not in {int(each) for each in supported}:
                yield f"{word(known(int(value)))} of {called(model, kind, i)}"
    for kind, names in IGNORED.items():
        for name in names:
            for i in np.flatnonzero(nonzero(getattr(model, name))):
                yield f"{name} of {called(model, kind, int(i))}"
    if model.nflex:
        yield f"flex {model.flex(0).name!r}"
    if model.nplugin:
        yield f"plugin {model.plugin(0).name!r}"
    for first, second, _ in collision_driver.geom_pairs(model):
        types = [mujoco.mjtGeom(int(model.geom_type[i])) for i in (first, second)]
        if not collision_driver.has_collision_fn(*types):
            names = " and ".join(called(model, "geom", int(i)) for i in (first, second))
            yield f"contact of {word(types[0])} and {word(types[1])}, between {names}"


def of_options(model: mujoco.MjModel) -> Iterator[str]:
    """Unsupported features in the options of a model."""
    option = model.opt
    for field, known, supported in (
        ("integrator", mujoco.mjtIntegrator, mjx.IntegratorType),
        ("cone", mujoco.mjtCone, mjx.ConeType),
        ("solver", mujoco.mjtSolver, mjx.SolverType),
    ):
        value = getattr(option, field)
        if value not in {int(each) for each in supported}:
            yield f"option {field} {word(known(value))}"
    flags = {bit for bit in mujoco.mjtEnableBit.__members__.values() if bit != mujoco.mjtEnableBit.mjNENABLE}
    for bit in sorted(flags, key=int):
        if option.enableflags & int(bit) and int(bit) not in {int(each) for each in mjx.EnableBit}:
            yield f"enabled flag {word(bit)}"
    if option.noslip_iterations:
        yield "option noslip_iterations"
    for i in range(model.nnumeric):
        numeric = model.numeric(i)
        if numeric.name == "max_geom_pairs":
            yield "custom numeric 'max_geom_pairs': it would silently drop pairs of geoms"
        if numeric.name == "max_contact_points" and model.numeric_adr[i] != i:
            yield "custom numerics of more than one number before 'max_contact_points'"


def nonzero(values: np.ndarray) -> np.ndarray:
    """Which rows of a field are set."""
    return np.array([np.any(row != 0) for row in values], bool)


def word(value: object) -> str:
    """mjtGeom.mjGEOM_BOX as "box"."""
    return value.name.split("_", 1)[-1].lower()


def called(model: mujoco.MjModel, kind: str, index: int) -> str:
    """An element by its name, or by its number and its body's name."""
    words = {"eq": "equality", "jnt": "joint"}
    element = getattr(model, {"eq": "equality"}.get(kind, kind))(index)
    if element.name:
        return f"{words.get(kind, kind)} {element.name!r}"
    if kind == "geom":
        return f"geom {index} of body {model.body(int(model.geom_bodyid[index])).name!r}"
    return f"{words.get(kind, kind)} {index}"
