"""Marks round the measured numbers of a page: `<!--figure:RUN.NAME-->5.8<!--/-->`, comments that no reader sees.

What has several lines, such as a table, has its marks on lines of their own. A mark that begins the line of a paragraph
would end the paragraph, both on GitHub and in the guide, and one inside code is no comment; both are refused.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass

from jaxbiped.errors import InputError

COMMENT = re.compile(r"<!--(.*?)(-->|\Z)", re.DOTALL)
OPENING = re.compile(r"figure:([\w-]+\.[\w-]+)")
LINE_START = re.compile(r"[ \t>]*(?:(?:[-*+]|\d+[.)])[ \t]+)*")  # after which a comment begins a block of HTML


@dataclass(frozen=True)
class Spot:
    """A marked place of a page."""

    where: str  # page and line, for people
    name: str
    start: int  # of what stands between the marks
    end: int
    shown: str


def unmarked(text: str) -> str:
    """A page without its marks, as readers see it."""
    return COMMENT.sub(lambda found: "" if found[1] == "/" or OPENING.fullmatch(found[1]) else found[0], text)


def spots(text: str, page: str) -> Iterator[Spot]:
    """The marked places of a page, in their order.

    Raises:
      InputError: a mark that is not closed, or not opened, that cannot be read, or that readers would see.
    """
    opened: re.Match[str] | None = None
    for found in COMMENT.finditer(text):
        words, where = found[1], line_of(text, found, page)
        if words == "/" and found[2]:
            if opened is None:
                raise InputError("closes a mark that is not open", file=where, value=found[0])
            yield placed(text, opened, found.start(), page)
            opened = None
        elif OPENING.fullmatch(words) and found[2]:
            if opened is not None:
                raise InputError(f"mark before that of {words} is not closed", file=where, value=opened[0])
            opened = found
        elif "figure" in words or words.strip() == "/":
            raise InputError("marks are <!--figure:RUN.NAME--> and <!--/-->", file=where, value=found[0].split("\n")[0])
    if opened is not None:
        raise InputError("mark is not closed", file=line_of(text, opened, page), value=opened[0])


def line_of(text: str, found: re.Match[str], page: str) -> str:
    """Page and line, for people."""
    return f"{page}:{1 + text.count(chr(10), 0, found.start())}"


def placed(text: str, opened: re.Match[str], end: int, page: str) -> Spot:
    """What stands between two marks, if they are where comments stay comments, and leave the text around them alone."""
    where = line_of(text, opened, page)
    shown, before = text[opened.end() : end], text[text.rfind("\n", 0, opened.start()) + 1 : opened.start()]
    if text.count("`", 0, opened.start()) % 2:
        raise InputError("marks inside code can be seen", file=where, value=opened[0])
    if "\n" in shown and (before or not shown.startswith("\n") or not shown.endswith("\n")):
        raise InputError("marks of several lines must have lines of their own", file=where, value=opened[0])
    if "\n" not in shown and LINE_START.fullmatch(before):
        raise InputError("a mark cannot begin a line: it would end the paragraph", file=where, value=opened[0])
    return Spot(where, OPENING.fullmatch(opened[1])[1], opened.end(), end, shown)
