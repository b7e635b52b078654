"""The ray-cast camera against plain NumPy and against MuJoCo's ray caster, and on scenes with a known answer."""

import jax
import jax.numpy as jnp
import mujoco
import numpy as np
import pytest

from jaxbiped.geometry.rays import INSIDE, marked, nearness
from jaxbiped.sensing import PRESETS, measure_raycast
from jaxbiped.sensing.camera import MountedCamera, T_robot_camera, mount, placed
from jaxbiped.sensing.raycast import cast, margin
from tests.reference import sensing as reference
from tests.sensing.scenes import CAMERA, IMAGE, as_jax, as_numpy, make, pose, random_scene, stack

STRETCHED = PRESETS["rendered"].stereo.model_copy(update={"stretch_kept": 0.1, "stretch_lost": 0.6})
SCENES = [random_scene(seed) for seed in range(16)]
EYE = MountedCamera(CAMERA, mount(CAMERA), IMAGE)


@jax.jit
@jax.vmap
def cast_all(arena, where, roll, pitch):
    marks = arena.boxes.contrast >= 0.5
    return cast(arena, where, EYE, (roll, pitch), marks, arena.floor_contrast >= 0.5)


@jax.jit
def measure_all(arenas, poses, noise, seeds, look, squat):
    one = lambda a, p, s, look, squat: measure_raycast(a, p, CAMERA, noise, IMAGE, s, look, squat)  # noqa: E731
    return jax.vmap(one)(arenas, poses, seeds, look, squat)


def measure(scenes, noise, seeds=None, look=False, squat=False):
    n = len(scenes)
    seeds = jnp.arange(n, dtype=jnp.uint32) if seeds is None else seeds
    flags = [jnp.full(n, flag) for flag in (look, squat)]
    return measure_all(*(stack(part) for part in zip(*scenes, strict=True)), noise, seeds, *flags)


def pixels():
    x, y = np.meshgrid(*margin(IMAGE))
    return x.ravel() / np.asarray(CAMERA.focal), y.ravel() / np.asarray(CAMERA.focal)


def depths(scenes, roll=0.0, pitch=0.0):
    n = len(scenes)
    arenas, poses = (stack(part) for part in zip(*scenes, strict=True))
    keys = cast_all(arenas, poses, jnp.full(n, roll), jnp.full(n, pitch))
    with np.errstate(divide="ignore"):
        return 1 / np.asarray(nearness(keys)).reshape(n, -1), np.asarray(marked(keys)).reshape(n, -1)


def test_cast_agrees_with_plain_numpy():
    """Depth within 2e-5 relative, but for rays along an edge, which may fall to either side of it.

    2e-5 is float32 rounding of a camera position of 1 m against a distance of 5 cm (1e-7 * 20) with ten to spare.
    """
    found, marks = depths(SCENES, roll=0.02, pitch=-0.03)
    x, y = pixels()
    for k, (arena, where) in enumerate(SCENES):
        origin, basis = reference.camera_pose(where, as_numpy(CAMERA), roll=0.02, pitch=-0.03)
        expected, contrast = reference.cast(arena, origin.astype(float), basis.astype(float), x, y)
        close = np.isclose(found[k], expected, rtol=2e-5) | (np.isinf(found[k]) & np.isinf(expected))
        assert (~close).sum() <= 3, f"scene {k}: {(~close).sum()} rays differ"
        finite = close & np.isfinite(expected)
        assert ((contrast >= 0.5) == marks[k])[finite].mean() > 0.999  # touching boxes tie


def test_cast_agrees_with_mujoco():
    """Depth within 1e-4 m of `mj_multiRay` on a model of the same boxes, edges apart."""
    found, _ = depths(SCENES)
    x, y = pixels()
    for k, (arena, where) in enumerate(SCENES):
        spec = mujoco.MjSpec()
        size = arena.size_xy / 2
        spec.worldbody.add_geom(type=mujoco.mjtGeom.mjGEOM_BOX, size=[*size, 0.5], pos=[*size, -0.5])
        b = arena.boxes
        for m in np.flatnonzero(b.used):
            spec.worldbody.add_geom(
                type=mujoco.mjtGeom.mjGEOM_BOX,
                size=[b.half_x[m], b.half_y[m], (b.top[m] - b.bottom[m]) / 2],
                pos=[b.x[m], b.y[m], (b.top[m] + b.bottom[m]) / 2],
                quat=[np.cos(b.yaw[m] / 2), 0, 0, np.sin(b.yaw[m] / 2)],
            )
        model = spec.compile()
        data = mujoco.MjData(model)
        mujoco.mj_forward(model, data)
        origin, basis = reference.camera_pose(where, as_numpy(CAMERA))
        if any(reference.ray_box(origin, np.array([[0.0, 0, 1]]), b, m)[0] == 0 for m in np.flatnonzero(b.used)):
            continue  # from within a box MuJoCo gives the way out
        directions = np.stack([x, y, np.ones_like(x)], axis=1) @ basis.T
        length = np.linalg.norm(directions, axis=1)
        distance, geom = np.zeros(len(x)), np.zeros(len(x), np.int32)
        unit = (directions / length[:, None]).ravel()
        mujoco.mj_multiRay(model, data, origin.astype(float), unit, None, 1, -1, geom, distance, None, len(x), 100.0)
        expected = np.where(distance < 0, np.inf, distance / length)
        side_of_floor = (geom == 0) & ((origin + directions * expected[:, None])[:, 2] < -1e-6)
        expected[side_of_floor] = np.inf  # the floor is a rectangle here, a block there
        with np.errstate(invalid="ignore"):
            close = (np.abs(found[k] - expected) <= 1e-4) | (np.isinf(found[k]) & np.isinf(expected))
        assert (~close).sum() <= 3, f"scene {k}"


@pytest.mark.parametrize("preset", [*PRESETS, "stretched"])
def test_whole_chain_agrees_with_plain_numpy(preset):
    """At least 99.9 % of rays within 1e-4 m: the rest round to the other step of 1/16 px, or lie on an edge."""
    noise = (STRETCHED if preset == "stretched" else PRESETS[preset].stereo).traced()
    views = as_numpy(measure(SCENES, noise))
    same = []
    for k, (arena, where) in enumerate(SCENES):
        args = (arena, where, as_numpy(CAMERA), as_numpy(noise), IMAGE, np.uint32(k))
        expected = reference.measure_raycast(*args)
        same.append(views.weight[k] == expected.weight)
        for name in "xyz":
            same[-1] &= np.abs(getattr(views, name)[k] - getattr(expected, name)) <= 1e-4
    assert np.mean(same) >= 0.999


def test_look_and_squat_agree_with_plain_numpy():
    noise = PRESETS["rendered"].stereo.traced()
    views = as_numpy(measure(SCENES[:4], noise, look=True, squat=True))
    for k, (arena, where) in enumerate(SCENES[:4]):
        args = (arena, where, as_numpy(CAMERA), as_numpy(noise), IMAGE, np.uint32(k), True, True)
        assert (np.abs(views.z[k] - reference.measure_raycast(*args).z) <= 1e-4).mean() >= 0.999


def test_views_do_not_depend_on_their_batch_and_presets_compile_once():
    noise = PRESETS["rendered"].stereo.traced()
    few, many = as_numpy(measure(SCENES[:4], noise)), as_numpy(measure(SCENES, noise))
    for name in ("x", "y", "z", "weight"):
        assert np.array_equal(getattr(few, name), getattr(many, name)[:4])
    compiled = measure_all._cache_size()
    for preset in PRESETS.values():
        measure(SCENES, preset.stereo.traced())
    assert measure_all._cache_size() == compiled


def test_ideal_points_lie_on_true_surfaces():
    """In the robot frame: the floor at z = 0 below the robot's own surface, a wall where it stands."""
    view = as_numpy(
        measure([(make([(1.0, 0.7, 0, 0.1, 0.7, 0, 0.5)]), pose(z=0.06))], PRESETS["ideal"].stereo.traced())
    )
    x, z = view.x[view.weight > 0], view.z[view.weight > 0]
    floor, wall = np.abs(z + 0.06) < 1e-4, np.abs(x - 0.6) < 1e-4
    assert np.all(floor | wall) and floor.sum() > 300 and wall.sum() > 300


def test_underside_of_a_lintel_is_seen():
    arena = make([(1.0, 0.7, 0, 0.1, 0.4, 0.45, 0.6)])
    view = as_numpy(measure([(arena, pose())], PRESETS["ideal"].stereo.traced()))
    assert np.isclose(view.z[view.weight > 0].max(), 0.45, atol=0.15) and (np.abs(view.z - 0.45) < 1e-4).any()


def test_looking_down_sees_the_feet_and_squatting_lowers_the_eye():
    noise = PRESETS["ideal"].stereo.traced()
    scene = [(make(), pose())]
    ahead, down = (as_numpy(measure(scene, noise, look=look)) for look in (False, True))
    assert down.x[down.weight > 0].min() < ahead.x[ahead.weight > 0].min() - 0.05
    low = as_numpy(measure(scene, noise, squat=True))
    assert np.abs(low.z[low.weight > 0]).max() < 1e-4  # the reprojection knows about it
    assert low.x[low.weight > 0].min() < ahead.x[ahead.weight > 0].min()


def test_attitude_tilts_the_points():
    """A robot that leans forward by an angle sees a level floor come up by as much: z = tan(angle) x."""
    arena, where = make(), pose()
    noise = PRESETS["ideal"].stereo.model_copy(update={"attitude_sd": 1.0}).traced()
    views = as_numpy(measure([(arena, where)] * 200, noise))
    slopes = []
    for x, y, z, weight in zip(views.x, views.y, views.z, views.weight, strict=True):
        A = np.stack([x, y, np.ones_like(x)], axis=1)[weight > 0]
        fit, *_ = np.linalg.lstsq(A, z[weight > 0], rcond=None)
        assert np.abs(A @ fit - z[weight > 0]).max() < 1e-4
        slopes.append(fit[:2])
    # 200 draws: their standard deviation is known within 5 % (one in a thousand lies beyond 17 %).
    assert np.allclose(np.std(slopes, axis=0), np.tan(np.deg2rad(1)), rtol=0.17)


def test_nothing_is_measured_where_the_pose_is_not_finite():
    noise = PRESETS["rendered"].stereo.traced()
    poses = [pose(x=np.nan), pose(z=np.nan), pose(yaw=np.nan), pose(x=np.inf), pose(x=-5, yaw=np.pi), pose(z=-1)]
    view = as_numpy(measure([(SCENES[1][0], where) for where in poses], noise))
    assert np.all(view.weight == 0)
    assert all(np.all(axis == 0) for axis in (view.x, view.y, view.z))


def test_camera_inside_a_box_sees_nothing_but_phantoms():
    arena = make([(0.3, 0.7, 0.3, 0.2, 0.2, 0, 0.5)])
    found, _ = depths([(arena, pose())])
    assert np.allclose(found, 1 / INSIDE, rtol=1e-3)
    assert np.all(np.asarray(measure([(arena, pose())], PRESETS["ideal"].stereo.traced()).weight) == 0)


def test_transform_from_camera_to_robot():
    """The optical axis looks ahead and down by the pitch; camera x is the robot's right."""
    at = mount(CAMERA, look=True, squat=True)
    T = np.asarray(T_robot_camera(at))
    assert np.allclose(T[:3, :3] @ T[:3, :3].T, np.eye(3), atol=1e-6) and np.isclose(np.linalg.det(T[:3, :3]), 1)
    assert np.allclose(T[:3, 2], [np.cos(np.pi / 3), 0, -np.sin(np.pi / 3)], atol=1e-6)
    assert np.allclose(T[:3, 0], [0, -1, 0]) and np.allclose(T[:3, 3], [0.03, 0, 0.32])
    origin, basis = placed(as_jax(pose(1.0, 2.0, 0.5, np.pi / 2)), at, jnp.float32(0), jnp.float32(0))
    assert np.allclose(origin, [1.0, 2.03, 0.82], atol=1e-6) and np.allclose(basis[:, 0], [1, 0, 0], atol=1e-6)
