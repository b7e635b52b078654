"""Tables of the HTML page: sheets whose numbers are aligned at the decimal point."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from jaxbiped.report.tables import Sheet
from jaxbiped.report.words import NONE

NUMBER = re.compile(r"[-+]?\d[\d,]*(\.\d+)?$")
INTERVAL = re.compile(r"(?:(\S+) )?\[(\S+), (\S+)\](.*)$")


@dataclass(frozen=True)
class Cell:
    """A number or words, perhaps with an interval. Pads are invisible digits that align decimal points."""

    value: str
    pad: str = ""
    low: str = ""
    low_pad: str = ""
    high: str = ""
    high_pad: str = ""
    width: int = 0  # characters of the widest limit in this column
    after: str = ""
    gap: bool = False  # whether to leave room for an interval, since other cells of the column have one


@dataclass(frozen=True)
class Line:
    """A row; without cells, the heading of the rows below it."""

    name: str
    cells: tuple[Cell, ...]


@dataclass(frozen=True)
class Grid:
    """A table of the page."""

    title: str
    columns: tuple[str, ...]
    groups: tuple[tuple[Line, ...], ...]
    notes: tuple[str, ...]


def to_grid(sheet: Sheet) -> Grid:
    """A sheet for the page. Cells are parsed in the format of tables.py: "5.8", "[4.2, 8.0]" or "5.8 [4.2, 8.0]"."""
    rows = [row for group in sheet.groups for row in group]
    columns = [aligned([parsed(row[k]) for row in rows]) for k in range(1, len(sheet.columns))]
    lines = [
        Line(typeset(row[0].strip()), tuple(column[i] for column in columns) if any(row[1:]) else ())
        for i, row in enumerate(rows)
    ]
    rest = iter(lines)
    groups = tuple(tuple(next(rest) for _ in group) for group in sheet.groups)
    return Grid(sheet.title, sheet.columns, groups, sheet.notes)


def parsed(text: str) -> Cell:
    """One cell of a sheet."""
    found = INTERVAL.match(text)
    if not found:
        return Cell(text.strip())
    value, low, high, after = found.groups(default="")
    return Cell(value, low=low, high=high, after=after.strip())


def aligned(cells: list[Cell]) -> list[Cell]:
    """The cells of one column, padded to the same number of decimals."""
    most = max((decimals(cell.value) for cell in cells), default=0)
    most_limits = max((decimals(limit) for cell in cells for limit in (cell.low, cell.high)), default=0)
    result = []
    for cell in cells:
        pads = {"pad": padding(cell.value, most)}
        pads |= {f"{end}_pad": padding(getattr(cell, end), most_limits) for end in ("low", "high")}
        result.append(replace(cell, **pads))
    ends = [limit for cell in result for limit in (cell.low + cell.low_pad, cell.high + cell.high_pad)]
    width = max(map(len, ends), default=0)
    beside = any(cell.value and cell.low for cell in result)
    return [
        replace(
            cell,
            width=width,
            value=typeset(cell.value),
            low=typeset(cell.low),
            high=typeset(cell.high),
            gap=beside and not cell.low,
        )
        for cell in result
    ]


def decimals(text: str) -> int:
    """Digits after the point of a number; 0 for anything else."""
    found = NUMBER.match(text)
    return len(found.group(1) or ".") - 1 if found else 0


def padding(text: str, wanted: int) -> str:
    """The digits that a number lacks to have the wanted number of decimals."""
    if not NUMBER.match(text) or decimals(text) == wanted:
        return ""
    return "0" * (wanted - decimals(text)) if decimals(text) else "." + "0" * wanted


def typeset(text: str) -> str:
    """Text with true minus signs, and a true dash for a missing value."""
    return "–" if text == NONE else re.sub(r"(?<![\w.])-(?=[\d ])", "−", text)
