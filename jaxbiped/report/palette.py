"""Colours of maps, as in the paper's figures, and of what is drawn on them."""

from __future__ import annotations

from jaxbiped.mapping.grid import Cell

COLOURS = {
    Cell.UNMEASURED: "#ffffff",
    Cell.FLOOR: "#cfcfcf",
    Cell.BUMP: "#7db1e6",
    Cell.GATE: "#b186d3",
    Cell.OBSTACLE: "#d9534f",
}
BUMP_SHADES = ("#7db1e6", "#4a8ad4", "#2763ab")  # one step from the base floor, two, more
PLAN, TRACK, INK = "#118a2e", "#222222", "#333333"
OUTLINES = {"obstacle": "#8e1f1c", "bump": "#163f75", "gate": "#5b2a86"}
MARKS = {"circle": {"mfc": "#ff3b3028", "mec": "#ff3b30"}, "square": {"mfc": "#0a60ff", "mec": "white"}}
