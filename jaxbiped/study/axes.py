"""The axes of a sweep: the values that each field takes."""

from __future__ import annotations

from typing import Annotated

import numpy as np
import pydantic
from jaxtyping import Float

from jaxbiped.config import Model, refuse_value

MOST = 1_000_000  # most values of an axis

Values = Annotated[tuple[float, ...], pydantic.Field(min_length=1, max_length=MOST)]
Bounds = tuple[float, float]


class Range(Model):
    """Evenly spaced values, including both ends."""

    start: float
    stop: float
    num: Annotated[int, pydantic.Field(ge=2, le=MOST)]
    """Number of values."""

    @pydantic.model_validator(mode="after")
    def _rises(self):
        check_bounds((self.start, self.stop), "start", "stop", self.logarithmic())
        return self

    def logarithmic(self) -> bool:
        """Whether the logarithms are evenly spaced."""
        return False

    def numbers(self) -> tuple[float, ...]:
        """The values."""
        return plain(np.linspace(self.start, self.stop, self.num))


class LogRange(Range):
    """Values with a constant ratio, including both ends."""

    def logarithmic(self) -> bool:
        return True

    def numbers(self) -> tuple[float, ...]:
        return plain(np.geomspace(self.start, self.stop, self.num))


class Axis(Model):
    """One field of the config and the values that it takes: exactly one of `values`, `range` and `log_range`."""

    field: str
    """Dotted, as on the command line: `costs.c3`, `pitch`, `population.bump_width`."""
    values: Values | None = None
    range: Range | None = None
    log_range: LogRange | None = None
    together: dict[str, Values] = pydantic.Field(default_factory=dict)
    """Other fields that change along with it, with one value for each of its values."""

    @pydantic.model_validator(mode="after")
    def _one_way(self):
        given = [name for name in ("values", "range", "log_range") if getattr(self, name) is not None]
        if len(given) != 1:
            refuse_value(
                f"{self.field}: give exactly one of values, range and log_range, not {' and '.join(given) or 'none'}"
            )
        numbers = self.numbers()
        if len(set(numbers)) < len(numbers):
            refuse_value(f"{self.field}: values must be distinct, in {list(numbers)}")
        for name, others in self.together.items():
            if len(others) != len(numbers):
                refuse_value(
                    f"{self.field}: together.{name} must have {len(numbers)} values, one per value, not {len(others)}"
                )
        return self

    def numbers(self) -> tuple[float, ...]:
        """The values of the field."""
        source = self.range or self.log_range
        return source.numbers() if source else self.values

    def names(self) -> tuple[str, ...]:
        """All fields that it changes."""
        return self.field, *self.together


class Sobol(Model):
    """Points that fill a box evenly: a scrambled Sobol sequence (`scipy.stats.qmc.Sobol`)."""

    points: Annotated[int, pydantic.Field(ge=1, le=MOST)]
    """Number of points; a power of 2, for which the sequence is balanced."""
    seed: Annotated[int, pydantic.Field(ge=0, lt=2**32)] = 0
    """Seed of the scrambling."""
    range: dict[str, Bounds] = pydantic.Field(default_factory=dict)
    """Lowest and highest value of each field."""
    log_range: dict[str, Bounds] = pydantic.Field(default_factory=dict)
    """The same for fields that are spaced evenly in their logarithm."""

    @pydantic.model_validator(mode="after")
    def _sound(self):
        if self.points & (self.points - 1):
            less = 2 ** (self.points.bit_length() - 1)
            refuse_value(f"points must be a power of 2, such as {less} or {2 * less}, not {self.points}")
        if not self.names():
            refuse_value("needs a range or a log_range of at least one field")
        for name in set(self.range) & set(self.log_range):
            refuse_value(f"{name}: must be in one of range and log_range")
        for log, box in ((False, self.range), (True, self.log_range)):
            for name, bounds in box.items():
                check_bounds(bounds, f"{name}: the first", "the second", log)
        return self

    def names(self) -> tuple[str, ...]:
        """All fields that it changes."""
        return *self.range, *self.log_range

    def numbers(self) -> list[dict[str, float]]:
        """The points: field to value."""
        from scipy.stats import qmc

        unit = qmc.Sobol(len(self.names()), rng=np.random.default_rng(self.seed)).random(self.points)
        columns = {}
        for share, name in zip(unit.T, self.names(), strict=True):
            if name in self.range:
                low, high = self.range[name]
                columns[name] = low + share * (high - low)
            else:
                low, high = self.log_range[name]
                columns[name] = low * (high / low) ** share
        return [dict(zip(columns, map(float, row), strict=True)) for row in zip(*columns.values(), strict=True)]


def plain(numbers: Float[np.ndarray, "n"]) -> tuple[float, ...]:
    """Values rounded to twelve digits: 10, where a power of a root gives 10.000000000000002."""
    return tuple(float(f"{number:.12g}") for number in numbers)


def check_bounds(bounds: Bounds, low: str, high: str, log: bool) -> None:
    """Raise about a range that does not increase, or that has no logarithm."""
    if bounds[1] <= bounds[0]:
        refuse_value(f"{low} must be below {high}: {bounds[0]:g} is not below {bounds[1]:g}")
    if log and bounds[0] <= 0:
        refuse_value(f"{low} must be above 0 on a log range, not {bounds[0]:g}")
