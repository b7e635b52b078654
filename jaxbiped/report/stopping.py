"""How watching a difference ended, in words."""

from __future__ import annotations

from pathlib import Path

from jaxbiped.report.answer_text import MEASURES
from jaxbiped.report.words import signed
from jaxbiped.study.stopping import read_stopping


def stopping_sentences(folder: str | Path) -> tuple[str, ...]:
    """How many arenas were used and left out, and what the interval means; empty if nothing was watched."""
    found = read_stopping(folder)
    if found is None:
        return ()
    measure = next(measure for measure in MEASURES if measure.name == found.measure)
    asked = f"{found.width * measure.scale:g}"
    looks = f"{found.looks} look{'s' * (found.looks != 1)}"
    start = "Stopped after" if found.reached else "Not stopped: all of"
    used = f"{start} {found.arenas:,} of at most {found.most:,} arenas and {looks}"
    if found.low is None:
        return (f"{used}; too few arenas, or too similar, for an interval of the difference in {measure.name}.",)
    limits = [signed(value * measure.scale, measure.digits) for value in (found.low, found.high)]
    wide = f"{(found.high - found.low) * measure.scale:.{measure.digits}f} wide"
    what = (
        f"the difference in {measure.name}, {found.first} minus {found.second}, is {' to '.join(limits)} {measure.unit}"
    )
    left = f" {found.most - found.arenas:,} arenas were left out." if found.arenas < found.most else ""
    sure = f"This interval holds at all looks at once with {100 * found.level:g} % (confidence sequence, on"
    sure += f" {found.samples:,} arenas); intervals and p-values elsewhere are those of a fixed number of arenas."
    return (f"{used}: {what}, {wide}, where {asked} was requested.{left} {sure}",)
