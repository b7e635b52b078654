"""The measures by which strategies are compared, and how they are presented."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from jaxbiped.mission.metric import MetricFormat
from jaxbiped.statistics import Comparison


@dataclass(frozen=True)
class Measure:
    """One measure by which strategies are compared, and how it is presented."""

    name: str
    unit: str  # as displayed
    scale: float  # from SI to that unit
    digits: int
    more: str  # what a greater value means
    less: str
    smaller_is_better: bool | None  # None: not known

    @property
    def title(self) -> str:
        """The name with its unit."""
        return f"{self.name}, {self.unit}" if self.unit else self.name


SUCCESS = Measure("success", "points", 100.0, 1, "more often", "less often", False)
DISTANCE = Measure("distance", "cm", 100.0, 1, "more", "less", True)
TIME = Measure("time", "min", 1 / 60, 2, "more", "less", True)
MEASURES = (SUCCESS, DISTANCE, TIME)


def metric_measure(name: str, shown: Mapping[str, MetricFormat] = MappingProxyType({})) -> Measure:
    """How the metric of a column is presented: as stored with its numbers, else as it declares if registered here.
    Nothing is imported: otherwise its numbers are shown as they are, without saying which are better.
    """
    from jaxbiped.core.registry import METRICS
    from jaxbiped.mission import metrics  # noqa: F401  registers those that are built in

    if name not in shown and name not in METRICS:
        return Measure(name, "", 1.0, 3, "more", "less", None)
    metric = shown[name] if name in shown else METRICS.held[name]
    return Measure(name, metric.unit, metric.scale, metric.digits, "more", "less", metric.smaller_is_better)


def metric_measures(comparison: Comparison) -> tuple[Measure, ...]:
    """The measures of a comparison other than success, distance and time."""
    return tuple(metric_measure(name, comparison.shown) for name in comparison.metrics)
