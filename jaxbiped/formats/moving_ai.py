"""Moving AI benchmark maps (`.map`) and their scenarios (`.scen`).

Format: Sturtevant, "Benchmarks for Grid-Based Pathfinding", IEEE T-CIAIG 4(2), 2012. A position is (x, y) =
(column, row), with (0, 0) the upper left character. Row i of the class grid is text row i, and column j its column:
nothing is flipped, so that cell (i, j) = (y, x); the grid's y axis therefore points down the page, and pictures
of such a map are flipped.

Deviation: water (`W`) is passable in the format, but only from water, and public scenarios hold queries within water
and even within trees. A walking robot cannot go there: both are obstacles, and such a query has no path.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64, Int

from jaxbiped.core.class_grid import Cell, ClassGrid
from jaxbiped.errors import InputError
from jaxbiped.files import read_text

TERRAIN = {
    ".": Cell.FLOOR,  # passable
    "G": Cell.FLOOR,  # passable
    "S": Cell.FLOOR,  # swamp, passable from ground and at the same cost
    "@": Cell.OBSTACLE,  # out of bounds
    "O": Cell.OBSTACLE,  # out of bounds
    "T": Cell.OBSTACLE,  # trees
    "W": Cell.OBSTACLE,  # water
}
LARGEST_SIDE = 1 << 16  # [cells]; a header beyond this is damage, not a map
HEADER = (["type"], ["height"], ["width"])
HEADER_LINES = 20  # within which the word 'map' must come, after comments and blank lines


@dataclass(frozen=True)
class Scenario:
    """`Q` queries on one map. Lengths are octile: 1 straight, sqrt(2) diagonal, corners never cut."""

    bucket: Int[np.ndarray, "Q"]
    start_ij: Int[np.ndarray, "Q 2"]  # row, column: the file's y, x
    goal_ij: Int[np.ndarray, "Q 2"]
    optimal: Float64[np.ndarray, "Q"]  # [cells]
    tolerance: Float64[np.ndarray, "Q"]  # [cells] largest error of `optimal`, from its digits


def load_map(path: str | Path, pitch: float = 0.05) -> ClassGrid:
    """Read a `.map` of type octile as floor and obstacles, all on level 0.

    Args:
      path: the file.
      pitch: [m] side of a cell, above 0; not in the file, so that a cell is a step of the robot by default.

    Raises:
      InputError: no such file, another type, a bad header, a row or column missing or in excess, an unknown
        character, a pitch that is not above 0.
    """
    lines = read_lines(path)
    start = lines.index("map") if "map" in lines[:HEADER_LINES] else None
    head = dict(line.split(maxsplit=1) for line in lines[:start][:HEADER_LINES] if len(line.split()) == 2)
    if "type" not in head and not {"height", "width"} <= head.keys():
        first = lines[0] if lines else ""
        raise InputError("must be a Moving AI map, whose first line is 'type octile'", file=path, value=first)
    if head.get("type", "octile") != "octile":
        raise InputError("must be octile: maps of other types are not supported", file=path, field="type",
                         value=head["type"])  # fmt: skip
    height, width = (side(head.get(key), path, key) for key in ("height", "width"))
    if start is None:
        place = next((k for k, line in enumerate(lines) if line.split()[:1] not in HEADER), len(lines))
        value = lines[place] if place < len(lines) else ""
        raise InputError("must be the word 'map'", file=path, field=f"line {place + 1}", value=value)
    rows = lines[start + 1 :]
    if len(rows) != height:
        raise InputError(f"must hold {height} rows, as its header says", file=path, field="map", value=len(rows))
    for i, row in enumerate(rows, start=start + 2):
        if len(row) != width:
            message = f"must be {width} characters long, as the header says"
            raise InputError(message, file=path, field=f"line {i}", value=len(row))
    cell_of = np.full(256, -1, np.int8)
    for character, cell in TERRAIN.items():
        cell_of[ord(character)] = cell
    characters = np.frombuffer("".join(rows).encode("latin-1", "replace"), np.uint8).reshape(height, width)
    classes = cell_of[characters]
    wrong = np.argwhere(classes < 0)
    if len(wrong):
        i, j = wrong[0]
        field = f"line {i + start + 2}, column {j + 1}"
        raise InputError(f"must be one of {' '.join(TERRAIN)}", file=path, field=field, value=rows[i][j])
    return ClassGrid(classes, np.zeros_like(classes), np.zeros(2), float(pitch))


def load_scenario(path: str | Path, grid: ClassGrid) -> Scenario:
    """Read a `.scen` file of version 1, or 0, that belongs to the map `grid`.

    Raises:
      InputError: no such file, another version, a line that is truncated or not a query, a map of another size, a
        position outside the map, a negative or infinite length, no queries.
    """
    lines = read_lines(path)
    first, *rest = lines or [""]
    words = first.split()
    says = words[:1] == ["version"]
    if not says:  # files of version 0 do not state it, nor need they state the size of their map
        rest = lines
    elif words[1:] not in (["1"], ["1.0"]):
        raise InputError("must begin with 'version 1'", file=path, field="line 1", value=first)
    numbered = [(k, line) for k, line in enumerate(rest, start=len(lines) - len(rest) + 1) if line]
    if not numbered:
        raise InputError("must hold at least one query", file=path)
    queries = [query(line, grid.shape, path, f"line {number}", sized=says) for number, line in numbered]
    bucket, start_ij, goal_ij, optimal, texts = zip(*queries, strict=True)
    return Scenario(
        np.array(bucket), np.array(start_ij), np.array(goal_ij), np.array(optimal), rounding(np.array(optimal), texts)
    )


def query(
    line: str, shape: tuple[int, int], path: str | Path, field: str, sized: bool
) -> tuple[int, tuple[int, int], tuple[int, int], float, str]:
    """One line of a scenario: bucket, start (i, j), goal (i, j), length, and the length as written.

    The size of the map may be missing unless it must be `sized`.
    """
    words = re.split("\t" if "\t" in line else " +", line)  # the map's name may contain any other character
    if not sized and len(words) == 7:
        words[2:2] = str(shape[1]), str(shape[0])
    allowed = "must hold bucket, map, width, height, start x, start y, goal x, goal y, optimal length"
    try:
        bucket, _, width, height, start_x, start_y, goal_x, goal_y, text = words
        bucket, width, height, start_x, start_y, goal_x, goal_y = map(
            int, (bucket, width, height, start_x, start_y, goal_x, goal_y)
        )
        length = float(text)
    except ValueError:
        raise InputError(allowed, file=path, field=field, value=line) from None
    if (height, width) != shape:
        message = f"must be for a map of the size of this one, {shape[1]} x {shape[0]}"
        raise InputError(message, file=path, field=field, value=f"{width} x {height}")
    for x, y in ((start_x, start_y), (goal_x, goal_y)):
        if not (0 <= x < width and 0 <= y < height):
            raise InputError(f"position must lie on the map, {width} x {height}", file=path, field=field, value=(x, y))
    if not 0 <= length < math.inf:
        raise InputError("optimal length must be finite and 0 or more", file=path, field=field, value=length)
    return bucket, (start_y, start_x), (goal_y, goal_x), length, text.strip()


def rounding(lengths: Float64[np.ndarray, "Q"], texts: tuple[str, ...]) -> Float64[np.ndarray, "Q"]:
    """Largest error of each length, from the digits with which its file was written.

    The public files were printed in three ways, which can be told from a whole file but not from a single number ("4"
    may be any of them): 2 decimals, 6 significant digits with trailing zeros dropped, and 8 decimals. So a length may
    have an error of half a unit of the file's last decimal or of its last significant digit (the sixth at least),
    whichever is greater, plus the rounding of sums.
    """
    decimals = max(len(text.partition(".")[2]) for text in texts)
    significant = max(6, *(len(text.replace(".", "").lstrip("0")) for text in texts))
    exponent = np.floor(np.log10(np.maximum(lengths, 1.0)))
    unit = np.maximum(10.0**-decimals if decimals else 0.0, 10.0 ** (exponent + 1 - significant))
    return 0.5 * unit + 1e-9 * lengths


def side(text: str | None, path: str | Path, field: str) -> int:
    """A height or a width of the header."""
    if text is None or not re.fullmatch("[0-9]{1,9}", text) or not 1 <= int(text) <= LARGEST_SIDE:
        message = f"must be a whole number of cells from 1 to {LARGEST_SIDE}"
        raise InputError(message, file=path, field=field, value=text or "")
    return int(text)


def read_lines(path: str | Path) -> list[str]:
    """The lines of a text file, without trailing spaces and tabs and without empty lines at the end of the file."""
    lines = [line.rstrip(" \t") for line in read_text(path, otherwise="latin-1").split("\n")]
    while lines and not lines[-1]:
        lines.pop()
    return lines
