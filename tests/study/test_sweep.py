"""Axes to sweep points: grids, ranges and Sobol points against NumPy and SciPy, and what is refused by name."""

import itertools
import warnings

import numpy as np
import pytest
from scipy.stats import qmc

from jaxbiped.arenas.config import PopulationConfig
from jaxbiped.config import parse
from jaxbiped.errors import InputError
from jaxbiped.mission.params import MissionConfig
from jaxbiped.study import memory_limit
from jaxbiped.study.batching import group_points, shards
from jaxbiped.study.memory_limit import check_memory
from jaxbiped.study.run_study import table
from jaxbiped.study.sweep import SweepConfig

STRATEGIES = ("full", "floor_only")


def sweep(*axes, **fields):
    return parse(SweepConfig, {"axes": axes, "strategies": STRATEGIES, **fields}, file="s.toml")


def test_axes_combine_as_a_grid_whose_last_axis_changes_fastest():
    config = sweep(
        {"field": "costs.c3", "values": [5, 10]},
        {"field": "pitch", "values": [0.1, 0.05, 0.025]},
        {"field": "limits.max_decisions", "values": [9]},
    )
    points = list(config.points())
    assert [point.index for point in points] == list(range(6)) and config.size() == 6
    for point, (c3, pitch) in zip(points, itertools.product([5, 10], [0.1, 0.05, 0.025]), strict=True):
        assert point.mission == MissionConfig(costs={"c3": c3}, pitch=pitch, limits={"max_decisions": 9})
        assert point.values == {"costs.c3": c3, "pitch": pitch, "limits.max_decisions": 9}
    stored = table(points)
    assert stored.columns == ["point", "costs.c3", "pitch", "limits.max_decisions"]
    assert stored["pitch"].to_list() == [0.1, 0.05, 0.025] * 2


def test_ranges():
    even = sweep({"field": "costs.c1", "range": {"start": 0, "stop": 3, "num": 7}})
    ratio = sweep({"field": "costs.c1", "log_range": {"start": 0.25, "stop": 4, "num": 5}})
    np.testing.assert_allclose([p.mission.costs.c1 for p in even.points()], np.linspace(0, 3, 7))
    np.testing.assert_allclose([p.mission.costs.c1 for p in ratio.points()], [0.25, 0.5, 1, 2, 4])


def test_fields_that_change_together():
    axis = {
        "field": "pitch",
        "values": [0.05, 0.025],
        "together": {"camera.columns": [64, 128], "camera.rows": [48, 96]},
    }
    fine = list(sweep(axis).points())[1].mission
    assert (fine.pitch, fine.camera.columns, fine.camera.rows) == (0.025, 128, 96)


def test_sobol_points_are_scipys():
    box = {"points": 8, "seed": 5, "range": {"costs.c1": (0, 4)}, "log_range": {"costs.c3": (1, 100)}}
    points = list(sweep(sobol=box).points())
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        unit = qmc.Sobol(2, rng=np.random.default_rng(5)).random_base2(3)
    np.testing.assert_allclose([p.mission.costs.c1 for p in points], qmc.scale(unit[:, :1], 0, 4)[:, 0])
    np.testing.assert_allclose([p.mission.costs.c3 for p in points], 10 ** (2 * unit[:, 1]))
    both = sweep({"field": "pitch", "values": [0.1, 0.05]}, sobol=box)
    assert both.size() == len(list(both.points())) == 16
    assert both.fields() == ("pitch", "costs.c1", "costs.c3")


def test_the_base_of_all_points_is_the_study():
    config = sweep({"field": "costs.c3", "values": [5, 20]}, mission={"preset": "real", "costs": {"c2": 7}})
    for point in config.points():
        assert point.mission.preset == "real" and point.mission.costs.c2 == 7
        assert point.mission.stereo == MissionConfig(preset="real").stereo


def test_points_that_differ_in_traced_numbers_share_a_group():
    config = sweep(
        {"field": "pitch", "values": [0.1, 0.05]},
        {"field": "stereo.sd", "values": [0.1, 0.2]},
        {"field": "population.bump_width", "values": [0.2, 0.3]},
        {"field": "robot.radius", "values": [0.09, 0.12]},
    )
    groups = group_points(config.points(), STRATEGIES)
    assert [group.points for group in groups] == [tuple(range(8)), tuple(range(8, 16))]
    assert [group.spec.grid.pitch for group in groups] == [0.1, 0.05]
    one = groups[0]
    assert one.params.costs.c1.shape == (16,) and one.populations.bump_width.tolist() == pytest.approx([0.2, 0.3])
    assert one.population_of.tolist() == [0, 0, 0, 0, 1, 1, 1, 1] * 2
    np.testing.assert_allclose(one.params.body.radius[:4], [0.09, 0.09, 0.12, 0.12])
    assert one.params.strategy.bumps.tolist() == [True, False] * 8
    rays = sweep({"field": "camera.columns", "values": [64, 32]})
    assert len(group_points(rays.points(), STRATEGIES)) == 2
    # How simulated bipeds walk is no number of the program, and does not matter to others.
    walks = {"field": "walk.slots", "values": [8, 16]}
    assert len(group_points(sweep(walks).points(), STRATEGIES)) == 1
    assert len(group_points(sweep(walks, mission={"executor": "native"}).points(), STRATEGIES)) == 2


def test_shards_are_numbered_by_the_config_alone():
    config = sweep({"field": "pitch", "values": [0.1, 0.05]}, arenas=10, shard=4)
    cut = [(shard.number, shard.group, shard.first, shard.count) for shard in shards(config, 2, swept=True)]
    assert cut == [(0, 0, 0, 4), (1, 0, 4, 4), (2, 0, 8, 2), (3, 1, 0, 4), (4, 1, 4, 4), (5, 1, 8, 2)]
    cut = [(shard.number, shard.group, shard.first, shard.count) for shard in shards(config, 2)]
    assert cut == [(0, 0, 0, 4), (1, 1, 0, 4), (2, 0, 4, 4), (3, 1, 4, 4), (4, 0, 8, 2), (5, 1, 8, 2)]


def test_nothing_fixed_leaves_the_population_as_it_is():
    groups = group_points(sweep({"field": "costs.c1", "values": [1, 2]}).points(), STRATEGIES)
    assert groups[0].populations is None and groups[0].population_of.tolist() == [0] * 4
    assert PopulationConfig().bump_width is None


C3 = {"field": "costs.c3", "values": [5]}


@pytest.mark.parametrize(
    ("axes", "said"),
    [
        (
            [{"field": "costs.c9", "values": [1]}],
            "axis costs.c9: no such field; sweep a number of the config, such as costs.c",
        ),
        ([{"field": "mission.pitch", "values": [1]}], "axis mission.pitch: no such field; .* such as .*pitch"),
        ([{"field": "xyzzy", "values": [1]}], "axis xyzzy: no such field; .* such as costs.c3, pitch"),
        ([{"field": "seed", "values": [1]}], "axis seed: no such field"),
        (
            [{"field": "costs", "values": [1]}],
            "axis costs: is a table; sweep a number in it, such as costs.c0, costs.c1",
        ),
        ([{"field": "sensor", "values": [1]}], r"axis sensor: is not a number; .* \(got 'raycast'\)"),
        ([{"field": "corner_cutting", "values": [1]}], r"axis corner_cutting: is not a number; .* \(got False\)"),
        ([{"field": "walk.device", "values": [1]}], "axis walk.device: is not a number"),
        ([{"field": "costs.c3", "values": []}], r"s.toml: axes.0.values: .*at least 1 item"),
        ([{"field": "costs.c3", "values": ["dear"]}], r"axes.0.values.0: .*number.*\(got 'dear'\)"),
        ([{"field": "costs.c3", "values": [float("nan")]}], "axes.0.values.0: .*finite"),
        ([{"field": "costs.c3", "values": [1, 1]}], "costs.c3: values must be distinct"),
        ([{"field": "costs.c3"}], "costs.c3: give exactly one of values, range and log_range, not none"),
        ([C3 | {"range": {"start": 1, "stop": 2, "num": 3}}], "exactly one of .*, not values and range"),
        (
            [{"field": "costs.c3", "range": {"start": 2, "stop": 1, "num": 3}}],
            "axes.0.range: start must be below stop: 2",
        ),
        ([{"field": "costs.c3", "range": {"start": 1, "stop": 2, "num": 1}}], "axes.0.range.num: .*equal to 2"),
        (
            [{"field": "costs.c3", "log_range": {"start": 0, "stop": 2, "num": 3}}],
            "start must be above 0 on a log range",
        ),
        ([{"field": "costs.c3", "log_range": {"start": 9, "stop": 2, "num": 3}}], "start must be below stop: 9"),
        ([C3, C3], "costs.c3: is swept twice"),
        ([C3 | {"together": {"costs.c1": [1, 2]}}], "together.costs.c1 must have 1 values, one per value, not 2"),
        ([C3 | {"together": {"costs.c9": [1]}}], "axis costs.c9: no such field"),
        ([{"field": "costs.c3", "values": [5, -1]}], r"axis costs.c3: .*greater than or equal to 0 \(got -1.0\)"),
        ([{"field": "robot.radius", "values": [0.2]}], r"axis robot.radius: .*less than or equal to 0.15 \(got 0.2\)"),
        ([{"field": "robot.radius", "values": [0.05]}], "robot.radius = 0.05: body_radius must be at most radius"),
        ([{"field": "limits.max_decisions", "values": [1.5]}], r"axis limits.max_decisions: .*integer.*\(got 1.5\)"),
        ([{"field": "camera.columns", "values": [60]}], "camera.columns = 60: .*must divide the width"),
        ([{"field": "pitch", "values": [0.03]}], "pitch = 0.03: pitch: must divide the area"),
        (
            [{"field": "population.bump_width", "values": [0.9]}],
            "axis population.bump_width: .*less than or equal to 0.6",
        ),
        ([{"field": "costs.c3", "value": [1]}], "axes.0.value: unknown key"),
    ],
)
def test_bad_axes_are_refused_by_name(axes, said):
    with pytest.raises(InputError, match=said) as stop:
        sweep(*axes)
    assert str(stop.value).startswith("s.toml: axes") or str(stop.value).startswith("s.toml: axis")
    assert "\n" not in str(stop.value) and len(str(stop.value)) < 400


@pytest.mark.parametrize(
    ("box", "said"),
    [
        ({"points": 6, "range": {"costs.c1": (0, 1)}}, "sobol: points must be a power of 2, such as 4 or 8, not 6"),
        ({"points": 0, "range": {"costs.c1": (0, 1)}}, "sobol.points: .*equal to 1"),
        ({"points": 4}, "sobol: needs a range or a log_range"),
        ({"points": 4, "range": {"costs.c1": (2, 1)}}, "costs.c1: the first must be below the second: 2"),
        ({"points": 4, "log_range": {"costs.c1": (0, 1)}}, "costs.c1: the first must be above 0"),
        (
            {"points": 4, "range": {"costs.c1": (0, 1)}, "log_range": {"costs.c1": (1, 2)}},
            "in one of range and log_range",
        ),
        ({"points": 4, "range": {"costs.c8": (0, 1)}}, "axis costs.c8: no such field"),
        ({"points": 4, "range": {"costs.c1": (-3, -1)}}, "axis costs.c1: .*greater than or equal to 0"),
        ({"points": 4, "range": {"costs.c1": (0, 1, 2)}}, r"sobol.range.costs.c1"),
    ],
)
def test_bad_sobol_points_are_refused_by_name(box, said):
    with pytest.raises(InputError, match=said):
        sweep(sobol=box)


def test_bumps_that_no_family_has_cannot_be_swept():
    with pytest.raises(InputError, match=r"population.bump_width: needs the family bump"):
        sweep({"field": "population.bump_width", "values": [0.2]}, families=("gate",))
    with pytest.raises(InputError, match="needs the family bump"):
        sweep(C3, families=("gate",), population={"bump_width": 0.2})


def test_more_points_than_memory_holds_are_refused(monkeypatch):
    long = {"range": {"start": 1, "stop": 2, "num": 1000}}
    with pytest.raises(InputError, match=r"axes: 1000 x 1000 x 1000 points do not fit in memory; at most [0-9]+ fit"):
        sweep(*({"field": f"costs.c{k}"} | long for k in range(1, 4)))
    spec = group_points(sweep(C3).points(), STRATEGIES)[0].spec
    check_memory(spec, 64, 2, 1024, 2)
    monkeypatch.setattr(memory_limit, "memory", lambda: 2**31)
    with pytest.raises(InputError, match=r"shard: 64 points x 2 strategies: at most (\d+) arenas a shard fit") as stop:
        check_memory(spec, 64, 2, 65536, 2)
    fit = int(str(stop.value).split("at most ")[1].split()[0])
    check_memory(spec, 64, 2, fit, 2)
    monkeypatch.setattr(memory_limit, "memory", lambda: 2**26)
    with pytest.raises(InputError, match=r"need [0-9.]+ GiB, of 0.1 available; sweep fewer points"):
        check_memory(spec, 2000, 2, 1024, 2)


@pytest.mark.parametrize("workers", [1, 2, 3, 64])
@pytest.mark.parametrize(("points", "strategies"), [(1, 1), (1, 5), (3, 3), (8, 1), (33, 2), (129, 4)])
def test_what_memory_holds_is_counted_as_programs_are_compiled(points, strategies, workers, monkeypatch):
    """Queues, and the points of a program, are of powers of two."""
    spec = group_points(sweep(C3).points(), STRATEGIES)[0].spec

    def needed(arenas):
        length, rows = 64, 8
        while length * workers < arenas * points * strategies:
            length *= 2
        while rows < points * strategies:
            rows *= 2
        lasting = memory_limit.map_bytes(spec, workers) + points * memory_limit.POINT + rows * memory_limit.SETTING
        return lasting + length * workers * memory_limit.ROW

    for arenas in (1, 7, 64, 1000, 1024, 1025):
        monkeypatch.setattr(memory_limit, "memory", lambda: needed(arenas))  # noqa: B023
        check_memory(spec, points, strategies, arenas, workers)
        monkeypatch.setattr(memory_limit, "memory", lambda: needed(arenas) - 1)  # noqa: B023
        with pytest.raises(InputError, match=r"arenas a shard fit in memory|available"):
            check_memory(spec, points, strategies, arenas, workers)
