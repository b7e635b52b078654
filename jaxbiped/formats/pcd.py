"""PCD files of the Point Cloud Library: the positions of their points.

PCL's own reader takes a missing COUNT as 1, skips fields of COUNT 0, and needs either POINTS or WIDTH and HEIGHT;
pypcd4, which unpacks the data here, needs each line. So it is given a rewritten header.
"""

from __future__ import annotations

import io
import re
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from jaxbiped.errors import InputError

KINDS = {"F": (4, 8), "I": (1, 2, 4, 8), "U": (1, 2, 4, 8)}  # of TYPE: what SIZE may be
FORMS = ("ascii", "binary", "binary_compressed")


@dataclass(frozen=True)
class Field:
    """A field of each point."""

    name: str
    kind: str  # F, I or U
    size: int  # bytes
    count: int  # numbers


def read_pcd(path: Path) -> np.ndarray:
    """x, y and z [N, 3] of all points, in the file's unit.

    Raises:
      InputError: not a PCD file, a bad header, no fields x, y and z, or a file that is truncated or damaged.
    """
    data = path.read_bytes().removeprefix(b"\xef\xbb\xbf")
    fields, points, form, body = read_header(data, path)
    names = [field.name for field in fields]
    missing = [name for name in "xyz" if name not in [field.name for field in fields if field.count == 1]]
    if missing:
        raise InputError(f"must have the fields x, y and z; it has {', '.join(names)}", file=path)
    if form == "ascii":
        return from_ascii(body, fields, points, path)
    record = sum(field.size * field.count for field in fields)
    if form == "binary" and len(body) < points * record:
        raise InputError(f"is cut short: it holds {len(body) // record} of {points} points", file=path)
    if form == "binary_compressed" and points:
        packed, unpacked = (int.from_bytes(body[k : k + 4], "little") for k in (0, 4))
        if len(body) < 8 + packed or unpacked != points * record:
            raise InputError(f"is cut short or damaged: its data are not {points} points", file=path)
    from pypcd4 import PointCloud

    cloud = PointCloud.from_fileobj(io.BytesIO(whole_header(fields, points, form) + body))
    return cloud.numpy(("x", "y", "z"))


def read_header(data: bytes, path: Path) -> tuple[list[Field], int, str, bytes]:
    """Fields of COUNT 1 or more, the number of points, how they are packed, and their data."""
    end = re.search(rb"(?:^|[\r\n])[ \t]*DATA[ \t]+(\w+)[ \t]*(\r\n|\n|\r|$)", data[:1_000_000])
    if end is None:
        raise InputError("is not a PCD file, or is cut short: its header must end with DATA", file=path)
    form = end[1].decode("latin-1")
    if form not in FORMS:
        raise InputError(f"must be one of {', '.join(FORMS)}", file=path, field="DATA", value=form)
    lines = re.split(r"\r\n|\n|\r", data[: end.start()].decode("latin-1"))
    said = {words[0]: words[1:] for line in lines if (words := line.split()) and not words[0].startswith("#")}
    names = said.get("FIELDS", said.get("COLUMNS", []))
    if not names:
        raise InputError("is missing or empty", file=path, field="FIELDS")
    kinds, sizes = said.get("TYPE", ["F"] * len(names)), said.get("SIZE", ["4"] * len(names))
    counts = said.get("COUNT", ["1"] * len(names))
    for key, values in (("TYPE", kinds), ("SIZE", sizes), ("COUNT", counts)):
        if len(values) != len(names):
            raise InputError(f"must have a value for each of the {len(names)} fields", file=path, field=key,
                             value=" ".join(values))  # fmt: skip
    fields = []
    for name, kind, size, count in zip(names, kinds, sizes, counts, strict=True):
        if size not in map(str, KINDS.get(kind, ())):
            message = f"TYPE {kind} and SIZE {size} are not supported: F has 4 or 8 bytes, I and U 1, 2, 4 or 8"
            raise InputError(message, file=path, field=name)
        if not re.fullmatch("[0-9]{1,9}", count):
            raise InputError("must hold whole numbers", file=path, field="COUNT", value=" ".join(counts))
        fields.append(Field(name, kind, int(size), int(count)))
    return [field for field in fields if field.count], how_many(said, path), form, data[end.end() :]


def how_many(said: dict[str, list[str]], path: Path) -> int:
    """The number of points: POINTS, or WIDTH times HEIGHT, which must agree if both are present."""
    found = {}
    for key in ("WIDTH", "HEIGHT", "POINTS"):
        if key in said:
            text = " ".join(said[key])
            if not re.fullmatch("[0-9]{1,18}", text):
                raise InputError("must be a whole number", file=path, field=key, value=text)
            found[key] = int(text)
    width, height, points = found.get("WIDTH"), found.get("HEIGHT", 1), found.get("POINTS")
    if width is None and points is None:
        raise InputError("is missing, and so are WIDTH and HEIGHT", file=path, field="POINTS")
    if width is not None and points is not None and width * height != points:
        raise InputError(f"must be WIDTH times HEIGHT, {width} x {height}", file=path, field="POINTS", value=points)
    return width * height if points is None else points


def from_ascii(body: bytes, fields: list[Field], points: int, path: Path) -> np.ndarray:
    """x, y and z of points in ASCII."""
    columns = sum(field.count for field in fields)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            numbers = np.fromstring(body, np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            raise InputError("is damaged: its header must be followed by numbers", file=path) from None
    if len(numbers) < points * columns:
        raise InputError(f"is cut short: it holds {len(numbers) // columns} of {points} points", file=path)
    starts = np.cumsum([0] + [field.count for field in fields])
    names = [field.name for field in fields]
    return numbers[: points * columns].reshape(points, columns)[:, [starts[names.index(name)] for name in "xyz"]]


def whole_header(fields: list[Field], points: int, form: str) -> bytes:
    """A complete header; fields that are not read get made-up names."""
    names = [field.name if field.name in "xyz" else f"f{k}" for k, field in enumerate(fields)]
    lines = (
        "VERSION 0.7",
        f"FIELDS {' '.join(names)}",
        f"SIZE {' '.join(str(field.size) for field in fields)}",
        f"TYPE {' '.join(field.kind for field in fields)}",
        f"COUNT {' '.join(str(field.count) for field in fields)}",
        f"WIDTH {points}",
        "HEIGHT 1",
        "VIEWPOINT 0 0 0 1 0 0 0",
        f"POINTS {points}",
        f"DATA {form}",
    )
    return ("\n".join(lines) + "\n").encode()
