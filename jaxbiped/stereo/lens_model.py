"""Lens models in other people's calibration files: those compatible with OpenCV's pinhole with distortion.

A fisheye lens has four coefficients, as many as a pinhole with distortion, so the numbers do not distinguish the two
and the name must: if mistaken for the other, its pictures are distorted by up to a hundred pixels.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from jaxtyping import Float64

from jaxbiped.errors import InputError

# Coefficients of all of these are in OpenCV's order: k1, k2, p1, p2, k3, ...
FITTING = ("pinhole", "plumb_bob", "radtan", "rational_polynomial", "none")
# fmt: off
SAME = {  # synonyms, in lower-case letters and digits only
    "", "pinhole", "perspective", "projective", "linear", "ideal", "opencv", "standard", "rectified", "distorted",
    "undistorted", "plumbbob", "radtan", "radialtan", "radialtangential", "brown", "brownconrady", "pinholeradtan",
    "pinholebrown", "rational", "rationalpolynomial", "none", "no", "null", "false", "0",
}
# fmt: on
OTHER = re.compile(
    r"fish|equi|omni|mei|unified|sphere|eucm|kannala|kb4|ocam|scaramuzza|cata|panoram|cylind|prism|ftheta|^f?ov$|atan"
)
NAMES = re.compile(r"(camera|lens|distortion|dist|projection|intrinsics?)_?model|(distortion|projection)_?type")
MAYBE = re.compile(r"model|type|lens|projection")  # may refer to the camera's make, or to the file
FLAGS = re.compile(r"fish_?eye|omni_?dir|equidistant|equirectangular")
XI = re.compile(r"(.*_)?xi(_?(\d|left|right|l|r))?")  # eccentricity of an omnidirectional mirror's projection
FALSE = ("", "0", "0.0", "false", "no", "off", "none")


def check_lens_model(fields: Mapping[str, object], file: str | Path) -> None:
    """Raise `InputError` if a calibration names a lens that is not a pinhole with OpenCV's distortion.

    Args:
      fields: the file's content, by its own names; nested mappings are searched.
      file: named in the message.
    """
    for key, value in fields.items():
        name = re.sub(r"(?<=[a-z])(?=[A-Z])", "_", str(key)).lower().replace("-", "_").replace(" ", "_")
        if isinstance(value, Mapping):
            check_lens_model(value, file)
        elif XI.fullmatch(name):
            raise InputError(f"is for an omnidirectional lens: {allowed()}", file=file, field=str(key))
        elif FLAGS.search(name):
            if str(value).strip().lower() not in FALSE and not isinstance(value, list | tuple):
                raise InputError(allowed(), file=file, field=str(key), value=value)
        elif isinstance(value, str | int | float | None):
            model = re.sub(r"[^a-z0-9]", "", "" if value is None else str(value).lower())
            named = NAMES.search(name) and "matrix" not in name and isinstance(value, str | None)
            if model not in SAME and (named or (MAYBE.search(name) and OTHER.search(model))):
                raise InputError(allowed(), file=file, field=str(key), value=value)


def allowed() -> str:
    """The supported lenses, for a message."""
    return f"must be one of {', '.join(FITTING)}; other lenses are not supported"


def check_camera_matrix(K: Float64[np.ndarray, "3 3"], file: str | Path, field: str) -> None:
    """Raise `InputError` unless a camera matrix is [[fx, 0, cx], [0, fy, cy], [0, 0, 1]]: no skew, not transposed."""
    zeros = [K[0, 1], K[1, 0], K[2, 0], K[2, 1], K[2, 2] - 1]
    if not np.isfinite(K).all() or np.abs(zeros).max() > 1e-6 * max(abs(K[0, 0]), 1):
        message = "must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], without skew and not transposed"
        raise InputError(message, file=file, field=field, value=K)
