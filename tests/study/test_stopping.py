"""A study ends when a difference is known well enough, says so, and can be gone on with until then."""

from functools import partial

import polars as pl
import pytest

from jaxbiped.errors import InputError
from jaxbiped.report.folder_report import write_report
from jaxbiped.report.stopping import stopping_sentences
from jaxbiped.statistics.sequential import Goal
from jaxbiped.study import store
from jaxbiped.study.batching import shards
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.run_study import Engine, compute_study
from jaxbiped.study.stopping import STOPPING, Rule, read_stopping
from tests.study.synthetic import rows

PAIR = ("full", "floor_only")
CONFIG = StudyConfig(arenas=480, shard=40, strategies=PAIR)
TABLE = rows(480, strategies=PAIR)


def engine(config, on_progress=None, *, points, done, last=99):
    """The rows of `TABLE`, shard by shard; interrupted after shard `last`."""
    for shard in shards(config, 1):
        if shard.number not in done:
            if shard.number > last:
                raise KeyboardInterrupt
            yield shard, TABLE.filter(pl.col("arena").is_between(shard.first, shard.first + shard.count - 1))


def watched(folder, width, **how):
    rule = Rule(Goal("success", *PAIR, width), folder, CONFIG.arenas)
    return rule, compute_study(folder, CONFIG, enough=rule, **({"engine": Engine(engine)} | how))


def test_it_ends_at_the_first_look_that_is_tight_enough(tmp_path):
    rule, manifest = watched(tmp_path / "r", 0.25)
    kept = read_stopping(tmp_path / "r")
    assert manifest.state == "finished" and kept == rule.outcome() and kept.reached
    assert kept.arenas == 40 * kept.looks == manifest.rows / 2 < CONFIG.arenas == kept.most
    one_less = Rule(rule.goal, tmp_path, CONFIG.arenas)
    for k in range(kept.looks - 1):
        assert not one_less(TABLE.filter(pl.col("arena") // 40 == k))
    (sentence,) = stopping_sentences(tmp_path / "r")
    assert f"Stopped after {kept.arenas} of at most 480 arenas and {kept.looks} looks" in sentence
    assert f"{480 - kept.arenas} arenas were left out" in sentence and "where 25 was requested" in sentence
    report = write_report(tmp_path / "r", resamples=20)
    assert report.remarks == (sentence,)
    assert "confidence sequence" in (tmp_path / "r" / "summary.md").read_text()
    assert "confidence sequence" in (tmp_path / "r" / "report.html").read_text()


def test_it_ends_with_the_arenas_where_the_width_is_never_reached(tmp_path):
    _, manifest = watched(tmp_path / "r", 0.01)
    kept = read_stopping(tmp_path / "r")
    assert manifest.rows == 960 and kept.arenas == 480 and not kept.reached
    (sentence,) = stopping_sentences(tmp_path / "r")
    assert sentence.startswith("Not stopped: all of 480 of at most 480 arenas") and "left out" not in sentence


def test_a_stopped_one_goes_on_to_the_same_end(tmp_path):
    whole, _ = watched(tmp_path / "whole", 0.25)
    with pytest.raises(KeyboardInterrupt):
        watched(tmp_path / "r", 0.25, engine=Engine(partial(engine, last=1)))
    assert not (tmp_path / "r" / STOPPING).exists() and stopping_sentences(tmp_path / "r") == ()
    rule, _ = watched(tmp_path / "r", 0.25, resume=True)
    assert rule.outcome() == whole.outcome()
    assert store.read(tmp_path / "r")[0].equals(store.read(tmp_path / "whole")[0])


def test_stored_shards_can_be_enough(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        watched(tmp_path / "r", 0.01, engine=Engine(partial(engine, last=7)))
    rule, manifest = watched(tmp_path / "r", 0.25, resume=True)
    assert rule.looks < 8 and manifest.rows == 8 * 80  # what was computed is kept


def test_a_damaged_note_is_named(tmp_path):
    watched(tmp_path / "r", 0.25)
    (tmp_path / "r" / STOPPING).write_text("measure = 'cost'\n")
    with pytest.raises(InputError, match=r"stopping\.toml: measure"):
        write_report(tmp_path / "r", resamples=20)
