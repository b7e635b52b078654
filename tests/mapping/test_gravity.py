"""The floor and gravity of clouds, found: against the plane that they were made with."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from jaxbiped.mapping.floor import find_floor
from jaxbiped.mapping.gravity import FRAMES, find_upright, nearest_frame, set_upright, shortest

UP = np.array([0.0, 0.0, 1.0])


def room(seed=0, noise=0.003, walls=True, table=True):
    """A floor of 3 x 2 m at z = 0, two walls, a table, a bump and a few wild points."""
    rng = np.random.default_rng(seed)

    def face(low, high, n):
        return rng.uniform(low, high, (n, 3))

    parts = [face((0, 0, 0), (3, 2, 0), 9000), face((0.5, 0.5, 0.03), (0.8, 1.5, 0.03), 900)]
    if walls:
        parts += [face((3, 0, 0), (3, 2, 2), 12000), face((0, 2, 0), (3, 2, 2), 15000)]
    if table:
        parts += [face((1, 1, 0.7), (2, 1.8, 0.7), 6000)]
    points = np.concatenate(parts)
    wild = rng.uniform((-1, -1, -0.5), (4, 3, 3), (len(points) // 50, 3))
    return np.concatenate([points + noise * rng.normal(size=points.shape), wild])


def turned(points, axis, degrees, shift=(0, 0, 0)):
    """The cloud turned about an axis through the origin, and the rotation."""
    R = Rotation.from_rotvec(np.radians(degrees) * np.asarray(axis) / np.linalg.norm(axis)).as_matrix()
    return points @ R.T + shift, R


def off(up, want):
    """[deg] between two directions."""
    return np.degrees(np.arccos(np.clip(up @ want, -1, 1)))


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("degrees", [0, 5, 20])
def test_the_floor_of_a_room(seed, degrees):
    points, R = turned(room(seed), (1, -2, 0.3), degrees, (5, 6, 7))
    floor = find_floor(points, UP, np.radians(30), seed=seed)
    assert off(floor.up, R @ UP) < 0.15  # 3 mm of noise on 9,000 points would allow 0.01; the bump lies within reach
    assert abs(floor.offset - R @ UP @ np.array([5, 6, 7])) < 0.01  # at the origin of the frame, 10 m away
    assert np.abs((room(seed)[:9000] @ R.T + [5, 6, 7]) @ floor.up - floor.offset).max() < 0.02
    assert 0 < floor.score <= floor.share < 1 and floor.spread < 0.008


def test_a_ceiling_or_a_table_is_no_floor():
    points = room(walls=False)
    ceiling = np.random.default_rng(9).uniform((0, 0, 2.5), (3, 2, 2.5), (20000, 3))
    floor = find_floor(np.concatenate([points, ceiling]), UP, np.radians(30))
    assert abs(floor.offset) < 0.005


def test_a_known_direction_finds_the_height_alone():
    floor = find_floor(room() + 4 * UP, UP, 0.0)
    np.testing.assert_allclose(floor.up, UP)
    assert floor.offset == pytest.approx(4, abs=0.003)


@pytest.mark.parametrize("frame", ["z", "-y", "y"])
def test_gravity_is_found_in_the_usual_frames(frame):
    # Walls would be as good a floor, where up is not known: they make up for it when z is up only.
    points, _ = turned(room(walls=frame == "z"), (1, 1, 0.2), 8)
    axes = FRAMES[frame]
    upright = find_upright(points @ axes)  # so that axes @ points gives the room
    assert upright.frame == frame and abs(np.degrees(upright.tilt) - 8) < 0.5
    height = upright.apply(points @ axes)[:9000, 2]
    assert np.abs(height).max() < 0.03 and abs(height.mean()) < 0.003


@pytest.mark.parametrize("name", FRAMES)
def test_frames_are_rotations_with_their_axis_up(name):
    R = FRAMES[name]
    assert np.linalg.det(R) == pytest.approx(1) and nearest_frame(R[2].astype(float)) == name
    upright = set_upright(R[2].astype(float), 0.5, np.array([3.0, 4.0, 5.0]))
    np.testing.assert_allclose(upright.R, R, atol=1e-12)
    np.testing.assert_allclose(upright.shift, [0, 0, -0.5], atol=1e-12)


def test_maps_keep_their_coordinates():
    """A cloud with z up turns about its middle: x and y there stay what they were."""
    points, _ = turned(room(), (1, 0, 0), 3)
    upright = find_upright(points)
    pivot = np.median(points, axis=0)
    np.testing.assert_allclose(upright.apply(pivot[None])[0, :2], pivot[:2], atol=0.02)
    distances = np.linalg.norm(np.diff(points[:100], axis=0), axis=1)
    np.testing.assert_allclose(np.linalg.norm(np.diff(upright.apply(points[:100]), axis=0), axis=1), distances)


@pytest.mark.parametrize("seed", range(5))
def test_the_shortest_turn(seed):
    up = np.random.default_rng(seed).normal(size=3)
    up /= np.linalg.norm(up)
    up[2] = abs(up[2])
    R = shortest(up)
    np.testing.assert_allclose(R @ up, UP, atol=1e-12)
    np.testing.assert_allclose(R @ R.T, np.eye(3), atol=1e-12)
    assert np.degrees(Rotation.from_matrix(R).magnitude()) == pytest.approx(off(up, UP))


WALL = np.random.default_rng(2).uniform((0, 1, 0), (3, 1, 2), (20000, 3))


@pytest.mark.parametrize(
    "points",
    [
        np.zeros((0, 3)),
        np.zeros((1, 3)),
        np.zeros((5000, 3)),
        WALL + 0.003 * np.random.default_rng(3).normal(size=WALL.shape),
        np.random.default_rng(4).uniform(0, 1, (30000, 3)),
        np.random.default_rng(5).uniform((0, 0, 0), (1, 0, 0), (1000, 3)),
        np.random.default_rng(6).normal(size=(2, 3)),
    ],
    ids=["nothing", "one", "one place", "a wall", "fog", "a line", "two"],
)
def test_clouds_without_a_floor(points):
    assert find_floor(points, UP, np.radians(30)) is None
    assert find_upright(points, UP) is None


def test_the_camera_is_above_the_floor():
    ceiling = np.random.default_rng(7).uniform((0, 0, 2), (3, 2, 2), (20000, 3))
    assert find_floor(ceiling, UP, 0.3) is not None
    assert find_floor(ceiling, UP, 0.3, above=np.zeros(3)) is None


def test_a_seed_gives_the_same_floor():
    first, second = (find_floor(room(), UP, 0.5, seed=3) for _ in range(2))
    np.testing.assert_array_equal(first.up, second.up)


@pytest.mark.parametrize("noise", [0.001, 0.006, 0.012, 0.02])
def test_noisy_floors(noise):
    """The tolerance widens until a floor is found."""
    points, R = turned(room(noise=noise), (1, -1, 0), 6)
    floor = find_floor(points, UP, np.radians(20))
    # What a noisy table, a bump and the foot of walls add is not symmetric: some tenths of the noise.
    assert off(floor.up, R @ UP) < 0.1 + 15 * noise and abs(floor.offset) < 0.003 + 0.3 * noise


def test_stairs_are_no_slope():
    """Five treads of 3 cm: a plane laid across them holds more places within 15 mm than the floor does."""
    rng = np.random.default_rng(0)
    points = rng.uniform((0, 0, 0), (1.8, 1.4, 0), (40_000, 3))
    points[:, 2] = 0.03 * np.clip(np.floor((points[:, 0] - 0.6) / 0.2), 0, 4)
    floor = find_floor(points + 0.002 * rng.normal(size=points.shape), UP, np.radians(30))
    assert off(floor.up, UP) < 0.3 and abs(floor.offset) < 0.005
