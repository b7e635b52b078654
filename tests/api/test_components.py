"""A sensor, an executor and metrics of people's own in the closed loop, and what built-in metrics say."""

import importlib.util
import sys
from dataclasses import dataclass, replace

import jax
import jax.numpy as jnp
import numpy as np
import polars as pl
import pytest

import jaxbiped as jb
from jaxbiped.arenas import sample
from jaxbiped.core.registry import METRICS
from jaxbiped.mission.metric import format_of
from jaxbiped.report.measures import metric_measure
from jaxbiped.statistics.schema import FAMILIES
from tests.api.conftest import EXAMPLES


def example(name):
    """The module of a numbered example, without what it does as a script."""
    spec = importlib.util.spec_from_file_location(f"example_{name[:2]}", EXAMPLES / f"{name}.py")
    sys.modules[spec.name] = module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


TurnedAngle = example("07_own_metric").TurnedAngle
ShortSighted = example("08_own_sensor").ShortSighted
Slippery = example("09_own_executor").Slippery


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Hopeless(jb.Metric):
    """1 where a robot failed, as a matrix says that it remembers; NaN where it did not."""

    def start(self, arena, settings):
        return {"counts": jnp.zeros((2, 3)), "some": jnp.zeros((), bool)}

    def update(self, state, step):
        return {"counts": state["counts"].at[1, 2].add(1.0), "some": state["some"] | True}

    def result(self, state, end):
        counted = (state["counts"][1, 2] == end.result.decisions) & (state["counts"].sum() == end.result.decisions)
        one = jnp.where(counted & state["some"], 1.0, 2.0)
        return jnp.where(end.result.code == jb.Code.REACHED, jnp.nan, one), True & (end.result.code >= 0)


AXES = {"executor.chance": [0.0, 1.0], "sensor.reach": [9.0, 0.05]}


@pytest.fixture(scope="module")
def swept():
    study = jb.Study(
        jb.RandomArenas(count=12),
        ["full"],
        jb.MissionConfig(robot={"radius": 0.1}),  # by default 0.125 for any executor but `kinematic`
        seed=5,
        metrics=["clearance", "spl", TurnedAngle(), Hopeless()],
        sensor=ShortSighted(reach=9.0),
        executor=Slippery(chance=0.0),
    )
    with pytest.warns(RuntimeWarning, match="metric hopeless: not finite in [0-9]+ of 48"):
        return jb.sweep(study, AXES)


def point(swept, index):
    return swept.rows.filter(pl.col("point") == index).sort("arena")


def test_own_components_that_change_nothing_play_the_same_missions(swept, results):
    ours = results.rows.filter(pl.col("strategy") == "full").sort("arena")
    theirs = point(swept, 0)
    for name in ("code", "decisions", "measurements"):
        assert theirs[name].to_list() == ours[name].to_list()
    for name in ("walked", "elapsed", "clearance", "spl"):
        np.testing.assert_allclose(theirs[name].to_numpy(), ours[name].to_numpy(), rtol=1e-5, atol=1e-5, equal_nan=True)


def test_their_numbers_are_axes(swept):
    assert swept.axes == ("executor.chance", "sensor.reach")
    sighted, blind = point(swept, 0), point(swept, 1)
    assert (sighted["code"] == "reached").sum() >= 9
    assert (blind["code"] != "reached").sum() >= 9 and not (blind["code"] == "invalid").any()
    slippery = point(swept, 2)
    fell = slippery.filter(pl.col("code") == "fell")
    assert len(fell) >= 2 and set(fell["family"]) <= {"bump", "stairs", "mixed"}
    assert (slippery.filter(pl.col("family") == "clutter")["code"] == "reached").all()


def test_own_metrics_are_columns_and_null_where_they_are_not_valid(swept):
    rows = swept.rows
    assert rows.columns[-4:] == ["clearance", "spl", "turned_angle", "hopeless"]
    reached = pl.col("code") == "reached"
    assert (
        rows.filter(reached)["turned_angle"].is_not_null().all()
        and rows.filter(~reached)["turned_angle"].is_null().all()
    )
    assert rows.filter(reached)["hopeless"].is_null().all() and (rows.filter(~reached)["hopeless"] == 1).all()
    assert rows.filter(reached)["turned_angle"].is_between(0.1, 100).any()


def test_they_are_part_of_the_config_and_drawn_like_any_other(swept, tmp_path):
    made = swept.config["components"]
    assert set(made) == {"metric turned_angle", "metric hopeless", "sensor short_sighted", "executor slippery"}
    assert swept.config["mission"]["sensor"] == "short_sighted" and swept.config["mission"]["executor"] == "slippery"
    only = replace(swept, rows=point(swept, 0), points=swept.points.head(1).select("point"))
    assert "turned_angle [rad]" in only.plot("turned_angle").axes[0].get_ylabel()
    found = only.compare().statistics.summaries[0]
    assert found.metrics["turned_angle"].n == (only.rows["code"] == "reached").sum()
    swept.save(tmp_path / "kept")
    again = jb.load(tmp_path / "kept")
    assert again.rows.equals(swept.rows)


def test_their_units_are_stored_with_their_numbers(swept, tmp_path, monkeypatch):
    """So that who has the rows and not the metric reads the same tables and figures."""
    swept.save(tmp_path / "kept")
    monkeypatch.delitem(METRICS.held, "turned_angle")
    again = jb.load(tmp_path / "kept")
    assert again.shown["turned_angle"].model_dump() == {
        "unit": "rad", "scale": 1.0, "digits": 2, "smaller_is_better": True,
    }  # fmt: skip
    only = replace(again, rows=point(again, 0), points=again.points.head(1).select("point"))
    assert "turned_angle [rad]" in only.plot("turned_angle").axes[0].get_ylabel()
    assert metric_measure("turned_angle", only.compare().statistics.shown).title == "turned_angle, rad"


@pytest.mark.parametrize("wrong", [{"unit": "$x$"}, {"unit": 3}, {"scale": float("nan")}, {"digits": -1}])
def test_a_metric_that_cannot_be_shown_is_refused(wrong):
    metric = type("Odd", (TurnedAngle,), wrong)()
    with pytest.raises(jb.InputError, match=f"metric odd: {next(iter(wrong))}: ") as error:
        format_of(metric, "odd")
    assert "\n" not in str(error.value)


def test_a_number_that_no_component_has_is_named():
    study = jb.Study(jb.RandomArenas(count=2), ["full"], sensor=ShortSighted())
    for name in ("sensor.length", "executor.chance", "planner.clearance"):
        with pytest.raises(jb.InputError, match="of these missions has this number"):
            jb.Study(jb.RandomArenas(count=2), ["full"], sensor=ShortSighted(), numbers={name: 1.0})
    with pytest.raises(jb.InputError, match="no sensor of these missions has this number; sensor has reach"):
        jb.sweep(study, {"sensor.length": [1.0]})
    with pytest.raises(jb.InputError, match="no executor of these missions has this number; executor has none"):
        jb.sweep(study, {"executor.chance": [1.0]})
    twice = ["replans", "jaxbiped.mission.metrics:Replans"]
    with pytest.raises(jb.InputError, match="is a column that rows have already"):
        jb.evaluate(jb.Study(jb.RandomArenas(count=2), ["full"], metrics=twice))


def gap(x, y, box):
    """[m] from a point to an oriented rectangle."""
    cos, sin = np.cos(box["yaw"]), np.sin(box["yaw"])
    dx, dy = x - box["x"], y - box["y"]
    along, across = abs(cos * dx + sin * dy) - box["half_x"], abs(-sin * dx + cos * dy) - box["half_y"]
    return np.hypot(max(along, 0), max(across, 0)) if max(along, across) > 0 else 0.0


@pytest.mark.parametrize("k", [0, 3, 5])
def test_clearance_is_the_least_distance_that_the_log_shows(results, k):
    """Against poses of the mission played again, in plain Python: at a third, two thirds and the end of each step."""
    row = results.rows.filter((pl.col("strategy") == "full") & (pl.col("arena") == k)).row(0, named=True)
    log = results.replay("full", k).log
    arena = jax.device_get(sample(jax.random.key(5), k, FAMILIES))
    config, least = jb.RobotConfig(), np.inf
    for n in range(1, len(log.time)):
        (x0, y0, _), (x1, y1, _) = log.true_xyyaw[n - 1 : n + 1]
        foot = max(log.true_z[n - 1 : n + 1]) + config.step
        head = max(log.true_z[n - 1 : n + 1]) + (config.squatting if log.squat[n] else config.standing)
        for m in np.flatnonzero(arena.boxes.used):
            box = {name: float(getattr(arena.boxes, name)[m]) for name in ("x", "y", "yaw", "half_x", "half_y")}
            if arena.boxes.top[m] > foot + 1e-3 and arena.boxes.bottom[m] < head - 1e-3:
                least = min(least, *(gap(x0 + s * (x1 - x0), y0 + s * (y1 - y0), box) for s in (1 / 3, 2 / 3, 1.0)))
    if np.isinf(least):
        assert row["clearance"] is None
    else:
        assert row["clearance"] == pytest.approx(least - config.body_radius, abs=1e-4)


def test_built_in_metrics_follow_from_the_other_columns(results):
    rows = results.rows
    reached = rows.filter("success")
    expected = (
        reached["oracle_length"] / pl.select(pl.max_horizontal(reached["walked"], reached["oracle_length"])).to_series()
    )
    np.testing.assert_allclose(reached["spl"].to_numpy(), expected, atol=1e-5)
    assert (rows.filter(~pl.col("success"))["spl"] == 0).all()
    assert rows["spl"].is_between(0, 1).all()
    assert (rows["replans"] == rows["planning_calls"] - 1).all()
    share = rows["measurements"] * jb.DurationConfig().measure / rows["elapsed"]
    assert (rows["measuring"] - share).abs().max() < 1e-5
