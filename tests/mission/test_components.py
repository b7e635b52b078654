"""What metrics, sensors and executors may give, without any mission: what is checked, and how it is said."""

from dataclasses import dataclass, field, replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

import jaxbiped as jb
from jaxbiped.core.component import check_component
from jaxbiped.core.registry import EXECUTORS, METRICS, SENSORS
from jaxbiped.executors.execution import Execution, execution_of, find_executor
from jaxbiped.geometry.pose import Pose
from jaxbiped.mission.host_sensor import HostSensor
from jaxbiped.mission.metric import MissionEnd, Step, as_metric, column_of, find_metric, numbers_at_end, updated
from jaxbiped.mission.params import mission_spec
from jaxbiped.mission.sensors import Standpoint, find_sensor, view_of
from jaxbiped.sensing.view import View

ZERO, NO = jnp.zeros(()), jnp.zeros((), bool)


def component(base, **methods):
    """An object of a class that is made here, a pytree without numbers."""
    kind = type("Made", (base,), methods)
    return jax.tree_util.register_dataclass(dataclass(frozen=True)(kind))()


@pytest.mark.parametrize(
    "made, match",
    [
        (5, "must be \\(value, valid\\)"),
        ((ZERO,), "must be \\(value, valid\\)"),
        ((jnp.zeros(3), NO), r"float32\[3\], bool\[\] where one number and one boolean"),
        ((ZERO, ZERO), "one boolean"),
        ((NO, NO), "one number"),
    ],
)
def test_results_of_metrics_that_are_no_number_are_named(made, match):
    metric = component(jb.Metric, result=lambda self, state, end: made)
    with pytest.raises(jb.InputError, match=match) as caught:
        numbers_at_end((metric,), ((),), MissionEnd(None, None, None, None))
    assert "metric Made" in str(caught.value)


@pytest.mark.parametrize("new", [jnp.zeros(2), jnp.zeros((), jnp.int32), (), (ZERO, ZERO)])
def test_a_memory_that_changes_its_shape_is_named(new):
    metric = component(jb.Metric, update=lambda self, state, step: new)
    with pytest.raises(jb.InputError, match=r"update returned .* where its start gave float32\[\]"):
        updated((metric,), (ZERO,), Step(None, None, None, None, NO, None))


@pytest.mark.parametrize("name", ["", "Upper", "with space", "9", "a" * 41, "x-y", "ü"])
def test_names_that_no_column_can_have(name):
    with pytest.raises(jb.InputError, match="small letter"):
        as_metric(component(jb.Metric), name)


def test_components_that_are_none_are_named():
    class Plain(jb.Metric):
        pass

    @dataclass(frozen=True)
    class NoPytree(jb.Sensor):
        pass

    @jax.tree_util.register_dataclass
    @dataclass(frozen=True)
    class WithText(jb.Executor):
        name: str = "one"

    @jax.tree_util.register_dataclass
    @dataclass(frozen=True)
    class Unhashable(jb.Metric):
        names: list = field(default_factory=list, metadata={"static": True})

    for thing, base, match in [
        (Plain(), jb.Metric, "is not a pytree"),
        (NoPytree(), jb.Sensor, "is not a pytree"),
        (WithText(), jb.Executor, "holds a str"),
        (Unhashable(), jb.Metric, "cannot be hashed"),
        (3, jb.Sensor, "must be a Sensor, not int"),
    ]:
        with pytest.raises(jb.InputError, match=match):
            check_component(thing, base, "component")


def test_names_are_found_and_unknown_ones_list_those_that_are_known():
    assert find_sensor("stereo") is None and find_executor("mjx") is None
    assert isinstance(find_sensor("raycast"), jb.RayCast) and isinstance(find_executor("sampled"), jb.Sampled)
    for find, known in ((find_sensor, "raycast, oracle"), (find_executor, "kinematic, sampled"), (find_metric, "spl")):
        with pytest.raises(jb.InputError, match=f"must be one of {known}"):
            find("nobody")
        with pytest.raises(jb.InputError, match="cannot be imported"):
            find("no_such_module:Thing")
        with pytest.raises(jb.InputError, match="has no Thing"):
            find("jaxbiped.errors:Thing")
    with pytest.raises(jb.InputError, match="must be a Metric"):
        find_metric("jaxbiped.mission.outcome:Code")
    assert find_metric("jaxbiped.mission.metrics:Replans") == find_metric("replans")
    assert column_of("my_lab.metrics:Replans") == "replans"


@pytest.mark.parametrize(
    "thing, name",
    [(jb.RayCast(), "stereo"), (jb.RayCast(), "a b"), (jb.Kinematic(), "mjx"), (jb.Kinematic(), "kine matic")],
)
def test_names_that_cannot_be_registered(thing, name):
    with pytest.raises(jb.InputError, match="name"):
        jb.register(thing, name)


def test_a_built_in_name_is_not_given_away():
    for thing, name in ((jb.Oracle(), "raycast"), (jb.Sampled(), "kinematic"), (find_metric("spl"), "clearance")):
        with pytest.raises(jb.InputError, match="is taken"):
            jb.register(thing, name)
    other = component(jb.Sensor)
    try:
        assert jb.register(other, "one_more") == "one_more"
        with pytest.raises(jb.InputError, match="is taken"):
            jb.register(jb.RayCast(), "one_more")
        assert jb.register(jb.RayCast(), "one_more", replace=True) == "one_more"
    finally:
        SENSORS.held.pop("one_more")
    assert set(SENSORS) >= {"raycast", "oracle"} and set(EXECUTORS) >= {"kinematic"} and "spl" in METRICS


AT = Standpoint(Pose(ZERO, ZERO, ZERO, ZERO), NO, NO, None, jnp.uint32(1))
POINTS = jnp.arange(3.0)


@pytest.mark.parametrize(
    "made, match",
    [
        (None, "must return a View"),
        (View(POINTS, POINTS, POINTS, jnp.ones(2)), r"\[3\], \[3\], \[3\], \[2\] where \[N\]"),
        (View(ZERO, ZERO, ZERO, ZERO), r"where \[N\]"),
        (View(*(jnp.zeros((2, 3)),) * 4), r"where \[N\]"),
        (View(*(jnp.zeros(0),) * 4), r"where \[N\]"),
    ],
)
def test_views_of_the_wrong_shape_are_named(made, match):
    with pytest.raises(jb.InputError, match=match):
        view_of(component(jb.Sensor, measure=lambda *_: made), None, AT, None, None)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("part", ["x", "z", "weight"])
def test_what_is_not_finite_ends_a_mission_and_does_not_reach_the_map(bad, part):
    view = View(POINTS, POINTS, POINTS, jnp.ones(3))
    broken = replace(view, **{part: getattr(view, part).at[1].set(bad)})
    found = view_of(component(jb.Sensor, measure=lambda *_: broken), None, AT, None, None)
    assert np.isnan(found.weight).any() and np.isfinite(found.x + found.y + found.z).all()
    whole = view_of(component(jb.Sensor, measure=lambda *_: view), None, AT, None, None)
    assert np.isfinite(whole.weight).all() and np.array_equal(whole.x, POINTS)


FINE = Execution(AT.pose, jnp.zeros(3), jnp.zeros(3), ZERO, ZERO, NO, NO, NO)


@pytest.mark.parametrize(
    "made, match",
    [
        (None, "must return an Execution"),
        (replace(FINE, moved=jnp.zeros(2)), r"moved: gave float32\[2\] where real numbers of shape \[3\]"),
        (replace(FINE, fell=ZERO), r"fell: gave float32\[\] where truth values"),
        (replace(FINE, time=jnp.zeros((), jnp.int32)), "time: gave int32"),
        (replace(FINE, pose=replace(AT.pose, yaw=jnp.zeros(1))), "pose.yaw"),
    ],
)
def test_executions_of_the_wrong_shape_are_named(made, match):
    with pytest.raises(jb.InputError, match=match):
        execution_of(component(jb.Executor, execute=lambda *_: made), None, None, None, None)


@pytest.mark.parametrize(
    "change, sane",
    [
        ({}, True),
        ({"distance": jnp.float32(np.nan)}, False),
        ({"distance": jnp.float32(-1.0)}, False),
        ({"time": jnp.float32(np.inf)}, False),
        ({"time": jnp.float32(-0.1)}, False),
        ({"pose": replace(AT.pose, z=jnp.float32(np.nan))}, False),
    ],
)
def test_what_is_no_distance_or_time_makes_a_mission_invalid_and_spoils_no_row(change, sane):
    made = replace(FINE, **change)
    found = execution_of(component(jb.Executor, execute=lambda *_: made), None, None, None, None)
    assert np.isfinite(found.pose.x) == sane and np.isfinite(found.distance + found.time)
    assert found.distance >= 0 and found.time >= 0


def test_walls_are_not_matched_by_a_sensor_without_pictures():
    jb.register(HostSensor(len), "lone_points", replace=True)
    try:
        for way in ("icp", "both"):
            config = jb.MissionConfig(sensor="lone_points", localisation=way)
            with pytest.raises(jb.InputError, match="localisation: needs a picture, and lone_points measures none"):
                mission_spec(config, (1.8, 1.4))
        for sensor, way in (("lone_points", "odometry"), ("raycast", "icp"), ("oracle", "icp"), ("stereo", "both")):
            mission_spec(jb.MissionConfig(sensor=sensor, localisation=way), (1.8, 1.4))
    finally:
        SENSORS.held.pop("lone_points")


def arena():
    return jb.make_arena([(0.5, 0.5, 0.0, 0.1, 0.1, 0.0, 0.3)], (0.2, 0.5, 0.0), (0.8, 0.5))


def stands(k):
    """Batches of standpoints: robot k at x = k."""
    k = jnp.asarray(k, jnp.float32)
    same = jnp.zeros_like(k)
    return Standpoint(Pose(k, same, same, same), same > 1, same > 1, None, (k + 7).astype(jnp.uint32))


def test_a_function_of_numpy_arrays_measures_for_each_robot_of_a_batch(capsys):
    def corner_of_box(arena, pose, looks_down, squat, rng):
        if pose[0] == 2:
            raise ValueError("dazzled")
        assert isinstance(arena.boxes.used, np.ndarray) and arena.boxes.used.sum() == 1 and not looks_down
        return [(arena.boxes.x[0] - pose[0], 0.5, 0.3), (rng.random(), 0.0, 0.0)][: 1 + int(pose[0])]

    sensor = HostSensor(corner_of_box, points=4)
    one = jax.tree.map(jnp.asarray, arena())
    measured = jax.jit(jax.vmap(lambda at: view_of(sensor, one, at, None, None)))(stands([0, 1, 2, 1]))
    assert measured.x.shape == (4, 4)
    np.testing.assert_allclose(measured.x[:2, 0], [0.5, -0.5])
    np.testing.assert_array_equal(measured.weight[0], [1, 0, 0, 0])
    np.testing.assert_array_equal(measured.weight[1], [1, 1, 0, 0])
    np.testing.assert_array_equal(measured.x[1], measured.x[3])  # the same seed
    assert np.isnan(measured.weight[2]).all() and np.isfinite(np.delete(measured.weight, 2, 0)).all()
    alone = jax.jit(lambda at: view_of(sensor, one, at, None, None))(jax.tree.map(lambda leaf: leaf[1], stands([0, 1])))
    np.testing.assert_array_equal(alone.x, measured.x[1])
    assert "sensor" in (said := capsys.readouterr().err) and "dazzled" in said and said.count("\n") == 1


@pytest.mark.parametrize(
    "function, points, match",
    [(None, 4, "must be a function"), (len, 0, "1 to 1000000"), (len, 2.5, "1 to 1000000")],
)
def test_host_sensors_that_cannot_be(function, points, match):
    with pytest.raises(jb.InputError, match=match):
        HostSensor(function, points)


@pytest.mark.parametrize(
    "boxes, start, goal, options, match",
    [
        ([(1, 2, 3)], (0, 0, 0), (1, 1), {}, r"boxes: must be \[M, 7\]"),
        ([(0,) * 7, (0,) * 6], (0, 0, 0), (1, 1), {}, "boxes: must be numbers"),
        ([], (0, 0), (1, 1), {}, "start: must be x, y, yaw"),
        ([], (0, 0, 0), (1, 1, 1), {}, "goal: must be x, y"),
        ([], (0, 0, 0), (1, 1), {"size": (0.0, 1.0)}, "size: must be two lengths"),
    ],
)
def test_arenas_that_cannot_be_made(boxes, start, goal, options, match):
    with pytest.raises(jb.InputError, match=match):
        jb.make_arena(boxes, start, goal, **options)


def test_an_arena_from_arrays():
    made = jb.make_arena([(0.5, 0.4, 0.1, 0.2, 0.3, 0.36, 0.4), (1, 1, 0, 0.1, 0.1, 0.1, 0.1)], (0, 0, 0), (1, 1))
    assert made.boxes.x.shape == (12,) and made.boxes.used.sum() == 1 and bool(made.boxes.overhead[0])
    assert float(made.boxes.half_y[0]) == pytest.approx(0.15) and made.landmarks.used.any()
    many = jb.make_arena(np.ones((20, 7)) * 0.1, (0, 0, 0), (1, 1), size=(4.0, 3.0))
    assert many.boxes.x.shape == (20,) and float(many.landmarks.x.max()) == pytest.approx(1.7 * 4 / 1.8)
    empty = jb.make_arena([], (0, 0, 0), (1, 1))
    assert not empty.boxes.used.any() and empty.landmarks.used.all()
