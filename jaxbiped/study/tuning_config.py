"""What may be chosen of the tuning of costs."""

from __future__ import annotations

from typing import Annotated, Literal

import pydantic
import tyro

from jaxbiped.config import Model
from jaxbiped.core.names import FAMILIES, STRATEGIES
from jaxbiped.mission.config import RENDERED, SIMULATED, MissionConfig
from jaxbiped.study.config import Family

Plans = Literal[tuple(name for name in STRATEGIES if name != "blind_stop")]
Positive = Annotated[int, pydantic.Field(ge=1, le=100_000_000)]


class TuneConfig(Model):
    """Costs tuned on random arenas.

    The planner takes the same paths when all costs double, so that C0 stays as it is, and log(C1 / C0) to log(C4 / C0)
    are tuned. The objective is the mean time of a mission, where a failure counts `penalty`.
    """

    seed: Annotated[int, pydantic.Field(ge=0, lt=2**32)] = 0
    """Of arenas and all noise, perturbations and intervals."""
    arenas: Positive = 1024
    """Training arenas. Their numbers are 100,000,000 and up, which no study compares on."""
    test_arenas: Positive = 2048
    """Test arenas. Their numbers are 0 and up, those of `jaxbiped compare` with this seed."""
    families: Annotated[tuple[Family, ...], pydantic.Field(min_length=1)] = FAMILIES
    """Of arenas: obstacles, bump, stairs, gate, mixed, clutter (these by default) or traffic. They take turns: arena k
    is of family k modulo their number."""
    strategy: Plans = "full"
    """Whose missions: full, bump_aware, gate_aware or floor_only. The way of `blind_stop` does not depend on costs."""
    steps: Positive = 32
    """Steps of the descent."""
    batch: Positive = 32
    """Training arenas of a step; steps take them in turn."""
    pairs: Annotated[int, pydantic.Field(ge=1, le=1024)] = 4
    """Pairs of perturbed costs of a step, all on the same arenas with the same noise."""
    radius: Annotated[float, pydantic.Field(gt=0.0, le=3.0)] = 1.0
    """By how much the logarithms are perturbed, together."""
    rate: Annotated[float, pydantic.Field(gt=0.0, le=3.0)] = 0.15
    """What each logarithm changes in the first step; it falls to 0 as a cosine."""
    penalty: Annotated[float, pydantic.Field(gt=0.0, le=1e6)] = 1800.0
    """[s] that a failed mission counts, and a longer one too."""
    low: Annotated[float, pydantic.Field(ge=1e-3, le=1e3)] = 0.1
    """Least of C1 to C4, in C0."""
    high: Annotated[float, pydantic.Field(ge=1e-3, le=1e3)] = 100.0
    """Greatest of C1 to C4, in C0."""
    sweep: Annotated[int, pydantic.Field(ge=0, le=1000)] = 10
    """A sweep over Sobol points of the same box gets this many times the missions of the tuning; 0: none."""
    mission: Annotated[MissionConfig, tyro.conf.arg(name="")] = MissionConfig()

    @pydantic.model_validator(mode="after")
    def _possible(self):
        if self.high <= self.low:
            raise ValueError("high must be above low")
        if len(set(self.families)) < len(self.families):
            raise ValueError("families must be named once each")
        if self.mission.executor in SIMULATED:
            raise ValueError("executor must be kinematic or sampled: tuning takes thousands of missions")
        if self.mission.sensor in RENDERED:
            raise ValueError("sensor must be raycast or oracle: tuning takes thousands of missions")
        return self

    @property
    def tuning_missions(self) -> int:
        """Missions of the tuning: its steps, and the costs that it begins from on each training arena."""
        return self.steps * self.batch * 2 * self.pairs + self.arenas

    @property
    def sweep_points(self) -> int:
        """Points of the sweep, each on all training arenas."""
        return -(-self.sweep * self.tuning_missions // self.arenas)
