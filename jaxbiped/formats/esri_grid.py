"""Esri's ASCII grids of heights; see `elevation`."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from jaxbiped.errors import InputError
from jaxbiped.files import read_text
from jaxbiped.formats.heights import check_shape

NO_DATA = -9999.0  # default marker for missing data
CORNERS = (("xllcorner", "xllcenter"), ("yllcorner", "yllcenter"))


def read_asc(path: Path) -> tuple[Float64[np.ndarray, "P Q"], Float64[np.ndarray, "2"], float]:
    """Heights, position of the first, and pitch."""
    words = read_text(path, otherwise="latin-1").split()
    header: dict[str, float] = {}
    while len(words) > 2 * len(header) and re.match(r"[A-Za-z_]", key := words[2 * len(header)]):
        if key.lower() in ("nan", "inf", "infinity"):
            break
        value = words[2 * len(header) + 1 : 2 * len(header) + 2]
        if key.lower() in header:
            raise InputError("must be given once", file=path, field=key.lower())
        header[key.lower()] = number(value[0] if value else "", path, key.lower())
    body = words[2 * len(header) :]
    if "cellsize" not in header and "dx" in header:
        if header["dx"] != header.get("dy"):
            message = "must be equal: cells are square"
            raise InputError(message, file=path, field="dx, dy", value=(header["dx"], header.get("dy")))
        header["cellsize"] = header["dx"]
    for key in ("ncols", "nrows", "cellsize"):
        if key not in header:
            raise InputError("is missing from the header of an ASCII grid", file=path, field=key)
        whole = key != "cellsize"
        if not 0 < header[key] < np.inf or (whole and header[key] % 1):
            raise InputError(f"must be a {'whole ' * whole}number above 0", file=path, field=key, value=header[key])
    rows, columns, pitch = int(header["nrows"]), int(header["ncols"]), header["cellsize"]
    check_shape(rows, columns, path)
    origin = []
    for corner, centre in CORNERS:
        value = header[corner] + pitch / 2 if corner in header else header.get(centre, pitch / 2)
        if not np.isfinite(value):
            raise InputError("must be finite", file=path, field=corner if corner in header else centre, value=value)
        origin.append(value)
    if len(body) != rows * columns:
        message = f"must hold nrows x ncols = {rows * columns} heights after its header"
        raise InputError(message, file=path, value=len(body))
    try:
        heights = np.array(body, np.float64)
    except ValueError:
        bad = next(word for word in body if not is_number(word))
        raise InputError("must hold numbers after its header", file=path, value=bad) from None
    heights = np.where(heights == header.get("nodata_value", NO_DATA), np.nan, heights)
    return heights.reshape(rows, columns)[::-1].copy(), np.array(origin), pitch


def is_number(word: str) -> bool:
    """Whether Python can read a word as a number."""
    try:
        float(word)
    except ValueError:
        return False
    return True


def number(word: str, path: Path, key: str) -> float:
    """The value of a header's key."""
    if not is_number(word):
        raise InputError("must be a number", file=path, field=key, value=word)
    return float(word)
