"""Logs of missions as files: what is written is what is read, and what is no log is named in one line."""

import json
from dataclasses import fields, replace

import numpy as np
import pytest

from jaxbiped.errors import InputError
from jaxbiped.mission import recording as room
from jaxbiped.mission.log import MissionLog, Picture, Walk
from jaxbiped.mission.recording import load_log, save_log
from tests.report.test_pictures import mission

RNG = np.random.default_rng(0)
HALF_MILLIMETRE = 0.5e-3 + 1e-6  # what rounding to 1 mm leaves
JPEG_LOSS = 12  # grey levels that a smooth picture is off at most, at this quality


def whole(moments=4):
    """A log with everything in it: clouds of different sizes, one of them empty."""
    ramp = np.tile(np.linspace(20, 230, 48, dtype=np.uint8)[None, :, None], (32, 1, 3))
    disparity = np.where(RNG.random((32, 48)) < 0.3, 0, np.float32(RNG.integers(0, 2560, (32, 48)) / 16))
    first, *others = mission(moments).outlines
    return replace(
        mission(moments),
        outlines=(replace(first, top=0.03, way=(0.3, -0.1, 0.02, 0.5)), *others),
        true_z=np.linspace(0, 0.03, moments),
        squat=np.arange(moments) % 2 == 1,
        seen=np.arange(moments) % 3,
        points=tuple(RNG.uniform(-1, 2, (n, 3)).astype(np.float32) for n in (7, 0, 300, 1)[:moments]),
        voxels=RNG.random((moments, 7, 9, 15)) < 0.1,
        walk=Walk(RNG.normal(size=(11, 19)).astype(np.float32), np.linspace(0, 2.9, 11, dtype=np.float32)),
        pictures=tuple(Picture(np.roll(ramp, k, 0), disparity.astype(np.float32)) for k in range(moments)),
    )


def assert_equal(ours, theirs, name=""):
    if isinstance(theirs, tuple):
        assert len(ours) == len(theirs), name
        for k, pair in enumerate(zip(ours, theirs, strict=True)):
            assert_equal(*pair, f"{name}[{k}]")
    elif hasattr(theirs, "__dataclass_fields__"):
        for field in fields(theirs):
            assert_equal(getattr(ours, field.name), getattr(theirs, field.name), f"{name}.{field.name}")
    elif isinstance(theirs, np.ndarray):
        loss = {"points": HALF_MILLIMETRE, "left": JPEG_LOSS, "plan": 1e-6}
        tolerance = next((loss[part] for part in loss if part in name), 0)
        assert ours.shape == theirs.shape and ours.dtype == theirs.dtype, name
        np.testing.assert_allclose(ours.astype(float), theirs.astype(float), atol=tolerance, rtol=0, err_msg=name)
    else:
        assert ours == theirs, name


@pytest.mark.parametrize(
    "log", [whole(), mission(1), replace(mission(), walk=whole().walk)], ids=["all", "bare", "walk"]
)
def test_what_is_written_is_read(tmp_path, log):
    save_log(tmp_path / "mission.npz", log, {"scene": "a", "config": {"pitch": 0.05}})
    found, facts = load_log(tmp_path / "mission.npz")
    assert facts == {"scene": "a", "config": {"pitch": 0.05}}
    assert_equal(found, log)


def test_every_field_of_a_log_is_written():
    ragged = {"action", "outlines", "landmarks", "plan", "points", "pictures", "voxels", "walk", "terrain"}
    assert {field.name for field in fields(MissionLog)} == {*room.WHOLE, *room.OPTIONAL, *room.NAMED, *ragged}


def test_far_points_are_held_at_the_edge_of_what_is_written(tmp_path):
    points = tuple(np.full((1, 3), value, np.float32) for value in (1e6, -1e6, 0.0, 31.0))
    save_log(tmp_path / "m.npz", replace(mission(4), points=points))
    found = load_log(tmp_path / "m.npz")[0].points
    assert [float(each[0, 0]) for each in found] == pytest.approx([32, -32, 0, 31])


def damaged(tmp_path, how):
    path = tmp_path / "m.npz"
    save_log(path, whole())
    data = path.read_bytes()
    if how == "cut":
        path.write_bytes(data[: len(data) // 2])
    elif how == "other":
        path.write_text("not a log")
    elif how == "array":
        np.save(path.with_suffix(".npy"), np.zeros(3))
        path.with_suffix(".npy").rename(path)
    else:
        with np.load(path) as file:
            arrays = {name: file[name] for name in file.files}
        header = json.loads(arrays["header"].tobytes())
        if how == "format":
            header["format"] = 99
        elif how == "missing":
            del arrays["classes"]
        elif how == "short":
            arrays["time"] = arrays["time"][:-1]
        arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
        np.savez(path, **arrays)
    return path


@pytest.mark.parametrize("how", ["cut", "other", "array", "format", "missing", "short"])
def test_what_is_no_log_is_refused(tmp_path, how):
    path = damaged(tmp_path, how)
    said = {"format": "reads logs of format 1 (got 99)", "missing": "damaged", "short": "damaged"}.get(
        how, "is not the log"
    )
    with pytest.raises(InputError, match=r"m\.npz") as caught:
        load_log(path)
    assert said in str(caught.value)


def test_no_file(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        load_log(tmp_path / "nothing.npz")
