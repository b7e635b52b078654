"""Durations: Table 2 of the paper, and the mission times of its Tables 3 and 4 that they add up to."""

import jax
import jax.numpy as jnp
import numpy as np
import pydantic
import pytest

from jaxbiped.motion.config import DurationConfig, RobotConfig
from jaxbiped.motion.primitives import Command, Primitive, duration

TABLE_2 = {  # command: (turn [deg], primitive, length [m], rise), seconds
    "straight": ((0, Primitive.STRAIGHT_FORWARD, 0.05, 0), 16),
    "diagonal": ((0, Primitive.STRAIGHT_FORWARD, 0.05 * 2**0.5, 0), 16 * 2**0.5),
    "turn": ((45, Primitive.NONE, 0, 0), 5),
    "turn right": ((-45, Primitive.NONE, 0, 0), 5),
    "turn round": ((180, Primitive.NONE, 0, 0), 20),
    "step up": ((0, Primitive.STEP_UP_BUMP, 0.05, 1), 96),
    "step down": ((0, Primitive.STEP_DOWN_BUMP, 0.05, -1), 96),
    "diagonal step up": ((0, Primitive.STEP_UP_BUMP, 0.07, 1), 96),
    "long step up": ((0, Primitive.STEP_UP_BUMP, 0.05 * 2**0.5 + 0.05, 1), 96 + 16),
    "gate": ((0, Primitive.PASS_GATE, 0.05, 0), 48),
    "look": ((45, Primitive.LOOK, 0, 0), 5),
    "stay": ((0, Primitive.NONE, 0, 0), 0),
}


def command(turn, primitive, length, rise):
    return Command(
        turn=jnp.asarray(np.deg2rad(turn), jnp.float32),
        primitive=jnp.asarray(primitive, jnp.int32),
        length=jnp.asarray(length, jnp.float32),
        rise=jnp.asarray(rise, jnp.int32),
        squat=jnp.asarray(primitive == Primitive.PASS_GATE),
    )


@pytest.mark.parametrize("name", TABLE_2)
def test_table_2(name):
    played, seconds = TABLE_2[name]
    assert float(duration(command(*played), DurationConfig().traced())) == pytest.approx(seconds, abs=1e-4)


def test_batch_is_as_one_by_one():
    batch = command(*(np.array(column) for column in zip(*(played for played, _ in TABLE_2.values()), strict=True)))
    times = duration(batch, jax.tree.map(lambda leaf: leaf[None], DurationConfig().traced()))
    np.testing.assert_allclose(times, [seconds for _, seconds in TABLE_2.values()], rtol=1e-5, atol=1e-4)


def mission_time(cells, up=0, down=0, gate=0):
    """Seconds for so many cells straight ahead, one measurement each."""
    durations = DurationConfig()
    walked = cells - up - down - gate
    return (cells * durations.measure + walked * durations.straight + up * durations.step_up
            + down * durations.step_down + gate * durations.pass_gate)  # fmt: skip


def test_85_cm_over_a_bump_take_the_10_minutes_of_experiment_5():
    """Table 3: 10.0 min (600 s)."""
    assert mission_time(17, up=1, down=1) == 602


def test_gate_of_experiment_6_takes_9_minutes():
    """Table 4: 9.2 min (552 s) for 104 cm, of which the last 10 need not be walked; two cells of gate."""
    assert mission_time(19, gate=2) == pytest.approx(552, abs=10)


@pytest.mark.parametrize("field", DurationConfig.model_fields)
@pytest.mark.parametrize("value", [-1.0, float("nan"), float("inf"), 1e6, "long"])
def test_bad_durations_are_refused(field, value):
    with pytest.raises(pydantic.ValidationError, match=field):
        DurationConfig(**{field: value})


@pytest.mark.parametrize(
    "values",
    [{"radius": 0}, {"radius": 1}, {"body_radius": 0.11}, {"standing": 0.33}, {"squatting": 0.02}, {"step": -0.01},
     {"standing": float("nan")}, {"arms": 2}],
)  # fmt: skip
def test_bad_robots_are_refused(values):
    with pytest.raises(pydantic.ValidationError):
        RobotConfig(**values)


def test_robot_of_the_paper_passes_its_gate_only_squatting():
    """Paper, 3.1 and Table 2: a gate of 37 cm."""
    robot = RobotConfig()
    assert robot.squatting < 0.37 < robot.standing and robot.step == 0.03
