"""The results of a study: its rows, and what can be computed from them."""

from __future__ import annotations

import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

import polars as pl
import pydantic

from jaxbiped.config import Model
from jaxbiped.core.names import MEASURES
from jaxbiped.errors import InputError
from jaxbiped.mission.metric import MetricFormat, format_of
from jaxbiped.mission.strategies import Strategy
from jaxbiped.statistics.comparison import Comparison, compare, default_pairs
from jaxbiped.statistics.schema import metric_columns, ordered, validate
from jaxbiped.study import store
from jaxbiped.study.batching import metrics_of
from jaxbiped.study.config import StudyConfig

if TYPE_CHECKING:
    from matplotlib.figure import Figure


class Kept(Model):
    """A config as it was stored: names in it are not looked up, so nothing is imported."""

    model_config = pydantic.ConfigDict(extra="allow", frozen=True)


@dataclass(frozen=True)
class Table:
    """Tables and sentences that display themselves: as text, in a terminal, and as HTML in a notebook."""

    what: Callable[[], Any]  # makes a Rich renderable

    def __rich__(self):
        return self.what()

    def text(self, html: bool = False, width: int = 100) -> str:
        """The content as text or as HTML."""
        from rich.console import Console

        console = Console(file=io.StringIO(), record=True, width=width, force_jupyter=False)
        console.print(self.what(), highlight=False)
        if html:
            return console.export_html(inline_styles=True, code_format="<pre>{code}</pre>")
        return console.export_text().rstrip("\n")

    def __str__(self) -> str:
        return self.text()

    def __repr__(self) -> str:
        return self.text()

    def _repr_html_(self) -> str:
        return self.text(html=True)


@dataclass(frozen=True, repr=False)
class Compared(Table):
    """Paired statistics of strategies at one sweep point."""

    statistics: Comparison | None = None  # the numbers in the tables


@dataclass(frozen=True)
class Results:
    """The rows of a study or a sweep."""

    rows: pl.DataFrame  # of `statistics.schema.SCHEMA`: one for each sweep point, arena and strategy
    points: pl.DataFrame  # `point`, and a column for each swept field
    config: dict[str, Any]  # config of the study, as stored
    folder: Path | None = None  # where it is stored
    own: tuple[Strategy, ...] = ()  # strategies that are not built in
    shown: Mapping[str, MetricFormat] = field(default_factory=dict)  # how numbers of metrics are displayed

    @classmethod
    def of(cls, rows: pl.DataFrame, points: pl.DataFrame, config: StudyConfig, own: Sequence[Strategy]) -> Results:
        """Make results from rows in any order."""
        rank = pl.col("strategy").cast(pl.Enum(ordered(rows["strategy"].unique())))
        return cls(
            rows=validate(rows).sort("point", "arena", rank),
            points=points,
            config=config.model_dump(mode="json"),
            own=tuple(own),
            shown={name: format_of(metric, name) for name, metric in metrics_of(config).items()},
        )

    @property
    def strategies(self) -> tuple[str, ...]:
        """Names of the strategies, in the order of tables."""
        return ordered(self.rows["strategy"].unique())

    @property
    def axes(self) -> tuple[str, ...]:
        """The swept fields."""
        return tuple(name for name in self.points.columns if name != "point")

    def compare(
        self, first: str | None = None, second: str | None = None, *, point: int = 0, resamples: int = 4999
    ) -> Compared:
        """Compare two strategies on the same arenas: success, distance and time, with intervals and corrected p-values.

        Args:
          first, second: differences are first minus second; by default all usual pairs.
          point: sweep point.
          resamples: resamples of the bootstraps.

        Raises:
          InputError: a strategy or a point that does not exist, or the same strategy twice.
        """
        for side, name in (("first", first), ("second", second)):
            if name is not None and name not in self.strategies:
                raise InputError(f"must be one of {', '.join(self.strategies)}", field=side, value=name)
        if (first is None) != (second is None) or (first is not None and first == second):
            raise InputError("must be two strategies, or none for all usual pairs", field="first, second")
        pairs = [(first, second)] if first else default_pairs(self.strategies)
        rows = self.rows.filter(pl.col("strategy").is_in([first, second])) if first else self.rows
        found = compare(rows, point=point, pairs=pairs, seed=self.config["seed"], resamples=resamples, shown=self.shown)

        def shown():
            from jaxbiped.report.tables import terminal

            return terminal(found)

        return Compared(shown, found)

    def summary(self) -> Table:
        """Each strategy alone, or success at each point of a sweep."""
        if not self.axes:
            return self.compare()

        def shown():
            from rich.console import Group

            from jaxbiped.report.sweep import sheets
            from jaxbiped.report.tables import to_rich

            return Group(*(to_rich(sheet) for sheet in sheets(self.pointwise)))

        return Table(shown)

    @cached_property
    def pointwise(self):
        """The statistics of every sweep point (`statistics.sweep_points.SweepResult`)."""
        from jaxbiped.statistics.sweep_points import pointwise

        return pointwise(self.rows, self.points, self.config, seed=self.config["seed"])

    def plot(self, metric: str = "success") -> Figure:
        """Plot each strategy's own metric with intervals, over the axis of a sweep or side by side.

        Args:
          metric: success, distance, time, or the column of another metric; distance and time are means over a
            strategy's own reached missions.

        Raises:
          InputError: an unknown metric; a sweep of several fields.
        """
        known = (*MEASURES, *metric_columns(self.rows))
        if metric not in known:
            raise InputError(f"must be one of {', '.join(known)}", field="metric", value=metric)
        if len(self.axes) > 1:
            raise InputError(
                "draws one field; filter `rows` and `points` for the others", field="plot", value=self.axes
            )
        from jaxbiped.report.metric_figure import own_metric

        return own_metric(self.rows, self.points, metric, shown=self.shown)

    def save(self, folder: str | Path) -> Path:
        """Store the rows in a new folder, in the form of a study; `jaxbiped report FOLDER` draws its page.

        Raises:
          InputError: a folder that exists, a full disk.
        """
        config, swept = Kept.model_validate(self.config), self.points if self.axes else None
        seed, arenas = self.config["seed"], self.config["arenas"]
        header = store.StudyHeader(config, seed, arenas, points=swept, metrics=self.shown)
        with store.create(folder, header) as results:
            numbered = self.rows.with_columns(
                (pl.col("arena") // self.config["shard"]).alias("_block")
            )  # not the name of a metric
            for block in numbered.partition_by("_block", include_key=False, maintain_order=True):
                results.append(block)
            results.finish()
        return Path(folder)

    def replay(self, strategy: str, arena: int, point: int = 0):
        """Replay one mission of the study, with its log.

        Raises:
          InputError: a strategy, arena or point that does not exist; a strategy whose code has changed.
        """
        from jaxbiped.api.single_mission import PlayedMission
        from jaxbiped.study.manifest import Manifest
        from jaxbiped.study.replay import play_again

        where = (pl.col("strategy") == strategy) & (pl.col("arena") == arena) & (pl.col("point") == point)
        if self.rows.filter(where).is_empty():
            raise InputError("no such mission in these rows", field="replay", value=(strategy, arena, point))
        values = self.points.filter(pl.col("point") == point).row(0, named=True)
        values = {name: value for name, value in values.items() if name != "point"}
        manifest = Manifest.model_construct(config=self.config, seed=self.config["seed"])
        own = {item.name: item for item in self.own}
        mission = play_again(manifest, point, values, strategy, [arena], own)[0]
        return PlayedMission(f"arena {arena}", strategy, mission)

    def __rich__(self):
        return self.summary().__rich__()

    def __str__(self) -> str:
        return str(self.summary())

    def __repr__(self) -> str:
        what = f"{len(self.rows)} rows: {len(self.points)} point(s), {self.rows['arena'].n_unique()} arenas"
        return f"Results({what}, {', '.join(self.strategies)})"

    def _repr_html_(self) -> str:
        return self.summary()._repr_html_()
