"""The HTML page of a sweep: figures that fit its axes, all its tables, and one point in full."""

import io

import polars as pl
import pytest
from rich.console import Console

from jaxbiped import cli
from jaxbiped.config import Model
from jaxbiped.errors import InputError
from jaxbiped.report import Report, SweepReport, write_report
from jaxbiped.report.folder_report import terminal_report
from jaxbiped.report.sweep import write_sweep_report
from jaxbiped.report.sweep_page import write_sweep_page
from jaxbiped.study import StudyHeader, create
from tests.report.html_reader import Reader
from tests.study.synthetic import rows
from tests.study.test_stored_series import other, stored

C3, WIDTH = {"field": "costs.c3", "values": [5.0, 10.0, 20.0]}, {"field": "population.bump_width", "values": [0.2, 0.4]}


class Config(Model):
    axes: tuple[dict, ...] = ()
    mission: dict = {"costs": {"c3": 10.0}}  # noqa: RUF012 (pydantic copies it)
    question: str = ""


def swept(folder, config, points, strategies=("full", "floor_only"), change=lambda point: point):
    """A folder of a made-up sweep; every point is slower than the one before, or as slow as `change` says."""
    table = pl.DataFrame({"point": range(len(points)), **{k: [float(p[k]) for p in points] for k in points[0]}})
    table = table.with_columns(pl.col("point").cast(pl.Int32))
    frames = [other(rows(48, strategies=strategies), change(k)).with_columns(point=pl.lit(k, pl.Int32))
              for k in range(len(points))]  # fmt: skip
    with create(
        folder, StudyHeader(config, seed=0, arenas=48, points=table, command="jaxbiped sweep x.toml")
    ) as results:
        results.append(pl.concat(frames))
        results.finish(compile_time=1.0)
    return folder


LINE = [{"costs.c3": c3} for c3 in C3["values"]]
GRID = [{"costs.c3": c3, "population.bump_width": w} for c3 in C3["values"] for w in WIDTH["values"]]


@pytest.mark.parametrize(
    ("axes", "points", "drawn"),
    [((C3,), LINE, 6), ((C3, WIDTH), GRID, 5), ((), GRID, 2)],
    ids=["one axis", "two axes", "no grid"],
)
def test_figures_fit_the_axes(tmp_path, axes, points, drawn):
    folder = swept(tmp_path / "s", Config(axes=axes), points)
    path = write_sweep_page(write_sweep_report(folder, resamples=20), resamples=20)
    text = path.read_text()
    read = Reader(text)
    figures = [found for tag, found in read.elements if tag == "svg" and found.get("role") == "img"]
    assert len(figures) == drawn + 7
    names = [found["id"] for _, found in read.elements if "id" in found]
    assert len(set(names)) == len(names)
    assert all(len({sum(span for span, _ in row) for row in table}) == 1 for table in read.tables)
    assert any(len(table) == len(points) + 1 for table in read.tables)
    assert f"{len(points)} sweep points" in read.text and "jaxbiped sweep x.toml" in read.text
    assert "How does the difference between full and floor_only depend on costs.c3" in read.text


def test_each_strategys_own_means_are_drawn_over_one_axis(tmp_path):
    folder = swept(tmp_path / "s", Config(axes=(C3,)), LINE)
    read = Reader(write_sweep_page(write_sweep_report(folder, resamples=20), resamples=20).read_text())
    heard = [found["aria-label"] for tag, found in read.elements if tag == "svg" and found.get("role") == "img"]
    assert heard[0].startswith("Success of each strategy")
    assert heard[1].startswith("Mean distance of each strategy") and heard[2].startswith("Mean time of each strategy")


def test_an_axis_that_changes_nothing_is_named_on_the_page_and_in_the_terminal(tmp_path):
    folder = swept(tmp_path / "s", Config(axes=(C3,)), LINE, change=lambda point: min(point, 1))
    report = write_report(folder, resamples=20)
    said = "costs.c3 changes nothing from 10 to 20: every mission is the same at these 2 values."
    assert report.sentences[-1] == said and said in Reader((folder / "report.html").read_text()).text
    console = Console(width=200, record=True, file=io.StringIO())
    console.print(terminal_report(report))
    assert said in console.export_text()


def test_the_point_in_full_is_the_configs_own_or_the_one_that_is_named(tmp_path):
    report = write_sweep_report(swept(tmp_path / "s", Config(axes=(C3,), question="Does it pay?"), LINE), resamples=20)
    read = Reader(write_sweep_page(report, resamples=20).read_text())
    assert "At point 1: costs.c3 10" in read.text and "Does it pay?" in read.text
    assert "At point 2: costs.c3 20" in Reader(write_sweep_page(report, point=2, resamples=20).read_text()).text
    with pytest.raises(InputError, match="must be a sweep point with rows, 0 to 2"):
        write_sweep_page(report, point=3)


def test_one_strategy_has_rates_alone(tmp_path):
    folder = swept(tmp_path / "s", Config(axes=(C3,)), LINE, strategies=("full",))
    read = Reader(write_sweep_page(write_sweep_report(folder, resamples=20), resamples=20).read_text())
    assert "How does full depend on costs.c3?" in read.text


def test_one_function_reports_on_comparisons_and_on_sweeps(tmp_path):
    report = write_report(swept(tmp_path / "s", Config(axes=(C3,)), LINE), point=2, resamples=20)
    assert isinstance(report, SweepReport)
    assert [path.name for path in report.files] == ["report.html", "summary.md", "sweep.png"]
    assert "At point 2" in (tmp_path / "s" / "report.html").read_text()
    assert (tmp_path / "s" / "summary.md").read_text().startswith("# Sweep")
    assert isinstance(write_report(stored(tmp_path / "r"), resamples=20), Report)
    assert (tmp_path / "r" / "summary.md").read_text().startswith("# Strategies compared")


def test_the_command_knows_a_sweep(tmp_path, capsys):
    folder = swept(tmp_path / "s", Config(axes=(C3,)), LINE)
    assert cli.main(["report", str(folder), "--examples", "0", "--point", "2"]) == 0
    assert "report.html, summary.md, sweep.png" in capsys.readouterr().out
    assert "At point 2" in (folder / "report.html").read_text()
    assert cli.main(["report", str(folder), "--point", "7"]) == 2
    assert "point: must be a sweep point with rows" in capsys.readouterr().err
