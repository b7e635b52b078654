"""What the stage says is true of simulated robots."""

import math

import numpy as np
import pytest

from jaxbiped.biped import request as ask
from jaxbiped.errors import InputError
from jaxbiped.executors.config import WalkConfig
from jaxbiped.executors.primitive_schedule import targets
from jaxbiped.geometry.boxes import Boxes
from jaxbiped.mission.stage import Stage, nearest

ROBOT = WalkConfig().biped
AHEAD = targets(ask.straight(0.05).lasting(2.5), ROBOT)


def boxes(*arenas):
    """Each box (x, y, yaw, half_x, half_y, bottom, top); [A, M] with as many slots as the fullest arena needs."""
    most = max(map(len, arenas))
    rows = np.zeros((7, len(arenas), most))
    used = np.zeros((len(arenas), most), bool)
    for a, arena in enumerate(arenas):
        for m, box in enumerate(arena):
            rows[:, a, m], used[a, m] = box, True
    return Boxes(*rows, overhead=rows[5] > 0, contrast=np.ones_like(rows[0]), used=used)


def stage(*arenas, starts=None, **options):
    """One robot in each arena, at (x, y, z, yaw), (0, 0, 0, 0) by default."""
    made = Stage("native", len(arenas), boxes(*arenas), ROBOT, **options)
    count = len(arenas)
    made.enter(np.ones(count, bool), np.arange(count), np.zeros((count, 4)) if starts is None else np.array(starts))
    return made


def play(made, table):
    rest = np.repeat(table[-1:], 60, axis=0)
    for rows in np.array_split(np.concatenate([table, rest]), 10):
        made.play(np.tile(rows, (len(made.fell), 1, 1)))


FAR_BOX = (9.0, 9.0, 0.0, 0.1, 0.1, 0.0, 0.1)


def test_a_robot_stands_where_it_was_put_and_holds_its_body_as_the_map_believes():
    starts = [(0.3, 0.4, 0.0, 0.5), (0.3, 0.4, 0.03, -2.5)]
    made = stage([FAR_BOX], [(0.3, 0.4, 0.0, 0.3, 0.3, 0.0, 0.03)], starts=starts)
    play(made, made.rest(False))
    stands = made.stands(np.arange(2), np.zeros(2, bool))
    np.testing.assert_allclose(stands.feet, starts, atol=1e-3)
    np.testing.assert_allclose(stands.body[:, :4], starts, atol=1e-3)
    np.testing.assert_allclose(stands.body[:, 4:], 0, atol=math.radians(0.1))  # upright
    assert not made.fell.any() and not made.collided.any()


def test_a_tilted_body_is_told_by_its_angles():
    made = stage([FAR_BOX])
    yaw, pitch, roll = 0.4, 0.1, -0.05
    spin = lambda axis, angle: np.array([math.cos(angle / 2), *(math.sin(angle / 2) * np.eye(3)[axis])])  # noqa: E731
    attitude = product(product(spin(2, yaw), spin(1, pitch)), spin(0, roll))
    made.state.qpos[0, 3:7] = attitude
    body = made.stands(np.array([0]), np.array([False])).body[0]
    np.testing.assert_allclose(body[3:], [yaw, roll, pitch], atol=1e-9)


def product(a, b):
    """Of two quaternions."""
    w, x, y, z = a
    return np.array([[w, -x, -y, -z], [x, w, -z, y], [y, z, w, -x], [z, -y, x, w]]) @ b


def test_walking_moves_the_stand_as_it_should():
    made = stage([FAR_BOX], starts=[(0.0, 0.0, 0.0, math.pi / 2)])
    play(made, AHEAD)
    stands = made.stands(np.array([0]), np.array([False]))
    np.testing.assert_allclose(stands.feet[0], [0.0, 0.05, 0.0, math.pi / 2], atol=3e-3)


@pytest.mark.parametrize(
    ("box", "collides"),
    [
        ((0.11, 0.0, 0.0, 0.03, 0.3, 0.0, 0.20), True),  # a low wall, which only feet reach
        ((0.11, 0.0, 0.0, 0.03, 0.3, 0.0, 0.50), True),
        ((0.05, 0.0, 0.0, 0.02, 0.3, 0.36, 0.50), True),  # a lintel below the head
        ((0.05, 0.0, 0.0, 0.02, 0.3, 0.39, 0.50), False),  # above it
        ((0.11, 0.0, 0.0, 0.03, 0.3, 0.0, 0.03), False),  # a bump's edge, kicked
        ((0.30, 0.0, 0.0, 0.03, 0.3, 0.0, 0.50), False),  # further off
    ],
)
def test_walls_and_lintels_collide_and_kicked_bumps_do_not(box, collides):
    made = stage([box])
    made.expect(0, np.zeros(4), 0.03)
    play(made, AHEAD)
    assert made.collided[0] == collides
    assert not made.fell[0]


def test_a_foot_may_touch_what_it_steps_on_only():
    made = stage([(0.11, 0.0, 0.0, 0.03, 0.3, 0.0, 0.06)])
    made.expect(0, np.zeros(4), 0.06)
    play(made, AHEAD)
    assert not made.collided[0]
    made.enter(np.ones(1, bool), np.zeros(1, int), np.zeros((1, 4)))
    play(made, AHEAD)
    assert made.collided[0]


def test_a_robot_laid_down_has_fallen_and_neighbours_have_not():
    made = stage([FAR_BOX], [FAR_BOX], [FAR_BOX])
    qpos = made.state.qpos.copy()
    qpos[0, 2:7] = 0.08, math.cos(math.pi / 4), math.sin(math.pi / 4), 0.0, 0.0  # on its side
    qpos[2, 2:7] = 0.30, math.cos(0.3), math.sin(0.3), 0.0, 0.0  # in the air, about to topple
    made.state = made.backend.reset(np.array([True, False, True]), qpos)
    play(made, made.rest(False))
    np.testing.assert_array_equal(made.fell, [True, False, True])
    made.enter(np.array([True, False, True]), np.arange(3), np.zeros((3, 4)))
    play(made, made.rest(False))
    assert not made.fell.any()


def test_an_invalid_simulation_stands_nowhere():
    made = stage([FAR_BOX], [FAR_BOX])
    qvel = np.zeros((2, made.model.nv))
    qvel[0, 2] = 1e11
    made.backend.reset(np.array([True, False]), made.state.qpos, qvel)
    play(made, made.rest(False))
    stands = made.stands(np.arange(2), np.zeros(2, bool))
    assert np.isnan(stands.feet[0]).all() and np.isnan(stands.body[0]).all()
    assert np.isfinite(stands.feet[1]).all()
    assert not made.fell.any() and not made.collided.any()


def test_few_slots_hold_the_nearest_boxes_and_keep_them():
    row = [(0.5 * m, 0.0, 0.0, 0.1, 0.1, 0.0, 0.5) for m in range(8)]
    arena = boxes(row)
    assert nearest(arena, 0, np.array([0.0, 0.0]), 4) == [0, 1, 2, 3]
    made = stage(row)
    made.slots, made.held = 4, made.held[:, :4]  # as in MJX
    made.held[:] = -2
    made.expect(0, np.zeros(4), 0.0)
    first = made.held[0].copy()
    made.expect(0, np.array([1.1, 0.0, 0.0, 0.0]), 0.0)
    assert set(made.held[0]) == {1, 2, 3, 0} or set(made.held[0]) == {1, 2, 3, 4}
    kept = np.isin(first, made.held[0])
    np.testing.assert_array_equal(made.held[0][kept], first[kept])


def test_a_device_that_is_not_there_is_one_clear_line():
    with pytest.raises(InputError, match="native runs on a CPU"):
        stage([FAR_BOX], device="gpu")
