"""A map that forgets what has gone, and nothing else."""

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.geometry.pose import Pose, to_robot
from jaxbiped.mapping import Cell, GridSpec, MapConfig, classify, empty, update
from jaxbiped.mapping.fading import HIDDEN, Eye, missed
from jaxbiped.mapping.gridmap import voxel_of, voxelise
from jaxbiped.sensing import raycast
from jaxbiped.sensing.camera import MountedCamera, T_robot_camera, mount
from jaxbiped.sensing.presets import sensor_preset
from tests.mapping.scenes import BODY
from tests.sensing.scenes import CAMERA, IMAGE, as_jax, make

SPEC, PARAMS = GridSpec(), MapConfig().params()
NOISE = sensor_preset("rendered").stereo.traced()
POSE = Pose(*(jnp.float32(v) for v in (0.3, 0.7, 0.0, 0.0)))
BLOCK = (0.8, 0.7, 0.0, 0.06, 0.06, 0.0, 0.5)
GATE = [(0.8, 0.40, 0, 0.025, 0.08, 0, 0.5), (0.8, 1.0, 0, 0.025, 0.08, 0, 0.5), (0.8, 0.7, 0, 0.025, 0.24, 0.37, 0.5)]


@jax.jit
def look(grid_map, arena, pose, seed, keep):
    view = raycast.measure(arena, pose, CAMERA, NOISE, IMAGE, seed)
    eye = Eye(MountedCamera(CAMERA, mount(CAMERA), IMAGE), keep)
    return update(grid_map, view, pose, BODY, PARAMS, SPEC, eye=eye)


READ = jax.jit(partial(classify, params=PARAMS, spec=SPEC))


def mapped(*arenas, keep=0.0, poses=None):
    """Class grid after one measurement of each arena in turn."""
    grid_map = empty(SPEC)
    for k, arena in enumerate(arenas):
        pose = poses[k] if poses else POSE
        grid_map = look(grid_map, as_jax(make(arena)), pose, jnp.uint32(k), jnp.float32(keep))
    return np.asarray(READ(grid_map)[0])


def at(x, y):
    return int(y / SPEC.pitch), int(x / SPEC.pitch)


def test_what_has_gone_is_forgotten():
    block = mapped([BLOCK], [BLOCK])
    assert block[at(0.72, 0.7)] == Cell.OBSTACLE
    assert mapped([BLOCK], [BLOCK], [])[at(0.72, 0.7)] == Cell.FLOOR
    assert (mapped([BLOCK], [BLOCK], []) == Cell.OBSTACLE).sum() == 0
    kept = mapped([BLOCK], [BLOCK], [], keep=1.0)  # as the paper has it
    assert kept[at(0.72, 0.7)] == Cell.OBSTACLE


def test_what_has_come_is_seen():
    classes = mapped([], [], [], [BLOCK])
    assert classes[at(0.67, 0.7)] == Cell.OBSTACLE
    assert mapped([], [], [], [BLOCK], keep=1.0)[at(0.67, 0.7)] == Cell.FLOOR  # old votes still win


def test_what_stands_stays():
    whole = mapped([BLOCK], [BLOCK], keep=1.0)
    faded = mapped([BLOCK], [BLOCK], keep=0.5)
    # Far cells have few points in one view, and are unmeasured where that one alone counts.
    near = np.s_[:, : at(1.3, 0)[1]]
    assert np.mean(whole[near] != faded[near]) < 0.03
    assert not np.any((whole != faded) & (whole != Cell.UNMEASURED) & (faded != Cell.UNMEASURED) & (whole > faded))


def test_a_lintel_out_of_view_is_kept():
    far, near = POSE, replace(POSE, x=jnp.float32(0.62))
    classes = mapped(GATE, GATE, GATE, poses=[far, far, near])
    assert classes[at(0.8, 0.7)] == Cell.GATE
    assert Cell.GATE not in mapped(GATE, poses=[near])[:, : at(0.85, 0.7)[1]]  # so near it is not to be seen at all


@pytest.mark.parametrize("seed", range(2))
def test_what_is_missed_as_by_plain_loops(seed):
    rng = np.random.default_rng(seed)
    yaw = np.float32(rng.uniform(-0.4, 0.4))
    pose = replace(POSE, yaw=jnp.float32(yaw))
    arena = as_jax(make([BLOCK, (1.2, 0.5, 0.4, 0.1, 0.1, 0.0, 0.2)]))
    view = raycast.measure(arena, pose, CAMERA, NOISE, IMAGE, jnp.uint32(seed))
    at_ = mount(CAMERA)
    points = voxelise(view, *voxel_of(view, pose, PARAMS, SPEC), SPEC)
    found = np.asarray(missed(view, points, pose, MountedCamera(CAMERA, at_, IMAGE), SPEC))
    T = np.linalg.inv(np.asarray(T_robot_camera(at_), float))

    def pixel(x, y, z):
        right, down, depth = (T @ [x, y, z, 1.0])[:3]
        if depth < float(CAMERA.focal * CAMERA.baseline / CAMERA.max_disparity):
            return None
        if IMAGE.centre[0] + float(CAMERA.focal) * (right - float(CAMERA.baseline)) / depth < 0:
            return None  # not in view of the right camera
        column = (IMAGE.centre[0] + float(CAMERA.focal) * right / depth + 0.5) / IMAGE.stride[0]
        row = (IMAGE.centre[1] + float(CAMERA.focal) * down / depth + 0.5) / IMAGE.stride[1]
        return depth, row, column

    depths = np.full((IMAGE.rows + 2, IMAGE.columns + 2), np.inf)
    for x, y, z, weight in zip(*(np.asarray(v) for v in (view.x, view.y, view.z, view.weight)), strict=True):
        if weight > 0 and (hit := pixel(x, y, z)):
            i, j = int(np.floor(hit[1])) + 1, int(np.floor(hit[2])) + 1
            if 1 <= i <= IMAGE.rows and 1 <= j <= IMAGE.columns:
                depths[i, j] = min(depths[i, j], hit[0])
    checked = {True: 0, False: 0}
    for i, j, k in rng.integers(0, found.shape, (1500, 3)):
        x, y = to_robot(pose, jnp.float32((j + 0.5) * SPEC.pitch), jnp.float32((i + 0.5) * SPEC.pitch))
        hit = pixel(float(x), float(y), (k + SPEC.lowest) * SPEC.level_height)
        expected = False
        if hit:
            depth, row, column = hit
            if min(abs(row - round(row)), abs(column - round(column))) < 1e-3:
                continue  # rounding decides
            if 0 <= row < IMAGE.rows and 0 <= column < IMAGE.columns:
                around = depths[int(row) : int(row) + 3, int(column) : int(column) + 3].min()
                if abs(around - depth + HIDDEN) < 1e-4:
                    continue
                expected = bool(around > depth - HIDDEN and points[i, j, k] == 0)
        assert found[i, j, k] == expected
        checked[expected] += 1
    assert min(checked.values()) > 30


def test_a_view_of_nothing_forgets_nothing():
    arena = as_jax(make([BLOCK], floor_contrast=0.0))
    arena = replace(arena, boxes=replace(arena.boxes, contrast=jnp.zeros_like(arena.boxes.contrast)))
    before = look(empty(SPEC), as_jax(make([BLOCK])), POSE, jnp.uint32(0), jnp.float32(0))
    after = look(before, arena, POSE, jnp.uint32(1), jnp.float32(0))
    for a, b in zip(jax.tree.leaves(before), jax.tree.leaves(after), strict=True):
        np.testing.assert_array_equal(a, b)
