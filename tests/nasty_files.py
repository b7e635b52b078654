"""Files as other people's programs and editors leave them, made of a good one: what must read the same, and what is
spoilt."""

from __future__ import annotations

import codecs
import re
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from jaxbiped.errors import InputError

# What only a library, or Python itself, would say.
FOREIGN = re.compile(
    r"np\.|numpy|float64|codec|Errno|identify image|validation error|type=|pydantic|yaml\.|while (parsing|scanning)"
    r"|expected|expecting|OpenCV\(|cv2|trimesh|pypcd|zlib|zip file|struct|unpack|buffer|dtype|index|NoneType"
    r"|literal|could not convert|broken data|Truncated|truncated|not enough image data",
)


def same(text: bytes) -> Iterator[tuple[str, bytes]]:
    """The same content to any reader: (what was done, file)."""
    yield "as it is", text
    yield "byte order mark", codecs.BOM_UTF8 + text
    yield "lines end in CR LF", text.replace(b"\n", b"\r\n")
    yield "lines end in CR", text.replace(b"\n", b"\r")
    yield "byte order mark and CR LF", codecs.BOM_UTF8 + text.replace(b"\n", b"\r\n")
    yield "spaces after each line", text.replace(b"\n", b"  \n")
    yield "no end of the last line", text.rstrip(b"\n")
    yield "empty lines at the end", text + b"\n\n"


def spoilt(content: bytes, step: int = 1) -> Iterator[tuple[str, bytes]]:
    """Cut at every `step`-th byte, in another encoding, filled with what does not belong there."""
    for end in range(0, len(content), step):
        yield f"cut at byte {end}", content[:end]
    yield "UTF-16", codecs.BOM_UTF16_LE + content.decode("latin-1").encode("utf-16-le")
    yield "bytes of no encoding", b"\xff\xfe\xfa" + content
    yield "zeros", bytes(200)
    yield "words", b"These are words, and nothing else.\n"
    for number in re.findall(rb"(?<![\w.])-?\d+\.?\d*(?![\w.])", content[:2000])[:40]:
        for other in (b"nan", b"inf", b"-1", b"1e999", b"99999999999999999999", b"9" * 5000, b"x", b""):
            yield f"{number!r} as {other[:20]!r}", content.replace(number, other, 1)


def read_or_refuse(read: Callable[[Path], object], path: Path, what: str) -> object | None:
    """What `read` gives, or None where it refused in one line of ours that names the file."""
    try:
        return read(path)
    except InputError as error:
        said = str(error)
        assert "\n" not in said and path.stem in said, f"{what}: {said}"
        ours = re.sub(r" \(got .*\)$", "", said.replace(str(path.parent), ""), flags=re.DOTALL)
        assert not FOREIGN.search(ours), f"{what}: {said}"
        return None
    except Exception as error:
        pytest.fail(f"{what}: {type(error).__name__}: {error}")
