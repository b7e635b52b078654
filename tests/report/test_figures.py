"""Figures: written whole, the same each time, for full and for poor studies."""

import errno
import io

import numpy as np
import polars as pl
import pytest
from PIL import Image

from jaxbiped import files
from jaxbiped.errors import InputError
from jaxbiped.report import figures
from jaxbiped.statistics import compare
from jaxbiped.statistics.schema import STRATEGIES
from tests.study.synthetic import rows

FRAME = rows(60)
COMPARISON = compare(FRAME, resamples=50)


def test_every_figure_is_a_picture_with_a_caption(tmp_path):
    captions = figures.write_figures(tmp_path, FRAME, COMPARISON)
    assert list(captions) == ["success.png", "codes.png", "difficulty.png", "differences.png", "times.png"]
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(captions)
    for name, caption in captions.items():
        pixels = np.asarray(Image.open(tmp_path / name).convert("RGB"))
        assert caption.endswith(".") and min(pixels.shape[:2]) > 300
        assert 0.3 < np.mean(pixels == 255) < 0.99  # something is drawn, on white


def test_figures_do_not_depend_on_when_they_are_made():
    once, again = io.BytesIO(), io.BytesIO()
    figures.saver(figures.success(COMPARISON))(once)
    figures.saver(figures.success(COMPARISON))(again)
    assert once.getvalue() == again.getvalue()


def test_dots_are_where_the_estimates_are():
    ax = figures.success(COMPARISON).axes[0]
    drawn = sorted(round(float(line.get_ydata()[0]), 6) for line in ax.lines if line.get_marker() == "o")
    assert round(100 * COMPARISON.summary("full").success.estimate, 6) in drawn


def test_the_forest_is_symmetric_about_zero_and_says_which_side_is_better():
    figure = figures.differences(COMPARISON, "bump_aware", "floor_only")
    for ax in figure.axes:
        assert sum(ax.get_xlim()) == pytest.approx(0)
    labels = [ax.get_xlabel() for ax in figure.axes]
    assert labels[0].startswith("← floor_only better")
    assert labels[1] == labels[2] and labels[1].startswith("← bump_aware better")


def test_every_strategy_has_its_own_look():
    assert set(figures.COLOURS) == set(figures.MARKERS) == set(STRATEGIES)
    assert len(set(figures.COLOURS.values())) == len(STRATEGIES)


def nobody(frame):
    null = pl.lit(None, pl.Float64)
    code, failed = pl.lit("stuck").alias("code"), pl.lit(False).alias("success")
    return frame.with_columns(code, failed, null.alias("distance"), null.alias("time"))


@pytest.mark.parametrize(
    ("frame", "names"),
    [
        (nobody(FRAME), 5),
        (FRAME.head(5), 5),
        (FRAME.filter(pl.col("strategy") == "full"), 3),
        (FRAME.with_columns(pl.lit(0.5, pl.Float32).alias("difficulty")), 5),
        (FRAME.with_columns(pl.lit("scene").alias("family")), 5),
    ],
)
def test_poor_studies_draw_too(tmp_path, frame, names):
    assert len(figures.write_figures(tmp_path, frame, compare(frame, resamples=50))) == names


def test_a_full_disk_leaves_nothing_half_written(tmp_path, monkeypatch):
    def full(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(files.os, "fsync", full)
    with pytest.raises(InputError, match=r"success.png: cannot be written: no space left"):
        figures.write_figures(tmp_path, FRAME, COMPARISON)
    assert list(tmp_path.iterdir()) == []
