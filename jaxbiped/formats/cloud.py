"""Point clouds as files: .npz, .npy, .ply and .pcd, in metres."""

from __future__ import annotations

import io
import warnings
import zipfile
import zlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float32, Float64, UInt8

from jaxbiped.errors import InputError
from jaxbiped.files import reason, write_whole
from jaxbiped.formats.pcd import read_pcd
from jaxbiped.formats.ply import read_ply

SUFFIXES = (".npz", ".npy", ".ply", ".pcd")
AT_ONCE = 1_000_000  # points processed at a time
GREATEST = 1e9  # [m] largest coordinate: beyond it, metres are lost even in double precision


@dataclass(frozen=True)
class Cloud:
    """Points relative to an origin of their own: coordinates far from 0, as in map projections, do not fit float32."""

    points: Float32[np.ndarray, "N 3"]  # [m] from the origin; finite
    origin: Float64[np.ndarray, "3"]  # [m]
    dropped: int = 0  # points that were not finite


def recentred(points: np.ndarray, scale: float = 1.0) -> Cloud:
    """A cloud of points [N, 3] of any real type, times `scale`; points that are not finite are dropped.

    The origin is 0 for a cloud within 1 km of it, else its first point in whole metres.
    """
    kept, origin = [], None
    for start in range(0, len(points), AT_ONCE):
        part = np.asarray(points[start : start + AT_ONCE], np.float64) * scale
        part = part[(np.abs(part) < GREATEST).all(1)]  # NaN compares false
        if origin is None and len(part):
            origin = np.round(part[0]) if np.abs(part[0]).max() > 1000 else np.zeros(3)
        if len(part):
            kept.append((part - origin).astype(np.float32))
    points_kept = np.concatenate(kept) if kept else np.zeros((0, 3), np.float32)
    return Cloud(points_kept, np.zeros(3) if origin is None else origin, len(points) - len(points_kept))


def load(path: str | Path, scale: float = 1.0) -> Cloud:
    """Read a point cloud by the suffix of its file.

    Args:
      path: .npz with `points` [N, 3] (or `x`, `y`, `z` [N]), .npy [N, 3], .ply (its vertices), .pcd.
      scale: [m] one unit of the file; 0.001 for millimetres.

    Raises:
      InputError: no such file, an unknown suffix, a damaged or empty file, no finite point.
    """
    path = Path(path)
    suffix = path.suffix.lower()
    if suffix not in SUFFIXES:
        raise InputError(f"must be one of {', '.join(SUFFIXES)}", file=path, field="cloud", value=path.suffix)
    read = {".npz": read_npz, ".npy": read_npy, ".ply": read_ply, ".pcd": read_pcd}[suffix]
    try:
        if path.stat().st_size == 0:
            raise InputError("is empty", file=path)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # about odd NumPy headers
            points = read(path)
    except FileNotFoundError:
        raise InputError("no such file", file=path) from None
    except InputError:
        raise
    except OSError as error:
        raise InputError(f"cannot be read: {reason(error)}", file=path) from None
    except MemoryError:
        raise InputError("is too large for the memory of this machine", file=path) from None
    except Exception:  # readers raise errors of many types for damaged files
        raise InputError(f"is not a {suffix} point cloud, or is damaged", file=path) from None
    if points.ndim != 2 or points.shape[1] != 3 or points.dtype.kind not in "iuf":
        got = f"{points.dtype} {list(points.shape)}"
        raise InputError("must hold numbers [N, 3]", file=path, field="points", value=got)
    cloud = recentred(points, scale)
    if not len(cloud.points):
        what = f"all {cloud.dropped} are NaN or infinite" if cloud.dropped else "it has none"
        raise InputError(f"must hold finite points; {what}", file=path)
    return cloud


def read_npz(path: Path) -> np.ndarray:
    """`points`, or `x`, `y` and `z`."""
    if not zipfile.is_zipfile(path):
        raise InputError("is not an .npz, or is cut short", file=path)
    try:
        with open(path, "rb") as file, np.load(file, allow_pickle=False) as archive:
            if "points" in archive.files:
                return archive["points"]
            if all(name in archive.files for name in "xyz"):
                return np.stack([archive[name].ravel() for name in "xyz"], axis=1)
            names = ", ".join(archive.files) or "nothing"
    except (zipfile.BadZipFile, zlib.error, ValueError, KeyError, EOFError) as error:
        what = (
            "holds pickled objects, which are rejected" if "pickle" in str(error) else "is not an .npz, or is cut short"
        )
        raise InputError(what, file=path) from None
    raise InputError(f"must hold points [N, 3], or x, y and z [N]; it holds {names}", file=path)


def read_npy(path: Path) -> np.ndarray:
    """One array, memory-mapped."""
    return np.load(path, mmap_mode="r", allow_pickle=False)


def save_ply(
    path: str | Path, points: Float32[np.ndarray, "N 3"], colours: UInt8[np.ndarray, "N 3"] | None = None
) -> None:
    """Write points [m] and their RGB as binary PLY, whole or not at all; raise `InputError` if that fails."""
    import trimesh

    stream = io.BytesIO()
    trimesh.PointCloud(points, colors=colours).export(stream, file_type="ply")
    write_whole(path, lambda file: file.write(stream.getvalue()))
