"""Decisions to requests, and requests to tables that chain without a seam."""

import math

import numpy as np
import pytest

from jaxbiped.biped import request as ask
from jaxbiped.biped.gait import home_table
from jaxbiped.errors import InputError
from jaxbiped.executors.config import WalkConfig
from jaxbiped.executors.primitive_schedule import ANGLE, PER_METRE, Move, requests, targets
from jaxbiped.motion.primitives import Primitive

ROBOT = WalkConfig().biped
RISE = 0.03
LENGTH = 1 / PER_METRE


def asked(squatting=False, pace="paper", **move):
    values = {"turn": 0.0, "primitive": Primitive.NONE, "length": 0.0, "rise": 0, "squat": False} | move
    return requests(Move(**values), squatting, RISE, pace)


def test_only_looking_moves_nothing():
    assert asked() == asked(primitive=Primitive.LOOK) == ()
    assert asked(primitive=Primitive.LOOK, squat=True, squatting=True) == ()


def test_turn_side_and_straight_in_this_order():
    turn, aside, ahead = asked(
        turn=math.pi / 4, left=-0.02, primitive=Primitive.STRAIGHT_FORWARD, length=math.sqrt(2) * 0.05
    )
    assert turn == ask.turn(math.pi / 4)
    assert aside == ask.sidestep(-0.02)
    assert ahead == ask.straight(0.071)


def test_displacements_lie_on_the_lattice():
    rng = np.random.default_rng(0)
    for turn, length, left in zip(*rng.uniform(-0.1, 0.1, (3, 50)), strict=True):
        parts = asked(turn=turn, primitive=Primitive.STRAIGHT_FORWARD, length=length, left=left)
        total = np.sum([[p.turn, p.forward, p.left] for p in parts], axis=0)
        assert np.all(np.abs(total - [turn, length, left]) <= np.array([ANGLE, LENGTH, LENGTH]) / 2 + 1e-12)
    assert asked(turn=0.4 * ANGLE, left=0.4 * LENGTH, primitive=Primitive.STRAIGHT_FORWARD, length=-0.4 * LENGTH) == ()


@pytest.mark.parametrize("degrees", [-180, -91, 90, 180])
def test_a_wide_turn_is_played_in_parts_that_can_be(degrees):
    parts = asked(turn=math.radians(degrees))
    assert len(parts) == math.ceil(abs(degrees) / 90)
    assert math.degrees(sum(p.turn for p in parts)) == pytest.approx(degrees, abs=0.3)
    assert all(np.isfinite(targets(p, ROBOT)).all() for p in asked(turn=math.radians(degrees), pace="fast"))


def test_a_gate_is_split_and_the_stance_changes_once():
    gate = {"primitive": Primitive.PASS_GATE, "length": 0.05, "squat": True}
    assert asked(**gate) == (ask.squat(), ask.straight(0.05, squat=True))
    assert asked(squatting=True, **gate) == (ask.straight(0.05, squat=True),)
    assert asked(squatting=True, turn=0.2, **gate)[0].squat_start
    up, ahead = asked(squatting=True, primitive=Primitive.STRAIGHT_FORWARD, length=0.05)
    assert (up, ahead) == (ask.stand(), ask.straight(0.05))


@pytest.mark.parametrize("squat", [False, True])
def test_a_step_goes_up_or_down_as_far_as_it_can(squat):
    for rise, primitive in ((1, Primitive.STEP_UP_BUMP), (-1, Primitive.STEP_DOWN_BUMP)):
        (step,) = asked(squatting=squat, squat=squat, primitive=primitive, length=0.113, rise=rise)
        assert (step.forward, step.rise) == (0.10, RISE * rise)
        assert step.squat_start == step.squat == step.squat_end == squat


def test_every_request_that_a_decision_can_make_can_be_played_fast():
    moves = [
        {"turn": turn, "primitive": primitive, "length": length, "rise": rise, "left": left, "squat": squat}
        for primitive, rise in ((Primitive.STRAIGHT_FORWARD, 0), (Primitive.STEP_UP_BUMP, 1), (Primitive.PASS_GATE, 0))
        for turn, length, left in ((-math.pi, 0.113, 0.04), (0.04, 0.07, -0.04), (math.pi / 4, 0.05, 0.005))
        for squat in (False, True)
    ]
    for move in moves:
        before = home_table(ROBOT, False).ctrl[-1]
        for request in asked(pace="fast", **move):
            table = targets(request, ROBOT)
            np.testing.assert_allclose(table[0], before, atol=2e-3)  # one row after the start: no seam
            before = table[-1]
        np.testing.assert_allclose(before, home_table(ROBOT, move["squat"]).ctrl[-1], atol=1e-6)


def test_fast_is_never_slower_than_the_paper():
    for move in ({"turn": 3.0}, {"turn": 0.05}, {"length": 0.02}, {"length": 0.113}, {"left": 0.05}, {"squat": True}):
        move = {"primitive": Primitive.STRAIGHT_FORWARD} | move
        for quick, slow in zip(asked(pace="fast", **move), asked(**move), strict=True):
            assert quick.duration <= slow.duration


def test_what_no_robot_can_do_is_an_input_error():
    with pytest.raises(InputError, match=r"step up.*leg is|leaves its"):
        targets(ask.step(0.10, 0.30), ROBOT)
