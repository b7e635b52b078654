"""Trials in batches are the trials one by one, whoever steps them."""

import dataclasses
import math

import mujoco
import numpy as np
import pytest

from jaxbiped.biped import request as ask
from jaxbiped.biped import verify
from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.biped.gait import generate
from jaxbiped.biped.primitive_catalogue import FAST, PAPER, catalogue
from jaxbiped.biped.spread import HARD, MILD, DisturbanceSet
from jaxbiped.biped.trial import Disturbance, Tolerance, play

ROBOT, TOLERANCE = RobotModelConfig(), Tolerance()
ZMP = 0.004  # [m] between the force sensors of the ankles and the contact forces; they differ while a foot touches down


def table(name):
    return generate(catalogue("fast")[name], ROBOT)


@pytest.mark.parametrize("name", ["turn", "step_up", "step_down", "gate"])
def test_a_batch_is_as_one_by_one(name):
    """Hard disturbances, some of which fail: bit for bit the same in MuJoCo in C."""
    played, disturbances = table(name), [Disturbance(), *HARD.draws(5, 1)]
    batch = verify.trials(played, ROBOT, disturbances)
    for b, disturbance in enumerate(disturbances):
        one = play(played, ROBOT, disturbance, record=b == 0)
        np.testing.assert_array_equal(batch.error[b], one.error)
        assert batch.height[b] == one.height and batch.tilt[b] == pytest.approx(one.tilt, abs=1e-12)
        assert batch.touched[b] == one.head_contact and batch.warnings[b] == one.warnings
        assert (batch.peak_torque[b], batch.peak_speed[b]) == (one.peak_torque, one.peak_speed)
        assert batch.success(TOLERANCE)[b] == one.success(TOLERANCE)
        if b == 0:
            assert batch.zmp_margin[b] == pytest.approx(one.zmp_margin, abs=ZMP)


def test_blocks_and_records_change_nothing(monkeypatch):
    played, disturbances = table("step_up"), HARD.draws(5, 2)
    whole = verify.trials(played, ROBOT, disturbances)
    ends = verify.trials(played, ROBOT, disturbances, record=False)
    monkeypatch.setattr(verify, "ROOM", 2 * 4 * (len(played.ctrl) + 160))
    blocks = verify.trials(played, ROBOT, disturbances, record=False)
    for field in ("error", "height", "tilt", "touched", "warnings"):
        for other in (ends, blocks):
            np.testing.assert_array_equal(getattr(whole, field), getattr(other, field))
    assert np.isnan(ends.slip).all() and np.isfinite(whole.slip).all()


def test_how_a_trial_ends_has_one_name():
    result = verify.trials(table("step_up"), ROBOT, HARD.draws(24, 3), record=False)
    fell, slipped, success = (word(TOLERANCE) for word in (result.fell, result.slipped, result.success))
    assert not (fell & slipped).any() and not (success & (fell | slipped)).any()
    assert (success | fell | slipped | result.touched).all()
    assert 0 < success.sum() < 24


def test_what_is_not_valid_is_no_success():
    result = verify.trials(table("straight"), ROBOT, [Disturbance(), Disturbance(mass=1e-9)], record=True)
    broken = dataclasses.replace(
        result, warnings=np.array([0, 1]), error=np.array([[0.0] * 3, [math.nan] * 3]), tilt=np.array([0, math.nan])
    )
    np.testing.assert_array_equal(broken.success(TOLERANCE), [True, False])
    np.testing.assert_array_equal(broken.fell(TOLERANCE), [False, True])


def test_instruments_on_what_is_known():
    """Squatting: no slip, the energy that lifts it again, and the head under the lintel."""
    stand = verify.trials(generate(ask.stand(4.0), ROBOT), ROBOT, [Disturbance()])
    rise = ROBOT.stance.standing - ROBOT.stance.squatting
    assert stand.energy[0] == pytest.approx(9.81 * ROBOT.masses.total * 0.8 * rise, rel=0.2)  # feet and shanks stay
    assert stand.slip[0] < 3e-4 and stand.sway[0] < 1e-3
    assert stand.zmp_margin[0] == pytest.approx(0.05 - 0.005, abs=0.01)  # the middle of a foot of 10 cm
    gate = verify.trials(table("gate"), ROBOT, [Disturbance(), Disturbance(clearance=0.36)])
    assert gate.head_clearance[0] == pytest.approx(0.37 - ROBOT.head_squatting, abs=1e-3)
    np.testing.assert_allclose(gate.head_clearance[0] - gate.head_clearance[1], 0.01, atol=1e-6)


def test_ice_is_slip():
    """Without friction the feet slide on a slope, and the slip says so."""
    result = verify.trials(table("straight"), ROBOT, [Disturbance(), Disturbance(friction=0.05, slope=0.1)])
    assert result.slip[0] < 1e-3 < 0.05 < result.slip[1]


def test_sets_are_drawn_from_a_seed():
    few, many = HARD.draws(3, 5), HARD.draws(6, 5)
    assert many[:3] == few and HARD.draws(3, 6) != few
    assert [d.friction for d in DisturbanceSet().draws(3, 0)] == [0.8] * 3
    mild = MILD.draws(400, 0)
    for value, low, high in (("friction", 0.4, 1.2), ("mass", 0.8, 1.2), ("rise", -0.003, 0.003)):
        drawn = [getattr(d, value) for d in mild]
        assert low <= min(drawn) < low + 0.05 * (high - low) and high - 0.05 * (high - low) < max(drawn) <= high
    assert np.std([d.servo for d in HARD.draws(400, 0)]) == pytest.approx(math.radians(HARD.servo), rel=0.05)


@pytest.mark.parametrize("name", [*PAPER])
def test_the_catalogue_can_be_played(name):
    assert generate(PAPER[name], ROBOT).margin > 0.016
    assert table(name).duration == FAST[name]


def test_a_robot_without_terrain_has_its_instruments():
    model = verify.trial_spec(ROBOT, 0).compile()
    assert isinstance(model, mujoco.MjModel) and model.nsensor == 5 * 2 + 2 + 12
