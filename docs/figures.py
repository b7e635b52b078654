"""The measured numbers of README and of the guide, which stand in `docs/figures.toml` alone; pages are filled from it.

    python docs/figures.py fill              # write the numbers into the pages
    python docs/figures.py check             # do pages and file agree? 1 where they do not
    python docs/figures.py rerun [RUN ...]   # print again what takes under a minute: 1 where a number differs

A page marks a number as `<!--figure:RUN.NAME-->5.8<!--/-->` (`figure_marks`).
"""

from __future__ import annotations

import argparse
import os
import re
import shlex
import subprocess
import sys
import tempfile
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import pydantic

from figure_marks import Spot, spots
from jaxbiped.config import Model, load_toml, parse
from jaxbiped.errors import InputError

ROOT = Path(__file__).parents[1]
QUICK = 60.0  # [s] what takes less is printed again by `rerun`
LIMIT = 600.0  # [s] that such a command may take on a slow machine
WIDTH = "150"  # columns of the terminal that commands print to, so that no table wraps
NUMBER = re.compile(r"(?:(?<![\w.])[-+])?\d+(?:,\d{3})*(?:\.\d+)?(?:e[-+]?\d+)?|\b(?:nan|inf)\b", re.IGNORECASE)


class Tolerance(Model):
    """How far a number that is printed again may be from the file's."""

    absolute: float = pydantic.Field(0.0, ge=0)
    relative: float = pydantic.Field(0.0, ge=0)
    """A share of the file's number."""

    def __str__(self) -> str:
        return f"{self.absolute:g}" if self.absolute or not self.relative else f"{100 * self.relative:g} %"

    def covers(self, wanted: float, found: float) -> bool:
        """Whether it is no further; NaN is never near."""
        return abs(found - wanted) <= max(self.absolute, self.relative * abs(wanted)) + 1e-9


def as_tolerance(given: Any) -> Any:
    """`0.5` is absolute, and `"5 %"` relative."""
    if isinstance(given, str) and (found := re.fullmatch(r"(\d+(?:\.\d+)?) ?%", given)):
        return {"relative": float(found[1]) / 100}
    return {"absolute": given}


Allowed = Annotated[Tolerance, pydantic.BeforeValidator(as_tolerance)]


class Figure(Model):
    """A number, or several that stand together, as pages show it."""

    value: str = pydantic.Field(min_length=1)
    pattern: re.Pattern[str] | None = None
    """Finds it in what the command prints: its groups, or all of it."""
    tolerance: Allowed | None = None
    """The run's, unless it is given."""

    @pydantic.model_validator(mode="before")
    @classmethod
    def _alone(cls, given: Any) -> Any:
        return {"value": given} if isinstance(given, str) else given

    @pydantic.field_validator("value")
    @classmethod
    def _value(cls, value: str) -> str:
        if "<!--" in value or "-->" in value:
            raise ValueError("must hold no comment")
        return value.strip("\n")


class Run(Model):
    """A command, and the figures that it printed."""

    command: str
    commit: str = pydantic.Field(pattern="^[0-9a-f]{7,40}$")
    """Of the version that printed them."""
    machine: str
    seconds: float = pydantic.Field(gt=0)
    """That the command took."""
    tolerance: Allowed
    figures: dict[str, Figure]

    @pydantic.field_validator("command")
    @classmethod
    def _command(cls, command: str) -> str:
        if not shlex.split(command):
            raise ValueError("must name a program")
        return command

    @pydantic.model_validator(mode="after")
    def _patterns(self) -> Run:
        for name, figure in self.figures.items():
            if self.seconds < QUICK and figure.pattern is None:
                raise ValueError(f"figures.{name} must have a pattern, as the command takes under {QUICK:g} s")
        return self


def read(path: Path) -> dict[str, Run]:
    """The runs of a file by their names.

    Raises:
      InputError: no such file, or something in it that is wrong.
    """
    return {name: parse(Run, data, file=f"{path}: {name}") for name, data in load_toml(path).items()}


def figures_of(runs: dict[str, Run]) -> dict[str, Figure]:
    """All figures, as pages name them."""
    return {f"{run}.{name}": figure for run, held in runs.items() for name, figure in held.figures.items()}


def pages_of(root: Path) -> list[Path]:
    """README and the guide."""
    return [*root.glob("README.md"), *sorted((root / "docs").rglob("*.md"))]


def wanted(spot: Spot, figures: dict[str, Figure]) -> str:
    """What must stand there."""
    if spot.name not in figures:
        raise InputError("is not in docs/figures.toml", file=spot.where, value=spot.name)
    value = figures[spot.name].value
    if ("\n" in value) != ("\n" in spot.shown):
        raise InputError("marks have lines of their own if a figure has several", file=spot.where, value=spot.name)
    return f"\n{value}\n" if "\n" in value else value


def filled(text: str, figures: dict[str, Figure], page: str) -> str:
    """A page with the file's numbers between its marks."""
    parts, end = [], 0
    for spot in spots(text, page):
        parts += [text[end : spot.start], wanted(spot, figures)]
        end = spot.end
    return "".join([*parts, text[end:]])


def fill(root: Path) -> list[str]:
    """Write the file's numbers into the pages; names the pages that changed. No page is written if one is wrong."""
    figures = figures_of(read(root / "docs" / "figures.toml"))
    texts = {page: page.read_text(encoding="utf-8") for page in pages_of(root)}
    names = {page: page.relative_to(root).as_posix() for page in texts}
    made = {page: filled(text, figures, names[page]) for page, text in texts.items()}
    changed = [page for page, text in texts.items() if made[page] != text]
    for page in changed:
        page.write_text(made[page], encoding="utf-8")
    return [f"{names[page]}: filled" for page in changed]


def check(root: Path) -> list[str]:
    """Where pages and file do not agree, in a line each: numbers that differ, and names that no page has."""
    figures = figures_of(read(root / "docs" / "figures.toml"))
    wrong, used = [], set()
    for page in pages_of(root):
        for spot in spots(page.read_text(encoding="utf-8"), page.relative_to(root).as_posix()):
            value = wanted(spot, figures)
            used.add(spot.name)
            if spot.shown != value:
                wrong.append(f"{spot.where}: {spot.name}: shows {spot.shown.strip()!r}, the file has {value.strip()!r}")
    return wrong + [f"docs/figures.toml: {name}: no page shows it" for name in figures if name not in used]


def rerun(root: Path, only: Sequence[str] = ()) -> list[str]:
    """Run the commands that take under a minute; names the figures that differ from the file by more than they may.

    Args:
      root: of the checkout.
      only: names of runs; all of them unless it is given.
    """
    runs = read(root / "docs" / "figures.toml")
    for name in only:
        if name not in runs or runs[name].seconds >= QUICK:
            raise InputError(f"is no run that takes under {QUICK:g} s", file=root / "docs" / "figures.toml", value=name)
    wrong = []
    for name, run in runs.items():
        if run.seconds < QUICK and (not only or name in only):
            print(f"{name}: {run.command}", flush=True)
            wrong += differences(name, run, output(run.command, root))
    return wrong


def output(command: str, root: Path) -> str:
    """What a command prints. It runs in an empty folder, since what it writes may be in the checkout already.

    Args:
      command: its words that are paths of the checkout lead there.
      root: of the checkout.

    Raises:
      InputError: it fails, cannot be run, or prints nothing.
    """
    words = shlex.split(command)
    own = {"python": [sys.executable], "jaxbiped": [sys.executable, "-m", "jaxbiped"]}
    words = own.get(words[0], words[:1]) + [str(root / word) if (root / word).exists() else word for word in words[1:]]
    environment = os.environ | {"COLUMNS": WIDTH, "PYTHONPATH": str(root)}
    try:
        with tempfile.TemporaryDirectory() as room:
            done = subprocess.run(
                words, cwd=room, env=environment, capture_output=True, encoding="utf-8", timeout=LIMIT, check=False
            )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise InputError(f"cannot be run: {error}", field="command", value=command) from None
    if done.returncode:
        said = (done.stderr.strip().splitlines() or ["nothing on stderr"])[-1]
        raise InputError(f"fails with exit status {done.returncode}: {said}", field="command", value=command)
    if not done.stdout.strip():
        raise InputError("prints nothing", field="command", value=command)
    return done.stdout


def differences(name: str, run: Run, printed: str) -> list[str]:
    """The figures of a run that are further from what was printed than they may be, in a line each."""
    wrong = []
    for own, figure in run.figures.items():
        found = figure.pattern.search(printed)
        if not found:
            field, value = f"{name}.{own}.pattern", figure.pattern.pattern
            raise InputError("finds nothing in what the command prints", field=field, value=value)
        said = " ".join(filter(None, found.groups())) if found.groups() else found[0]
        allowed = figure.tolerance or run.tolerance
        before, now = numbers(figure.value), numbers(said)
        near = len(before) == len(now) and all(map(allowed.covers, before, now))
        if not near or (not before and said != figure.value):
            wrong.append(f"{name}.{own}: the file has {figure.value}, the command prints {said} (tolerance {allowed})")
    return wrong


def numbers(text: str) -> list[float]:
    """Those in a text, in their order; NaN and infinity are numbers, too."""
    return [float(found.replace(",", "")) for found in NUMBER.findall(text)]


def main(words: Sequence[str] | None = None, root: Path = ROOT) -> int:
    """Do what the command line says; 1 where numbers differ, 2 for what cannot be used."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("action", choices=["fill", "check", "rerun"])
    parser.add_argument("runs", nargs="*", metavar="RUN", help="for rerun: these alone")
    given = parser.parse_args(words)
    try:
        said = {"fill": fill, "check": check, "rerun": partial(rerun, only=given.runs)}[given.action](root)
    except InputError as error:
        print(error, file=sys.stderr)
        return 2
    print(*said, sep="\n", end="\n" if said else "")
    return int(bool(said) and given.action != "fill")


if __name__ == "__main__":
    sys.exit(main())
