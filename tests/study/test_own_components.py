"""What people bring to a study: how it is cut, resumed, sent to workers and kept."""

import sys
from dataclasses import dataclass, field

import jax
import jax.numpy as jnp
import numpy as np
import polars as pl
import pytest

import jaxbiped as jb
from jaxbiped.api.results import Results
from jaxbiped.arenas.source import Family, scene_family
from jaxbiped.core.component import numbers_of, with_numbers
from jaxbiped.core.registry import FAMILIES, STRATEGIES, Registry
from jaxbiped.errors import InputError
from jaxbiped.mission.strategies import Strategy
from jaxbiped.planning import Costs
from jaxbiped.planning.planners import GridPlanner, Route, StraightLine, check_route
from jaxbiped.statistics.comparison import compare
from jaxbiped.study.batching import families_of, group_points, only_point, shards
from jaxbiped.study.config import StudyConfig
from jaxbiped.study.manifest import Manifest
from jaxbiped.study.replay import play_again
from jaxbiped.study.run_study import Engine, compute_study, in_order, shard_rows
from jaxbiped.study.runner import numbered
from jaxbiped.study.store import read_points
from tests.study.synthetic import rows


@pytest.fixture
def two_groups():
    """A study of a strategy that is built in and one with another planner, in two blocks of arenas."""
    STRATEGIES.add("straight", Strategy("straight", StraightLine()), replace=True)
    return StudyConfig(arenas=10, shard=6, strategies=("full", "straight"))


def test_a_study_of_two_groups_is_cut_block_by_block_by_its_writer_and_its_engine_alike(two_groups, tmp_path):
    seen = {}

    def engine(config, on_progress, *, points, done):
        seen.update(points=points, done=done)
        groups = group_points(points or only_point(config), config.strategies)
        for shard in shards(config, len(groups), swept=bool(points)):
            frame = rows(10, strategies=("full",)).filter(arena_in(shard))
            yield shard, frame.with_columns(strategy=literal(groups[shard.group].strategies[0]))

    compute_study(tmp_path / "study", two_groups, engine=Engine(engine))
    assert seen["points"] is None and len(read_points(tmp_path / "study")) == 1
    assert shard_rows(two_groups, only_point(two_groups)) == [6, 6, 4, 4]
    again = compute_study(tmp_path / "other", two_groups, engine=Engine(engine), enough=both_strategies)
    assert again.rows == 12  # one block, with both


def arena_in(shard):
    return (pl.col("arena") >= shard.first) & (pl.col("arena") < shard.first + shard.count)


def literal(name):
    return pl.lit(name)


def both_strategies(frame):
    assert set(frame["strategy"]) == {"full", "straight"} and frame["arena"].n_unique() == len(frame) / 2
    return True


def test_blocks_are_judged_whole_whatever_the_order_of_their_parts():
    seen = []
    judge = in_order(lambda frame: seen.append(frame["n"].to_list()) or len(seen) == 2, parts=2)
    ends = [judge(number, pl.DataFrame({"n": [number]})) for number in (3, 0, 2, 1)]
    assert seen == [[0, 1], [2, 3]] and ends == [False, False, False, True]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Many(GridPlanner):
    whole: int = 4
    real: float = 0.5
    table: np.ndarray = field(default_factory=lambda: np.zeros(3))
    costs: Costs = field(default_factory=Costs)
    way: str = field(default="a", metadata={"static": True})


def test_numbers_that_can_be_swept_are_single_and_keep_their_fractions():
    assert numbers_of(Many()) == ("whole", "real") and numbers_of(None) == ()
    changed = with_numbers(Many(), {"whole": 0.5, "real": 2.0, "other": 3.0})
    assert (changed.whole, changed.real) == (0.5, 2.0)


def test_planners_with_arrays_can_be_registered_anew():
    registry = Registry("thing", "nothing.nowhere")
    registry.add("many", Strategy("many", Many()))
    registry.add("many", Strategy("many", Many()), replace=True)
    with pytest.raises(InputError, match="cannot have one name"):
        registry.add("many", Strategy("many", Many()))


def test_workers_are_not_given_what_they_cannot_find():
    pytest.importorskip("distributed")
    from jaxbiped.study.cluster import refuse_own

    refuse_own(StudyConfig())
    FAMILIES.add("hills", Family("hills", jnp.sin), replace=True)
    with pytest.raises(InputError, match="is registered in this process only"):
        refuse_own(StudyConfig(families=("bump", "hills")))


def test_rows_of_strangers_are_kept_without_an_import(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "evil.py").write_text("raise SystemExit('imported')")
    config = StudyConfig(arenas=12, strategies=("full",)).model_dump(mode="json") | {"strategies": ["full", "evil:it"]}
    results = Results(rows(12, strategies=("full",)), pl.DataFrame({"point": [0]}), config)
    assert results.save(tmp_path / "kept") == tmp_path / "kept" and "evil" not in sys.modules


def test_names_that_are_taken_or_cannot_be_shown_are_refused(tmp_path):
    for name in ("bump", "a/b", "", "<i>", "scene (1)"):
        with pytest.raises(InputError, match="name of a family"):
            Family(name, jnp.sin)
    path = tmp_path / "scene (1).toml"
    path.write_text("")
    with pytest.raises(InputError, match=r"\.toml: name of a family"):
        scene_family(path)
    FAMILIES.add("hills", Family("hills", jnp.sin), replace=True)
    with pytest.raises(InputError, match="can only be combined with built-in families"):
        families_of(StudyConfig(families=("traffic", "hills")))


def test_routes_that_are_none_and_states_that_change_are_named():
    given = jnp.zeros(3)
    check_route(Route(jnp.zeros((3, 1), jnp.int8), state=jnp.ones(3)), given, "Lab")
    with pytest.raises(InputError, match="Lab: plan must return a Route"):
        check_route(jnp.zeros((3, 1)), given, "Lab")
    for state in (None, jnp.zeros((3, 2)), jnp.zeros(3, jnp.int32)):
        with pytest.raises(InputError, match="Lab: a route's state must be like that of initial_state"):
            check_route(Route(jnp.zeros((3, 1), jnp.int8), state=state), given, "Lab")


@pytest.mark.parametrize("part", ["sensor", "executor"])
def test_a_folder_of_a_stranger_imports_no_component(part, tmp_path, monkeypatch):
    """The module that it names would leave a mark."""
    (tmp_path / "evil.py").write_text(f"open({str(tmp_path / 'mark')!r}, 'w')\nS = 1\n")
    monkeypatch.chdir(tmp_path)
    config = StudyConfig(arenas=2).model_dump(mode="json")
    config["mission"][part] = "evil:S"
    manifest = Manifest.model_construct(config=config, seed=0)
    with pytest.raises(InputError, match=f"{part}: is not built in"):
        play_again(manifest, 0, {}, "full", [0])
    assert not (tmp_path / "mark").exists()


def test_metrics_of_any_name_are_compared_and_stored(tmp_path):
    frame = rows(8).with_columns(block=pl.lit(1.0), gap=pl.col("walked"), gap_second=pl.col("walked"))
    named = compare(frame, resamples=99).pairs[0].metrics
    assert set(named) >= {"block", "gap", "gap_second"} and named["gap"].n == named["gap_second"].n
    config = StudyConfig(arenas=8, shard=3).model_dump(mode="json")
    points = pl.DataFrame({"point": [0]}, schema={"point": pl.Int32})
    Results(frame, points, config).save(tmp_path / "kept")
    assert {"block", "gap", "gap_second"} <= set(jb.load(tmp_path / "kept").rows.columns)


def test_a_study_from_a_file_is_the_one_that_the_command_has(tmp_path):
    (tmp_path / "s.toml").write_text('arenas = 5\nshard = 3\nstrategies = ["full"]\nmetrics = ["spl"]\n')
    study = jb.Study.from_toml(tmp_path / "s.toml")
    assert (study.shard, study.sensor, tuple(study.metrics)) == (3, None, ("spl",))
    assert study.config().shard == 3 and study.config().metrics == ("spl",)


def test_another_executor_brings_the_defaults_that_depend_on_it():
    for name in ("sampled", "kinematic"):
        mission = jb.Study(jb.RandomArenas(count=2), ["full"], executor=name).config().mission
        assert mission == jb.MissionConfig(executor=name)
    own = jb.MissionConfig(robot={"radius": 0.11}, costs={"c3": 7.0})
    mission = jb.Study(jb.RandomArenas(count=2), ["full"], own, executor="sampled").config().mission
    assert (mission.robot.radius, mission.costs.c3, mission.executor) == (0.11, 7.0, "sampled")


def test_numbers_of_components_are_those_of_missions_played_again():
    @jax.tree_util.register_dataclass
    @dataclass(frozen=True)
    class Shy(GridPlanner):
        fear: float = 3.0

    strategy = Strategy("shy", Shy())
    params = jb.MissionConfig().params(strategy)
    assert float(numbered(params, strategy, {"planner.fear": 5.0}).planner.fear) == 5.0
    same = numbered(params, strategy, {"sensor.reach": 1.0})
    assert float(same.planner.fear) == 3.0 and same.sensor == params.sensor
