"""Errors of MuJoCo's compiler as one line in the form of our own messages."""

from __future__ import annotations

import re

PREFIX = re.compile(r"^(XML Error|Error|ParseXML|Schema violation|XML parse error \d+): *", re.IGNORECASE)
PLACE = re.compile(r"Element (?:name )?'([^']*)'(?:, id \d+)?,? line (\d+)|Line number=(\d+)")


def mjcf_problem(error: Exception) -> str:
    """Line, element and diagnosis of a compiler's error, such as "line 3, torso: mass must be positive"."""
    text = str(error)
    place = PLACE.search(text)
    where = []
    if place:
        where.append(f"line {place[2] or place[3]}")
        where += [place[1]] if place[1] else []
    said = text[: place.start()] if place and place[2] else text
    lines = [line.strip() for line in said.splitlines() if line.strip()]
    if place and place[3]:
        lines = ["is not well-formed XML"]
    message = " ".join(lines)
    while (shorter := PREFIX.sub("", message)) != message:
        message = shorter
    return f"{', '.join(where)}: {message}" if where else message
