"""The options of tuning costs."""

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

    The planner takes the same paths if all costs double, so C0 stays fixed, and log(C1 / C0) to log(C4 / C0) are tuned.
    The objective is the mean time of a mission, where a failure counts `penalty`.
    """

    seed: Annotated[int, pydantic.Field(ge=0, lt=2**32)] = 0
    """Seed of arenas and all noise, perturbations and intervals."""
    arenas: Positive = 1024
    """Number of training arenas. They are numbered from 100,000,000, which no study compares on."""
    test_arenas: Positive = 2048
    """Number of test arenas. They are numbered from 0, like those of `jaxbiped compare` with this seed."""
    families: Annotated[tuple[Family, ...], pydantic.Field(min_length=1)] = FAMILIES
    """Families of arenas: obstacles, bump, stairs, gate, mixed, clutter (these by default) or traffic. They take turns:
    arena k is of family k modulo their number."""
    strategy: Plans = "full"
    """Strategy of the missions: full, bump_aware, gate_aware or floor_only. The path of `blind_stop` does not depend on
    costs."""
    steps: Positive = 32
    """Steps of the descent."""
    batch: Positive = 32
    """Training arenas per step; steps take them in turn."""
    pairs: Annotated[int, pydantic.Field(ge=1, le=1024)] = 4
    """Pairs of perturbed costs per step, all on the same arenas with the same noise."""
    radius: Annotated[float, pydantic.Field(gt=0.0, le=3.0)] = 1.0
    """Size of the perturbation of the logarithms, together."""
    rate: Annotated[float, pydantic.Field(gt=0.0, le=3.0)] = 0.15
    """Change of each logarithm in the first step; it decays to 0 as a cosine."""
    penalty: Annotated[float, pydantic.Field(gt=0.0, le=1e6)] = 1800.0
    """[s] Objective of a failed mission, and of a longer one."""
    low: Annotated[float, pydantic.Field(ge=1e-3, le=1e3)] = 0.1
    """Lower bound of C1 to C4, in units of C0."""
    high: Annotated[float, pydantic.Field(ge=1e-3, le=1e3)] = 100.0
    """Upper bound of C1 to C4, in units of C0."""
    sweep: Annotated[int, pydantic.Field(ge=0, le=1000)] = 10
    """A sweep over Sobol points of the same box gets this many times the missions of the tuning; 0: none."""
    mission: Annotated[MissionConfig, tyro.conf.arg(name="")] = MissionConfig()

    @pydantic.model_validator(mode="after")
    def _possible(self):
        if self.high <= self.low:
            raise ValueError("high must be above low")
        if len(set(self.families)) < len(self.families):
            raise ValueError("families must be distinct")
        if self.mission.executor in SIMULATED:
            raise ValueError("executor must be kinematic or sampled: tuning takes thousands of missions")
        if self.mission.sensor in RENDERED:
            raise ValueError("sensor must be raycast or oracle: tuning takes thousands of missions")
        return self

    @property
    def tuning_missions(self) -> int:
        """Missions of the tuning: its steps, and the initial costs on each training arena."""
        return self.steps * self.batch * 2 * self.pairs + self.arenas

    @property
    def sweep_points(self) -> int:
        """Points of the sweep, each on all training arenas."""
        return -(-self.sweep * self.tuning_missions // self.arenas)
