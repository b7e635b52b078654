"""Maps of missions that differ, drawn from logs that are at hand."""

import base64
import re

import polars as pl
import pytest

from jaxbiped.errors import InputError
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.recorded_driver import Mission
from jaxbiped.report import examples as room
from jaxbiped.report.examples import KEY, example_section
from jaxbiped.study.replay import Origin
from tests.report.html_reader import Reader
from tests.report.test_pictures import mission
from tests.study.synthetic import rows
from tests.study.test_stored_series import open_stored, stored

PAIR = ("full", "floor_only")
FRAME = rows(60, strategies=PAIR)


@pytest.fixture
def origins(tmp_path):
    manifest = open_stored(stored(tmp_path / "r")).manifest
    return tuple(Origin(manifest, 0, {}, name) for name in PAIR)


def played(manifest, point, values, strategy, arenas):
    """As `play_again`: missions that end as the rows say."""
    ends = dict(FRAME.filter(pl.col("strategy") == strategy).select("arena", "code").iter_rows())
    codes = [Code[ends[arena].upper()] for arena in arenas]
    return [Mission(code, 1.23, 600.0, 5, (), mission()) for code in codes]


def test_two_maps_an_arena(origins, monkeypatch):
    monkeypatch.setattr(room, "play_again", played)
    section = example_section(FRAME, PAIR, origins, 2)
    assert section.text == (KEY,) and section.kind == "pairs" and len(section.plots) == 4
    captions = [plot.caption for plot in section.plots]
    assert re.match(
        r"Arena \d+ \(\w+, difficulty 0\.\d\d\): .* is faster by .* min\. full: reached, 123 cm", captions[0]
    )
    assert captions[1].startswith("floor_only: reached, 123 cm in 10.0 min")
    for plot in section.plots:
        ((tag, found),) = Reader(plot.markup).elements
        assert tag == "img" and found["alt"] == plot.caption
        assert base64.b64decode(found["src"].removeprefix("data:image/png;base64,")).startswith(b"\x89PNG")


def test_missions_that_end_otherwise_are_named(origins, monkeypatch):
    fell = Mission(Code.FELL, 0.5, 60.0, 3, (), mission())
    monkeypatch.setattr(room, "play_again", lambda *origin: [fell] * len(origin[-1]))
    section = example_section(FRAME, PAIR, origins, 1)
    assert "Replayed here, these differ: full on arena" in section.text[1] and "reached when" in section.text[1]


def test_what_cannot_be_played_is_said(origins, monkeypatch):
    section = example_section(FRAME, PAIR, origins, 2)  # the folder holds no config of missions
    assert section.plots == () and "Not drawn: manifest.json: the manifest holds no config" in section.text[0]

    def broken(*_):
        raise InputError("no physics", field="executor")

    monkeypatch.setattr(room, "play_again", broken)
    assert "no physics" in example_section(FRAME, PAIR, origins, 2).text[0]


def test_nothing_where_nothing_differs(origins):
    same = [FRAME.filter(pl.col("strategy") == "full").with_columns(strategy=pl.lit(name)) for name in PAIR]
    assert example_section(pl.concat(same), PAIR, origins, 3) is None
