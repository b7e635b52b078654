"""PLY files of clouds and of meshes: the positions of their vertices.

Format: Turk, "The PLY Polygon File Format", 1994. Elements of any kind may come before and after the vertices,
properties of any kind beside x, y and z, including lists that state their own length. (trimesh, which writes
these files here, reads no lists of varying length, and splits and drops vertices of a textured mesh.)
"""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from jaxbiped.errors import InputError

TYPES = {
    **{"char": "i1", "uchar": "u1", "short": "i2", "ushort": "u2", "int": "i4", "uint": "u4", "float": "f4"},
    **{"double": "f8", "int8": "i1", "uint8": "u1", "int16": "i2", "uint16": "u2", "int32": "i4", "uint32": "u4"},
    **{"int64": "i8", "uint64": "u8", "float16": "f2", "float32": "f4", "float64": "f8"},
}
ENDS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
LONGEST_HEADER = 1_000_000  # bytes


@dataclass(frozen=True)
class Property:
    """One number of each record of an element, or a list of them."""

    name: str
    kind: str  # NumPy's, without its byte order
    length: str | None  # the kind of the number before a list that gives its length; None: not a list


@dataclass(frozen=True)
class Element:
    """A table of the file."""

    name: str
    count: int
    properties: tuple[Property, ...]


class CutShortError(Exception):
    """The file ends within an element; holds the number of complete records."""


def read_ply(path: Path) -> Float64[np.ndarray, "N 3"]:
    """x, y and z of all vertices, in the file's unit.

    Raises:
      InputError: not a PLY file, a bad header, no vertices with x, y and z, or a truncated file.
    """
    data = path.read_bytes().removeprefix(b"\xef\xbb\xbf")
    form, elements, start = read_header(data, path)
    if form == "ascii":
        body, end = numbers_of(data[start:], path), ""
        elements = [as_numbers(element) for element in elements]
    else:
        body, end = np.frombuffer(data, np.uint8, offset=start), ENDS[form]
    at, points = 0, None
    for element in elements:
        try:
            at, table = records(body, at, element, end)
        except CutShortError as error:
            what = "points" if element.name == "vertex" else f"records of {element.name}"
            raise InputError(f"is cut short: it holds {error} of {element.count} {what}", file=path) from None
        if element.name == "vertex" and points is None:
            points = np.stack([table[name].astype(np.float64) for name in "xyz"], axis=1)
    return points


def read_header(data: bytes, path: Path) -> tuple[str, list[Element], int]:
    """Format, elements, and the position where the data begin."""
    if not re.match(rb"ply[ \t]*[\r\n]", data):
        raise InputError("is not a PLY file: it must begin with ply", file=path)
    line_end = re.search(rb"\r\n|\n|\r", data)[0]  # all lines end like the first: what follows may be binary
    end = re.search(rb"[\r\n]end_header[ \t]*(" + line_end + rb"|$)", data[:LONGEST_HEADER])
    if end is None:
        raise InputError("is not a PLY file, or is cut short: its header does not end", file=path)
    form, elements = "", []
    for line in data[: end.start()].decode("latin-1").split(line_end.decode())[1:]:
        words = line.split()
        if words[:1] == ["format"]:
            form = words[1] if len(words) > 1 else ""
        elif words[:1] == ["element"]:
            if len(words) != 3 or not re.fullmatch("[0-9]{1,18}", words[2]):
                raise InputError("must be a name and a count", file=path, field="element", value=line)
            elements.append(Element(words[1], int(words[2]), ()))
        elif words[:1] == ["property"]:
            if not elements:
                raise InputError("must stand below an element", file=path, field="property", value=line)
            last, found = elements.pop(), read_property(words, path, line)
            if found.name in [p.name for p in last.properties]:
                raise InputError("must occur once", file=path, field="property", value=line)
            elements.append(Element(last.name, last.count, (*last.properties, found)))
    if form not in ENDS:
        raise InputError(f"must be one of {', '.join(ENDS)}", file=path, field="format", value=form)
    vertex = next((element for element in elements if element.name == "vertex"), None)
    names = [p.name for p in vertex.properties if p.length is None] if vertex else []
    if not set("xyz") <= set(names):
        message = f"must have vertices with x, y and z; it has {', '.join(names) or 'none'}"
        raise InputError(message, file=path, field="element vertex")
    return form, elements, end.end()


def read_property(words: list[str], path: Path, line: str) -> Property:
    """One header line that begins with property."""
    *kinds, name = words[1:] or [""]
    listed = kinds[:1] == ["list"]
    if len(kinds) != (3 if listed else 1) or not set(kinds[listed:]) <= TYPES.keys():
        message = "must be a type and a name, or list, two types and a name"
        raise InputError(message, file=path, field="property", value=line)
    return Property(name, TYPES[kinds[-1]], TYPES[kinds[1]] if listed else None)


def numbers_of(text: bytes, path: Path) -> np.ndarray:
    """All numbers of ASCII data, as bytes of float64, so that they can be read like binary data."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        try:
            numbers = np.fromstring(text, np.float64, sep=" ")
        except (DeprecationWarning, ValueError):
            raise InputError("is damaged: its header must be followed by numbers", file=path) from None
    return numbers.view(np.uint8)


def as_numbers(element: Element) -> Element:
    """The element of an ASCII file as represented in `numbers_of`."""
    doubles = tuple(Property(p.name, "f8", p.length and "f8") for p in element.properties)
    return Element(element.name, element.count, doubles)


def records(body: np.ndarray, at: int, element: Element, end: str) -> tuple[int, np.ndarray]:
    """The end of an element's records that begin at byte `at`; and its numbers that are not lists, by name."""
    lists = [k for k, p in enumerate(element.properties) if p.length is not None]
    if not element.count or not element.properties:
        return at, np.zeros(0, [(p.name, "f8") for p in element.properties if p.length is None])
    lengths = first_lengths(body, at, element, end)  # usually all are as long as the first
    kind, sizes = record_type(element, lengths, end)
    whole = (len(body) - at) // kind.itemsize
    if whole >= element.count:
        table = body[at : at + element.count * kind.itemsize].view(kind)
        if all((table[size] == lengths[k]).all() for k, size in sizes.items()):
            return at + element.count * kind.itemsize, table
    elif not lists:
        raise CutShortError(whole)
    return walk(body, at, element, end)


def record_type(element: Element, lengths: dict[int, int], end: str) -> tuple[np.dtype, dict[int, str]]:
    """The type of records with lists of these lengths, and the names of the numbers that give the lengths."""
    fields, sizes = [], {}
    for k, p in enumerate(element.properties):
        if p.length is not None:
            sizes[k] = f" length {k}"
            fields += [(sizes[k], end + p.length), (f" list {k}", end + p.kind, (lengths[k],))]
        else:
            fields.append((p.name, end + p.kind))
    return np.dtype(fields), sizes


def first_lengths(body: np.ndarray, at: int, element: Element, end: str) -> dict[int, int]:
    """The lengths of the lists in the record at byte `at`."""
    lengths = {}
    for k, p in enumerate(element.properties):
        if p.length is not None:
            lengths[k] = number_at(body, at, end + p.length)
            at += np.dtype(p.length).itemsize + lengths[k] * np.dtype(p.kind).itemsize
        else:
            at += np.dtype(p.kind).itemsize
    return lengths


def number_at(body: np.ndarray, at: int, kind: str) -> int:
    """The length of the list at byte `at`."""
    size = np.dtype(kind).itemsize
    length = float(body[at : at + size].view(kind)[0]) if at + size <= len(body) else -1.0
    if not (0 <= length <= len(body) and length == int(length)):
        raise CutShortError(0)
    return int(length)


def walk(body: np.ndarray, at: int, element: Element, end: str) -> tuple[int, np.ndarray]:
    """As `records`, for lists of varying length, one record after another."""
    plain = [p for p in element.properties if p.length is None]
    kind = np.dtype([(p.name, end + p.kind) for p in plain])
    kept = np.zeros((element.count if element.count <= len(body) else 0, kind.itemsize), np.uint8)
    for n in range(element.count):
        filled = 0
        for p in element.properties:
            size = np.dtype(p.kind).itemsize
            try:
                if p.length is not None:
                    at += np.dtype(p.length).itemsize + size * number_at(body, at, end + p.length)
                    size = 0
            except CutShortError:
                raise CutShortError(n) from None
            if at + size > len(body):
                raise CutShortError(n)
            if p.length is None:
                kept[n, filled : filled + size] = body[at : at + size]
                filled, at = filled + size, at + size
    return at, kept.reshape(-1).view(kind)
