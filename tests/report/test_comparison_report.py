"""`summary.md` of a stored study."""

import re

import pytest

from jaxbiped.config import Model
from jaxbiped.errors import InputError
from jaxbiped.report.comparison_report import QUESTION_TEXT
from jaxbiped.report.folder_report import write_report
from jaxbiped.study import StudyHeader, create, store
from tests.study.synthetic import rows

FRAME = rows(60)


class Config(Model):
    seed: int = 3


def study(folder, frame=FRAME, finish=True):
    with create(folder, StudyHeader(Config(), seed=3, arenas=60, command="jaxbiped compare --arenas 60")) as results:
        results.append(frame)
        if finish:
            results.finish(compile_time=2.0)
    return folder


def test_the_summary_says_where_it_comes_from(tmp_path):
    folder = study(tmp_path / "r")
    report = write_report(folder, resamples=100)
    text = (folder / "summary.md").read_text()
    assert QUESTION_TEXT in text and report.answer[0] in text
    assert "`jaxbiped compare --arenas 60`" in text
    assert report.manifest.config_hash in text and '"seed": 3' in text
    assert "## Limitations" in text and "not finished" not in text
    pictures = re.findall(r"!\[.*?\]\((.*?)\)", text)
    assert [folder / name for name in ["report.html", "summary.md", *pictures]] == list(report.files)
    assert all(path.exists() for path in report.files)


def test_again_is_the_same_and_the_rows_stay(tmp_path):
    folder = study(tmp_path / "r")
    first = write_report(folder, resamples=100)
    before = {path: path.read_bytes() for path in first.files}
    second = write_report(folder, resamples=100)
    assert second.comparison == first.comparison
    assert {path: path.read_bytes() for path in second.files} == before
    assert store.read(folder).rows.height == 300


def test_an_unfinished_study_says_so(tmp_path):
    folder = study(tmp_path / "r", FRAME.head(100), finish=False)
    write_report(folder, resamples=50)
    assert "not finished: it has 20 of 60 arenas" in (folder / "summary.md").read_text()


def test_one_strategy_has_no_answer_but_a_summary(tmp_path):
    folder = study(tmp_path / "r", rows(60, strategies=("full",)))
    report = write_report(folder, resamples=50)
    assert report.answer == () and "## Tables" in (folder / "summary.md").read_text()


def test_what_cannot_be_reported_is_named(tmp_path):
    with pytest.raises(InputError, match="no such results folder"):
        write_report(tmp_path / "nowhere")
    folder = study(tmp_path / "r")
    with pytest.raises(InputError, match="point"):
        write_report(folder, point=4)
    with create(tmp_path / "empty", StudyHeader(Config(), seed=3, arenas=60)) as results:
        results.finish()
    with pytest.raises(InputError, match="has no rows"):
        write_report(tmp_path / "empty")
