"""Point clouds in all their files, and every way that such a file can be bad."""

import os
import struct

import lzf
import numpy as np
import pytest
import trimesh
from hypothesis import given, settings
from hypothesis import strategies as st
from pypcd4 import Encoding, PointCloud

from jaxbiped.errors import InputError
from jaxbiped.formats import cloud
from jaxbiped.formats.cloud import load, recentred, save_ply

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
        ("c.ply", "solid cube", "is not a PLY file"),
        ("c.ply", "ply\nformat ascii 1.0\n", "is not a PLY file, or is cut short: its header does not end"),
        (
            "c.ply",
            EMPTY.replace("float z", "quad z"),
            "property: must be a type and a name, or list, two types and a name",
        ),
        (
            "c.ply",
            EMPTY.replace("z\nend", "w\nend"),
            "element vertex: must have vertices with x, y and z; it has x, y, w",
        ),
        (
            "c.ply",
            EMPTY.replace("ascii", "text"),
            r"format: must be one of ascii, binary_little_endian, .* \(got 'text'\)",
        ),
        ("c.ply", EMPTY.replace("vertex 0", "vertex 2") + "1 2 3\n", "is cut short: it holds 1 of 2 points"),
        ("c.ply", EMPTY.replace("vertex 0", "vertex 1") + "1 2 three\n", "its header must be followed by numbers"),
        ("c.ply", EMPTY, "must hold finite points; it has none"),
        ("c.pcd", "hello", "is not a PCD file, or is cut short: its header must end with DATA"),
        ("c.pcd", PCD.format("x y z").replace("SIZE 4", "SIZE 2"), "x: TYPE F and SIZE 2 are not supported"),
        ("c.pcd", PCD.format("x y z").replace("POINTS 1", "POINTS 2"), "POINTS: must be WIDTH times HEIGHT, 1 x 1"),
        (
            "c.pcd",
            PCD.format("x y z").replace("COUNT 1 1 1", "COUNT 1 1"),
            "COUNT: must have a value for each of the 3",
        ),
        ("c.pcd", PCD.format("x y z").replace("1 2 3", "1 2"), "is cut short: it holds 0 of 1 points"),
        ("c.pcd", PCD.format("x y z").replace("ascii", "lz4"), "DATA: must be one of ascii, binary, binary_compressed"),
        ("c.pcd", PCD.format("x y i"), "must have the fields x, y and z; it has x, y, i"),
        ("c.npz", "PK", "is not an .npz, or is cut short"),
        ("c.npy", "hello", "is not a .npy point cloud, or is damaged"),
        ("c.las", "LASF", r"cloud: must be one of .npz, .npy, .ply, .pcd \(got '.las'\)"),
    ],
)
def test_bad_files(tmp_path, name, content, words, capfd):
    path = tmp_path / name
    path.write_text(content)
    with pytest.raises(InputError, match=words) as caught:
        load(path)
    assert "\n" not in str(caught.value)


# What a header may leave out or add: (lines to drop, lines to put before DATA)
HEADERS = {
    "all lines": ((), ()),
    "no COUNT": (("COUNT",), ()),
    "no VERSION and no VIEWPOINT": (("VERSION", "VIEWPOINT"), ()),
    "no POINTS": (("POINTS",), ()),
    "no WIDTH and no HEIGHT": (("WIDTH", "HEIGHT"), ()),
    "no HEIGHT": (("HEIGHT",), ()),
    "an older version": (("VERSION",), ("VERSION .5",)),
    "comments and unknown lines": ((), ("# made by hand", "", "SENSOR left", "# SIZE 1", "A b", "C d", "E f")),
}


def pcd(points, form, dropped=(), added=(), padded=False, line_end="\n"):
    """A PCD file; padded, there are fields between its coordinates that nobody reads, some of COUNT 0."""
    kinds = [("x", "F", 4, 1), ("y", "F", 4, 1), ("z", "F", 4, 1)]
    if padded:
        gaps = [
            ("_", "U", 1, 4),
            ("ring", "U", 2, 1),
            ("_", "U", 1, 0),
            ("noise", "I", 8, 0),
            ("_", "F", 8, 3),
            ("_", "I", 1, 1),
        ]
        kinds = [gaps[0], kinds[0], *gaps[1:4], kinds[1], gaps[4], kinds[2], gaps[5]]
    head = [
        "VERSION 0.7",
        *(
            f"{key} {' '.join(str(kind[k]) for kind in kinds)}"
            for key, k in (("FIELDS", 0), ("SIZE", 2), ("TYPE", 1), ("COUNT", 3))
        ),
        f"WIDTH {len(points)}",
        "HEIGHT 1",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {len(points)}",
    ]
    head = [line for line in head if line.split()[0] not in dropped] + [*added, f"DATA {form}"]
    types = [(f"{name} {k}", f"<{kind.lower()}{size}", (count,)) for k, (name, kind, size, count) in enumerate(kinds)]
    table = np.ones(len(points), types)
    for name in table.dtype.names:
        if name[0] in "xyz":
            table[name][:, 0] = points[:, "xyz".index(name[0])]
    if form == "ascii":
        rows = [" ".join(repr(float(v)) for part in row for v in np.ravel(part)) for row in table]
        body = line_end.join([*rows, ""]).encode()
    else:
        body = table.tobytes()
    if form == "binary_compressed":
        columns = b"".join(np.ascontiguousarray(table[name]).tobytes() for name in table.dtype.names)
        packed = lzf.compress(columns, 2 * len(columns) + 100)
        body = struct.pack("<II", len(packed), len(columns)) + packed
    return (line_end.join(["# .PCD", *head, ""])).encode() + body


@pytest.mark.parametrize("header", HEADERS)
@pytest.mark.parametrize("form", ["ascii", "binary", "binary_compressed"])
@pytest.mark.parametrize("padded", [False, True])
def test_pcd_headers_as_the_point_cloud_library_reads_them(tmp_path, header, form, padded):
    if padded and header == "no COUNT":
        pytest.skip("padding has counts")
    path = tmp_path / "c.pcd"
    for count, line_end in ((500, "\n"), (1, "\r\n")):
        path.write_bytes(pcd(POINTS[:count], form, *HEADERS[header], padded=padded, line_end=line_end))
        np.testing.assert_allclose(load(path).points, POINTS[:count], atol=1e-6)
    if form != "ascii":
        path.write_bytes(pcd(POINTS, form, *HEADERS[header], padded=padded)[:-1])
        with pytest.raises(InputError, match="is cut short"):
            load(path)


def ply(form, lists, line_end="\n", before=False):
    """A PLY file with faces of 3 and 4 corners and, in each vertex, perhaps a list of fixed or varying length."""
    order = {"ascii": "<", "binary_little_endian": "<", "binary_big_endian": ">"}[form]
    faces = "element face 2{0}property list uchar int vertex_indices{0}property float quality{0}"
    head = f"ply{{0}}format {form} 1.0{{0}}comment element vertex 9{{0}}obj_info by hand{{0}}"
    head += faces if before else ""
    head += "element vertex 500{0}property double x{0}property float y{0}property short nx{0}property float z{0}"
    head += "property list uchar int16 tags{0}" if lists else ""
    head += "" if before else faces
    rows = []
    for n, (x, y, z) in enumerate(POINTS.tolist()):
        tags = {"fixed": [7, 8], "varying": list(range(n % 4))}.get(lists, [])
        rows.append(
            ([x, y, -3, z] + ([len(tags), *tags] if lists else []), "dfhf" + ("B" + len(tags) * "h" if lists else ""))
        )
    extra = [([3, 0, 1, 2, 0.5], "Biiif"), ([4, 0, 1, 2, 3, 0.5], "Biiiif")]
    rows = extra + rows if before else rows + extra
    if form == "ascii":
        body = line_end.join(" ".join(f"{v!r}" for v in row) for row, _ in rows).encode()
    else:
        body = b"".join(struct.pack(order + kinds, *row) for row, kinds in rows)
    return (head + "end_header{0}").format(line_end).encode() + body


@pytest.mark.parametrize("form", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("lists", [None, "fixed", "varying"])
def test_ply_files_with_lists_and_other_elements(tmp_path, form, lists):
    path = tmp_path / "c.ply"
    for line_end in ("\n", "\r\n", "\r"):
        for before in (False, True):
            path.write_bytes(ply(form, lists, line_end, before))
            np.testing.assert_allclose(load(path).points, POINTS, atol=1e-6)
    for cut in (5, 3000):
        path.write_bytes(ply(form, lists)[:-cut])
        with pytest.raises(InputError, match=r"is cut short: it holds \d+ of \d+ (points|records of face)"):
            load(path)


def test_a_textured_mesh_keeps_all_its_vertices(tmp_path):
    """A reader of meshes would part vertices at the seams of the texture, and drop what has no face."""
    head = "ply\nformat ascii 1.0\ncomment TextureFile none.png\nelement vertex 5\nproperty float x\nproperty float y\n"
    head += (
        "property float z\nproperty float s\nproperty float t\nelement face 1\nproperty list uchar int vertex_indices\n"
    )
    rows = [f"{x} {y} {z} 0.5 0.25" for x, y, z in POINTS[:5].tolist()]
    (tmp_path / "m.ply").write_text(head + "end_header\n" + "\n".join(rows) + "\n3 0 1 2\n")
    np.testing.assert_allclose(load(tmp_path / "m.ply").points, POINTS[:5], atol=1e-6)


@pytest.mark.parametrize(
    ("arrays", "words"),
    [
        ({"points": POINTS[:, :2]}, r"points: must hold numbers \[N, 3\] \(got 'float32 \[500, 2\]'\)"),
        ({"points": POINTS.astype(str)}, "must hold numbers"),
        ({"points": np.zeros((0, 3))}, "must hold finite points; it has none"),
        ({"points": np.full((4, 3), np.nan)}, "must hold finite points; all 4 are NaN or infinite"),
        ({"cells": POINTS}, r"must hold points \[N, 3\], or x, y and z \[N\]; it holds cells"),
        ({"x": np.zeros(3), "y": np.zeros(3), "z": np.zeros(4)}, "is not an .npz, or is cut short|same shape"),
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
