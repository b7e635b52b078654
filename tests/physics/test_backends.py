"""What both backends do alike."""

import mujoco
import numpy as np
import pytest

from jaxbiped import physics
from tests.physics.models import BATCH, HOPPER, hops

# Single precision against double over 4 s of hopping, with contacts made and broken: 0.03 mm measured.
MILLIMETRE = 1e-3


def test_mjx_is_as_mujoco(native, mjx):
    controls, qpos, qvel, fields = hops(native.model, 800)
    ours = mjx.rollout(controls, qpos, qvel, fields, record_every=10)
    reference = native.rollout(controls, qpos, qvel, fields, record_every=10)
    assert ours.valid.all() and reference.valid.all()
    np.testing.assert_allclose(ours.qpos[..., :3], reference.qpos[..., :3], atol=MILLIMETRE, rtol=0)
    np.testing.assert_allclose(ours.qpos, reference.qpos, atol=0.01, rtol=0)
    np.testing.assert_array_equal(ours.touched, reference.touched)
    np.testing.assert_allclose(ours.depth, reference.depth, atol=MILLIMETRE / 10, rtol=0)
    np.testing.assert_allclose(ours.time, reference.time)
    np.testing.assert_array_equal(reference.touched, [[False, False], [True, False], [False, True], [False, False]])


def test_slices_are_a_rollout(backend):
    controls, qpos, qvel, fields = hops(backend.model, 90)
    rolled = backend.rollout(controls, qpos, qvel, fields)
    backend.set_fields(fields)
    backend.reset(qpos=qpos, qvel=qvel)
    touched = np.zeros((BATCH, 2), bool)
    for begin, end in ((0, 1), (1, 40), (40, 90)):
        state = backend.advance(controls[:, begin:end])
        touched |= state.touched
        np.testing.assert_array_equal(state.qpos, rolled.qpos[:, end - 1])
        np.testing.assert_array_equal(state.qvel, rolled.qvel[:, end - 1])
        np.testing.assert_allclose(state.time, rolled.time[end - 1])
    np.testing.assert_array_equal(touched, rolled.touched)


def test_controls_are_held(backend):
    controls, qpos, qvel, _ = hops(backend.model, 12)
    held = backend.rollout(controls, qpos, qvel, hold=5, record_every=5)
    each = backend.rollout(np.repeat(controls, 5, axis=1), qpos, qvel, record_every=5)
    np.testing.assert_array_equal(held.qpos, each.qpos)
    backend.reset(qpos=qpos, qvel=qvel)
    np.testing.assert_array_equal(backend.advance(controls, hold=5).qpos, held.qpos[:, -1])


def test_simulations_are_at_different_phases(backend):
    """One that is reset, to other terrain, while others go on, does what it does from the beginning."""
    controls, qpos, qvel, fields = hops(backend.model, 60)
    rolled = backend.rollout(controls, qpos, qvel, fields)
    late = np.array([False, True, False, True])
    own = {name: np.where(late.reshape(-1, *[1] * (value.ndim - 1)), np.nan, value) for name, value in fields.items()}
    backend.set_fields(own, ~late)  # rows outside the mask are not looked at
    backend.reset(qpos=qpos, qvel=qvel)
    backend.advance(controls[:, :20])
    backend.set_fields(fields, late)
    state = backend.reset(late, np.where(late[:, None], qpos, np.nan), qvel)
    np.testing.assert_allclose(state.time, np.where(late, 0, 0.1))
    shifted = np.where(late[:, None, None], controls[:, :40], controls[:, 20:])
    state = backend.advance(shifted)
    np.testing.assert_array_equal(state.qpos, np.where(late[:, None], rolled.qpos[:, 39], rolled.qpos[:, 59]))


def test_who_is_not_of_the_mask_stays_as_it_is(backend):
    controls, qpos, qvel, fields = hops(backend.model, 60)
    backend.set_fields(fields)
    backend.reset(qpos=qpos, qvel=qvel)
    before = backend.advance(controls[:, :20])
    some = np.array([True, False] * (BATCH // 2))
    state = backend.advance(controls[:, 20:40], mask=some)
    np.testing.assert_allclose(state.time, np.where(some, 2, 1) * before.time)
    for name in ("qpos", "qvel"):
        np.testing.assert_array_equal(getattr(state, name)[~some], getattr(before, name)[~some])
    assert not state.touched[~some].any() and not state.depth[~some].any()
    backend.advance(controls[:, 20:40], mask=~some)
    after = backend.advance(controls[:, 40:])
    rolled = backend.rollout(controls, qpos, qvel, fields)
    np.testing.assert_array_equal(after.qpos, rolled.qpos[:, -1])
    np.testing.assert_array_equal(backend.advance(controls, mask=np.zeros(BATCH, bool)).qpos, after.qpos)


def test_rollouts_leave_the_living_batch_alone(backend):
    controls, qpos, qvel, fields = hops(backend.model, 40)
    backend.reset(qpos=qpos, qvel=qvel)
    backend.advance(controls[:, :20])
    plain = backend.rollout(controls, qpos, qvel)
    other = backend.rollout(controls, qpos, qvel, fields)
    assert not np.array_equal(plain.qpos, other.qpos)
    np.testing.assert_array_equal(plain.qpos[:, -1], backend.advance(controls[:, 20:]).qpos)
    np.testing.assert_array_equal(plain.qpos, backend.rollout(controls, qpos, qvel).qpos)


@pytest.mark.parametrize("when", ["at once", "after a while"])
def test_one_that_blows_up_is_not_valid_and_harms_no_other(backend, when):
    controls, qpos, qvel, fields = hops(backend.model, 60)
    well = backend.rollout(controls, qpos, qvel, fields)
    if when == "at once":
        qvel[2, 0] = 1e11
    else:
        fields["actuator_gainprm"][2, 0, 0] = 1e18
    rolled = backend.rollout(controls, qpos, qvel, fields)
    np.testing.assert_array_equal(rolled.valid, [True, True, False, True])
    assert physics.explain(rolled.warnings[2]).startswith("bad_") and not rolled.warnings[[0, 1, 3]].any()
    broken = np.isnan(rolled.qpos[2]).any(axis=1)
    assert broken[-1] and (np.diff(broken.astype(int)) >= 0).all()  # once broken, broken
    assert (np.abs(rolled.qvel[2][~broken]) < 1e10).all()
    np.testing.assert_array_equal(rolled.qpos[[0, 1, 3]], well.qpos[[0, 1, 3]])

    backend.set_fields(fields)
    backend.reset(qpos=qpos, qvel=qvel)
    for begin in range(0, 60, 20):
        state = backend.advance(controls[:, begin : begin + 20])
    np.testing.assert_array_equal(state.valid, rolled.valid)
    np.testing.assert_array_equal(state.warnings[2] > 0, rolled.warnings[2] > 0)
    assert np.isnan(state.qpos[2]).all() and np.isnan(state.qvel[2]).all()
    np.testing.assert_array_equal(state.qpos[[0, 1, 3]], well.qpos[[0, 1, 3], -1])

    _, qpos, qvel, fields = hops(backend.model, 60)
    backend.set_fields(fields)
    healed = backend.reset(np.arange(BATCH) == 2, qpos, qvel)
    np.testing.assert_array_equal(healed.sensordata[2], 0)  # until the first step
    assert healed.valid.all() and not healed.warnings.any() and np.isfinite(healed.qpos).all()
    np.testing.assert_array_equal(backend.advance(controls[:, :30]).qpos[2], well.qpos[2, 29])


def test_a_model_is_left_as_it_is():
    model = mujoco.MjModel.from_xml_string(HOPPER)
    flags = model.opt.disableflags
    physics.make("native", model, 2, free_joint=True)
    assert model.opt.disableflags == flags


def test_it_compiles_once(mjx):
    """After tables of many lengths, intervals and holds, slices and rollouts, fields and none."""
    controls, *_ = hops(mjx.model, 7)
    mjx.rollout(controls, hold=3)
    mjx.advance(controls[:, :1])
    assert mjx.compile() < 5
    assert mjx.traces == 1
    assert mjx.block._cache_size() == 1  # XLA compiles again for arrays that are not bound to the device
