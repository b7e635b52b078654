"""What may be chosen of the robot: its measures, and how long its primitives take. Light to import, without JAX."""

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
    """Where a step over an edge wants the robot to stand. The steps of the simulated biped; chosen by simulation.

    Distances to an edge are from the middle between the feet. A step that is 10 cm long, from feet of 10 cm, has the
    widest tolerance: 8 mm and 6 degrees are fine, 25 mm fails (5 cm long, it has none).
    """

    length: Length = 0.10
    """[m] of a step over an edge."""
    before_up: Length = 0.075
    """[m] that a rising edge lies ahead of the robot before its step."""
    before_down: Length = 0.025
    """[m] that a falling edge lies ahead of the robot before its step."""
    tolerance: Length = 0.005
    """[m] off that place, from which the robot corrects."""
    clear_up: Length = 0.075
    """[m] beyond an edge that rose, where the robot can turn on the spot."""
    clear_down: Length = 0.10
    """[m] beyond an edge that fell, where the robot can turn on the spot."""
    foot_length: Length = 0.10
    """[m]"""
    hip_offset: Length = 0.045
    """[m] of a foot's middle to the side."""
    foot_outside: Length = 0.075
    """[m] of a foot's outer rim to the side."""

    def traced(self) -> Footing:
        """The same as arrays."""
        import jax.numpy as jnp

        from jaxbiped.motion.robot import Footing

        return Footing(**{field.name: jnp.float32(getattr(self, field.name)) for field in fields(Footing)})


class RobotConfig(FileModel):
    """A biped as an upright cylinder that can squat (paper, 2.2, Fig. 4); by default the e-nuvo WALK of the paper."""

    radius: Annotated[float, pydantic.Field(gt=0.0, le=0.15)] = 0.10
    """[m] of the cylinder that obstacles are grown by: the body, and a margin for pose errors. With simulated bipeds,
    which sway as they walk, 0.125 by default."""
    body_radius: Annotated[float, pydantic.Field(gt=0.0, le=0.15)] = 0.08
    """[m] of the cylinder that really collides."""
    standing: Length = 0.385
    """[m] head height, standing."""
    squatting: Length = 0.340
    """[m] head height, squatting."""
    step: Annotated[float, pydantic.Field(gt=0.0, le=0.1)] = 0.03
    """[m] greatest height of one step up or down."""
    height_tolerance: Tolerance = HEIGHT_TOLERANCE
    """[m] that ground may be off the height that is stepped to: the map takes ground further off its level for an
    obstacle. In missions that of the executor (`limits.height_tolerance`), by default."""
    step_tolerance: Tolerance = STEP_TOLERANCE
    """[m] that ground may be higher than a step: the map takes what is higher for an obstacle."""
    footing: FootingConfig = FootingConfig()
    """Where its feet want to be before an edge; read where footing counts (simulated bipeds)."""

    @pydantic.model_validator(mode="after")
    def _order(self):
        if self.body_radius > self.radius:
            raise ValueError(f"body_radius must be at most radius ({self.radius:g} m)")
        if not self.step < self.squatting <= self.standing:
            raise ValueError("step, squatting and standing must rise in this order")
        return self

    def body(self) -> Body:
        """What the map needs of it, traced."""
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
    """[s] for 5 cm forward, squatting; getting down and up is in it."""
    measure: Annotated[float, pydantic.Field(ge=0.0, le=3600.0)] = 10.0
    """[s] for one stereo measurement."""

    def traced(self) -> Durations:
        """The same as arrays."""
        import jax.numpy as jnp

        from jaxbiped.motion.primitives import Durations

        return Durations(**{name: jnp.float32(value) for name, value in self.model_dump().items()})
