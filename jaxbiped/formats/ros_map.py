"""Occupancy maps of ROS `map_server`: a YAML file and the PNG or PGM picture that it names.

Rules (wiki.ros.org/map_server, "Map format"): a pixel of grey x in 0..255 is occupied with p = (255 - x) / 255, or
p = x / 255 when `negate` is set. It is an obstacle where p > occupied_thresh, floor where p < free_thresh, and
unmeasured between them. The picture's top row has the greatest y, a class grid's row 0 the smallest: the rows are
flipped.

Modes: `trinary` is the rule above. `scale` grades values between the thresholds and treats a pixel that is not
opaque as unknown; a class has no grades, so both are unmeasured. `raw` takes the pixel itself (after `negate`) as an
occupancy in percent, unknown above 100; the thresholds then apply to it.

The origin is the pose of the lower left corner; with a yaw the grid is rotated about it (`ClassGrid.yaw`). Keys that
`map_server` does not know, such as `map_type` and `frame_id`, are ignored, as in `map_server`.

Deviations: colour pictures are rejected (`map_server` averages the channels: a photograph would become a map). Alpha
matters in `scale` only, as documented (the code of `map_server` averages it into the grey of the other modes).
"""

from __future__ import annotations

import io
import math
from pathlib import Path
from typing import Annotated, Literal

import numpy as np
import pydantic
from jaxtyping import Bool, Int8, UInt8
from PIL import Image, UnidentifiedImageError
from pydantic import Field, model_validator

from jaxbiped.config import Model, parse
from jaxbiped.core.class_grid import Cell, ClassGrid
from jaxbiped.core.image_depth import no_chatter, sample_bits
from jaxbiped.errors import InputError
from jaxbiped.files import read_yaml, reason

Fraction = Annotated[float, Field(ge=0, le=1)]
PICTURES = (".png", ".pgm")
SHEETS = (".yaml", ".yml")
LEAST_TURN = 1e-3  # [cells] at the far end of the map; less is attributed to rounding of the yaw
ORIENTATION = 0x0112  # the EXIF tag


class RosMap(Model):
    """The YAML file of a map."""

    model_config = pydantic.ConfigDict(extra="ignore")

    image: str
    """The picture; a relative path starts at the YAML file's folder."""
    resolution: Annotated[float, Field(gt=0)]
    """[m] Side of a pixel."""
    origin: tuple[float, float, float]
    """[m, m, rad] x, y of the lower left corner, and yaw."""
    negate: bool
    """Whether white is occupied and black free."""
    occupied_thresh: Fraction
    """Occupied above this probability."""
    free_thresh: Fraction
    """Free below this probability."""
    mode: Literal["trinary", "scale", "raw"] = "trinary"
    """How pixels are read; see the module."""

    @model_validator(mode="after")
    def consistent(self) -> RosMap:
        if self.free_thresh > self.occupied_thresh:
            raise ValueError(
                f"free_thresh {self.free_thresh:g} must not be above occupied_thresh {self.occupied_thresh:g}"
            )
        return self


def load(path: str | Path) -> ClassGrid:
    """Read a map by its YAML file, or by its picture with a YAML file of the same stem beside it; all on level 0.

    Raises:
      InputError: no such file, no YAML beside the picture, missing keys, values out of range, a picture that
        is truncated, damaged, empty, in colour, of more than 8 bits or neither PNG nor PGM.
    """
    path = Path(path)
    sheet = path if path.suffix.lower() in SHEETS else sheet_beside(path)
    fields = parse(RosMap, read_fields(sheet), file=sheet)
    grey, opaque = read_picture(sheet.parent / fields.image)
    classes = classify(grey, opaque, fields)
    x, y, yaw = fields.origin
    yaw = math.remainder(yaw, 2 * math.pi)
    yaw = yaw if abs(yaw) * max(classes.shape) > LEAST_TURN else 0.0
    return ClassGrid(classes, np.zeros_like(classes), np.array([x, y]), fields.resolution, yaw)


def classify(
    grey: UInt8[np.ndarray, "H W"], opaque: Bool[np.ndarray, "H W"], fields: RosMap
) -> Int8[np.ndarray, "H W"]:
    """Pixels, top row first, as classes, lowest row first.

    Args:
      grey: 0 (black) to 255 (white).
      opaque: whether the pixel is fully opaque.
      fields: thresholds and mode.
    """
    grey = grey.astype(float)
    value = 255 - grey if fields.negate else grey
    if fields.mode == "raw":
        occupied, known = value / 100, value <= 100
    else:
        occupied, known = (255 - value) / 255, opaque | (fields.mode == "trinary")
    classes = np.select(
        [known & (occupied > fields.occupied_thresh), known & (occupied < fields.free_thresh)],
        [Cell.OBSTACLE, Cell.FLOOR],
        Cell.UNMEASURED,
    )
    return np.ascontiguousarray(classes[::-1]).astype(np.int8)


def read_picture(path: Path) -> tuple[UInt8[np.ndarray, "H W"], Bool[np.ndarray, "H W"]]:
    """Grey values of a PNG or PGM, and where it is opaque; raise `InputError` if it is not a map."""
    try:
        data = path.read_bytes()
        with no_chatter(), Image.open(io.BytesIO(data), formats=("PNG", "PPM")) as image:
            image.load()
            deep = sample_bits(data) > 8 or image.mode in ("I", "F") or image.mode.startswith("I;")
            turned = image.getexif().get(ORIENTATION, 1)
            picture = image.convert("RGBA")
    except FileNotFoundError:
        raise InputError("no such picture", file=path) from None
    except UnidentifiedImageError:
        raise InputError("must be a PNG or PGM picture", file=path) from None
    except Exception as error:  # Pillow raises errors of many types for damaged pictures
        if isinstance(error, OSError) and error.errno:
            raise InputError(f"cannot be read: {reason(error)}", file=path) from None
        raise InputError("is damaged or cut short", file=path) from None
    if deep:
        raise InputError("must have 8 bits per pixel and channel, but this picture has more", file=path)
    if turned != 1:
        message = "must be upright as it is stored: map_server does not turn pictures by their EXIF orientation"
        raise InputError(message, file=path, value=turned)
    red, green, blue, alpha = np.moveaxis(np.asarray(picture), -1, 0)
    if not (np.array_equal(red, green) and np.array_equal(red, blue)):
        raise InputError("must be a grey map, but this picture is in colour", file=path)
    return red, alpha == 255


def read_fields(path: Path) -> dict[str, object]:
    """The mapping in a YAML file; raise `InputError` if there is none."""
    data = read_yaml(path)
    if not isinstance(data, dict):
        raise InputError("must hold the fields of a map_server map (image, resolution, origin, ...)", file=path)
    return {str(key): value for key, value in data.items()}


def sheet_beside(picture: Path) -> Path:
    """The YAML file of the same stem as `picture`."""
    if not picture.exists():
        raise InputError("no such file", file=picture)
    for suffix in SHEETS:
        sheet = picture.with_suffix(suffix)
        if sheet.exists():
            return sheet
    message = f"is not a map: the map_server file {picture.with_suffix('.yaml').name} must be beside it"
    raise InputError(message, file=picture)
