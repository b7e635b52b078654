"""What is of MJX alone: what it refuses, devices, contact slots, compilations."""

import importlib.util
import os
import subprocess
import sys
import time

import jax
import mujoco
import numpy as np
import pytest

from jaxbiped import physics
from jaxbiped.errors import InputError
from jaxbiped.physics.engine import grow
from tests.physics.models import BATCH, HOPPER, PENDULUM, WATCH, hops

BALLS = """
<mujoco>
  {option}
  {custom}
  <worldbody>
    <geom name="floor" type="plane" size="0 0 .1"/>
    <body name="one" pos="0 0 1"><freejoint name="free"/><geom name="a" {shape} mass="1"/></body>
    <body name="two" pos="1 0 1"><joint name="slide" type="slide" axis="0 0 1"/><geom name="b" {shape} mass="1"/></body>
  </worldbody>
  {rest}
</mujoco>
"""


def balls(option="", custom="", shape='type="sphere" size=".1"', rest=""):
    return BALLS.format(option=option, custom=custom, shape=shape, rest=rest)


@pytest.mark.parametrize(
    ("xml", "words"),
    [
        (balls('<option integrator="implicit"/>'), "option integrator implicit"),
        (balls('<option solver="PGS"/>'), "option solver pgs"),
        (balls('<option noslip_iterations="3"/>'), "option noslip_iterations"),
        (balls('<option><flag energy="enable"/></option>'), "enabled flag energy"),
        (balls(shape='type="cylinder" size=".1 .1"').replace('type="plane" size="0 0 .1"', 'type="box" size="1 1 .1"'),
         "contact of box and cylinder, between geom 'floor' and geom 'a'|contact of cylinder and box"),
        (balls(custom='<custom><numeric name="max_geom_pairs" data="1"/></custom>'), "max_geom_pairs"),
        (balls(custom='<custom><numeric name="x" data="1 2"/><numeric name="max_contact_points" data="1"/></custom>'),
         "more than one number before 'max_contact_points'"),
        (balls(rest='<sensor><user name="mine" dim="1" needstage="pos"/></sensor>'), "user of sensor 'mine'"),
        (balls(rest='<actuator><motor name="slow" joint="slide" delay="0.1" nsample="60"/></actuator>'),
         "actuator_delay of actuator 'slow'"),
        (balls('<option density="1.2" integrator="implicitfast"/>'), "implicitfast not implemented for fluid drag"),
    ],
)  # fmt: skip
def test_what_mjx_refuses_is_named(xml, words):
    physics.make("native", xml, 1)  # MuJoCo does not
    with pytest.raises(InputError, match=f"model: MJX cannot step this model: .*({words})"):
        physics.make("mjx", xml, 1)


def test_a_dropped_contact_is_seen():
    """One slot and two balls: one that lies on the floor is fine, two are not."""
    one_slot = balls(custom='<custom><numeric name="max_contact_points" data="1"/></custom>')
    made = physics.make("mjx", one_slot, 2)
    assert made.engine.contact_count() == 2  # the one, and one that must stay empty
    low, high = 0.099, 5.0
    qpos = np.tile(made.model.qpos0, (2, 1))
    qpos[:, 2], qpos[:, 7] = low, [low - 1, high]  # the slide joint counts from 1 m
    rolled = made.rollout(np.zeros((2, 5, 0)), qpos)
    np.testing.assert_array_equal(rolled.valid, [False, True])
    assert physics.explain(rolled.warnings[0]) == "contact_full x1"
    assert np.isnan(rolled.qpos[0]).all() and np.isfinite(rolled.qpos[1]).all()


@pytest.mark.parametrize("platform", ["gpu", "tpu"])
def test_a_device_that_is_not_there(platform):
    if any(device.platform == platform for device in jax.devices()):
        pytest.skip(f"there is a {platform}")
    for name in ("mjx", "auto"):
        with pytest.raises(InputError, match=f"device: no such device is there; JAX sees cpu .got '{platform}'"):
            physics.make(name, PENDULUM, 1, device=platform)


@pytest.mark.skipif(importlib.util.find_spec("warp") is not None, reason="MuJoCo Warp is installed")
def test_warp_that_is_not_installed():
    with pytest.raises(InputError, match="impl: needs the package warp-lang"):
        physics.make("mjx", PENDULUM, 1, impl="warp")


def test_options_of_mjx():
    with pytest.raises(InputError, match="impl: must be 'jax' or 'warp'"):
        physics.make("mjx", PENDULUM, 1, impl="cpp")
    with pytest.raises(InputError, match="threads: unknown option; known ones are block, contacts, device"):
        physics.make("mjx", PENDULUM, 1, threads=1)


def test_auto_is_native_on_a_cpu(monkeypatch):
    assert physics.make("auto", PENDULUM, 1, device="cpu").name == "native"
    monkeypatch.setattr(jax, "default_backend", lambda: "cpu")
    assert physics.make("auto", PENDULUM, 1).name == "native"
    monkeypatch.setattr(jax, "default_backend", lambda: "gpu")
    assert physics.make("auto", PENDULUM, 1).name == "mjx"


def test_importing_it_prints_nothing():
    code = "import jaxbiped.physics.mjx"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0 and not done.stdout, done.stderr


@pytest.mark.slow
def test_a_new_field_compiles_once_more():
    made = physics.make("mjx", PENDULUM, 2)
    controls = np.full((2, 40, 1), 0.1)
    plain = made.rollout(controls)
    damped = made.rollout(controls, fields={"dof_damping": [[0.01], [1.0]]})
    again = made.rollout(controls)
    assert made.traces == 2
    np.testing.assert_allclose(damped.qpos[0], plain.qpos[0], atol=1e-6)
    np.testing.assert_allclose(again.qpos, plain.qpos, atol=1e-6)
    assert abs(damped.qpos[1, -1]) < abs(plain.qpos[1, -1])


@pytest.mark.slow
def test_the_compilation_cache_works(tmp_path):
    """A second process compiles the same (model, batch size) in less than half the time."""
    code = (
        "from jaxbiped import physics; from tests.physics.models import HOPPER;"
        "print(physics.make('mjx', HOPPER, 4).compile())"
    )
    environment = os.environ | {"JAX_COMPILATION_CACHE_DIR": str(tmp_path / "cache")}

    def seconds():
        start = time.perf_counter()
        done = subprocess.run([sys.executable, "-c", code], env=environment, capture_output=True, text=True, check=True)
        return float(done.stdout), time.perf_counter() - start

    (first, _), (second, _) = seconds(), seconds()
    assert any((tmp_path / "cache").iterdir())
    assert second < 0.5 * first


@pytest.mark.slow
@pytest.mark.skipif(importlib.util.find_spec("warp") is None, reason="MuJoCo Warp is not installed")
def test_warp_is_as_mujoco(native):
    """Static geoms that differ by simulation too, which Warp itself places only once."""
    controls, qpos, qvel, fields = hops(native.model, 100)
    fields = {"geom_pos": fields["geom_pos"]}
    made = physics.make("mjx", HOPPER, BATCH, watch=WATCH, fields=tuple(fields), impl="warp")
    ours, reference = (backend.rollout(controls, qpos, qvel, fields) for backend in (made, native))
    assert ours.valid.all()
    np.testing.assert_allclose(ours.qpos[..., :3], reference.qpos[..., :3], atol=1e-4, rtol=0)  # 1e-6 measured
    np.testing.assert_array_equal(ours.touched, reference.touched)


MARGINS = """
<mujoco>
  <option timestep="0.005"/>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 .1"/>
    <geom name="block" type="box" pos="1 0 0.1" size=".2 .2 .1"/>
    <body pos="0 0 0.052"><freejoint/><geom name="foot" type="box" size=".05 .03 .05" mass="1" margin="0.002"/></body>
  </worldbody>
</mujoco>
"""


def test_margins_become_size():
    model = mujoco.MjModel.from_xml_string(MARGINS)
    growth = grow(model)
    foot = model.geom("foot").id
    np.testing.assert_allclose(growth[foot], 0.002)
    np.testing.assert_allclose(model.geom_size[foot], [0.052, 0.032, 0.052])
    assert not model.geom_margin.any() and not np.delete(growth, foot, axis=0).any()


@pytest.mark.slow
def test_margins_are_as_in_mujoco():
    """A box rests above floor and block by its margin; MJX itself has no such contact on a plane."""
    qpos = np.array([[0, 0, 0.052, 1, 0, 0, 0], [1, 0, 0.252, 1, 0, 0, 0], [0, 0, 0.04, 1, 0, 0, 0]], float)
    watch = {"floor": (("foot", "floor"),), "block": (("foot", "block"),)}
    rolls = [
        physics.make(name, MARGINS, 3, watch=watch, fields=("geom_size",)).rollout(np.zeros((3, 40, 0)), qpos)
        for name in ("native", "mjx")
    ]
    assert rolls[0].qpos[0, -1, 2] > 0.0512
    np.testing.assert_allclose(rolls[1].qpos[:, -1, 2], rolls[0].qpos[:, -1, 2], atol=5e-5)
    np.testing.assert_array_equal(rolls[1].touched, rolls[0].touched)
    np.testing.assert_allclose(rolls[1].depth, rolls[0].depth, atol=1e-4)


def test_work_is_that_of_the_engine_in_c():
    """Within 1 %: single precision, and contacts that are solved otherwise."""
    controls = np.random.default_rng(0).uniform(-0.1, 0.1, (BATCH, 40, 1))
    ours, theirs = (physics.make(name, HOPPER, BATCH, work=True) for name in ("mjx", "native"))
    mask = np.arange(BATCH) != 2
    for begin in (0, 20):
        for batch in (ours, theirs):
            if begin == 0:
                batch.reset()
        found, want = (batch.advance(controls[:, begin : begin + 20], mask=mask) for batch in (ours, theirs))
        np.testing.assert_allclose(found.work, want.work, rtol=0.01, atol=1e-6)
        assert not found.work[2] and (found.work[mask] > 0).all()
