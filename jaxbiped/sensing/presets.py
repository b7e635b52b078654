"""How well the camera measures, by name: `ideal`, `rendered` (pairs rendered and matched), `real`.

They live here so that an installed wheel has them; `configs/sensors/` has the same values with an explanation of each.
"""

from __future__ import annotations

from pathlib import Path

from pydantic import Field

from jaxbiped import config
from jaxbiped.config import Model
from jaxbiped.core.signatures import checked
from jaxbiped.errors import InputError
from jaxbiped.sensing import landmarks, noise
from jaxbiped.sensing.landmarks import LandmarkConfig
from jaxbiped.sensing.noise import NoiseConfig


class RayConfig(Model):
    """How many rays stand for a picture, which both must divide."""

    columns: int = Field(ge=4)
    """Rays across the image."""
    rows: int = Field(ge=4)
    """Rays down the image."""


class SensorConfig(Model):
    """A sensor file: noise of the points and of the landmarks, and perhaps how many rays it takes."""

    stereo: NoiseConfig = noise.RENDERED
    """Of stereo matching."""
    landmarks: LandmarkConfig = landmarks.RENDERED
    """Of finding landmarks."""
    rays: RayConfig | None = None
    """In place of the camera's own, where this is given and they are not."""


PRESETS = {
    "ideal": SensorConfig(stereo=noise.IDEAL, landmarks=landmarks.IDEAL),
    "rendered": SensorConfig(stereo=noise.RENDERED, landmarks=landmarks.RENDERED),
    "real": SensorConfig(stereo=noise.REAL, landmarks=landmarks.REAL),
}


@checked()
def sensor_preset(name: str) -> SensorConfig:
    """The preset of this name, or the sensor file of this path; raises `InputError` when it is neither."""
    if name in PRESETS:
        return PRESETS[name]
    if Path(name).suffix != ".toml":
        raise InputError(f"must be one of {', '.join(PRESETS)} or a .toml file", field="preset", value=name)
    return config.load(SensorConfig, name)
