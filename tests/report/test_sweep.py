"""The report of a sweep: a figure that fits its axes, tables that say what the rows hold, and the whole command."""

from contextlib import nullcontext

import polars as pl
import pytest
from matplotlib.figure import Figure
from PIL import Image

from jaxbiped import cli
from jaxbiped.commands import sweep as command
from jaxbiped.config import load, parse
from jaxbiped.errors import InputError
from jaxbiped.report.sweep import write_sweep_report
from jaxbiped.report.sweep_figures import sweep_figure
from jaxbiped.study import read_points, store
from jaxbiped.study.batching import group_points, only_point, shards
from jaxbiped.study.run_study import Engine, compute_study, table
from jaxbiped.study.sweep import SweepConfig
from tests.study.synthetic import rows

PAIR = ("bump_aware", "floor_only")
C3 = {"field": "costs.c3", "log_range": {"start": 2.5, "stop": 40, "num": 5}}
LENGTH = {"field": "population.bump_length", "values": [0.3, 0.6, 0.9]}
BOX = {"points": 8, "log_range": {"costs.c1": (0.25, 4), "costs.c3": (2.5, 40)}}


def made_up(config, on_progress=None, *, points, done):
    """An engine whose rows are made up: points differ by their seeds."""
    for shard in shards(config, 1):
        frames = [
            rows(config.arenas, seed=p.index % 5, strategies=config.strategies).with_columns(
                point=pl.lit(p.index, pl.Int32)
            )
            for p in points or only_point(config)
        ]
        inside = pl.col("arena").is_between(shard.first, shard.first + shard.count - 1)
        yield shard, pl.concat(frames).filter(inside)


def conducted(folder, **fields):
    """A sweep's folder."""
    config = parse(SweepConfig, {"arenas": 40, "strategies": PAIR} | fields)
    compute_study(folder, config, points=tuple(config.points()), engine=Engine(made_up))
    return folder


@pytest.mark.parametrize(
    ("fields", "panels"),
    [
        ({"axes": [C3]}, 4),
        ({"axes": [C3], "strategies": ("full",)}, 1),
        ({"axes": [LENGTH, C3]}, 3),
        ({"axes": [LENGTH, C3], "strategies": ("full",)}, 1),
        ({"sobol": BOX, "base": True}, 4),
        ({"axes": [LENGTH, C3, {"field": "stereo.sd", "values": [0.1, 0.2]}]}, 6),
    ],
)
def test_each_kind_of_sweep_has_its_figure(tmp_path, fields, panels):
    report = write_sweep_report(conducted(tmp_path / "r", **fields), resamples=99)
    axes = [axis["field"] for axis in report.manifest.config["axes"]] if "axes" in fields else []
    figure, _ = sweep_figure(report.result, axes)
    assert isinstance(figure, Figure) and len(figure.axes) == panels
    with Image.open(tmp_path / "r" / "sweep.png") as image:
        assert image.width > 400 and image.height > 300


def test_summary_says_what_the_rows_hold(tmp_path):
    folder = conducted(tmp_path / "r", axes=[C3], question="Is C3 right?")
    report = write_sweep_report(folder, resamples=99)
    text = (folder / "summary.md").read_text()
    assert "**Is C3 right?**" in text and "![" in text and "config hash" in text.lower()
    assert report.result.reference == 2  # C3 = 10, the paper's
    frame = store.read(folder).rows
    for point in report.result.points:
        reached = frame.filter((pl.col("point") == point.index) & (pl.col("strategy") == PAIR[0]))["success"].mean()
        line = next(row for row in text.splitlines() if row.startswith(f"| {point.index} |"))
        assert f"{100 * reached:.1f} [" in line
    assert "bump_aware: each point minus point 2" in text
    ended = text.split("### How missions ended")[1].split("###")[0].split("## ")[0]
    names, *table_rows = ([cell.strip() for cell in row.split("|")[1:-1]] for row in ended.splitlines() if "|" in row)
    for row in table_rows[1:]:  # under the line that aligns columns
        codes = frame.filter(pl.col("strategy") == row[0])["code"].cast(pl.String).to_list()
        assert {n.replace(" ", "_"): int(c) for n, c in zip(names[1:], row[1:], strict=True) if c != "0"} == {
            code: codes.count(code) for code in set(codes)
        }
    assert [row[0] for row in table_rows[1:]] == list(PAIR)
    before = text
    write_sweep_report(folder, resamples=99)
    assert (folder / "summary.md").read_text() == before


def test_a_sweep_that_was_stopped_says_so(tmp_path):
    config = parse(SweepConfig, {"arenas": 40, "shard": 10, "strategies": PAIR, "axes": [C3]})

    def stops(*arguments, **options):
        for count, shard in enumerate(made_up(*arguments, **options)):
            if count == 2:
                raise KeyboardInterrupt
            yield shard

    with pytest.raises(KeyboardInterrupt):
        compute_study(tmp_path / "r", config, points=tuple(config.points()), engine=Engine(stops))
    report = write_sweep_report(tmp_path / "r", resamples=99)
    assert report.result.points[0].success[PAIR[0]].n == 20
    assert "not finished" in (tmp_path / "r" / "summary.md").read_text()


def test_the_command(tmp_path, monkeypatch, capsys):
    """From a file to its folder: all of it but the missions."""
    monkeypatch.setattr(command, "chosen_engine", lambda *_: nullcontext(Engine(made_up)))
    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text(
        'arenas = 12\nstrategies = ["bump_aware", "floor_only"]\n[[axes]]\nfield = "costs.c3"\nvalues = [5, 10, 20]\n'
    )
    assert cli.main(["sweep", "s.toml", "--out", "r", "--seed", "3"]) == 0
    said = capsys.readouterr().out
    assert "3 sweep points in 1 compiled program" in said and "written r: " in " ".join(said.split())
    assert {path.name for path in (tmp_path / "r").iterdir()} == {
        "rows",
        "points.parquet",
        "manifest.json",
        "summary.md",
        "sweep.png",
        "report.html",
    }
    points = read_points("r")
    assert points["costs.c3"].to_list() == [5, 10, 20] and points["point"].to_list() == [0, 1, 2]
    manifest = store.read_manifest("r")
    assert manifest.seed == 3 and manifest.rows == 3 * 12 * 2 and manifest.config["axes"][0]["field"] == "costs.c3"
    assert (
        cli.main(["sweep", "s.toml", "--out", "r"]) == 2 and "must be a folder that does not" in capsys.readouterr().err
    )
    assert cli.main(["sweep", "s.toml", "--out", "r", "--seed", "3", "--resume"]) == 2
    assert "is finished" in capsys.readouterr().err
    (tmp_path / "bad.toml").write_text('[[axes]]\nfield = "costs.c9"\nvalues = [5]\n')
    assert cli.main(["sweep", "bad.toml"]) == 2
    said = capsys.readouterr().err
    assert said.startswith("jaxbiped: bad.toml: axis costs.c9: no such field") and said.count("\n") == 1


def test_points_that_are_damaged_are_named(tmp_path):
    folder = conducted(tmp_path / "r", axes=[C3])
    good = (folder / "points.parquet").read_bytes()
    for data, said in [(good[:50], "is damaged"), (b"", "is damaged")]:
        (folder / "points.parquet").write_bytes(data)
        with pytest.raises(InputError, match=rf"points.parquet: {said}"):
            read_points(folder)
    pl.DataFrame({"point": [0, 2], "costs.c3": [1.0, 2.0]}).write_parquet(folder / "points.parquet")
    with pytest.raises(InputError, match=r"points.parquet: must hold `point`, ascending from 0"):
        read_points(folder)


def test_points_of_a_study_that_sweeps_nothing(tmp_path):
    config = parse(SweepConfig, {"arenas": 6, "strategies": PAIR})
    compute_study(tmp_path / "r", config, engine=Engine(made_up))
    assert read_points(tmp_path / "r").to_dicts() == [{"point": 0}]
    assert table(tuple(config.points())).to_dicts() == [{"point": 0}]


@pytest.mark.parametrize(
    ("name", "points", "programs"),
    [("costs", 65, 1), ("resolution", 5, 5), ("noise", 7, 1), ("radius", 8, 1), ("bump", 30, 1), ("heights", 11, 1)],
)
def test_shipped_sweeps(request, name, points, programs):
    path = request.config.rootpath / "sweeps" / "studies" / f"{name}.toml"
    config = load(SweepConfig, path)
    assert path.read_text().startswith(f"# {config.question}\n")
    found = list(config.points())
    assert len(found) == points and len(group_points(found, config.strategies)) == programs
