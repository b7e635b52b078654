"""The biped in C MuJoCo: what its model is, and that the primitives carry it where they should."""

import dataclasses
import math

import mujoco
import numpy as np
import pytest

from jaxbiped.biped import request as ask
from jaxbiped.biped.config import JOINT_NAMES, ContactConfig, RobotModelConfig
from jaxbiped.biped.gait import generate, home_table
from jaxbiped.biped.model import PARTS, add_terrain, box_slots, home_qpos, part_geoms, robot_spec, set_box
from jaxbiped.biped.spread import MILD
from jaxbiped.biped.trial import Disturbance, Tolerance, nominal_edge, play
from jaxbiped.config import load
from jaxbiped.motion.config import RobotConfig

ROBOT = RobotModelConfig()
PAPER = {  # Table 2's durations
    "straight": ask.straight(0.05),
    "diagonal": ask.straight(math.sqrt(2) * 0.05),
    "turn": ask.turn(math.pi / 4),
    "step up": ask.step(0.10, 0.03),
    "step down": ask.step(0.10, -0.03),
    "gate": ask.gate(0.05),
}
FAST = {
    "straight": ask.straight(0.05).lasting(2.5),
    "turn": ask.turn(-math.pi / 4).lasting(4.0),
    "step up": ask.step(0.10, 0.03).lasting(8.0),
    "step down": ask.step(0.10, -0.03).lasting(8.0),
    "gate": ask.gate(0.15).lasting(8.0),
}
PLACE, TURN = 0.005, math.radians(1.0)  # [m], [rad] of a primitive's end


def compiled(boxes=0, robot=ROBOT):
    return add_terrain(robot_spec(robot), boxes).compile()


def test_the_file_holds_the_defaults():
    assert load(RobotModelConfig, "configs/robots/enuvo_walk_model.toml") == ROBOT


def test_it_is_as_high_as_the_map_believes():
    body = RobotConfig()
    assert pytest.approx(body.standing) == ROBOT.head_standing
    assert pytest.approx(body.squatting) == ROBOT.head_squatting
    model = compiled()
    for squatting, height in ((False, body.standing), (True, body.squatting)):
        data = mujoco.MjData(model)
        home = home_table(ROBOT, squatting)
        data.qpos[:] = home_qpos(model, home.pelvis[-1], home.q[-1])
        data.ctrl[:] = home.ctrl[-1]
        mujoco.mj_step(model, data, 200)
        assert data.site("head_top").xpos[2] == pytest.approx(height, abs=1e-3)  # soles float by the contact margin
        assert np.abs(data.qvel).max() < 1e-3


def test_names_sizes_and_masses():
    model = compiled(2)
    assert (model.nq, model.nv, model.nu) == (19, 18, 12)
    assert tuple(model.actuator(k).name for k in range(12)) == JOINT_NAMES
    assert model.body_mass.sum() == pytest.approx(ROBOT.masses.total)
    assert all(len(part_geoms(model, part)) == 1 for part in PARTS)
    assert len(box_slots(model)) == 2
    spheres = compiled(robot=RobotModelConfig(contact=ContactConfig(foot="spheres")))
    assert len(part_geoms(spheres, "foot_left")) == 4
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    apart = data.site("camera_left").xpos - data.site("camera_right").xpos
    np.testing.assert_allclose(apart, [0, ROBOT.proportions.camera_baseline, 0], atol=1e-9)


def test_masks_feet_meet_ground_and_boxes_the_rest_only_boxes():
    model = compiled(1)
    meets = lambda a, b: bool(  # noqa: E731
        model.geom_contype[a] & model.geom_conaffinity[b] or model.geom_contype[b] & model.geom_conaffinity[a]
    )
    floor, box = model.geom("floor").id, model.geom("box_0").id
    foot, other, torso, head = (part_geoms(model, part)[0] for part in PARTS)
    assert meets(foot, floor) and meets(foot, box) and meets(head, box) and meets(torso, box)
    assert not any(meets(a, b) for a in (foot, other, torso, head) for b in (foot, other, torso, head))
    assert not meets(head, floor) and not meets(floor, box)


def test_a_box_slot_bears_a_foot_where_it_is_put():
    model = compiled(1)
    set_box(model, 0, (0.0, 0.0), 0.3, (0.2, 0.2), 0.0, 0.05)
    data = mujoco.MjData(model)
    home = home_table(ROBOT, False)
    data.qpos[:] = home_qpos(model, home.pelvis[-1] + [0, 0, 0.05], home.q[-1])
    data.ctrl[:] = home.ctrl[-1]
    mujoco.mj_step(model, data, 200)
    assert data.site("sole_left").xpos[2] == pytest.approx(0.05, abs=1e-3)


def ends(name, request, record=False):
    table = generate(request, ROBOT)
    outcome = play(table, ROBOT, record=record)
    assert outcome.success(Tolerance()), name
    assert np.hypot(*outcome.error[:2]) < PLACE, name
    assert abs(outcome.error[2]) < TURN, name
    assert outcome.peak_speed <= 1.1 * np.deg2rad(ROBOT.servo.speed)
    return outcome


@pytest.mark.parametrize("name", [*FAST])
def test_primitives_end_where_they_should_played_fast(name):
    assert ends(name, FAST[name], record=True).zmp_margin > 0.004


@pytest.mark.parametrize("name", ["turn", "step down"])
def test_primitives_at_the_papers_durations(name):
    assert ends(name, PAPER[name], record=True).zmp_margin > 0.010


@pytest.mark.slow
@pytest.mark.parametrize("name", [*PAPER])
def test_all_primitives_at_the_papers_durations(name):
    assert ends(name, PAPER[name], record=True).zmp_margin > 0.010


@pytest.mark.parametrize("name", [*FAST])
def test_the_mild_set_is_borne(name):
    table, rng = generate(FAST[name], ROBOT), np.random.default_rng(7)
    draws = [MILD.draw(rng) for _ in range(8)]
    assert all(play(table, ROBOT, d).success(Tolerance()) for d in draws)


@pytest.mark.slow
@pytest.mark.parametrize("name", [*FAST])
def test_the_mild_set_is_borne_in_128_draws(name):
    table, rng = generate(FAST[name], ROBOT), np.random.default_rng(8)
    assert all(play(table, ROBOT, MILD.draw(rng)).success(Tolerance()) for _ in range(128))


@pytest.mark.parametrize("name", ["step up", "step down"])
def test_steps_bear_what_is_known_to_be_bearable(name):
    table = generate(FAST[name], ROBOT)
    bearable = [Disturbance(rise=v) for v in (-0.012, -0.008, 0.008)]
    bearable += [Disturbance(edge=v) for v in (-0.015, 0.015)]
    bearable += [Disturbance(yaw=math.radians(v)) for v in (-12, 12)]
    bearable += [Disturbance(slope=math.radians(v)) for v in (-3, 3)]
    assert [d for d in bearable if not play(table, ROBOT, d).success(Tolerance())] == []


def test_what_is_too_much_fails():
    up, gate = generate(FAST["step up"], ROBOT), generate(FAST["gate"], ROBOT)
    assert not play(up, ROBOT, Disturbance(rise=-0.02)).success(Tolerance())
    assert not play(up, ROBOT, Disturbance(edge=0.03)).success(Tolerance())
    low = play(gate, ROBOT, Disturbance(clearance=0.335))
    assert low.head_contact and not low.success(Tolerance())
    upright = dataclasses.replace(generate(ask.straight(0.15).lasting(8.0), ROBOT), request=FAST["gate"])
    assert play(upright, ROBOT).head_contact


def test_ten_steps_in_a_row_do_not_creep():
    """Half a metre in 25 s ends within 1 cm and 2 degrees: a step of 2.5 s, not of 16, falls 0.7 mm short."""
    step = generate(ask.straight(0.05).lasting(2.5), ROBOT)
    chain = dataclasses.replace(
        step, ctrl=np.tile(step.ctrl, (10, 1)), request=dataclasses.replace(step.request, forward=0.4)
    )
    error = play(chain, ROBOT).error + np.array([0.4 - 0.5, 0, 0])
    assert np.hypot(*error[:2]) < 0.010 and abs(error[2]) < 2 * TURN


def test_more_solver_iterations_change_nothing():
    """A fast step with ten times the iterations: the same state to 0.1 mm."""
    table = generate(FAST["straight"], ROBOT)
    states = []
    for factor in (1, 10):
        model = compiled()
        model.opt.iterations *= factor
        model.opt.ls_iterations *= factor
        data = mujoco.MjData(model)
        home = home_table(ROBOT, False)
        data.qpos[:] = home_qpos(model, home.pelvis[-1], home.q[-1])
        for control in table.ctrl:
            data.ctrl[:] = control
            mujoco.mj_step(model, data)
        states.append(data.qpos.copy())
    np.testing.assert_allclose(states[0], states[1], atol=1e-4)


def test_the_nominal_edge_leaves_room_on_both_sides():
    assert nominal_edge(FAST["step up"], ROBOT) == pytest.approx(0.075)
    assert nominal_edge(FAST["step down"], ROBOT) == pytest.approx(0.025)
