"""How metres are shown on the axes of a picture."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Axis:
    """The unit of the axes, and whether y points down the page."""

    unit: str = "cm"
    per_metre: float = 100.0
    y_down: bool = False


CENTIMETRES, METRES = Axis(), Axis("m", 1.0)
