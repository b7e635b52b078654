"""Arenas with terrain: what stands where, what rays meet, what scenes say, and what is refused."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from jaxbiped.arenas import load_scene, scene_warnings
from jaxbiped.arenas.ground import HOLE, cast_ground, ground_height, rises_near, terrain_height
from jaxbiped.errors import InputError
from jaxbiped.executors.kinematic_executor import kinematic
from jaxbiped.executors.sampled_executor import sampled
from jaxbiped.geometry.height_field import HeightField
from jaxbiped.geometry.rays import cast_boxes, key, nearness
from jaxbiped.mapping import Cell, GridSpec, truth_grid
from jaxbiped.mission.params import MissionConfig, mission_spec
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import start
from jaxbiped.motion.config import RobotConfig
from jaxbiped.motion.primitives import Command, Primitive
from jaxbiped.sensing import measure_oracle
from jaxbiped.sensing.camera import Mount, placed
from tests.geometry.triangles import height_at

SCENE = """
name = "a scene"
size = [1.8, 1.4]
start = [0.2, 0.7, 0.0]
goal = [1.5, 0.7]
boxes = [
    {{ centre = [0.9, 1.2], size = [0.2, 0.2], top = 0.2 }},
    {{ centre = [1.3, 0.3], size = [0.3, 0.3], bottom = 0.37, top = 0.5 }},
]
[terrain]
file = "map.npz"
{more}
"""


def stairs(holes=False):
    """[m] every centimetre of 160 x 120 cm: treads of 25 cm from x = 50 cm on, each 3 cm higher."""
    x = np.arange(161) * 0.01
    heights = np.tile(0.03 * np.clip(np.floor(x / 0.25 + 1e-9) - 1, 0, 3), (121, 1))
    if holes:
        heights[:20, 60:90] = np.nan
    return heights


def scene(tmp_path, heights=None, more="", pitch=0.01, text=SCENE, **arrays):
    np.savez(tmp_path / "map.npz", heights=stairs() if heights is None else heights, pitch=pitch, **arrays)
    path = tmp_path / "scene.toml"
    path.write_text(text.format(more=more))
    return path


def arena_of(tmp_path, *args, **kwargs):
    return load_scene(scene(tmp_path, *args, **kwargs))[1]


def ground_at(arena, *points):
    x, y = jnp.array(points, jnp.float32).T
    return np.asarray(ground_height(arena, x, y))


def test_ground_is_the_highest_of_terrain_and_boxes(tmp_path):
    arena = arena_of(tmp_path, stairs(holes=True))
    points = (
        (0.2, 0.7),
        (0.6, 0.7),
        (0.8, 0.7),
        (1.5, 0.7),
        (0.9, 1.15),
        (1.3, 0.3),
        (1.7, 0.7),
        (0.75, 0.1),
        (1.0, 1.35),
    )
    expected = [0, 0.03, 0.06, 0.09, 0.2, 0.09, 0, HOLE, 0]
    np.testing.assert_allclose(ground_at(arena, *points), expected, atol=1e-6)


def test_terrain_is_cut_to_the_area_and_lies_where_it_is_put(tmp_path):
    heights = np.add.outer(np.arange(300) * 0.001, np.arange(400) * 0.0005)
    arena = arena_of(tmp_path, heights, "origin = [-0.5, -0.25]\nfloor = 0.2")
    rows, columns = arena.terrain.heights.shape
    assert (rows, columns) == (142, 182) or (rows, columns) == (141, 181)
    expected = (0.7 + 0.25) / 0.01 * 0.001 + (0.2 + 0.5) / 0.01 * 0.0005 - 0.2
    np.testing.assert_allclose(ground_at(arena, (0.2, 0.7)), [expected], atol=1e-6)
    whole = arena_of(tmp_path, heights, "scale = 0.5\norigin = [0.0, 0.0]\nfloor = 0.0")
    assert float(whole.terrain.pitch) == pytest.approx(0.005)
    np.testing.assert_allclose(ground_at(whole, (0.2, 0.7)), [0.5 * (140 * 0.001 + 40 * 0.0005)], atol=1e-6)


def test_without_terrain_an_arena_has_the_leaves_that_it_had(tmp_path):
    path = tmp_path / "scene.toml"
    path.write_text(SCENE.format(more="").split("[terrain]")[0])
    arena = load_scene(path)[1]
    assert arena.terrain is None
    assert len(jax.tree.leaves(arena)) == 10 + 5 + 6
    assert mission_spec(MissionConfig(), (1.8, 1.4)) == mission_spec(MissionConfig(), (1.8, 1.4), arena.terrain)


def test_rays_meet_the_nearest_of_floor_terrain_and_boxes(tmp_path):
    """Within 1 mm of `mj_ray` in a model of the same; rays within 2 mm of an edge of a box may fall to either side."""
    arena = arena_of(tmp_path)
    heights = np.asarray(arena.terrain.heights, float)
    rows, columns = heights.shape
    spec = mujoco.MjSpec()
    size = (np.array([columns, rows]) - 1) * 0.01 / 2
    rise = float(heights.max())
    spec.add_hfield(
        name="h", nrow=rows, ncol=columns, size=[*size, rise, 1.0], userdata=(heights / rise).ravel().tolist()
    )
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_HFIELD, hfieldname="h", pos=[*size, 0])
    spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[0.9, 0.7, 0.5], pos=[0.9, 0.7, -0.5])
    for centre, half, low, high in (((0.9, 1.2), (0.1, 0.1), 0.0, 0.2), ((1.3, 0.3), (0.15, 0.15), 0.37, 0.5)):
        place = [*centre, (low + high) / 2]
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[*half, (high - low) / 2], pos=place)
    model = spec.compile()
    data = mujoco.MjData(model)
    mujoco.mj_forward(model, data)
    rng = np.random.default_rng(0)
    x, y = (rng.uniform(-1.1, 1.1, 1500).astype(np.float32) for _ in range(2))
    geom, wrong = np.zeros(1, np.int32), 0

    @jax.jit
    def cast(origin, basis):
        behind = key(cast_ground(arena, origin, basis, x, y), jnp.zeros((), bool))
        return nearness(cast_boxes(arena.boxes, arena.boxes.used, origin, basis, x, y, behind))

    for px, py, yaw, pitch in ((0.2, 0.7, 0.0, 0.5), (1.2, 0.9, 2.5, 0.6), (0.5, 0.2, 1.0, 0.2)):
        at = Mount(*(jnp.float32(v) for v in (pitch, 0.365, 0.03)))
        zero = jnp.float32(0)
        z = ground_height(arena, jnp.float32(px), jnp.float32(py))
        origin, basis = placed(type_pose(px, py, z, yaw), at, zero, zero)
        with np.errstate(divide="ignore"):
            found = 1 / np.asarray(cast(origin, basis))
        directions = np.stack([x, y, np.ones_like(x)], axis=1).astype(float) @ np.asarray(basis, float).T
        start = np.asarray(origin, float)
        expected = np.array([mujoco.mj_ray(model, data, start, d, None, 1, -1, geom) for d in directions])
        expected[expected < 0] = np.inf
        length = np.linalg.norm(directions, axis=1)
        close = (np.abs(found - expected) * length < 1e-3) | (np.isinf(found) & np.isinf(expected))
        wrong += (~close).sum()
        assert np.isfinite(expected).sum() > 600
    assert wrong <= 5, wrong


def type_pose(x, y, z, yaw):
    from jaxbiped.geometry.pose import Pose

    return Pose(*(jnp.asarray(v, jnp.float32) for v in (x, y, z, yaw)))


def test_what_rises_near_is_found_at_any_side():
    """A column 4 cm wide, at every bearing and distance; against the triangles' highest place in the circle."""
    heights = np.zeros((101, 101), np.float32)
    heights[48:53, 48:53] = 0.1
    field = HeightField(jnp.asarray(heights), jnp.zeros(2), jnp.float32(0.01))
    rng = np.random.default_rng(0)
    angle, distance = rng.uniform(0, 2 * np.pi, 300), rng.uniform(0, 0.2, 300)
    x, y = 0.5 + distance * np.cos(angle), 0.5 + distance * np.sin(angle)
    near = lambda x, y: rises_near(field, x, y, jnp.float32(0.08), jnp.float32(0.05))  # noqa: E731
    found = np.asarray(jax.vmap(near)(jnp.asarray(x, jnp.float32), jnp.asarray(y, jnp.float32)))
    # the surface is higher than 5 cm over a square of 5 cm: half a ramp of 1 cm on each side
    away = np.hypot(np.maximum(np.abs(x - 0.5) - 0.025, 0), np.maximum(np.abs(y - 0.5) - 0.025, 0))
    assert found[away < 0.07].all() and not found[away > 0.0801].any()
    assert not rises_near(None, jnp.float32(0), jnp.float32(0), jnp.float32(1), jnp.float32(-1))


def test_truth_is_that_of_the_stairs(tmp_path):
    """By hand: treads from 50, 75 and 100 cm, a hole, the end of the terrain at 160 x 120 cm, 9 cm high, a box."""
    arena = arena_of(tmp_path, stairs(holes=True))
    spec = mission_spec(MissionConfig(), (1.8, 1.4), arena.terrain).grid
    assert spec.ground_levels == 4
    classes, levels = (np.asarray(v) for v in jax.jit(truth_grid, static_argnums=1)(arena, spec, RobotConfig().body()))
    row = classes[14]  # y from 70 to 75 cm
    F, B, X = Cell.FLOOR, Cell.BUMP, Cell.OBSTACLE
    np.testing.assert_array_equal(row, [F] * 10 + [B] * 22 + [X] * 2 + [F] * 2)
    np.testing.assert_array_equal(levels[14, :32], [0] * 10 + [1] * 5 + [2] * 5 + [3] * 12)
    assert (classes[:3, 12:18] == X).all() and classes[8, 14] == B  # the hole; past it
    assert (classes[22:26, 16:20] == X).all()  # the box, 11 cm over the tread
    assert (classes[4:8, 24:28] == Cell.OBSTACLE).all()  # overhead: 28 cm over the tread is too low even to squat


def test_terrain_alone_and_in_an_arena_are_one(tmp_path):
    from jaxbiped.mapping import terrain_grid

    arena = arena_of(tmp_path, text=SCENE.replace("boxes = [", "#").replace("    {{", "#").replace("\n]", ""))
    spec = GridSpec(size_x=1.55, size_y=1.15, ground_levels=4)
    body = RobotConfig().body()
    alone = jax.jit(terrain_grid, static_argnums=1)(arena.terrain, spec, body)
    inside = jax.jit(truth_grid, static_argnums=1)(arena, spec, body)
    np.testing.assert_array_equal(alone[0], inside[0])
    np.testing.assert_array_equal(alone[1], inside[1])


def test_oracle_has_a_point_on_the_ground_of_each_column(tmp_path):
    arena = arena_of(tmp_path, stairs(holes=True))
    pose = type_pose(0.0, 0.0, 0.03, 0.0)
    view = measure_oracle(arena, pose, (1.8, 1.4), spacing=0.02)
    columns = 90 * 70
    z, weight = np.asarray(view.z), np.asarray(view.weight)
    x, y = (np.meshgrid((np.arange(90) + 0.5) * 0.02, (np.arange(70) + 0.5) * 0.02)[k].ravel() for k in (0, 1))
    hole = ground_at(arena, *np.stack([x, y], axis=1)) == HOLE
    assert hole.sum() > 50
    np.testing.assert_array_equal(weight[:columns] == 0, hole)
    np.testing.assert_allclose(z[:columns][~hole], ground_at(arena, *np.stack([x, y], axis=1))[~hole] - 0.03, atol=1e-6)
    inside = (weight[columns:] > 0).reshape(15, -1)
    assert inside[1][(x > 0.8) & (x < 1.0) & (y > 0.3) & (y < 1.0)].all()  # the level below a tread of 6 cm is solid
    assert not inside[:, (x < 0.4)].any()


CASES = {  # from, forward, rise: what comes of it
    "on a tread": ((0.6, 0.7), 0.05, 0, None),
    "over the riser": ((0.47, 0.7), 0.05, 0, "fell"),
    "up": ((0.46, 0.7), 0.05, 1, None),
    "up where there is none": ((0.3, 0.7), 0.05, 1, "fell"),
    "down": ((0.53, 0.7), -0.05, -1, None),
    "into the hole": ((0.58, 0.1), 0.1, 0, "fell"),
    "off the end of the terrain": ((1.57, 0.9), 0.08, 0, "fell"),
    "beside a step of 9 cm": ((1.72, 0.9), -0.06, 0, "collided"),
    "out": ((1.78, 0.9), 0.05, 0, "outside"),
}


@pytest.mark.parametrize("case", CASES)
def test_the_referee_knows_terrain(tmp_path, case):
    (x, y), length, rise, end = CASES[case]
    arena = arena_of(tmp_path, stairs(holes=True))
    arena = replace(arena, start_xyyaw=jnp.array([x, y, 0.0], jnp.float32))
    params = MissionConfig().params("full")
    setup = MissionSetup(arena, params, mission_spec(MissionConfig(), (1.8, 1.4), arena.terrain))
    world, _ = start(setup, jnp.uint32(0))
    assert float(world.pose.z) == pytest.approx(float(ground_at(arena, (x, y))[0]), abs=1e-6)
    kind = {0: Primitive.STRAIGHT_FORWARD, 1: Primitive.STEP_UP_BUMP, -1: Primitive.STEP_DOWN_BUMP}[rise]
    command = Command(
        turn=jnp.float32(0), primitive=jnp.int32(kind), length=jnp.float32(length), rise=jnp.int32(rise),
        squat=jnp.zeros((), bool), left=jnp.float32(0),
    )  # fmt: skip
    done = kinematic(arena, world, command, params)
    assert [name for name in ("fell", "collided", "outside") if getattr(done, name)] == ([end] if end else [])
    if end is None:
        assert float(done.pose.z) == pytest.approx(float(ground_at(arena, (x + length, y))[0]), abs=1e-6)


def test_the_sampled_executor_knows_terrain(tmp_path):
    """On a tread it stands, at the tread's height; into the hole it falls; at the end of the terrain its feet kick."""
    arena = arena_of(tmp_path, stairs(holes=True))
    params, still = MissionConfig(executor="sampled").params("full"), jnp.zeros((), bool)
    spec = mission_spec(MissionConfig(), (1.8, 1.4), arena.terrain)

    @jax.jit
    def play(pose, length):
        there = replace(arena, start_xyyaw=pose)
        world, _ = start(MissionSetup(there, params, spec), jnp.uint32(1))
        whole = jnp.int32(0)
        command = Command(
            turn=jnp.float32(0), primitive=whole + Primitive.STRAIGHT_FORWARD, length=length, rise=whole, squat=still,
            left=jnp.float32(0),
        )  # fmt: skip
        return sampled(there, world, command, params)

    for pose, length, end in (
        ((0.6, 0.7, 0.0), 0.05, None),
        ((0.55, 0.1, 0.0), 0.1, "fell"),
        ((1.74, 0.9, np.pi), 0.11, "collided"),
    ):
        done = play(jnp.array(pose, jnp.float32), jnp.float32(length))
        assert [name for name in ("fell", "collided", "outside") if getattr(done, name)] == ([end] if end else []), pose
        if end is None:
            assert float(done.pose.z) == pytest.approx(0.03, abs=1e-6)


@pytest.mark.parametrize(
    "more, heights, said",
    [
        ("scale = 0.0", None, "scene.toml: terrain.scale: must be greater than 0 (got 0.0)"),
        ("cell = 0.1", None, "scene.toml: terrain.cell: goes with pictures only, not with .npz"),
        ("range = [1.0, 0.0]", None, "scene.toml: terrain.range: must be LOW and HIGH [m], LOW below HIGH"),
        ("colour = 1", None, "scene.toml: terrain.colour: unknown key"),
        (
            "origin = [2.0, 0.0]",
            None,
            "scene.toml: terrain.origin: must place the terrain, 1.6 x 1.2 m, inside the area",
        ),
        ("origin = [0.0, -1.5]", None, "terrain.origin: must place the terrain"),
        ("floor = 5.0", None, "scene.toml: start: must lie on terrain from -0.2 to 0.69 m; terrain.floor moves it"),
        ("", stairs() + 431.0, "start: must lie on terrain from -0.2 to 0.69 m"),
        ("", np.where(np.arange(161) < 30, np.nan, stairs()), "start: must not lie in a hole of the terrain"),
        ("", np.where(np.arange(161) > 140, np.nan, stairs()), "goal: must not lie in a hole of the terrain"),
        ("", np.full((5, 5), np.nan), "map.npz: must hold heights; all are holes"),
        ("", np.ones((1, 5)), "map.npz: must have at least 2 x 2 heights"),
        ("", np.ones((5, 5)), "map.npz: must hold heights that differ"),
    ],
)
def test_scenes_are_checked(tmp_path, more, heights, said):
    with pytest.raises(InputError) as caught:
        arena_of(tmp_path, heights, more)
    assert said in str(caught.value) and "\n" not in str(caught.value)


def test_a_map_that_is_not_there(tmp_path):
    path = scene(tmp_path)
    (tmp_path / "map.npz").unlink()
    with pytest.raises(InputError, match=r"map\.npz: no such file"):
        load_scene(path)


def test_a_start_beside_a_wall_is_warned_of(tmp_path):
    heights = stairs()
    heights[:, :13] = 0.3
    warned = scene_warnings(arena_of(tmp_path, heights), RobotConfig(), 0.03)
    assert warned == ("start: this robot, 0.08 m in radius, starts in terrain more than a step above its ground of 0 m "
                      "(at [0.2, 0.7])",)  # fmt: skip
    assert scene_warnings(arena_of(tmp_path), RobotConfig(), 0.03) == ()


@pytest.mark.parametrize("options", [("--sensor", "stereo"), ("--executor", "native"), ("--executor", "mjx")])
def test_what_does_not_know_terrain_refuses_it(tmp_path, capsys, options):
    from jaxbiped import cli

    path = scene(tmp_path)
    assert cli.main(["run", str(path), *options, "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert said.count("\n") == 1 and f"{options[0][2:]} {options[1]}: does not support terrain" in said
    assert not (tmp_path / "out").exists()


def test_levels_of_a_map_follow_the_terrain():
    """Flat ground: the layout as it is. Higher: levels for it and for the head above; pits: levels below."""
    grid = MissionConfig().grid
    flat = GridSpec(size_x=1.8, size_y=1.4, pitch=0.05, max_radius=0.15)
    assert grid((1.8, 1.4)) == grid((1.8, 1.4), (0.0, 0.0)) == grid((1.8, 1.4), (-0.01, 0.06)) == flat
    for low, high, ground, above, lowest in (
        (0, 0.12, 5, 17, -1), (0, 0.6, 21, 32, -1), (0, 400, 24, 32, -1), (-0.1, 0, 3, 15, -4), (-9, 0.3, 11, 23, -8),
    ):  # fmt: skip
        spec = grid((1.8, 1.4), (float(low), float(high)))
        assert (spec.ground_levels, spec.levels + spec.lowest, spec.lowest) == (ground, above, lowest)


def test_heights_off_the_terrain_are_the_floor_s(tmp_path):
    arena = arena_of(tmp_path, stairs(holes=True))
    rng = np.random.default_rng(0)
    x, y = rng.uniform(-0.5, 2.5, (2, 500))
    expected = height_at(stairs(holes=True), 0.01, x, y)
    inside = (x >= 0) & (x <= 1.6) & (y >= 0) & (y <= 1.2)
    expected = np.where(np.isnan(expected), np.where(inside, HOLE, 0.0), expected)
    found = np.asarray(terrain_height(arena.terrain, jnp.asarray(x, jnp.float32), jnp.asarray(y, jnp.float32)))
    assert (np.abs(found - expected) > 1e-5).sum() <= 1
