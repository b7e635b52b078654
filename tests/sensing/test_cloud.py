"""Point clouds in all their files, and every way that such a file can be bad."""

import os

import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from pypcd4 import Encoding, PointCloud

from jaxbiped.errors import InputError
from jaxbiped.sensing import cloud
from jaxbiped.sensing.cloud import load, recentred, save_ply

POINTS = np.random.default_rng(0).uniform(-3, 3, (500, 3)).astype(np.float32)


def write(folder, kind):
    """POINTS as a file of some kind."""
    if kind == "npz":
        np.savez(folder / "cloud.npz", points=POINTS)
    elif kind == "xyz.npz":
        np.savez_compressed(folder / kind, **dict(zip("xyz", POINTS.T, strict=True)), weight=np.ones(500))
    elif kind == "npy":
        np.save(folder / "cloud.npy", POINTS)
    elif kind == "ply":
        save_ply(folder / "cloud.ply", POINTS, np.full((500, 3), 9, np.uint8))
    elif kind == "ascii.ply":
        trimesh.PointCloud(POINTS).export(folder / kind, encoding="ascii")
    elif kind == "mesh.ply":
        trimesh.Trimesh(POINTS, np.arange(498).reshape(-1, 3), process=False).export(folder / kind)
    else:
        PointCloud.from_xyz_points(POINTS).save(folder / kind, encoding=Encoding(kind.split(".")[0]))
    return next(folder / name for name in os.listdir(folder))


KINDS = ["npz", "xyz.npz", "npy", "ply", "ascii.ply", "mesh.ply", "ascii.pcd", "binary.pcd", "binary_compressed.pcd"]


@pytest.mark.parametrize("kind", KINDS)
def test_all_kinds_come_back(tmp_path, kind):
    got = load(write(tmp_path, kind))
    np.testing.assert_allclose(got.points, POINTS, atol=1e-6)  # ascii PLY has 8 decimals
    assert got.dropped == 0 and not got.origin.any() and got.points.dtype == np.float32


@pytest.mark.parametrize("kind", KINDS)
def test_files_cut_short(tmp_path, kind, capfd):
    path = write(tmp_path, kind)
    path.write_bytes(path.read_bytes()[:-700])
    with pytest.raises(InputError) as caught:
        load(path)
    assert str(caught.value).startswith(f"{path}: ") and "\n" not in str(caught.value)


def test_a_scale(tmp_path):
    np.savez(tmp_path / "mm.npz", points=(POINTS * 1000).astype(np.int32))
    np.testing.assert_allclose(load(tmp_path / "mm.npz", 0.001).points, POINTS, atol=0.001)


def test_points_that_are_not_finite_are_dropped_and_counted(tmp_path):
    points = POINTS.copy()
    points[3], points[7, 1], points[9, 2], points[11, 0] = np.nan, np.inf, -np.inf, 1e30
    np.save(tmp_path / "cloud.npy", points)
    got = load(tmp_path / "cloud.npy")
    assert got.dropped == 4 and np.isfinite(got.points).all()
    np.testing.assert_array_equal(got.points, np.delete(POINTS, [3, 7, 9, 11], axis=0))


@settings(max_examples=50, deadline=None)
@given(st.floats(-1e7, 1e7), st.floats(-1e7, 1e7), st.integers(1, 5))
def test_far_coordinates_keep_their_digits(x, y, part):
    far = POINTS[:20].astype(float) + np.array([x, y, 300.0])
    before, cloud.AT_ONCE = cloud.AT_ONCE, part
    got = recentred(far)
    cloud.AT_ONCE = before
    # A quarter of a millimetre where float32 alone would leave half a metre; 1 km from the origin it leaves 60 um.
    np.testing.assert_allclose(got.points.astype(float) + got.origin, far, atol=2.5e-4)
    if max(abs(x), abs(y)) > 2000:
        assert np.abs(got.points).max() < 20 and (got.origin == np.round(got.origin)).all()


EMPTY = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n"
PCD = "VERSION 0.7\nFIELDS {}\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 3\n"


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("c.ply", "", "is empty"),
        ("c.ply", "solid cube", "is no PLY file"),
        ("c.ply", "ply\nformat ascii 1.0\n", "is no .ply point cloud, or is damaged"),
        ("c.ply", EMPTY, "must hold finite points; it has none"),
        ("c.pcd", "hello", "is no .pcd point cloud, or is damaged"),
        ("c.pcd", PCD.format("x y i"), "must have the fields x, y and z; it has x, y, i"),
        ("c.npz", "PK", "is no .npz, or was cut short"),
        ("c.npy", "hello", "is no .npy point cloud, or is damaged"),
        ("c.las", "LASF", r"cloud: must be one of .npz, .npy, .ply, .pcd \(got '.las'\)"),
    ],
)
def test_bad_files(tmp_path, name, content, words, capfd):
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(InputError, match=words) as caught:
        load(path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"points": POINTS[:, :2]}, r"points: must hold numbers \[N, 3\] \(got 'float32 \[500, 2\]'\)"),
        ({"points": POINTS.astype(str)}, "must hold numbers"),
        ({"points": np.zeros((0, 3))}, "must hold finite points; it has none"),
        ({"points": np.full((4, 3), np.nan)}, "must hold finite points; all 4 are NaN or infinite"),
        ({"cells": POINTS}, r"must hold points \[N, 3\], or x, y and z \[N\]; it holds cells"),
        ({"x": np.zeros(3), "y": np.zeros(3), "z": np.zeros(4)}, "is no .npz, or was cut short|same shape"),
        ({"points": np.array([object()] * 3)}, "pickled"),
    ],
)
def test_bad_arrays(tmp_path, arrays, words):
    np.savez(tmp_path / "c.npz", **arrays)
    with pytest.raises(InputError, match=words):
        load(tmp_path / "c.npz")


def test_no_file(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load(tmp_path / "none.ply")
