"""A sweep: a study over many points of its config."""

from __future__ import annotations

import difflib
import itertools
import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Annotated, Any

import pydantic
import tyro

from jaxbiped.arenas.config import FAMILY_OF, PopulationConfig
from jaxbiped.config import Model, refuse_value
from jaxbiped.core.names import KNOWN
from jaxbiped.errors import InputError
from jaxbiped.mission.config import MissionConfig
from jaxbiped.study.axes import Axis, Sobol
from jaxbiped.study.config import OF_COMPONENTS, StudyConfig

if TYPE_CHECKING:
    from jaxbiped.study.batching import Point

POPULATION = "population"
OPTIONAL = (f"{POPULATION}.", "mapping.fade")  # prefixes of optional numbers
EXAMPLES = "costs.c3, pitch, stereo.sd, robot.radius or population.bump_width"


class SweepConfig(StudyConfig):
    """A study over a grid of values, Sobol points, or both combined: the last axis changes fastest.

    Any numeric field of the config can be swept. Whether points need separate compilations is found automatically: they
    share one program unless array shapes differ.
    """

    question: str = ""
    """The question it asks, for its report."""
    base: bool = False
    """Whether the unchanged config is an additional point, the first: the others are compared with it."""
    axes: Annotated[tuple[Axis, ...], tyro.conf.Fixed] = ()
    sobol: Annotated[Sobol | None, tyro.conf.Fixed] = None

    @pydantic.model_validator(mode="after")
    def _sound(self):
        try:
            for _ in self.points():
                pass
        except InputError as error:
            refuse_value(str(error))
        return self

    def fields(self) -> tuple[str, ...]:
        """All swept fields, in the order of the columns of `points.parquet`."""
        return *itertools.chain(*(axis.names() for axis in self.axes)), *(self.sobol.names() if self.sobol else ())

    def size(self) -> int:
        """Number of points."""
        return self.base + math.prod(len(axis.numbers()) for axis in self.axes) * (
            self.sobol.points if self.sobol else 1
        )

    def points(self) -> Iterator[Point]:
        """The sweep points, each validated; a single one if nothing is swept.

        Raises:
          InputError: a field that is unknown, not a number, or swept twice; a value that its field does not allow,
            alone or together with the others of its point; more points than fit in memory.
        """
        from jaxbiped.arenas.families import SIZE_X, SIZE_Y
        from jaxbiped.study.memory_limit import most_points

        fields = self.fields()
        if self.size() > (most := most_points(len(self.strategies))):
            sizes = [*(len(axis.numbers()) for axis in self.axes), *([self.sobol.points] if self.sobol else [])]
            message = f"{' x '.join(map(str, sizes))} points do not fit in memory; at most {most} fit"
            raise InputError(message, field="axes")
        mission, population = self.mission.model_dump(), self.population.model_dump()
        for name in fields:
            if fields.count(name) > 1:
                raise InputError("is swept twice; a field can be in one axis", field=f"axis {name}")
            if name.startswith(OF_COMPONENTS):
                check_component_field(name)
                continue
            check_field(name, mission | {POPULATION: population})
            family = FAMILY_OF.get(name.removeprefix(f"{POPULATION}."))
            if family and family not in self.families:
                raise InputError(f"needs the family {family} among the families", field=f"axis {name}")
        size_xy = (SIZE_X, SIZE_Y) if set(self.families) <= set(KNOWN) else None
        own = []
        if self.base:
            for name in fields:
                if name.startswith(OF_COMPONENTS):
                    raise InputError("a component's number has no value in the config for the base point", field=name)
            leaves = dict(flat(mission | {POPULATION: population}))
            own = [{name: leaves[name] for name in fields}]
            for name in fields:
                if leaves[name] is None:
                    raise InputError("has no value in the config for the base point; give it one", field=name)
        for index, values in enumerate(itertools.chain(own, self.combinations())):
            yield point_at(index, values, mission, population, size_xy)

    def combinations(self) -> Iterator[dict[str, float]]:
        """The value of each field, for each point."""
        parts: list[list[dict[str, float]]] = []
        for axis in self.axes:
            rows = zip(axis.numbers(), *axis.together.values(), strict=True)
            parts.append([dict(zip(axis.names(), row, strict=True)) for row in rows])
        if self.sobol:
            parts.append(self.sobol.numbers())
        for row in itertools.product(*parts):
            yield {name: value for part in row for name, value in part.items()}


def point_at(
    index: int,
    values: dict[str, float],
    mission: dict[str, Any],
    population: dict[str, Any],
    size_xy: tuple[float, float] | None = None,
) -> Point:
    """One sweep point: the config with some fields replaced; `InputError` about the value that is not allowed.

    Args:
      size_xy: [m] size of all arenas, which its pitch must divide; None: check this when they are known.
    """
    from jaxbiped.mission.params import mission_spec
    from jaxbiped.study.batching import Point

    own = {}
    for name, value in values.items():
        if name.startswith(OF_COMPONENTS):
            own[name] = value
        elif name.startswith(f"{POPULATION}."):
            population = replaced(population, name.split(".")[1:], value)
        else:
            mission = replaced(mission, name.split("."), value)
    kind = validated(MissionConfig, mission, values)
    try:
        if size_xy is not None:
            mission_spec(kind, size_xy)
    except InputError as error:
        raise InputError(f"{shown(values)}: {error}", field="axes") from None
    drawn = validated(PopulationConfig, population, values, f"{POPULATION}.")
    return Point(index, kind, drawn, values, own)


def validated(model: type[Model], data: dict[str, Any], values: Mapping[str, float], prefix: str = ""):
    """The model of a point; `InputError` that names the swept field, or all of them if their combination is wrong."""
    try:
        return model.model_validate(data)
    except pydantic.ValidationError as error:
        first = error.errors(include_url=False)[0]
        field, message = prefix + ".".join(map(str, first["loc"])), first["msg"].removeprefix("Value error, ")
        if field in values:
            raise InputError(message, field=f"axis {field}", value=values[field]) from None
        raise InputError(f"{shown(values)}: {message}", field=f"axes, {field}") from None


def shown(values: Mapping[str, float]) -> str:
    """A point as text."""
    return ", ".join(f"{name} = {value:g}" for name, value in values.items())


def replaced(tree: dict[str, Any], path: list[str], value: float) -> dict[str, Any]:
    """A config's values with one of them replaced."""
    name, *rest = path
    return tree | {name: replaced(tree[name], rest, value) if rest else value}


def check_component_field(name: str) -> None:
    """Raise `InputError` unless a dotted name may be that of a component's number; its existence is checked later."""
    kind, _, field = name.partition(".")
    if not field.isidentifier():
        raise InputError(f"must be {kind}.<field>", field=f"axis {name}")


def check_field(name: str, config: Mapping[str, Any]) -> None:
    """Raise `InputError` unless a dotted name is that of a number in a config."""
    leaves = dict(flat(config))
    field = f"axis {name}"
    if name not in leaves:
        inside = [leaf for leaf in leaves if leaf.startswith(f"{name}.")]
        near = inside or difflib.get_close_matches(name, leaves, 3, 0.6)
        message = "is a table; sweep a number in it" if inside else "no such field; sweep a number of the config"
        raise InputError(f"{message}, such as {', '.join(near[:4]) or EXAMPLES}", field=field)
    number = isinstance(leaves[name], int | float) and not isinstance(leaves[name], bool)
    if not (number or (leaves[name] is None and name.startswith(OPTIONAL))):
        raise InputError(f"is not a number; sweep one, such as {EXAMPLES}", field=field, value=leaves[name])


def flat(tree: Mapping[str, Any], name: str = "") -> Iterator[tuple[str, Any]]:
    """Dotted names and values of everything that is not a table."""
    for key, value in tree.items():
        dotted = f"{name}.{key}" if name else key
        if isinstance(value, Mapping):
            yield from flat(value, dotted)
        else:
            yield dotted, value
