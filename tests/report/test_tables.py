"""Tables and sentences: what they say, and what they must not say."""

import io
from dataclasses import replace

import polars as pl
import pytest
from rich.console import Console

from jaxbiped.report.answer_text import DISTANCE, SUCCESS, TIME, answer, verdict
from jaxbiped.report.tables import comparison_table, markdown_sheets, pair_sheet, terminal, to_markdown, to_rich
from jaxbiped.report.words import AHEAD, BEHIND, OPEN, brackets, p_cell, p_value, percent, signed
from jaxbiped.statistics import ALL, QUESTION, Estimate, compare
from tests.study.synthetic import rows

FRAME = rows(240)
COMPARISON = compare(FRAME, resamples=300)
PAIR = COMPARISON.pair(*QUESTION)


def nobody(frame):
    null = pl.lit(None, pl.Float64)
    code, failed = pl.lit("stuck").alias("code"), pl.lit(False).alias("success")
    return frame.with_columns(code, failed, null.alias("distance"), null.alias("time"))


def printed(renderable, width=80):
    console = Console(width=width, record=True, file=io.StringIO())
    console.print(renderable)
    return console.export_text()


def test_numbers_as_people_read_them():
    assert (signed(1.234, 1), signed(-0.04, 1), signed(0.0, 2), signed(None, 1)) == ("+1.2", "0.0", "0.00", "-")
    assert (p_value(0.0004), p_value(0.0314), p_value(1.0), p_value(None)) == ("< 0.001", "= 0.031", "= 1.000", "-")
    assert (p_cell(0.5), percent(0.123), percent(None)) == ("0.500", "12.3", "-")
    assert brackets(Estimate(0.1, -0.2, 0.3), 100.0, 0) == "[-20, +30]"
    assert brackets(Estimate(0.1)) == "-"


def test_the_terminal_holds_the_numbers_in_80_columns():
    text = printed(terminal(COMPARISON))
    assert max(len(line.rstrip()) for line in text.splitlines()) <= 80
    assert f"[{100 * PAIR.success.low:+.1f}, {100 * PAIR.success.high:+.1f}]" in text
    assert f"{100 * PAIR.distance.mean.estimate:+.1f}" in text
    assert f"{PAIR.time.mean.estimate / 60:+.2f}" in text
    for name in COMPARISON.strategies:
        assert name in text
    assert "…" not in text  # nothing is cut off
    assert "bump_aware - floor_only" in printed(comparison_table(COMPARISON))


def test_the_question_is_the_first_pair():
    assert pair_sheet(COMPARISON).groups[0][0][0] == "bump_aware - floor_only"
    assert len(pair_sheet(COMPARISON, detailed=1).groups[0]) > len(pair_sheet(COMPARISON, detailed=1).groups[1])


def test_markdown_rows_have_all_columns():
    sheets = markdown_sheets(COMPARISON)
    assert len(sheets) == 4 + 2 * (1 + 5)
    for sheet in sheets:
        lines = [line for line in to_markdown(sheet).splitlines() if line.startswith("|")]
        assert {line.count("|") for line in lines} == {len(sheet.columns) + 1}
        assert all(len(row) == len(sheet.columns) for group in sheet.groups for row in group)


@pytest.mark.parametrize(
    "frame", [nobody(FRAME), FRAME.head(5), FRAME.filter(pl.col("strategy") == "full"), FRAME.head(10)]
)
def test_what_is_not_valid_is_never_a_number(frame):
    comparison = compare(frame, resamples=50)
    text = printed(terminal(comparison)) + "".join(to_markdown(sheet) for sheet in markdown_sheets(comparison))
    assert "nan" not in text.lower() and "None" not in text and "inf]" not in text


def with_success(**changes):
    return replace(PAIR, success=replace(PAIR.success, **changes))


def with_time(mean, p_holm, improvement=0.3):
    chance = Estimate(improvement, improvement - 0.1, improvement + 0.1)
    return replace(PAIR, time=replace(PAIR.time, mean=mean, p_holm=p_holm, improvement=chance))


def test_a_verdict_needs_both_the_p_value_and_the_interval():
    shown = {"estimate": 0.1, "low": 0.05, "high": 0.15, "p_holm": 0.01}
    assert verdict(with_success(**shown), SUCCESS) == AHEAD
    assert verdict(with_success(estimate=-0.1, low=-0.15, high=-0.05, p_holm=0.01), SUCCESS) == BEHIND
    assert verdict(with_success(**shown | {"p_holm": 0.06}), SUCCESS) == OPEN
    assert verdict(with_success(**shown | {"low": -0.01}), SUCCESS) == OPEN
    assert verdict(with_success(**shown | {"p_holm": None}), SUCCESS) == OPEN


def test_smaller_is_better_for_time_and_ranks_must_agree():
    slower = Estimate(60.0, 30.0, 90.0, n=50)
    assert verdict(with_time(slower, 0.001), TIME) == BEHIND
    assert verdict(with_time(slower, 0.001, improvement=0.7), TIME) == OPEN  # slower on average, faster mostly
    assert verdict(with_time(Estimate(-60.0, -90.0, -30.0, n=50), 0.001, improvement=0.7), TIME) == AHEAD
    assert verdict(with_time(Estimate(60.0, n=2), 0.001), TIME) == OPEN  # no interval


def answered(pair):
    pairs = tuple(pair if item == PAIR else item for item in COMPARISON.pairs)
    return answer(replace(COMPARISON, pairs=pairs))


def test_sentences_claim_what_is_shown_and_no_more():
    sentences = answer(COMPARISON)
    for measure in (SUCCESS, DISTANCE, TIME):
        groups = sentences[0].removeprefix("Over all arenas, ").rstrip(".").split("; ")
        said = next(group for group in groups if measure.name in group)
        expected = {AHEAD: "bump_aware beats", BEHIND: "floor_only beats", OPEN: "no difference"}
        assert said.startswith(expected[verdict(PAIR, measure)])
    for sentence, measure in zip(sentences[1:4], (SUCCESS, DISTANCE, TIME), strict=True):
        assert ("no difference is shown" in sentence) == (verdict(PAIR, measure) == OPEN)
        assert "interval" in sentence and "p " in sentence


def test_a_mean_and_ranks_that_disagree_are_said_to():
    text = answered(with_time(Estimate(60.0, 30.0, 90.0, n=50), 0.001, improvement=0.7))[3]
    assert "no difference is shown" in text and "average and ranks disagree" in text


def test_families_are_listed_by_their_verdict():
    families = [COMPARISON.pair(*QUESTION, stratum) for stratum in COMPARISON.strata("family")]
    sentence = next(text for text in answer(COMPARISON) if text.startswith("By distance"))
    ahead, _, open_ = sentence.partition("no difference is shown in ")
    for pair in families:
        place = ahead if verdict(pair, DISTANCE) != OPEN else open_
        assert pair.stratum.name in place


def test_nobody_solved_is_said_in_words():
    sentences = answer(compare(nobody(FRAME), resamples=50))
    assert sentences[0] == "Over all arenas, no difference is shown in success, distance and time."
    assert "cannot be compared" in sentences[2]


def test_without_the_projects_pair_the_answer_is_about_the_first():
    assert "full" in answer(compare(FRAME.filter(pl.col("strategy") != "bump_aware"), resamples=50))[0]
    assert answer(compare(FRAME.filter(pl.col("strategy") == "full"), resamples=50)) == ()
    assert COMPARISON.pair("floor_only", "bump_aware", ALL) is None


def test_rich_keeps_every_cell():
    sheet = pair_sheet(COMPARISON)
    text = printed(to_rich(sheet), width=200)
    for row in (row for group in sheet.groups for row in group):
        assert all(cell.strip() in text for cell in row)
