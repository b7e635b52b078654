"""The native backend is MuJoCo, bit for bit."""

import mujoco
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxbiped import physics
from jaxbiped.errors import InputError
from tests.physics.models import BATCH, HOPPER, PENDULUM, WATCH, hops
from tests.physics.oracle import play


def assert_exact(native, steps, hold, every, seed):
    controls, qpos, qvel, fields = hops(native.model, steps, seed)
    rolled = native.rollout(controls, qpos, qvel, fields, record_every=every, hold=hold)
    assert rolled.valid.all() and not rolled.warnings.any()
    for i in range(BATCH):
        own = {name: value[i] for name, value in fields.items()}
        want = play(HOPPER, np.repeat(controls[i], hold, axis=0), qpos[i], qvel[i], own, WATCH)
        for got, expected in zip((rolled.qpos, rolled.qvel, rolled.sensordata), want, strict=False):
            np.testing.assert_array_equal(got[i], expected[every - 1 :: every])
        np.testing.assert_array_equal(rolled.touched[i], want[-1] >= 0)
        np.testing.assert_allclose(rolled.depth[i], np.maximum(want[-1], 0), rtol=0, atol=1e-15)
    np.testing.assert_allclose(rolled.time, 0.005 * every * np.arange(1, steps * hold // every + 1))
    return rolled


def test_a_rollout_is_a_loop_of_steps(native):
    rolled = assert_exact(native, 400, 1, 5, seed=0)
    np.testing.assert_array_equal(rolled.touched, [[False, False], [True, False], [False, True], [False, False]])


@settings(max_examples=8, deadline=None)
@given(st.integers(1, 40), st.integers(1, 4), st.data())
def test_any_length_hold_and_record(native, steps, hold, data):
    every = data.draw(st.sampled_from([n for n in range(1, steps * hold + 1) if steps * hold % n == 0]))
    assert_exact(native, steps, hold, every, seed=steps)


SHAPES = """
<mujoco>
  <worldbody>
    <geom name="floor" type="plane" size="0 0 .1"/>
    <geom name="sphere" type="sphere" size="{0} 0 0" pos="0 0 -1"/>
    <geom name="capsule" type="capsule" size="{1} {2} 0" pos="1 0 -1"/>
    <geom name="cylinder" type="cylinder" size="{3} {4} 0" pos="2 0 -1"/>
    <geom name="ellipsoid" type="ellipsoid" size="{5} {6} {7}" pos="3 0 -1"/>
    <geom name="box" type="box" size="{8} {9} {10}" pos="4 0 -1" euler="0 0 30"/>
    <body pos="0 0 .6"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
    <body pos="1 0 .6"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
    <body pos="2 0 .6"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
    <body pos="3 0 .6"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
    <body pos="4 0 .6"><freejoint/><geom type="box" size=".1 .1 .1"/></body>
  </worldbody>
</mujoco>
"""


def test_geoms_that_grow_are_as_if_compiled_so():
    """Grown through the floor, so that whoever falls lands on them: bounds and hierarchies must follow."""
    small = SHAPES.format(*[0.05] * 11)
    sizes = [1.25, 0.3, 1.2, 0.5, 1.3, 0.4, 0.6, 1.3, 0.4, 0.6, 1.35]
    grown = mujoco.MjModel.from_xml_string(SHAPES.format(*sizes))
    made = physics.make("native", small, 2)
    fields = {"geom_size": np.stack([made.model.geom_size, grown.geom_size])}
    rolled = made.rollout(np.zeros((2, 250, 0)), fields=fields)
    for i, model in enumerate((mujoco.MjModel.from_xml_string(small), grown)):
        data = mujoco.MjData(model)
        for k in range(250):
            mujoco.mj_step(model, data)
            np.testing.assert_array_equal(rolled.qpos[i, k], data.qpos)
    np.testing.assert_array_less(rolled.qpos[0, -1, 2::7] + 0.05, rolled.qpos[1, -1, 2::7])


def test_chunks_change_nothing(native, monkeypatch):
    controls, qpos, qvel, fields = hops(native.model, 60)
    whole = native.rollout(controls, qpos, qvel, fields, record_every=4)
    monkeypatch.setattr("jaxbiped.physics.native.CHUNK", 700)  # 7 steps, which neither 60 nor 4 are multiples of
    parts = native.rollout(controls, qpos, qvel, fields, record_every=4)
    np.testing.assert_array_equal(whole.qpos, parts.qpos)
    np.testing.assert_array_equal(whole.depth, parts.depth)


def test_neither_threads_nor_company_matter(native):
    controls, qpos, qvel, fields = hops(native.model, 100)
    whole = native.rollout(controls, qpos, qvel, fields)
    alone = physics.make("native", HOPPER, 1, threads=1, watch=WATCH)
    for i in range(BATCH):
        one = slice(i, i + 1)
        own = {name: value[one] for name, value in fields.items()}
        rolled = alone.rollout(controls[one], qpos[one], qvel[one], own)
        np.testing.assert_array_equal(rolled.qpos[0], whole.qpos[i])


@pytest.mark.parametrize(
    ("memory", "warning"), [("2K", "contact_full"), ("4K", "constraint_full"), ("8K", "engine_error")]
)
def test_a_full_buffer_is_no_success(memory, warning, tmp_path, monkeypatch, capfd):
    monkeypatch.chdir(tmp_path)
    tight = physics.make("native", HOPPER.replace("<worldbody>", f'<size memory="{memory}"/><worldbody>', 1), 2)
    qpos = np.tile(tight.model.qpos0, (2, 1))
    qpos[1, 2] = 5.0  # it falls through free air, and never touches
    rolled = tight.rollout(np.zeros((2, 100, 1)), qpos)
    np.testing.assert_array_equal(rolled.valid, [False, True])
    assert warning in physics.explain(rolled.warnings[0])
    assert np.isnan(rolled.qpos[0, -1]).all() and np.isfinite(rolled.qpos[1]).all()
    tight.reset(qpos=qpos)
    state = tight.advance(np.zeros((2, 100, 1)))
    np.testing.assert_array_equal(state.valid, [False, True])
    np.testing.assert_array_equal(state.qpos[1], rolled.qpos[1, -1])
    assert not list(tmp_path.iterdir()) and not capfd.readouterr().err  # the engine would print, and write a log


def test_models_without_free_joint_sensors_or_watches():
    pendulum = physics.make("native", PENDULUM, 2)
    rolled = pendulum.rollout(np.full((2, 50, 1), 0.1))
    assert rolled.qpos.shape == (2, 50, 1) and rolled.sensordata.shape == (2, 50, 0) and rolled.depth.shape == (2, 0)
    zero, swing = pendulum.reset(qpos=[[0.0], [1.0]]), pendulum.advance(np.zeros((2, 10, 1)))
    np.testing.assert_array_equal(zero.qpos, [[0.0], [1.0]])
    assert swing.qpos[0] == 0 and 0 < swing.qpos[1] < 1


def test_device():
    with pytest.raises(InputError, match="native runs on a CPU"):
        physics.make("native", PENDULUM, 2, device="gpu")


UNNAMED = PENDULUM.replace('name="hinge" joint="hinge" gear="1"', 'joint="hinge" gear="2"')


@pytest.mark.parametrize("model", [HOPPER, UNNAMED])
def test_work_is_summed_up_step_by_step(model):
    batch = physics.make("native", model, 3, work=True)
    plain = mujoco.MjModel.from_xml_string(model)
    controls = np.random.default_rng(0).uniform(-0.1, 0.1, (3, 60, 1))
    first = batch.reset()
    assert first.work.shape == (3, 1) and not first.work.any()
    states = [batch.advance(controls[:, k : k + 20], mask=np.array([True, k < 40, True])) for k in (0, 20, 40)]
    for i in range(3):
        data, want = mujoco.MjData(plain), []
        for control in controls[i] if i != 1 else controls[i, :40]:
            data.ctrl[:] = control
            mujoco.mj_step(plain, data)
            want.append(max(0.0, data.actuator_force[0] * data.actuator_velocity[0]) * plain.opt.timestep)
        want = [sum(want[k : k + 20]) for k in (0, 20, 40)]
        np.testing.assert_allclose([state.work[i, 0] for state in states], want, rtol=1e-12)
        assert sum(want) > 0
    rolled = batch.rollout(controls, record_every=20)
    np.testing.assert_allclose(rolled.work[0], states[0].work[0] + states[1].work[0] + states[2].work[0], rtol=1e-12)
    assert rolled.sensordata.shape[-1] == plain.nsensordata  # the model's own sensors alone


def test_work_is_not_told_where_it_is_not_asked_for_or_not_known():
    assert physics.make("native", PENDULUM, 2).reset().work.shape == (2, 0)
    batch = physics.make("native", PENDULUM, 2, work=True)
    state = batch.advance(np.array([[[1e12]] * 300, [[0.1]] * 300]))
    assert np.isnan(state.work[0]).all() and state.work[1] > 0 and state.valid.tolist() == [False, True]
    with pytest.raises(InputError, match="work: sensors can be added to MJCF"):
        physics.make("native", mujoco.MjModel.from_xml_string(PENDULUM), 1, work=True)


def test_names_of_watches_do_not_clash_with_those_of_actuators():
    batch = physics.make("native", HOPPER, 1, watch={"force": WATCH["step"], "actuator": WATCH["step"]}, work=True)
    assert batch.advance(np.full((1, 5, 1), 0.1)).work[0, 0] > 0


@pytest.mark.parametrize("options", [{"work": True}, {"watch": WATCH}])
def test_sensors_must_not_be_disabled(options):
    model = HOPPER.replace("<default>", '<option><flag sensor="disable"/></option><default>')
    with pytest.raises(InputError, match=r"flag\.sensor: must not be disabled"):
        physics.make("native", model, 1, **options)
