"""Pictures with more than 8 bits per sample: detection, and reading without loss of bits.

Pillow reads every kind of picture, but silently reduces colour of more than 8 bits to 8, confuses white and black in
deep TIFF files, and does not support some of these. OpenCV keeps the bits, if asked to.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import sys
import warnings
from collections.abc import Iterator

import cv2
import numpy as np
from PIL import TiffImagePlugin

PNG, TIFF = b"\x89PNG\r\n\x1a\n", (b"II*\0", b"MM\0*", b"II+\0", b"MM\0+")
DEEP_COLOUR = ("JPEG2000", "AVIF")  # other formats that may hold it; their headers are not read
WIDTH, HEIGHT, BITS, COLOURS = 256, 257, 258, 262  # tags of TIFF
WHITE_IS_0, BLACK_IS_0, RGB = 0, 1, 2  # of COLOURS


class UnsupportedError(Exception):
    """A kind of picture that appears to be intact, but that cannot be read here; the text says which."""


def sample_bits(data: bytes) -> int:
    """Bits per sample of a picture, from the first kilobytes of its file; 8 if its format holds no more."""
    if data.startswith(PNG):
        return data[24] if len(data) > 24 else 8
    if re.match(rb"P[2356]\s", data):
        words = re.sub(rb"#[^\r\n]*", b"", data[:4096]).split(maxsplit=4)
        return 16 if len(words) > 3 and words[3].isdigit() and int(words[3][:9]) > 255 else 8
    if data.startswith(TIFF):
        bits = tiff_tags(data).get(BITS, (1,))
        return max(bits) if isinstance(bits, tuple) else int(bits)
    return 8


def tiff_tags(data: bytes) -> dict[int, object]:
    """The tags of the first page of a TIFF file; none if it is damaged."""
    stream = io.BytesIO(data)
    head = stream.read(16 if b"+" in data[:4] else 8)
    try:
        with no_chatter():
            tags = TiffImagePlugin.ImageFileDirectory_v2(head)
            stream.seek(tags.next)
            tags.load(stream)
        return {tag: tags[tag] for tag in (WIDTH, HEIGHT, BITS, COLOURS) if tag in tags}
    except Exception:  # any error of Pillow for a damaged file; reading the picture will report it
        return {}


def deep_samples(data: bytes) -> np.ndarray | None:
    """Samples [H, W] or RGB [H, W, 3] of a picture of more than 8 bits, rotated by its EXIF tag; without alpha.

    None if OpenCV cannot read it.

    Raises:
      UnsupportedError: TIFF in other colours than grey or RGB, or of a kind whose bits OpenCV drops.
    """
    bits = sample_bits(data)
    tags = tiff_tags(data) if data.startswith(TIFF) else {}
    colours = tags.get(COLOURS, BLACK_IS_0)
    if colours not in (WHITE_IS_0, BLACK_IS_0, RGB):
        raise UnsupportedError(f"TIFF of {bits} bits per sample in other colours than grey or RGB")
    samples = decode(data)
    if samples is None:
        return None
    if samples.dtype.itemsize * 8 < bits:
        raise UnsupportedError(f"TIFF of {bits} bits per sample with such channels")
    if colours == WHITE_IS_0:
        if samples.dtype.kind != "u":
            raise UnsupportedError("TIFF in which 0 is white and samples are not whole numbers from 0 on")
        samples = np.iinfo(samples.dtype).max - samples
    return samples if samples.ndim == 2 else samples[..., 2::-1]  # OpenCV has blue first, and alpha last


def decode(data: bytes) -> np.ndarray | None:
    """The picture as OpenCV reads it: of any depth, grey, BGR or BGRA, upright; None if it cannot."""
    flags = cv2.IMREAD_UNCHANGED if data.startswith(TIFF) else cv2.IMREAD_ANYDEPTH | cv2.IMREAD_ANYCOLOR
    before = cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        return cv2.imdecode(np.frombuffer(data, np.uint8), flags)
    except (cv2.error, SystemError):
        return None
    finally:
        cv2.utils.logging.setLogLevel(before)


@contextlib.contextmanager
def no_chatter() -> Iterator[None]:
    """Suppress the warnings of Pillow, and what libtiff writes to standard error about each damaged strip."""
    sys.stderr.flush()
    kept, nowhere = os.dup(2), os.open(os.devnull, os.O_WRONLY)
    try:
        os.dup2(nowhere, 2)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        os.dup2(kept, 2)
        os.close(kept)
        os.close(nowhere)
