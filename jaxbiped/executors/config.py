"""The options of simulated bipeds: how they walk, and where."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import pydantic

from jaxbiped.biped.config import RobotModelConfig
from jaxbiped.config import Model


class WalkConfig(Model):
    """How simulated bipeds walk, and where."""

    pace: Literal["fast", "paper"] = "fast"
    """Speed of simulated primitives; the mission's clock counts Table 2's durations in any case."""
    slots: Annotated[int, pydantic.Field(ge=1, le=65536)] = 32
    """Number of bipeds simulated at once."""
    device: Literal["cpu", "gpu", "tpu"] | None = None
    """Device of `mjx`; None: JAX's default."""
    threads: Annotated[int, pydantic.Field(ge=0, le=1024)] = 0
    """Threads of `native`; 0: one per logical CPU."""
    impl: Literal["jax", "warp"] = "jax"
    """Of `mjx`."""
    biped: RobotModelConfig = RobotModelConfig()

    def options(self, executor: str) -> dict[str, Any]:
        """Options for `physics.make`."""
        own = {"threads": self.threads} if executor == "native" else {"impl": self.impl}
        return own | {"device": self.device}
