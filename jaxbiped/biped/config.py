"""The biped's proportions, masses and servos, shared by the gait generator and the simulated robot."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Literal

import pydantic

from jaxbiped.config import Model
from jaxbiped.core.config_file import FileModel

if TYPE_CHECKING:
    import numpy as np

    from jaxbiped.biped.leg import Biped

Length = Annotated[float, pydantic.Field(gt=0.0, le=2.0)]
Mass = Annotated[float, pydantic.Field(gt=0.0, le=100.0)]
Degrees = tuple[
    Annotated[float, pydantic.Field(ge=-180.0, le=180.0)], Annotated[float, pydantic.Field(ge=-180, le=180)]
]

JOINTS = ("hip_yaw", "hip_roll", "hip_pitch", "knee_pitch", "ankle_pitch", "ankle_roll")
SIDES = ("left", "right")
JOINT_NAMES = tuple(f"{joint}_{side}" for side in SIDES for joint in JOINTS)
"""The order of joints in every table: the left leg from hip to ankle, then the right leg."""
GRAVITY = 9.81  # [m/s^2]


class ProportionsConfig(Model):
    """Lengths [m]. Hip and ankle axes intersect, thigh and shank are straight."""

    foot_length: Length = 0.10
    foot_width: Length = 0.06
    foot_thickness: Length = 0.01
    ankle_height: Length = 0.03
    """Ankle axes above the sole."""
    shank: Length = 0.095
    thigh: Length = 0.095
    hip_offset: Length = 0.045
    """Lateral offset of each hip; the feet stand under the hips."""
    torso_top: Length = 0.145
    """Top of the torso above the hips."""
    camera_top: Length = 0.185
    """Top of the stereo camera above the hips."""
    camera_baseline: Length = 0.12
    """Distance between the two lenses."""


class StanceConfig(Model):
    """Heights [m] of the hips above the lower ground that a foot stands on."""

    standing: Length = 0.200
    walking: Length = 0.186
    """While stepping upright: lower than standing, because swaying over one foot stretches the other leg."""
    climbing: Length = 0.175
    """While stepping over a rise."""
    squatting: Length = 0.155
    inward: Annotated[float, pydantic.Field(ge=0.0, le=0.1)] = 0.012
    """Offset from a foot's middle to the inside where it carries the whole weight: less sway, and less margin to the
    foot's inner edge."""
    inward_climbing: Annotated[float, pydantic.Field(ge=0.0, le=0.1)] = 0.004
    """The same while stepping over a rise, whose height may differ from the expected one."""


class MassesConfig(Model):
    """Masses [kg]."""

    torso: Mass = 1.40
    """Pelvis, torso and camera."""
    thigh: Mass = 0.20
    shank: Mass = 0.15
    foot: Mass = 0.20

    @property
    def total(self) -> float:
        """Mass of the whole robot."""
        return self.torso + 2 * (self.thigh + self.shank + self.foot)


class ServoConfig(Model):
    """Position servos, twelve of one kind: torque = kp (target - angle) - kv speed, within limits."""

    kp: Annotated[float, pydantic.Field(gt=0.0)] = 60.0
    """[Nm/rad]"""
    kv: Annotated[float, pydantic.Field(ge=0.0)] = 1.5
    """[Nm s/rad]"""
    armature: Annotated[float, pydantic.Field(ge=0.0)] = 0.01
    """[kg m^2]"""
    damping: Annotated[float, pydantic.Field(ge=0.0)] = 0.05
    """[Nm s/rad] of the joint itself."""
    torque: Annotated[float, pydantic.Field(gt=0.0)] = 3.0
    """[Nm] maximum."""
    speed: Annotated[float, pydantic.Field(gt=0.0)] = 300.0
    """[deg/s] maximum."""


class RangesConfig(Model):
    """Joint ranges [deg] of the left leg; yaw and roll of the right leg are mirrored."""

    hip_yaw: Degrees = (-40.0, 40.0)
    hip_roll: Degrees = (-45.0, 45.0)
    hip_pitch: Degrees = (-110.0, 40.0)
    knee_pitch: Degrees = (0.0, 135.0)
    ankle_pitch: Degrees = (-90.0, 45.0)
    ankle_roll: Degrees = (-45.0, 45.0)

    @pydantic.model_validator(mode="after")
    def _order(self):
        for name in JOINTS:
            low, high = getattr(self, name)
            if not low < high:
                raise ValueError(f"{name} must rise from its lower to its upper limit")
        return self


class ContactConfig(Model):
    """Contact of the feet with the ground in simulation."""

    foot: Literal["box", "spheres"] = "box"
    """One box per foot, or small spheres under its rim."""
    friction: Annotated[float, pydantic.Field(gt=0.0, le=10.0)] = 0.8
    """Sliding friction between a foot and the ground."""


class RobotModelConfig(FileModel):
    """A biped with six joints per leg; by default the ZMP e-nuvo WALK ver. 3 of the paper (3.1).

    Known: 35 x 16 x 14 cm without the camera; 3 hip, 1 knee and 2 ankle joints per leg; steps of 3 cm. The rest is
    guessed.
    """

    proportions: ProportionsConfig = ProportionsConfig()
    stance: StanceConfig = StanceConfig()
    masses: MassesConfig = MassesConfig()
    servo: ServoConfig = ServoConfig()
    ranges: RangesConfig = RangesConfig()
    contact: ContactConfig = ContactConfig()

    @pydantic.model_validator(mode="after")
    def _reach(self):
        stance, body = self.stance, self.proportions
        longest = body.ankle_height + body.thigh + body.shank
        if not body.ankle_height < stance.squatting <= stance.climbing <= stance.walking <= stance.standing < longest:
            raise ValueError(
                f"stance: squatting, climbing, walking and standing must rise in this order, from above ankle_height "
                f"to below the length of a straight leg ({longest:g} m)"
            )
        if body.camera_top < body.torso_top:
            raise ValueError("proportions: camera_top must be at least torso_top")
        if max(stance.inward, stance.inward_climbing) >= body.foot_width / 2:
            raise ValueError("stance: inward and inward_climbing must be less than half of foot_width")
        if body.foot_width > 2 * body.hip_offset:
            raise ValueError("proportions: the feet overlap: foot_width must be at most twice hip_offset")
        return self

    @property
    def head_standing(self) -> float:
        """Height [m] of the camera's top, standing."""
        return self.stance.standing + self.proportions.camera_top

    @property
    def head_squatting(self) -> float:
        """Height [m] of the camera's top, squatting."""
        return self.stance.squatting + self.proportions.camera_top

    def limits(self) -> np.ndarray:
        """Joint ranges [12, 2] in radians, in the order of `JOINT_NAMES`."""
        import numpy as np

        left = np.array([getattr(self.ranges, name) for name in JOINTS])
        right = left.copy()
        for j in (0, 1, 5):
            right[j] = -left[j, ::-1]
        return np.deg2rad(np.concatenate([left, right]))

    def traced(self) -> Biped:
        """The parameters of the generator, as arrays."""
        import jax.numpy as jnp

        from jaxbiped.biped.leg import Biped

        body, masses, servo = self.proportions, self.masses, self.servo
        return Biped(
            thigh=jnp.float32(body.thigh),
            shank=jnp.float32(body.shank),
            ankle=jnp.float32(body.ankle_height),
            hip=jnp.float32(body.hip_offset),
            masses=jnp.array([masses.torso, masses.thigh, masses.shank, masses.foot], jnp.float32),
            centres=jnp.array(centres_of_mass(body), jnp.float32),
            foot=jnp.array([body.foot_length, body.foot_width], jnp.float32),
            servo=jnp.array([servo.kp, servo.kv + servo.damping], jnp.float32),
        )


def centres_of_mass(body: ProportionsConfig) -> tuple[float, float, float, float]:
    """Height [m] of the centres of mass of torso, thigh, shank and foot above hips, hip, knee and ankle."""
    return 0.45 * body.torso_top, -body.thigh / 2, -body.shank / 2, -body.ankle_height / 2
