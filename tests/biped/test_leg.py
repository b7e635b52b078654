"""The leg's inverse kinematics against its forward kinematics, and both against MuJoCo."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from jaxbiped.biped.config import JOINT_NAMES, RobotModelConfig
from jaxbiped.biped.leg import leg_angles, leg_frames
from jaxbiped.biped.model import add_terrain, home_qpos, robot_spec

ROBOT = RobotModelConfig()
THIGH, SHANK = jnp.float32(ROBOT.proportions.thigh), jnp.float32(ROBOT.proportions.shank)
FORWARD = jax.vmap(lambda q: leg_frames(THIGH, SHANK, jnp.zeros(3), jnp.eye(3), q))
INVERSE = jax.jit(jax.vmap(lambda ankle, R: leg_angles(THIGH, SHANK, jnp.zeros(3), jnp.eye(3), ankle, R)))
ANGLE = 2e-4  # [rad] single precision, where the knee's arc cosine is flattest (5 degrees bent)


def random_angles(rng, count):
    low, high = ROBOT.limits()[:6].T
    low[3] = np.radians(5.0)
    q = rng.uniform(low * 0.9, high * 0.9, (count, 6))
    above = np.cos(q[:, 4]) + np.cos(q[:, 4] + q[:, 3]) > 0.1  # the hip over the sole: the branch that is solved for
    return jnp.asarray(q[above], jnp.float32)


def test_inverse_returns_the_angles_that_forward_started_from():
    q = random_angles(np.random.default_rng(0), 500)
    origins, frames, _ = FORWARD(q)
    found, slack = INVERSE(origins[:, 2], frames[:, 2])
    again, frames_again, _ = FORWARD(found)
    np.testing.assert_allclose(found, q, atol=ANGLE)
    np.testing.assert_allclose(again[:, 2], origins[:, 2], atol=1e-6)
    np.testing.assert_allclose(frames_again[:, 2], frames[:, 2], atol=1e-5)
    assert np.all(np.asarray(slack) > 0)


def test_forward_is_mujocos():
    model = add_terrain(robot_spec(ROBOT)).compile()
    data = mujoco.MjData(model)
    assert tuple(model.joint(j + 1).name for j in range(12)) == JOINT_NAMES
    for q in random_angles(np.random.default_rng(1), 20):
        data.qpos[:] = home_qpos(model, np.zeros(3), np.tile(q, 2))
        mujoco.mj_kinematics(model, data)
        origins, frames, axes = (np.asarray(v[0]) for v in FORWARD(q[None]))
        for k, link in enumerate(("thigh", "shank", "foot")):
            body = data.body(f"{link}_left")
            hip = data.body("thigh_left").xpos
            np.testing.assert_allclose(body.xpos - hip, origins[k], atol=1e-6)
            np.testing.assert_allclose(body.xmat.reshape(3, 3), frames[k], atol=2e-6)
        np.testing.assert_allclose(data.xaxis[1:7], axes, atol=2e-6)


@pytest.mark.parametrize("beyond", [0.001, 0.05])
def test_out_of_reach_shows_in_the_slack(beyond):
    length = ROBOT.proportions.thigh + ROBOT.proportions.shank
    q, slack = INVERSE(jnp.array([[0.0, 0.0, -length - beyond]]), jnp.eye(3)[None])
    np.testing.assert_allclose(slack, -beyond, atol=1e-6)
    assert np.all(np.isfinite(q))
