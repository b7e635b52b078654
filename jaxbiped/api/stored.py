"""Comparisons across results: two strategies, two sweep points, or two studies on the same arenas."""

from __future__ import annotations

from pathlib import Path

from jaxbiped.api.results import Compared, Results
from jaxbiped.study.stored_series import Stored, choose, compare_sides, open_stored


def compare(
    results: Results | str | Path,
    others: Results | str | Path | None = None,
    *,
    first: str | None = None,
    second: str | None = None,
    first_point: int | None = None,
    second_point: int | None = None,
    resamples: int = 4999,
) -> Compared:
    """Compare two strategies or sweep points, of one study or of two, on the arenas that both have.

    Args:
      results, others: results, or their folders; from one study, or from two with the same seed and families.
      first, second: strategies; differences are first minus second. By default the first study's.
      first_point, second_point: sweep points, by default 0 and that of the first side.
      resamples: resamples of the bootstraps.

    Raises:
      InputError: no results, other arenas, a strategy or point that does not exist, or the same side twice.
    """
    stored = [as_stored(item) for item in (results, others) if item is not None]
    sides = choose(stored, (first, second), (first_point, second_point))
    found, _ = compare_sides(*sides, resamples=resamples)

    def shown():
        from rich.console import Group

        from jaxbiped.report.stored import terminal_sheets
        from jaxbiped.report.tables import to_rich

        return Group(*(to_rich(sheet) for sheet in terminal_sheets(found) if sheet.groups))

    return Compared(shown, found)


def as_stored(results: Results | str | Path) -> Stored:
    """Results in the form of a folder that was read."""
    if not isinstance(results, Results):
        return open_stored(results)
    from jaxbiped.study.manifest import Manifest

    manifest = Manifest.model_construct(
        config=results.config, seed=results.config["seed"], state="finished", metrics=results.shown
    )
    return Stored(results.folder or Path("results"), results.rows, manifest, results.points)
