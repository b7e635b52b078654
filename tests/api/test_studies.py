"""Own planners in the closed loop, and what can be asked of their results."""

import polars as pl
import pytest

import jaxbiped as jb
from jaxbiped.core.names import METRICS
from jaxbiped.statistics.schema import SCHEMA
from tests.api.conftest import gives_up, plain_dijkstra


def of(results, name):
    return results.rows.filter(pl.col("strategy") == name).sort("arena")


def test_every_strategy_has_a_row_for_every_arena_under_its_own_name(results):
    assert results.rows.columns == [*SCHEMA.names(), *METRICS] and len(results.rows) == 9 * 12
    assert results.strategies[0] == "full" and set(results.strategies[1:]) == {
        *("plain_dijkstra", "raises", "through_walls", "gives_up", "slow", "on floor", "priceless", "Clearance")
    }


def test_a_planner_of_numpy_arrays_finds_ways_of_the_same_cost_as_ours(results):
    ours, theirs = of(results, "full"), of(results, "plain_dijkstra")
    both = ours["plan_cost"].is_not_null() & theirs["plan_cost"].is_not_null()
    assert both.sum() >= 10
    assert (ours["plan_cost"] - theirs["plan_cost"]).abs().max() < 1e-2  # of about a hundred, in single precision
    assert (ours["code"] == theirs["code"]).sum() >= 10  # of equal ways another may be walked
    assert theirs["planning_time"].is_not_null().all() and (theirs["planning_time"] > 0).all()
    assert ours["planning_time"].is_null().all()
    assert (theirs["planning_calls"] == theirs["decisions"]).all()


def test_what_a_strategy_does_not_dare_its_planner_does_not_see(results):
    rows = of(results, "on floor").filter(pl.col("family").is_in(["bump", "gate", "stairs"]))
    assert len(rows) and not (rows["code"].is_in(["planner_failed"])).any()


@pytest.mark.parametrize("name, code", [("raises", "planner_failed"), ("slow", "planner_timeout")])
def test_planners_that_fail_end_their_missions_by_name(results, name, code):
    rows = of(results, name)
    assert (rows["code"] == code).all() and (rows["decisions"] == 1).all() and rows["time"].is_null().all()


def test_ways_through_obstacles_end_missions_and_no_way_is_looked_for_all_around(results):
    assert set(of(results, "through_walls")["code"]) <= {"planner_failed", "reached", "collided", "fell", "stuck"}
    assert (of(results, "through_walls")["code"] == "planner_failed").sum() >= 4
    rows = of(results, "gives_up")
    assert (rows["code"] == "no_path").all() and (rows["decisions"] == 4).all()


def test_own_costs_that_add_nothing_change_nothing(results):
    """But which of two ways of equal cost is taken: the one is read off costs, the other off classes."""
    ours, plain, own = (of(results, name) for name in ("priceless", "full", "Clearance"))
    assert (ours["plan_cost"] - plain["plan_cost"]).abs().max() < 1e-2
    alike = (ours["walked"] - plain["walked"]).abs() < 1e-6
    assert alike.sum() >= 6 and (ours["code"] == plain["code"]).sum() >= 11
    assert ((own["walked"] - plain["walked"]).abs() > 1e-6).sum() >= 6


def test_comparisons_show_themselves(results):
    found = results.compare("Clearance", "full", resamples=99)
    assert found.statistics.pairs[0].first == "Clearance" and "Clearance" in str(found) and "reached" in str(found)
    assert "<pre>" in found._repr_html_() and "full" in str(results) and "108 rows" in repr(results)
    for first, second, match in [("Clearance", "nobody", "must be one of full"), ("full", "full", "two strategies")]:
        with pytest.raises(jb.InputError, match=match):
            results.compare(first, second)


@pytest.mark.parametrize("metric", ["success", "distance", "time", "spl", "clearance"])
def test_own_metrics_are_drawn_side_by_side(results, metric):
    figure = results.plot(metric)
    labels = [text.get_text() for text in figure.axes[0].get_xticklabels()]
    assert labels == list(results.strategies)


def test_a_metric_that_is_not_known_is_named(results):
    with pytest.raises(jb.InputError, match="must be one of success, distance, time, spl, clearance"):
        results.plot("beauty")


def test_results_are_stored_and_read_and_nothing_they_name_is_imported(results, tmp_path):
    results.save(tmp_path / "kept")
    again = jb.load(tmp_path / "kept")
    assert again.rows.equals(results.rows, null_equal=True) and again.config == results.config
    assert set(again.config["components"]) == set(results.strategies) - {"full"}
    with pytest.raises(jb.InputError, match="is not built in"):
        again.replay("plain_dijkstra", 0)
    with pytest.raises(jb.InputError, match="exists"):
        results.save(tmp_path / "kept")
    other = jb.load(tmp_path / "kept", own=[jb.Strategy("plain_dijkstra", jb.HostPlanner(gives_up))])
    with pytest.raises(jb.InputError, match="has different code"):
        other.replay("plain_dijkstra", 0)


def test_missions_are_played_again_as_they_were(results):
    for name in ("full", "plain_dijkstra"):
        row = of(results, name).row(1, named=True)
        mission = results.replay(name, 1)
        assert mission.code == row["code"] and mission.distance == pytest.approx(row["walked"], abs=1e-6)
    with pytest.raises(jb.InputError, match="no such mission"):
        results.replay("full", 99)


def test_strategies_of_one_name_and_of_no_kind_are_refused():
    for strategies, match in [
        (["full", jb.Strategy("full", jb.StraightLine())], "cannot have one name"),
        ([plain_dijkstra, jb.Strategy("plain_dijkstra")], "must be distinct"),
        (["nobody"], "must be one of full, bump_aware"),
        ([5], "must be a Planner, not int"),
        ("full", "must be a list"),
        ([], "at least 1"),
    ]:
        with pytest.raises(jb.InputError, match=match):
            jb.Study(strategies=strategies)
