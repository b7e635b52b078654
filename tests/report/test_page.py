"""The HTML page: whole in itself, complete, and as wide as the screen, by a parser and by a browser."""

import re
import shutil
import subprocess
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from jaxbiped.report.folder_report import write_report
from jaxbiped.report.grid import parsed, to_grid, typeset
from jaxbiped.report.page_figures import attributed, attribution_sheet
from jaxbiped.report.tables import Sheet
from jaxbiped.study import StudyHeader, create
from tests.report.html_reader import Reader
from tests.report.test_comparison_report import Config
from tests.study.synthetic import rows

BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))), None)
ADDRESSES = ("src", "href", "xlink:href", "poster", "data", "action")
WIDTHS = (400, 700, 1000, 1280)  # [pixel] from a telephone to a screen
COMMAND = "jaxbiped compare --arenas 60 --out '<b>&x'"


@pytest.fixture(scope="module")
def page(tmp_path_factory) -> Path:
    """The page of a small study."""
    folder = tmp_path_factory.mktemp("page") / "r"
    with create(folder, StudyHeader(Config(), seed=3, arenas=60, command=COMMAND)) as results:
        results.append(rows(60))
        results.finish(compile_time=2.0)
    report = write_report(folder, resamples=50)
    assert report.files[0] == folder / "report.html"
    return report.files[0]


@pytest.fixture(scope="module")
def read(page) -> Reader:
    return Reader(page.read_text())


def test_nothing_is_fetched(page, read):
    addresses = [value for _, found in read.elements for name, value in found.items() if name in ADDRESSES]
    assert all(value.startswith(("#", "data:image/png;base64,")) for value in addresses)
    assert not {"script", "link", "iframe", "object"} & {tag for tag, _ in read.elements}
    styles = re.findall(r"url\(\s*['\"]?(.)|@import", page.read_text())
    assert set(styles) <= {"#"}


def test_names_are_distinct_and_what_is_named_is_there(page, read):
    names = [found["id"] for _, found in read.elements if "id" in found]
    assert len(set(names)) == len(names)
    used = re.findall(r'url\(#([^)]+)\)|href="#([^"]+)"', page.read_text())
    assert {a or b for a, b in used} <= set(names)


def test_it_says_what_was_asked_answered_and_done(read):
    assert "does bump-aware planning beat floor-only planning?" in read.text
    assert re.search(r"\(interval [−+]?\d+\.\d to [−+]?\d+\.\d, p", read.text)
    assert COMMAND in read.text and "jaxbiped report" in read.text  # escaped, and read back
    titles = ("Strategies", "On the same arenas", "Where it differs", "How missions fail", "How it was made")
    assert all(title in read.text for title in titles)
    assert '"seed": 3' in read.text


def test_tables_are_complete(read):
    assert len(read.tables) == 9
    for table in read.tables:
        widths = {sum(span for span, _ in row) for row in table}
        assert len(table) > 1 and len(widths) == 1
        filled = [[text.strip() for _, text in row] for row in table]
        assert all(all(row[:-1]) for row in filled)  # a median has no p, which stands last
        assert not {"nan", "none", "inf"} & {word for row in filled for cell in row for word in cell.lower().split()}


def test_figures_are_there_with_words_for_who_does_not_see_them(read):
    figures = [found for tag, found in read.elements if tag == "svg" and found.get("role") == "img"]
    assert len(figures) == 7 and all(found["aria-label"] for found in figures)
    assert sum(tag == "figcaption" for tag, _ in read.elements) == len(figures)


def test_every_mission_is_attributed_once():
    frame = rows(120)
    names = ("full", "floor_only")
    counts = attributed(frame, names)
    assert sum(counts.values()).tolist() == [120, 120]
    reached = frame.filter(pl.col("success"))["strategy"].value_counts()
    assert counts["reached"].tolist() == [dict(reached.iter_rows())[name] for name in names]
    full = frame.filter((pl.col("strategy") == "full") & ~pl.col("success"))
    assert counts["no plan exists"][0] == full["reachable"].not_().sum() > 0
    assert counts["fell"][0] == ((full["code"] == "fell") & full["reachable"]).sum()
    sheet = attribution_sheet(frame, *names)
    counted = np.array([[int(cell) for cell in row[1:]] for group in sheet.groups for row in group[1:]])
    assert counted.sum() == 240 and len(counted) == 12


def test_points_stand_under_each_other():
    sheet = Sheet("t", ("a", "b", "c"), ((("x", "-1.25", "3.0 [-2.5, 10.25]"), ("y", "7", "4"), ("z", "-", "")),))
    lines = to_grid(sheet).groups[0]
    assert [line.cells[0].value + line.cells[0].pad for line in lines] == ["−1.25", "7.00", "–"]
    cell = lines[0].cells[1]
    assert (cell.value, cell.low, cell.low_pad, cell.high, cell.width) == ("3.0", "−2.5", "0", "10.25", 5)
    assert parsed("+1 [0, 2]*").after == "*"
    assert typeset("bump-aware (-2.1 to -3) a - b") == "bump-aware (−2.1 to −3) a − b"


@pytest.mark.skipif(BROWSER is None, reason="no chromium on PATH")
def test_a_browser_shows_it_without_scrolling_sideways(page, tmp_path):
    # The page has no script of its own: it is measured from around.
    frames = "".join(
        f'<iframe src="{page.as_uri()}" style="width:{width}px;height:900px"></iframe>' for width in WIDTHS
    )
    (tmp_path / "around.html").write_text(
        f"<style>iframe {{ border: 0 }}</style>{frames}<script>onload = () => {{ document.body.dataset.seen ="
        "[...document.querySelectorAll('iframe')].map(frame => {"
        "const seen = frame.contentDocument, root = seen.documentElement;"
        "const figures = [...seen.querySelectorAll('svg, img')].map(it => it.getBoundingClientRect());"
        "const right = Math.max(...[...seen.querySelectorAll('main *')].filter(it => !it.closest('svg, thead'))"
        ".map(it => it.getBoundingClientRect().right));"
        "return [root.scrollWidth, root.clientWidth, right, figures.length, Math.min(...figures.map(it => it.width)),"
        "seen.querySelectorAll('table').length].join(' '); }).join(';'); }</script>"
    )
    command = [BROWSER, "--headless", "--no-sandbox", "--disable-gpu", "--allow-file-access-from-files"]
    command += [f"--user-data-dir={tmp_path / 'profile'}", "--virtual-time-budget=5000", "--window-size=1400,1000"]
    shown = subprocess.run(
        [*command, "--dump-dom", (tmp_path / "around.html").as_uri()],
        check=True,
        capture_output=True,
        text=True,
        timeout=120,
    )
    found = re.search(r'data-seen="([^"]+)"', shown.stdout)
    assert found, shown.stderr[-2000:]
    for width, measured in zip(WIDTHS, found.group(1).split(";"), strict=True):
        across, inner, right, figures, narrowest, tables = (float(value) for value in measured.split())
        assert across <= inner <= width and right <= inner + 0.5, (width, measured)
        assert figures == 7 and narrowest >= 300 and tables == 8, (width, measured)
