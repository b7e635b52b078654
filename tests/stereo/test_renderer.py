"""Rendered pairs against a plain ray cast, and what rendering needs."""

import os
import subprocess
import sys
import threading
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas import load_scene
from jaxbiped.errors import InputError
from jaxbiped.geometry.pose import Pose
from jaxbiped.sensing.camera import mount, placed
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.stereo import renderer as rendering
from tests.reference import sensing as reference

CAMERA = CameraConfig()
SIZE = CAMERA.width, CAMERA.height


@pytest.fixture(scope="module")
def eye():
    made = rendering.Renderer(CAMERA)
    yield made
    made.close()


@pytest.fixture(scope="module")
def arena(request):
    return load_scene(request.config.rootpath / "configs" / "scenes" / "experiment_6.toml")[1]


def looking(arena, roll=0.0, pitch=0.0):
    """The true centre and axes of the camera of a robot at the start of an arena."""
    x, y, yaw = arena.start_xyyaw
    return placed(Pose(x, y, jnp.float32(0), yaw), mount(CAMERA.traced()), jnp.float32(roll), jnp.float32(pitch))


def cast_depth(arena, origin, basis):
    """Depth of every seventh pixel of every fifth row, by plain NumPy."""
    u, v = (size.astype(float).reshape(-1) for size in np.meshgrid(*(np.arange(n) for n in SIZE)))
    u, v = (values.reshape(SIZE[::-1])[2::5, 3::7].reshape(-1) for values in (u, v))
    centre = CAMERA.image.centre
    x, y = (u - centre[0]) / CAMERA.focal, (v - centre[1]) / CAMERA.focal
    depth, _ = reference.cast(jax.device_get(arena), np.asarray(origin, float), np.asarray(basis, float), x, y)
    return depth


@pytest.mark.parametrize(("roll", "pitch"), [(0.0, 0.0), (0.05, -0.04)])
def test_depth_is_that_of_a_ray_cast(eye, arena, roll, pitch):
    origin, basis = looking(arena, roll, pitch)
    eye.show(arena)
    depth = eye.depth(np.asarray(origin), np.asarray(basis))[2::5, 3::7].reshape(-1)
    expected = cast_depth(arena, origin, basis)
    assert (np.isfinite(depth) == np.isfinite(expected)).mean() > 0.999  # a pixel on an edge falls to either side
    both = np.isfinite(depth) & np.isfinite(expected)
    error = np.abs(depth[both] - expected[both])
    assert np.median(error) < 2e-6 and np.quantile(error, 0.98) < 1e-3  # landmarks are 0.3 mm thick


def test_right_image_is_the_left_one_moved_by_disparity(eye, arena):
    origin, basis = looking(arena)
    eye.show(arena)
    pair = eye.pair(np.asarray(origin), np.asarray(basis), 0.0, 0, depth=True)
    disparity = CAMERA.focal * CAMERA.baseline / pair.depth[300, 200]
    column = 200 - disparity
    row = pair.right[300].astype(float).mean(-1)
    there = np.interp(column, np.arange(CAMERA.width), row)
    assert abs(there - pair.left[300, 200].mean()) < 10  # grey levels, of a texture with a spread of 45


def test_noise_is_of_the_seed_and_of_the_wanted_size(eye, arena):
    origin, basis = looking(arena)
    eye.show(arena)
    place = np.asarray(origin), np.asarray(basis)
    clean, noisy, again, other = (
        eye.pair(*place, noise, seed) for noise, seed in ((0.0, 0), (1.5, 1), (1.5, 1), (1.5, 2))
    )
    assert np.array_equal(noisy.left, again.left) and np.array_equal(noisy.right, again.right)
    assert not np.array_equal(noisy.left, other.left)
    inner = (clean.left > 10) & (clean.left < 245)
    off = noisy.left.astype(float) - clean.left
    assert abs(off[inner].std() - np.hypot(1.5, 12**-0.5)) < 0.02  # and the rounding to whole grey levels
    assert abs(np.corrcoef(off[inner], (noisy.right.astype(float) - clean.right)[inner])[0, 1]) < 0.02


def test_plain_surfaces_are_drawn_plain(eye, arena):
    plain = replace(arena, boxes=replace(arena.boxes, contrast=0 * arena.boxes.contrast))
    origin, basis = looking(arena)
    spread = []
    for each in (arena, plain):
        eye.show(each)
        wall = eye.picture(np.asarray(origin), np.asarray(basis))[50:150, 20:100].astype(float)
        spread.append(wall.std(axis=(0, 1)).mean())
    assert spread[0] > 15 and spread[1] < 0.5


def test_another_thread_is_refused(eye, arena):
    origin, basis = looking(arena)
    said = []

    def elsewhere():
        try:
            eye.pair(np.asarray(origin), np.asarray(basis), 0.0, 0)
        except RuntimeError as error:
            said.append(str(error))

    thread = threading.Thread(target=elsewhere)
    thread.start()
    thread.join()
    assert "thread" in said[0]


def test_no_opengl_is_one_line_that_names_the_package(monkeypatch):
    def broken(name, width, height):
        raise ImportError(f"no library for {name}\nand more lines")

    monkeypatch.setattr(rendering, "opened", broken)
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    monkeypatch.setattr(rendering.sys, "platform", "linux")
    with pytest.raises(InputError, match=r"apt install libegl1.*no library for egl.*no library for osmesa") as error:
        rendering.Renderer(CAMERA)
    assert "\n" not in str(error.value)
    monkeypatch.setenv("MUJOCO_GL", "osmesa")
    with pytest.raises(InputError, match="apt install libosmesa6"):
        rendering.Renderer(CAMERA)


DRAW = """
import sys, numpy as np
from jaxbiped.arenas import load_scene
from jaxbiped.errors import InputError
from jaxbiped.sensing.config import CameraConfig
try:
    from jaxbiped.stereo.renderer import Renderer
    eye = Renderer(CameraConfig())
except InputError:
    sys.exit(7)
eye.show(load_scene(sys.argv[1])[1])
pair = eye.pair(np.array([0.3, 0.7, 0.36]), np.array([[0, -0.5, 0.866], [-1, 0, 0], [0, -0.866, -0.5]]), 0.0, 1)
np.savez(sys.argv[2], left=pair.left, right=pair.right, kind=type(eye.gl).__module__)
eye.close()
"""


@pytest.mark.slow
def test_osmesa_draws_what_egl_draws(request, tmp_path):
    """In processes of their own, each asked for one of them. Drivers may round colours: within two grey levels."""
    scene, drawn = request.config.rootpath / "configs" / "scenes" / "experiment_6.toml", {}
    for name in ("egl", "osmesa"):
        out = tmp_path / f"{name}.npz"
        asked = [sys.executable, "-c", DRAW, str(scene), str(out)]
        named = os.environ | {"MUJOCO_GL": name}
        ended = subprocess.run(asked, env=named, cwd=request.config.rootpath, timeout=300, check=False)
        if ended.returncode == 7:
            pytest.skip(f"this machine has no {name}")
        assert ended.returncode == 0
        drawn[name] = np.load(out)
        assert name in str(drawn[name]["kind"])
    for side in ("left", "right"):
        off = np.abs(drawn["egl"][side].astype(int) - drawn["osmesa"][side])
        assert np.mean(off) < 0.5 and np.quantile(off, 0.99) <= 2
