"""The robot's measures, as the map and the referee need them."""

from __future__ import annotations

from typing import Annotated

import jax.numpy as jnp
import pydantic

from jaxbiped.config import Model
from jaxbiped.mapping.grid import Body

Length = Annotated[float, pydantic.Field(gt=0.0, le=2.0)]


class RobotConfig(Model):
    """A biped as an upright cylinder that can squat (paper, 2.2, Fig. 4); by default the e-nuvo WALK of the paper."""

    radius: Annotated[float, pydantic.Field(gt=0.0, le=0.15)] = 0.10
    """[m] of the cylinder that obstacles are grown by: the body, and a margin for pose errors."""
    body_radius: Annotated[float, pydantic.Field(gt=0.0, le=0.15)] = 0.08
    """[m] of the cylinder that really collides."""
    standing: Length = 0.385
    """[m] head height, standing."""
    squatting: Length = 0.340
    """[m] head height, squatting."""
    step: Annotated[float, pydantic.Field(gt=0.0, le=0.1)] = 0.03
    """[m] greatest height of one step up or down."""

    @pydantic.model_validator(mode="after")
    def _order(self):
        if self.body_radius > self.radius:
            raise ValueError(f"body_radius must be at most radius ({self.radius:g} m)")
        if not self.step < self.squatting <= self.standing:
            raise ValueError("step, squatting and standing must rise in this order")
        return self

    def body(self) -> Body:
        """What the map needs of it, traced."""
        return Body(*(jnp.float32(v) for v in (self.radius, self.standing, self.squatting, self.step)))
