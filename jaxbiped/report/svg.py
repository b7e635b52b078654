"""Matplotlib figures as SVG inside an HTML page, with colours and fonts taken from the page."""

from __future__ import annotations

import io
import re
from collections.abc import Iterator
from contextlib import contextmanager
from html import escape

from matplotlib.figure import Figure

from jaxbiped.report.style import own_style

# Colours in which a figure is drawn, and the variables of the page that replace them.
VARIABLES = {"#333333": "--ink", "#dddddd": "--line", "#f6f6f6": "--band", "#ffffff": "--paper"}
INK, LINE, PAPER = "#333333", "#DDDDDD", "#FFFFFF"
PIXELS_PER_UNIT = 1.4  # at most: a figure is not enlarged beyond the page's font size


@contextmanager
def themed() -> Iterator[None]:
    """Figures made in this context are drawn in the colours that `inline` knows."""
    ink = dict.fromkeys(("text.color", "axes.edgecolor", "axes.labelcolor", "xtick.color", "ytick.color"), INK)
    looks = {"font.size": 9, "axes.titlesize": 10, "axes.titleweight": "bold", "figure.facecolor": "none"}
    with own_style(ink | looks | {"axes.facecolor": "none", "axes.labelsize": 9}):
        yield


def inline(figure: Figure, name: str, description: str) -> str:
    """The figure as an `<svg>` element; the same figure gives the same text.

    Args:
      name: distinct in the page; keeps the names inside the figures apart.
      description: the text for screen readers.
    """
    buffer = io.StringIO()
    options = {"svg.fonttype": "none", "svg.hashsalt": name}
    with own_style(options):
        figure.savefig(buffer, format="svg", metadata={"Date": None, "Creator": None})
    text = buffer.getvalue()
    text = text[text.index("<svg") :]
    text = re.sub(r"<metadata>.*?</metadata>", "", text, flags=re.DOTALL)
    for colour, variable in VARIABLES.items():
        text = re.sub(colour, f"var({variable})", text, flags=re.IGNORECASE)
    text = re.sub(r"font: ([^'\";]*px) [^;\"]*", r"font: \1 var(--sans)", text)
    text = re.sub(r'\b(id="|url\(#|href="#)', rf"\g<1>{name}-", text)
    width, height = (float(value) for value in re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', text).groups())
    head = f'<svg role="img" aria-label="{escape(description)}" viewBox="0 0 {width:g} {height:g}"'
    head += f' style="max-width:{PIXELS_PER_UNIT * width:.0f}px">'
    return head + text[text.index(">") + 1 :]
