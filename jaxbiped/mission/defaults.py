"""Fields of a mission whose default is decided by another field: declared and filled in here.

Given values take precedence, wherever they are given: on the command line, in TOML, or in Python, where the fields
count that were set when a model was created.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from jaxbiped.config import Model
from jaxbiped.core.config_file import with_file
from jaxbiped.errors import InputError
from jaxbiped.motion.config import RobotConfig
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.sensing.presets import sensor_preset

SWAYING = 0.125  # [m] a walking biped sways, and its stereo camera, as wide as the body, sweeps 12 cm to each side
BELOW_POINTS = 50.0  # for rendered stereo; others keep the map that was published

OTHER = ""  # stands for all values not in a table
# Choice: value: resulting defaults of other fields.
BY_CHOICE: dict[str, dict[str, dict[str, float]]] = {
    "executor": {"kinematic": {}, OTHER: {"robot.radius": SWAYING}},
    "sensor": {"stereo": {"mapping.below_points": BELOW_POINTS}},
}
FOLLOWING = {"robot.height_tolerance": "limits.height_tolerance"}  # field: that whose value is its default, if given
OF_PRESET = ("stereo", "landmarks")  # parts whose fields come from the preset; and `camera`, if the preset has rays
OF_FILE: dict[str, type[Model]] = {"robot": RobotConfig, "camera": CameraConfig}
DECIDING = ("preset", *BY_CHOICE, *FOLLOWING.values())


def with_defaults(data: dict[str, Any]) -> dict[str, Any]:
    """The given fields of a mission, with those filled in that follow from others.

    Invalid values are left as they are, for the model to report.
    """
    for part, model in OF_FILE.items():
        if part in data:
            data = data | {part: opened(model, data[part])}
    for choice, table in BY_CHOICE.items():
        if isinstance(value := data.get(choice), str):
            for field, default in table.get(value, table.get(OTHER, {})).items():
                data = filled(data, field, default)
    for field, source in FOLLOWING.items():
        part, _, name = source.partition(".")
        fields = given_fields(data.get(part, {})) or {}
        if name in fields:
            data = filled(data, field, fields[name])
    try:
        preset = sensor_preset(data.get("preset", "rendered"))
    except (InputError, TypeError):
        return data
    parts = {name: getattr(preset, name) for name in OF_PRESET}
    if preset.rays:
        parts["camera"] = preset.rays
    for part, values in parts.items():
        fields = given_fields(data.get(part, {}))
        if fields is not None:
            data = data | {part: values.model_dump() | fields}
    return data


def filled(data: dict[str, Any], field: str, default: Any) -> dict[str, Any]:
    """The data with a default for a dotted field, unless that is given."""
    part, _, name = field.partition(".")
    fields = given_fields(data.get(part, {}))
    return data if fields is None else data | {part: {name: default} | fields}


def given_fields(part: Any) -> dict[str, Any] | None:
    """The fields of a part that were given; None if it is not a part."""
    if isinstance(part, Model):
        return {name: getattr(part, name) for name in part.model_fields_set}
    return dict(part) if isinstance(part, Mapping) else None


def opened(model: type[Model], part: Any) -> Any:
    """A part with the fields of the file that it names, if it names one that can be read."""
    try:
        return with_file(model, part)
    except InputError:
        return part
