"""Options that all backends have."""

from __future__ import annotations

import pydantic

from jaxbiped.config import Model


class Common(Model):
    """Options of `physics.make` for every backend."""

    free_joint: bool = False
    """Whether the model must have a free joint."""
    watch: dict[str, tuple[tuple[str, str], ...]] = pydantic.Field(default_factory=dict)
    """{name: pairs of geom names}: contacts that `touched` and `depth` report, one column per name."""
    work: bool = False
    """Whether the mechanical work of each actuator is accumulated, step by step."""
    fields: tuple[str, ...] = ()
    """Model fields that will differ by simulation, if known beforehand: `mjx` then compiles only once."""
