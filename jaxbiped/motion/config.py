"""The options of the robot: its dimensions, and the durations of its primitives. Quick to import, without JAX."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Annotated, Literal

import pydantic

from jaxbiped.config import Model
from jaxbiped.core.config_file import FileModel

if TYPE_CHECKING:
    from jaxbiped.mapping.grid import Body
    from jaxbiped.motion.primitives import Durations
    from jaxbiped.motion.robot import Footing

Goal = Literal["duration", "margin"]
Length = Annotated[float, pydantic.Field(gt=0.0, le=2.0)]
Tolerance = Annotated[float, pydantic.Field(ge=0.0, le=0.1)]

HEIGHT_TOLERANCE, STEP_TOLERANCE = 0.010, 0.002  # [m] defaults of the fields below, and of the executor's own rules


class FootingConfig(Model):
    """Where the robot should stand before a step over an edge. For the simulated biped; chosen by simulation.

    Distances to an edge are from the midpoint of the feet. A 10 cm long step with 10 cm long feet has the widest
    tolerance: 8 mm and 6 degrees are fine, 25 mm fails (a 5 cm long step has no tolerance).
    """

    length: Length = 0.10
    """[m] Length of a step over an edge."""
    before_up: Length = 0.075
    """[m] Distance of a rising edge ahead of the robot before its step."""
    before_down: Length = 0.025
    """[m] Distance of a falling edge ahead of the robot before its step."""
    tolerance: Length = 0.005
    """[m] Position error above which the robot corrects."""
    clear_up: Length = 0.075
    """[m] Distance beyond a rising edge at which the robot can turn on the spot."""
    clear_down: Length = 0.10
    """[m] Distance beyond a falling edge at which the robot can turn on the spot."""
    foot_length: Length = 0.10
    """[m]"""
    hip_offset: Length = 0.045
    """[m] Lateral offset of a foot's middle."""
    foot_outside: Length = 0.075
    """[m] Lateral offset of a foot's outer rim."""

    def traced(self) -> Footing:
        """The same as arrays."""
        import jax.numpy as jnp

        from jaxbiped.motion.robot import Footing

        return Footing(**{field.name: jnp.float32(getattr(self, field.name)) for field in fields(Footing)})


class RobotConfig(FileModel):
    """A biped as an upright cylinder that can squat (paper, 2.2, Fig. 4); by default the e-nuvo WALK of the paper."""

    radius: Annotated[float, pydantic.Field(gt=0.0, le=0.15)] = 0.10
    """[m] Radius of the cylinder by which obstacles are grown: the body, and a margin for pose errors. By default 0.125
    with simulated bipeds, which sway as they walk."""
    body_radius: Annotated[float, pydantic.Field(gt=0.0, le=0.15)] = 0.08
    """[m] Radius of the cylinder that really collides."""
    standing: Length = 0.385
    """[m] Head height, standing."""
    squatting: Length = 0.340
    """[m] Head height, squatting."""
    step: Annotated[float, pydantic.Field(gt=0.0, le=0.1)] = 0.03
    """[m] Greatest height of one step up or down."""
    height_tolerance: Tolerance = HEIGHT_TOLERANCE
    """[m] Largest deviation of the ground from the height stepped to: the map treats ground farther from its level as
    an obstacle. In missions, by default that of the executor (`limits.height_tolerance`)."""
    step_tolerance: Tolerance = STEP_TOLERANCE
    """[m] By how much ground may exceed a step: the map treats anything higher as an obstacle."""
    footing: FootingConfig = FootingConfig()
    """Where its feet should be before an edge; used with foot placement (simulated bipeds)."""

    @pydantic.model_validator(mode="after")
    def _order(self):
        if self.body_radius > self.radius:
            raise ValueError(f"body_radius must be at most radius ({self.radius:g} m)")
        if not self.step < self.squatting <= self.standing:
            raise ValueError("step, squatting and standing must rise in this order")
        return self

    def body(self) -> Body:
        """What the map needs to know about it, traced."""
        import jax.numpy as jnp

        from jaxbiped.mapping.grid import Body

        return Body(**{field.name: jnp.float32(getattr(self, field.name)) for field in fields(Body)})


class DurationConfig(Model):
    """Durations [s]: Table 2 of the paper by default.

    A measurement has no published time; about 10 s explains the mission times of Tables 3 and 4.
    """

    straight: Annotated[float, pydantic.Field(ge=0.0, le=3600.0)] = 16.0
    """[s] for 5 cm forward."""
    turn: Annotated[float, pydantic.Field(ge=0.0, le=3600.0)] = 5.0
    """[s] for 45 degrees."""
    step_up: Annotated[float, pydantic.Field(ge=0.0, le=3600.0)] = 96.0
    """[s] for one step of 3 cm up, 5 cm forward."""
    step_down: Annotated[float, pydantic.Field(ge=0.0, le=3600.0)] = 96.0
    """[s] for one step of 3 cm down, 5 cm forward."""
    pass_gate: Annotated[float, pydantic.Field(ge=0.0, le=3600.0)] = 48.0
    """[s] for 5 cm forward, squatting; includes getting down and up."""
    measure: Annotated[float, pydantic.Field(ge=0.0, le=3600.0)] = 10.0
    """[s] for one stereo measurement."""

    def traced(self) -> Durations:
        """The same as arrays."""
        import jax.numpy as jnp

        from jaxbiped.motion.primitives import Durations

        return Durations(**{name: jnp.float32(value) for name, value in self.model_dump().items()})
