"""How well the camera measures, by name: `ideal`, `rendered` (pairs rendered and matched), `real`.

They are in the code so that an installed wheel has them; `configs/sensors/` has the same values with explanations.
"""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from jaxbiped import config
from jaxbiped.config import Model
from jaxbiped.errors import InputError
from jaxbiped.sensing.config import LandmarkConfig, NoiseConfig


class RayConfig(Model):
    """Number of rays that represent a picture, whose sides they must divide."""

    columns: int = Field(ge=4)
    """Rays across the image."""
    rows: int = Field(ge=4)
    """Rays down the image."""


class SensorConfig(Model):
    """A sensor file: noise of the points and of the landmarks, and optionally the number of rays it requires."""

    stereo: NoiseConfig = NoiseConfig()
    """Noise of stereo matching."""
    landmarks: LandmarkConfig = LandmarkConfig()
    """Noise of landmark detection."""
    rays: RayConfig | None = None
    """Replaces the camera's default rays, if given here and not there."""


SOURCES = "bias sd quantum drop_plain drop_edge drop_grazing edge_swap phantom_hidden phantom_near attitude_sd"
PRESETS = {
    "ideal": SensorConfig(
        stereo=NoiseConfig(**dict.fromkeys(SOURCES.split(), 0), min_contrast=0),
        landmarks=LandmarkConfig(sd=0.001, sd_per_metre=0),
    ),
    "rendered": SensorConfig(),
    "real": SensorConfig(
        stereo=NoiseConfig(bias=0.06, sd=0.22, edge_swap=0.11, phantom_hidden=0.4, attitude_sd=0.5),
        landmarks=LandmarkConfig(sd=0.004, sd_per_metre=0.008),
    ),
}


def sensor_preset(name: str) -> SensorConfig:
    """The preset of this name, or the sensor file at this path; raises `InputError` if it is neither."""
    if not isinstance(name, str):
        raise InputError(f"must be str, not {type(name).__name__}", field="name")
    if name in PRESETS:
        return PRESETS[name]
    if Path(name).suffix != ".toml":
        raise InputError(f"must be one of {', '.join(PRESETS)} or a .toml file", field="preset", value=name)
    return config.load(SensorConfig, name)
