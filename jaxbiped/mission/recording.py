"""The log of a mission as a file: for `jaxbiped view`, and for pages drawn without playing again.

A compressed `.npz`: arrays of fixed size by the names of `MissionLog`, ragged ones end to end with their lengths,
pictures as JPEG, and a JSON header with everything else. Points are kept to 1 mm, disparities to 1/64 px.
"""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from jaxtyping import Num, UInt8
from PIL import Image

from jaxbiped.errors import InputError
from jaxbiped.files import write_whole
from jaxbiped.mission.log import Ground, Mark, MissionLog, Outline, Picture, Walk

FORMAT = 1
FILE = "mission.npz"  # its name in a results folder
MILLIMETRE, FAR = 1000.0, 32.0  # [1/m] resolution of points; [m] their maximum distance
FRACTION = 64.0  # [1/px] resolution of disparities
QUALITY = 88  # of JPEG
WHOLE = ("classes", "levels", "true_xyyaw", "estimated_xyyaw", "time", "origin_xy", "size_xy", "goal_xy")
OPTIONAL = ("true_z", "squat", "seen")
NAMED = ("pitch", "level_height", "outcome")  # plain values


def save_log(path: str | Path, log: MissionLog, facts: Mapping[str, Any] | None = None) -> None:
    """Write a log as one file, whole or not at all.

    Args:
      facts: further facts about the mission, as JSON: its config, the scene's name, and so on.

    Raises:
      InputError: the file cannot be written.
    """
    header = {
        "format": FORMAT,
        "facts": dict(facts or {}),
        "action": log.action,
        "outlines": [vars(each) | {"corners_xy": each.corners_xy.tolist()} for each in log.outlines],
        "landmarks": [vars(each) for each in log.landmarks],
        **{name: getattr(log, name) for name in NAMED},
    }
    arrays = {name: getattr(log, name) for name in WHOLE}
    arrays |= {name: getattr(log, name) for name in OPTIONAL if getattr(log, name) is not None}
    arrays |= ragged("plan", [np.asarray(each, np.float32).reshape(-1, 2) for each in log.plan])
    if log.points:
        clouds = [np.clip(each, -FAR, FAR) * MILLIMETRE for each in log.points]
        arrays |= ragged("points", [np.rint(each).astype(np.int16) for each in clouds])
    if log.voxels is not None:
        arrays |= {"voxels": np.packbits(log.voxels, axis=None), "voxels_shape": np.array(log.voxels.shape)}
    if log.walk is not None:
        arrays |= {"walk_qpos": log.walk.qpos, "walk_moment": log.walk.moment}
    if log.terrain is not None:
        arrays |= {f"terrain_{name}": np.asarray(value) for name, value in vars(log.terrain).items()}
    if log.pictures:
        arrays |= ragged("left", [jpeg(each.left) for each in log.pictures])
        arrays["disparity"] = np.stack([np.rint(each.disparity * FRACTION).astype(np.uint16) for each in log.pictures])
    arrays["header"] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    write_whole(path, lambda file: np.savez_compressed(file, **arrays))


def load_log(path: str | Path) -> tuple[MissionLog, dict[str, Any]]:
    """A log written by `save_log`, and the facts that came with it.

    Raises:
      InputError: the file does not exist, is not a log, is damaged, or has another format.
    """
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
            header = json.loads(arrays["header"].tobytes())
    except FileNotFoundError:
        raise InputError("no such file", file=path) from None
    except (OSError, ValueError, TypeError, KeyError, EOFError, zipfile.BadZipFile):
        raise InputError("is not the log of a mission, or is damaged", file=path) from None
    found = header.get("format") if isinstance(header, dict) else None
    if found != FORMAT:
        raise InputError(f"this version reads logs of format {FORMAT}", file=path, field="format", value=found)
    try:
        return to_log(header, arrays), header["facts"]
    except (KeyError, TypeError, ValueError, OSError):
        raise InputError("is a damaged log of a mission", file=path) from None


def to_log(header: dict[str, Any], arrays: dict[str, np.ndarray]) -> MissionLog:
    """The log of a file's parts."""
    pictures = ()
    if "disparity" in arrays:
        lefts, disparities = pieces(arrays, "left"), arrays["disparity"].astype(np.float32) / np.float32(FRACTION)
        pictures = tuple(Picture(pixels(left), each) for left, each in zip(lefts, disparities, strict=True))
    voxels = None
    if "voxels" in arrays:
        shape = tuple(int(n) for n in arrays["voxels_shape"])
        voxels = np.unpackbits(arrays["voxels"], count=int(np.prod(shape))).astype(bool).reshape(shape)
    walk = Walk(arrays["walk_qpos"], arrays["walk_moment"]) if "walk_qpos" in arrays else None
    terrain = None
    if "terrain_heights" in arrays:
        terrain = Ground(arrays["terrain_heights"], arrays["terrain_origin_xy"], float(arrays["terrain_pitch"]))
    outlines = [
        Outline(**each | {"corners_xy": np.array(each["corners_xy"]), "way": tuple(each.get("way") or ()) or None})
        for each in header["outlines"]
    ]
    return MissionLog(
        **{name: arrays[name] for name in WHOLE},
        **{name: arrays.get(name) for name in OPTIONAL},
        **{name: header[name] for name in NAMED},
        action=tuple(header["action"]),
        outlines=tuple(outlines),
        landmarks=tuple(Mark(**each | {"xy": tuple(each["xy"])}) for each in header["landmarks"]),
        plan=tuple(each.astype(float) for each in pieces(arrays, "plan")),
        points=tuple((each / MILLIMETRE).astype(np.float32) for each in pieces(arrays, "points")),
        pictures=pictures,
        voxels=voxels,
        walk=walk,
        terrain=terrain,
    )


def ragged(name: str, each: Sequence[Num[np.ndarray, "..."]]) -> dict[str, np.ndarray]:
    """Arrays of different lengths as two: their concatenation, and their lengths."""
    return {name: np.concatenate(each), f"{name}_lengths": np.array([len(one) for one in each])}


def pieces(arrays: dict[str, np.ndarray], name: str) -> list[np.ndarray]:
    """The arrays concatenated by `ragged`; none if the name does not exist."""
    if name not in arrays:
        return []
    return np.split(arrays[name], np.cumsum(arrays[f"{name}_lengths"])[:-1])


def jpeg(image: UInt8[np.ndarray, "h w 3"]) -> UInt8[np.ndarray, "_"]:
    """A picture as JPEG bytes."""
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, "JPEG", quality=QUALITY)
    return np.frombuffer(buffer.getvalue(), np.uint8)


def pixels(data: UInt8[np.ndarray, "_"]) -> UInt8[np.ndarray, "h w 3"]:
    """The picture in JPEG bytes."""
    return np.array(Image.open(io.BytesIO(data.tobytes())).convert("RGB"))
