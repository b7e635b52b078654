"""Numbers formatted for reading. A value that is not valid is a dash, never a number."""

from __future__ import annotations

from jaxbiped.statistics import Estimate

NONE = "-"
AHEAD, BEHIND, OPEN = "ahead", "behind", "open"


def percent(value: float | None, digits: int = 1) -> str:
    """A fraction in percent, without the percent sign."""
    return NONE if value is None else f"{100 * value:.{digits}f}"


def number(value: float | None, digits: int) -> str:
    """A number, or a dash."""
    return NONE if value is None else f"{value:.{digits}f}"


def signed(value: float | None, digits: int) -> str:
    """A number with its sign; numbers that round to zero have none."""
    if value is None:
        return NONE
    text = f"{value:+.{digits}f}"
    return text[1:] if float(text) == 0 else text


def p_value(p: float | None) -> str:
    """A p-value as in "p = 0.031", without the p."""
    if p is None:
        return NONE
    return "< 0.001" if p < 0.001 else f"= {min(p, 1.0):.3f}"


def p_cell(p: float | None) -> str:
    """The same for a table: 0.031."""
    return p_value(p).removeprefix("= ")


def interval(value: Estimate, scale: float = 1.0, digits: int = 1) -> str:
    """As in "interval -1.2 to +3.4"; empty if there is none."""
    if value.low is None or value.high is None:
        return ""
    return f"interval {signed(value.low * scale, digits)} to {signed(value.high * scale, digits)}"


def brackets(value: Estimate, scale: float = 1.0, digits: int = 1, sign: bool = True) -> str:
    """As in "[-1.2, +3.4]"; a dash if there is none."""
    if value.low is None or value.high is None:
        return NONE
    write = signed if sign else number
    return f"[{write(value.low * scale, digits)}, {write(value.high * scale, digits)}]"
