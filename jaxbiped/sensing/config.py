"""The options of the sensors. Quick to import: arrays are made, and JAX is loaded, only on demand."""

from __future__ import annotations

import math
from dataclasses import fields
from typing import TYPE_CHECKING

from pydantic import Field, model_validator

from jaxbiped.config import Model
from jaxbiped.core.config_file import FileModel

if TYPE_CHECKING:
    from jaxbiped.sensing.camera import Camera, ImageSpec
    from jaxbiped.sensing.landmarks import LandmarkNoise
    from jaxbiped.sensing.motion import VisualNoise
    from jaxbiped.sensing.noise import StereoNoise
    from jaxbiped.sensing.odometry import OdometryNoise


class CameraConfig(FileModel):
    """A stereo camera. Size and baseline are the paper's (3.1); the rest is chosen.

    At 97 degrees and 30 degrees of pitch the lintel of a gate is in view, which a lens of 66 degrees never sees.
    """

    width: int = Field(512, ge=16, le=8192)
    """[px] Image width."""
    height: int = Field(384, ge=16, le=8192)
    """[px] Image height."""
    columns: int = Field(64, ge=4)
    """Rays across the image (ray-cast sensor); divides the width."""
    rows: int = Field(48, ge=4)
    """Rays down the image (ray-cast sensor); divides the height."""
    baseline: float = Field(0.12, gt=0, le=1)
    """[m] Distance between the two cameras."""
    field_of_view: float = Field(97.0, ge=10, le=160)
    """[deg] Horizontal field of view."""
    pitch: float = Field(30.0, ge=-30, le=90)
    """[deg] Pitch below the horizon."""
    look_pitch: float = Field(60.0, ge=-30, le=90)
    """[deg] Pitch below the horizon when the robot looks at the ground in front of its feet."""
    camera_height: float = Field(0.365, gt=0, le=3)
    """[m] Height of the optical centre above the supporting surface, standing."""
    squat_drop: float = Field(0.045, ge=0, le=2)
    """[m] How much lower it is when squatting; less than its height."""
    forward: float = Field(0.03, ge=-1, le=1)
    """[m] Distance of the optical centre ahead of the robot's vertical axis."""
    num_disparities: int = Field(160, ge=16, le=1024, multiple_of=16)
    """[px] Search range of the matcher; sets the nearest distance that can be measured."""
    image_noise: float = Field(1.5, ge=0, le=64)
    """Standard deviation of each channel of each pixel, in grey levels of 256 (rendered sensor)."""

    @model_validator(mode="after")
    def check_whole(self) -> CameraConfig:
        for rays, pixels in (("columns", "width"), ("rows", "height")):
            if getattr(self, pixels) % getattr(self, rays):
                raise ValueError(
                    f"{rays} must divide the {pixels} of {getattr(self, pixels)}, got {getattr(self, rays)}"
                )
        if self.squat_drop >= self.camera_height:
            raise ValueError(f"squat_drop must be below the camera_height of {self.camera_height:g} m")
        return self

    @property
    def image(self) -> ImageSpec:
        """The static part."""
        from jaxbiped.sensing.camera import ImageSpec

        return ImageSpec(self.width, self.height, self.columns, self.rows)

    @property
    def focal(self) -> float:
        """[px]"""
        return self.width / 2 / math.tan(math.radians(self.field_of_view) / 2)

    def traced(self) -> Camera:
        """The traced part."""
        import jax.numpy as jnp

        from jaxbiped.sensing.camera import Camera

        values = {
            "focal": self.focal,
            "baseline": self.baseline,
            "pitch": math.radians(self.pitch),
            "look_pitch": math.radians(self.look_pitch),
            "height": self.camera_height,
            "squat_drop": self.squat_drop,
            "forward": self.forward,
            "max_disparity": self.num_disparities - 1,
        }
        return Camera(**{name: jnp.asarray(value, jnp.float32) for name, value in values.items()})


class NoiseConfig(Model):
    """Noise of stereo matching. The defaults are those of the preset `rendered`."""

    bias: float = Field(0.01, ge=-16, le=16)
    """[px] Added to each disparity."""
    sd: float = Field(0.14, ge=0, le=16)
    """[px] Standard deviation of disparity on a surface without slope."""
    slope_gain: float = Field(2.0, ge=0, le=100)
    """Growth of that: times 1 + slope_gain * slope, with the slope of disparity across the image in px per px."""
    correlation: float = Field(0.33, ge=0, le=0.5)
    """Correlation of the noise of two neighbouring rays, across and down (0.33 at 8 px, 0.5 at 4 px)."""
    quantum: float = Field(1 / 16, ge=0, le=16)
    """[px] Step of disparity; 0 for none."""
    drop_plain: float = Field(0.03, ge=0, le=1)
    """Chance that a ray is lost, anywhere."""
    drop_edge: float = Field(0.20, ge=0, le=1)
    """Chance that a ray is lost at an edge."""
    drop_grazing: float = Field(0.45, ge=0, le=1)
    """Chance that a ray is lost where slope exceeds grazing_slope or grazing_rise, or stretch reaches stretch_lost."""
    edge_jump: float = Field(2.5, gt=0, le=1000)
    """[px] Second difference of disparity from which a ray counts as one at an edge."""
    grazing_slope: float = Field(0.8, gt=0, le=100)
    """[px/px] Slope of disparity from which incidence counts as grazing; the floor has 0.3."""
    grazing_rise: float = Field(0.8, gt=0, le=100)
    """[px/px] The same for disparities that rise to the right: such a surface turns away from the right camera."""
    edge_swap: float = Field(0.065, ge=0, le=1)
    """Chance that a ray at an edge takes the disparity from across the edge."""
    phantom_hidden: float = Field(0.02, ge=0, le=1)
    """Share of the pixels hidden from the right camera that turn into clumps of one random disparity each."""
    phantom_near: float = Field(0.02, ge=0, le=1)
    """The same for surfaces nearer than the search range."""
    min_contrast: float = Field(0.1, ge=0, le=1)
    """Texture contrast below which nothing is measured."""
    max_range: float = Field(2.0, gt=0, le=100)
    """[m] From the camera; points beyond are dropped."""
    attitude_sd: float = Field(0.3, ge=0, le=20)
    """[deg] Standard deviation of the robot's roll and pitch in a view, which the reprojection does not know."""
    stretch_kept: float | None = Field(None, ge=0, le=100)
    """Share by which one image may show a surface wider than the other before rays are lost; by default any."""
    stretch_lost: float | None = Field(None, gt=0, le=100)
    """The same share, above which drop_grazing of the rays are lost; between the two, in proportion."""

    @model_validator(mode="after")
    def check_stretch(self) -> NoiseConfig:
        kept, lost = self.stretch_kept, self.stretch_lost
        if (kept is None) != (lost is None) or (kept is not None and not kept < lost):
            raise ValueError(f"stretch_lost must be above stretch_kept, or both omitted, got {lost} and {kept}")
        return self

    def traced(self) -> StereoNoise:
        """The same as traced arrays, angles in radians."""
        import jax.numpy as jnp
        import numpy as np

        from jaxbiped.sensing.noise import StereoNoise

        values = self.model_dump(exclude_none=True) | {"attitude_sd": np.deg2rad(self.attitude_sd)}
        return StereoNoise(**{name: jnp.asarray(value, jnp.float32) for name, value in values.items()})


class LandmarkConfig(Model):
    """How well landmarks are measured. The defaults are those of the preset `rendered`.

    A rendered disc is found within 0.4 mm at 0.35 m and 1.6 mm at 1 m; in practice,
    calibration, light and print make this worse.
    """

    sd: float = Field(0.002, ge=0, le=1)
    """[m] Standard deviation of x and of y at range 0."""
    sd_per_metre: float = Field(0.005, ge=0, le=1)
    """[m/m] Its growth with range."""
    nearest: float = Field(0.2, ge=0, le=100)
    """[m] From the robot's axis, on the floor; nearer landmarks are not found."""
    furthest_circle: float = Field(1.2, gt=0, le=100)
    """[m] Circles beyond are not found."""
    furthest_square: float = Field(0.75, gt=0, le=100)
    """[m] Squares beyond are not found."""

    def traced(self) -> LandmarkNoise:
        """The same as traced arrays."""
        import jax.numpy as jnp

        from jaxbiped.sensing.landmarks import LandmarkNoise

        values = {field.name: jnp.asarray(getattr(self, field.name), jnp.float32) for field in fields(LandmarkNoise)}
        return LandmarkNoise(**values)


class OdometryConfig(Model):
    """Standard deviations of dead reckoning; each grows with the square root of the distance or angle."""

    forward: float = Field(0.005, ge=0, le=1)
    """[m] Along the path, after 1 m."""
    lateral: float = Field(0.005, ge=0, le=1)
    """[m] Across the path, after 1 m."""
    yaw_walked: float = Field(2.7, ge=0, le=180)
    """[deg] After 1 m."""
    yaw_turned: float = Field(0.5, ge=0, le=180)
    """[deg] After turning by 1 rad."""

    def traced(self) -> OdometryNoise:
        """The same as traced arrays, angles in radians."""
        import jax.numpy as jnp

        from jaxbiped.sensing.odometry import OdometryNoise

        return OdometryNoise(
            forward=jnp.asarray(self.forward, jnp.float32),
            lateral=jnp.asarray(self.lateral, jnp.float32),
            yaw_walked=jnp.asarray(math.radians(self.yaw_walked), jnp.float32),
            yaw_turned=jnp.asarray(math.radians(self.yaw_turned), jnp.float32),
        )


class VisualConfig(Model):
    """Visual odometry of the ray-cast sensor.

    The defaults are the values that `sweeps/studies/visual_odometry.py` prints for rendered pictures, rounded up, with
    every preset. Standard deviations are for a tenth of the image's pixels in both views; they fall with the
    square root of that share.
    """

    forward: float = Field(0.0003, ge=0, le=1)
    """[m] Standard deviation along x of the robot before the motion."""
    left: float = Field(0.0003, ge=0, le=1)
    """[m] Along y."""
    yaw: float = Field(0.04, ge=0, le=180)
    """[deg] Of the angle turned."""
    least_share: float = Field(0.02, ge=0, le=1)
    """Share of the image's pixels that both views must measure; with less, nothing is found."""
    failure: float = Field(0.05, ge=0, le=1)
    """Chance that nothing is found although there is enough."""

    def traced(self) -> VisualNoise:
        """The same as traced arrays, angles in radians."""
        import jax.numpy as jnp

        from jaxbiped.sensing.motion import VisualNoise

        values = self.model_dump() | {"yaw": math.radians(self.yaw)}
        return VisualNoise(
            **{field.name: jnp.asarray(values[field.name], jnp.float32) for field in fields(VisualNoise)}
        )
