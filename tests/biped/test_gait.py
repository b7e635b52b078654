"""Generated primitives: what they reach, how they join, and what they refuse."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from jaxbiped.biped import request as ask
from jaxbiped.biped.config import GRAVITY, RobotModelConfig, ServoConfig
from jaxbiped.biped.gait import TIMESTEP, generate, home_table, perform
from jaxbiped.biped.request import Request
from jaxbiped.biped.score import compose, schedule
from jaxbiped.errors import InputError

ROBOT = RobotModelConfig()
TABLE = {
    "straight": ask.straight(0.05),
    "turn": ask.turn(math.pi / 4),
    "step up": ask.step(0.10, 0.03).lasting(24.0),
    "step down": ask.step(0.10, -0.03).lasting(24.0),
    "gate": ask.gate(0.05).lasting(24.0),
}
FAST = {
    "straight": ask.straight(0.05).lasting(2.5),
    "turn": ask.turn(math.pi / 4).lasting(4.0),
    "step up": ask.step(0.10, 0.03).lasting(8.0),
    "step down": ask.step(0.10, -0.03).lasting(8.0),
    "gate": ask.gate(0.05).lasting(6.0),
    "squat": ask.squat(2.0),
    "stand": ask.stand(2.0),
    "sidestep": ask.sidestep(-0.03, duration=3.0),
    "squatting": ask.straight(0.05, squat=True).lasting(3.0),
    "short": ask.straight(0.005).lasting(2.5),
    "mixed": Request("mixed", 0.03, 0.01, 0.1, duration=3.0),
    "back": ask.straight(-0.03).lasting(3.0),
}
SEAM_ANGLE = 1e-4  # [rad] single precision of the kinematics
SEAM_SPEED = 0.03  # [rad/s] single precision over one step of time


@pytest.mark.parametrize("name", [*TABLE])
def test_the_five_primitives_at_ease(name):
    table = generate(TABLE[name], ROBOT)
    request = table.request
    assert table.q.shape == table.ctrl.shape == (len(table.zmp), 12)
    assert table.duration == pytest.approx(TABLE[name].duration) == len(table.q) * TIMESTEP
    assert table.margin > 0.017
    middle = table.feet[-1].mean(axis=0)
    np.testing.assert_allclose(middle, [request.forward, request.left, request.rise, request.turn], atol=1e-6)
    assert table.peak_torque < 0.6 * ROBOT.servo.torque


@pytest.mark.parametrize("name", [*FAST])
def test_chains_have_no_seam(name):
    table = generate(FAST[name], ROBOT)
    before, after = (home_table(ROBOT, s) for s in (table.request.squat_start, table.request.squat_end))
    spread = SEAM_SPEED * TIMESTEP
    np.testing.assert_allclose(table.q[0], before.q[-1], atol=SEAM_ANGLE + spread)
    np.testing.assert_allclose(table.q[-1], after.q[-1], atol=SEAM_ANGLE)
    np.testing.assert_allclose(table.ctrl[-1], after.ctrl[-1], atol=SEAM_ANGLE + SEAM_SPEED * 1.6 / 60)
    speed = np.diff(np.concatenate([before.q[-1:], table.q, after.q[-1:]]), axis=0) / TIMESTEP
    assert np.abs(speed[[0, -2, -1]]).max() < SEAM_SPEED
    # Nothing jumps inside either: a joint at its greatest acceleration gains 40 rad/s^2 * 5 ms.
    assert np.abs(np.diff(speed, axis=0)).max() < 0.4
    assert table.margin > 0.015


def test_the_holding_torques_carry_the_robot():
    """Work of the joint torques on a small sinking of the hips is the robot's weight times that way."""
    below = generate(ask.squat(4.0), ROBOT)
    steps = np.diff(below.q, axis=0)
    torque = (below.ctrl - below.q) * ROBOT.servo.kp  # holding and drag; drag is small at this speed and taken out
    drag = (ROBOT.servo.kv + ROBOT.servo.damping) * np.gradient(below.q, TIMESTEP, axis=0)
    work = np.sum((torque - drag)[:-1] * steps)
    legs = ROBOT.masses
    drop = ROBOT.stance.standing - ROBOT.stance.squatting
    lifted = legs.torso + 1.5 * legs.thigh + 0.5 * legs.shank  # thighs sink about 3/4 of the way, shanks 1/4
    assert -work == pytest.approx(lifted * GRAVITY * drop, rel=0.04)


@settings(max_examples=15, deadline=None)
@given(
    length=st.floats(0.0, math.sqrt(2) * 0.05),
    angle=st.floats(-math.pi / 4, math.pi / 4),
    squat=st.booleans(),
)
def test_any_length_and_any_turn(length, angle, squat):
    for request in (ask.straight(length, squat).lasting(4.0), ask.turn(angle, squat).lasting(5.0)):
        table = generate(request, ROBOT)
        assert table.margin > 0.016
        np.testing.assert_allclose(table.feet[-1].mean(axis=0)[[0, 3]], [request.forward, request.turn], atol=1e-6)


@settings(max_examples=10, deadline=None)
@given(length=st.floats(0.02, 0.10), rise=st.floats(-0.03, 0.03))
def test_any_rise(length, rise):
    table = generate(ask.step(length, rise).lasting(12.0), ROBOT)
    assert table.margin > 0.016


def test_a_swinging_foot_clears_the_edge():
    for rise in (0.03, -0.03):
        table = generate(ask.step(0.10, rise).lasting(12.0), ROBOT)
        edge = (0.15 if rise > 0 else 0.05) / 2
        over = np.abs(table.feet[..., 0] - edge) < 0.05
        highest = max(rise, 0.0)
        moving = (table.feet[..., 0] > 1e-4) & (table.feet[..., 0] < 0.0999)
        assert np.all(table.feet[..., 2][over & moving] >= highest - 1e-6)


@pytest.mark.parametrize(
    ("request_", "robot", "words"),
    [
        (ask.straight(0.05).lasting(1.6), ROBOT, "speed at"),
        (ask.straight(0.05).lasting(0.5), ROBOT, "no time is left"),
        (ask.step(0.14, 0.03), ROBOT, "leg is"),
        (ask.step(0.05, 0.09), ROBOT, "at"),
        (ask.straight(0.05), RobotModelConfig(servo=ServoConfig(torque=1.0)), "torque at"),
    ],
)
def test_what_cannot_be_done_is_said(request_, robot, words):
    with pytest.raises(InputError, match=words):
        generate(request_, robot)


def test_bad_requests():
    for make in (
        lambda: ask.straight(math.nan),
        lambda: ask.straight(1.0),
        lambda: ask.straight(0.05).lasting(0.0),
        lambda: ask.turn(math.inf),
    ):
        with pytest.raises((InputError, ValueError)):
            make()


def test_one_compilation_serves_all():
    generate(TABLE["straight"], ROBOT)
    before = perform._cache_size()
    other = RobotModelConfig(masses={"torso": 1.6})
    generate(ask.gate(0.10), other)
    generate(ask.turn(-0.2), ROBOT)
    assert perform._cache_size() == before


def test_rest_is_kept_at_both_ends():
    song = compose(ask.straight(0.05), ROBOT)
    for duration in (2.0, 16.0):
        durations = schedule(song, duration)
        assert durations.sum() == pytest.approx(duration)
        assert durations[[0, -1]].min() >= 0.3 - 1e-9
