"""The public functions of sensing and localisation refuse what they cannot use, and are right about the rest."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np

from jaxbiped import localisation, sensing
from jaxbiped.geometry.pose import Pose
from jaxbiped.localisation.kalman_filter import predict_seen
from jaxbiped.localisation.scan_match import add_walls, find_walls, match, no_outlines
from jaxbiped.mapping.grid import GridSpec
from jaxbiped.sensing import CameraConfig, ImageSpec, LandmarkConfig, NoiseConfig, OdometryConfig, Sightings, View
from jaxbiped.sensing import VisualConfig as Visual
from jaxbiped.sensing.camera import mount
from jaxbiped.sensing.motion import track
from jaxbiped.sensing.view import Motion
from jaxbiped.stereo import Disparity, MatchParams, StereoCamera, ideal, to_points
from jaxbiped.stereo import match as match_pair
from tests import fuzzing
from tests.fuzzing import close, mapped, same, spoiled
from tests.sensing.scenes import as_jax, make

CONFIG = CameraConfig(width=32, height=24, columns=8, rows=6, num_disparities=16)
CAMERA, IMAGE = CONFIG.traced(), CONFIG.image
NOISE, MARKS, ODOMETRY = NoiseConfig().traced(), LandmarkConfig(nearest=0).traced(), OdometryConfig().traced()
SPEC = GridSpec(size_x=0.3, size_y=0.2)
ARENA = as_jax(make([(0.8, 0.7, 0.0, 0.05, 0.05, 0.0, 0.3)], [(0.6, 0.65, 0), (0.6, 0.8, 1)]))
HERE = Pose(*(jnp.float32(v) for v in (0.1, 0.7, 0.0, 0.0)))
SEED = jnp.uint32(3)
MOVED, SPREAD = tuple(jnp.float32(v) for v in (0.05, 0.01, 0.1)), jnp.full(3, 1e-4)
MOTION = Motion(*MOVED, jnp.eye(3) * 1e-4, jnp.bool_(True))
BELIEF = replace(localisation.known(HERE), cov=jnp.eye(3) * 1e-3)
SEEN = Sightings(
    x=jnp.array([0.52, 0.51, 0.0, 0.0, 0.0]),
    y=jnp.array([-0.05, 0.1, 0.0, 0.0, 0.0]),
    sd=jnp.full(5, 0.01),
    seen=jnp.arange(5) < 2,
)
AREA = {"size_xy": (0.4, 0.3), "spacing": 0.1, "level_height": 0.03, "levels": 4, "weight": 1.0}
VIEW = View(*jnp.ones((4, 12)))
LEFT = np.random.default_rng(0).integers(0, 256, (24, 32), np.uint8)
RIG = StereoCamera(20.0, (15.5, 11.5), 0.1, (32, 24))
FOUND = Disparity(np.full((24, 32), 4, np.float32), np.ones((24, 32), bool))


def test_bad_arguments_are_refused_and_odd_ones_are_right():
    fuzzing.run(__name__)


def cases():
    ray = {"arena": ARENA, "pose": HERE, "camera": CAMERA, "noise": NOISE, "image": IMAGE, "seed": SEED}
    ray |= {"look": jnp.bool_(False), "squat": jnp.bool_(True), "attitude": (jnp.float32(0), jnp.float32(0))}
    marks = {name: value for name, value in ray.items() if name != "attitude"} | {"noise": MARKS}
    true = {"arena": ARENA, "pose": HERE, **AREA}
    told = {"belief": BELIEF, **dict(zip(("dx", "dy", "dyaw"), MOVED, strict=True)), "variances": SPREAD}
    drift = {"displacement": MOVED, "noise": ODOMETRY, "seed": SEED}
    motion = {"belief": BELIEF, "moved": jnp.stack(MOVED), "variances": SPREAD, "motion": MOTION}
    visual = {"view": VIEW, "pose": HERE, "before": HERE, "at": mount(CAMERA), "camera": CAMERA, "image": IMAGE}
    visual |= {"noise": Visual().traced(), "max_range": jnp.float32(2.0), "seed": SEED}
    walls = {"view": VIEW, "shape": (4, 3), "step": 1, "ground": jnp.float32(0.0)}
    found = jax.jit(partial(find_walls, shape=(4, 3), step=1))(VIEW, ground=0.0)
    known = {"walls": found, "outlines": no_outlines(SPEC), "spec": SPEC}
    optional = ("stretch_kept", "stretch_lost", "movers", "motion", "attitude")
    tried = {
        **spoiled("measure_raycast", sensing.measure_raycast, ray, optional),
        **spoiled("sight_landmarks", sensing.sight_landmarks, marks, optional),
        **spoiled("measure_oracle", sensing.measure_oracle, true, optional),
        **spoiled("drift", sensing.drift, drift),
        **spoiled("known", localisation.known, {"pose": HERE}),
        **spoiled("predict", localisation.predict, told),
        **spoiled("correct", localisation.correct, {"belief": BELIEF, "landmarks": ARENA.landmarks, "sightings": SEEN}),
        **spoiled("predict_seen", predict_seen, motion),
        **spoiled("track", track, visual),
        **spoiled("find_walls", find_walls, walls),
        **spoiled("add_walls", add_walls, known | {"pose": HERE}),
        **spoiled("match", match, known | {"belief": BELIEF}),
        **spoiled("to_points", to_points, {"disparity": FOUND, "camera": RIG}),
        **spoiled("ideal", ideal, {"camera": CONFIG}),
        **spoiled("sensor_preset", sensing.sensor_preset, {"name": "real"}),
    }

    def refused(function, arguments, **wrong):
        tried[f"{len(tried)}: {function.__qualname__}({str(wrong)[:100]})"] = lambda: function(**arguments | wrong)

    for name in ("focal", "baseline", "max_disparity"):
        for value in (0.0, -1.0, np.nan, np.inf):
            refused(sensing.measure_raycast, ray, camera=replace(CAMERA, **{name: jnp.float32(value)}))
            refused(sensing.sight_landmarks, marks, camera=replace(CAMERA, **{name: value}))
    refused(sensing.measure_raycast, ray, noise=replace(NOISE, sd=jnp.float32(np.nan)))
    refused(sensing.sight_landmarks, marks, noise=replace(MARKS, nearest=jnp.float32(np.nan)))
    for kind in (-1, 2, 127):
        wrong = replace(ARENA, landmarks=replace(ARENA.landmarks, kind=jnp.full(5, kind)))
        refused(sensing.sight_landmarks, marks, arena=wrong)
    for seed in (-1, 2**32, 1.0, jnp.int32(3), None, "x"):
        refused(sensing.measure_raycast, ray, seed=seed)
        refused(sensing.drift, drift, seed=seed)
    for wrong in (
        {"size_xy": (0.4, np.nan)}, {"size_xy": (0.4, -1)}, {"size_xy": (0.4,)}, {"size_xy": 3}, {"spacing": 0},
        {"spacing": np.nan}, {"spacing": 1e-9}, {"level_height": 0.0}, {"levels": 0}, {"levels": 2.5}, {"weight": -1.0},
        {"levels": 10**9}, {"weight": np.inf}, {"spacing": jnp.ones(2)},
    ):  # fmt: skip
        refused(sensing.measure_oracle, true, **wrong)
    for value in (np.nan, np.inf):
        refused(localisation.predict, told, dx=value)
        refused(localisation.predict, told, variances=np.array([0, value, 0]))
        refused(sensing.drift, drift, displacement=(0.0, value, 0.0))
    refused(localisation.predict, told, variances=np.array([0, -1e-9, 0]))
    refused(sensing.drift, drift, noise=replace(ODOMETRY, forward=np.nan))
    refused(
        localisation.correct,
        {},
        belief=BELIEF,
        landmarks=ARENA.landmarks,
        sightings=jax.tree.map(lambda v: v[:4], SEEN),
    )
    for wrong in ({"shape": (5, 3)}, {"shape": (4, 3, 1)}, {"step": 0}, {"step": 4}, {"shape": (-4, -3)}):
        refused(find_walls, walls, **wrong)
    for wrong in ({"width": 0}, {"rows": -1}, {"columns": 2.5}, {"columns": 9999}, {"height": None}, {"rows": np.nan}):
        refused(ImageSpec, {}, **wrong)
    rig = {"focal": 20.0, "centre": (15.5, 11.5), "baseline": 0.1, "size": (32, 24)}
    for wrong in (
        {"focal": 0.0}, {"focal": np.nan}, {"baseline": -0.1}, {"centre": (1.0, np.inf)}, {"centre": 3},
        {"size": (0, 4)}, {"size": (1.5, 4)}, {"size": "ab"}, {"doffs": np.nan}, {"focal": "x"}, {"size": None},
    ):  # fmt: skip
        refused(StereoCamera, rig, **wrong)
    refused(to_points, {"camera": RIG}, disparity=Disparity(FOUND.value[:, :31], FOUND.valid[:, :31]))
    refused(to_points, {"camera": RIG}, disparity=Disparity(FOUND.value, FOUND.valid[0]))
    for image in (
        LEFT.astype(np.float32), LEFT.astype(np.int8), LEFT.astype(np.uint16), LEFT[None], LEFT[..., None], LEFT[:0],
        LEFT[:, :0], LEFT > 9, LEFT[:, :31], LEFT.tolist(), None, "x", LEFT.astype(object), np.stack([LEFT] * 4, -1),
    ):  # fmt: skip
        refused(match_pair, {"left": LEFT}, right=image)
        refused(match_pair, {"right": LEFT}, left=image)
    refused(match_pair, {"left": LEFT, "right": LEFT}, params=5)
    for name in ("ideall", "", "nowhere.toml", "/"):
        refused(sensing.sensor_preset, {}, name=name)
    return tried | {
        "a pair of any size and layout is matched": small_pairs,
        "prices and ranges at their limits are matched": limits_of_the_matcher,
        "points of disparities that are none": strange_disparities,
        "poses that are not finite measure nothing": nowhere,
        "sightings that are not finite change nothing": strange_sightings,
        "numbers of other types are the same numbers": other_types,
        "localisation is differentiable": gradients,
        "vmap and scan of measure_raycast, sight_landmarks": sensors_in_batches,
        "vmap and scan of measure_oracle": oracles_in_batches,
        "vmap and scan of drift, predict, correct, known": beliefs_in_batches,
    }


def small_pairs():
    """One pixel, one row, one column, pictures narrower than the search, transposed and colour ones."""
    colour = np.stack([LEFT] * 3, -1)
    for image in (LEFT[:1, :1], LEFT[:1], LEFT[:, :1], LEFT[:2, :3], LEFT.T, LEFT[::-1, ::2], colour, colour[:1, :1]):
        found = match_pair(image, image.copy(), MatchParams(num_disparities=64))
        if found.value.shape != image.shape[:2] or not np.isfinite(found.value).all():
            return image.shape
    shifted = match_pair(LEFT, np.roll(LEFT, -3, 1), MatchParams(num_disparities=16, agreement=-1, speckle_size=0))
    return bool((np.abs(shifted.value[:, 8:-8] - 3)[shifted.valid[:, 8:-8]] < 0.6).mean() > 0.9)


def limits_of_the_matcher():
    """Every field of `MatchParams` at both ends of its range."""
    ends = {name: field.metadata for name, field in MatchParams.model_fields.items() if field.metadata}
    for name, limits in ends.items():
        for limit in limits:
            value = next((getattr(limit, end) for end in ("ge", "le") if hasattr(limit, end)), None)
            if value is None:
                continue
            above = {"p2": value + 1} if name == "p1" else {"p1": value - 1} if name == "p2" else {}
            found = match_pair(LEFT, LEFT, MatchParams(**{name: value} | above))
            if not np.isfinite(found.value).all():
                return name, value
    return True


def strange_disparities():
    value = FOUND.value.copy()
    value[0, :6] = np.nan, np.inf, -np.inf, -4, 0, 1e-9
    points = to_points(Disparity(value, FOUND.valid), RIG)
    good = np.arange(len(points.z)) >= 6
    finite = all(np.isfinite(axis).all() for axis in points)
    double = to_points(Disparity(value.astype(np.float64), FOUND.valid), RIG)
    return finite and same(points, double) and bool((points.z[good] == 0.5).all() and not points.weight[:6].any())


@jax.jit
def see(pose, arena=ARENA):
    seen = sensing.sight_landmarks(arena, pose, CAMERA, MARKS, IMAGE, SEED)
    return sensing.measure_raycast(arena, pose, CAMERA, NOISE, IMAGE, SEED), seen


def nowhere():
    view, seen = see(HERE)
    assert (view.weight > 0).any() and seen.seen.any()
    for name in ("x", "y", "z", "yaw"):
        for value in (np.nan, np.inf):
            view, seen = see(replace(HERE, **{name: jnp.float32(value)}))
            if any(np.any(leaf) for leaf in jax.tree.leaves((view, seen))):
                return name, value
    return True


def strange_sightings():
    correct = jax.jit(localisation.correct)
    without = correct(BELIEF, ARENA.landmarks, replace(SEEN, seen=SEEN.seen.at[1].set(False)))
    for name in ("x", "y", "sd"):
        for value in (np.nan, np.inf):
            sightings = replace(SEEN, **{name: getattr(SEEN, name).at[1].set(value)})
            if not close(correct(BELIEF, ARENA.landmarks, sightings), without):
                return name, value
    return not close(without.pose, HERE)


def other_types():
    """Whole numbers, doubles, lists, and seeds of NumPy or Python."""
    drift = [sensing.drift((0, np.float64(1), 0.5), ODOMETRY, seed) for seed in (SEED, 3, np.int64(3), np.uint32(3))]
    listed = localisation.predict(localisation.known(Pose(1, 2, 0, 0)), 1, np.int8(2), 0.5, [1, 0, 2])
    plain = localisation.predict(
        localisation.known(Pose(*jnp.array([1.0, 2, 0, 0]))), *jnp.array([1.0, 2, 0.5]), jnp.array([1.0, 0, 2])
    )
    return same(*drift) and same(listed, plain)


def gradients():
    """Against differences, of all that is estimated, by the motion and by what is seen."""

    def pose(moved, shift):
        moved, variances = sensing.drift(tuple(moved), ODOMETRY, SEED)
        belief = localisation.predict(BELIEF, *moved, variances)
        belief = localisation.correct(belief, ARENA.landmarks, replace(SEEN, x=SEEN.x + shift))
        return belief.pose.x + 2 * belief.pose.y + 3 * belief.pose.yaw

    both, moved = jax.jit(jax.value_and_grad(pose, (0, 1))), jnp.stack(MOVED)
    pose, (by_moved, by_shift) = lambda *at: both(*at)[0], both(moved, 0.0)[1]
    step = 1e-3
    each = [(pose(moved + step * d, 0.0) - pose(moved - step * d, 0.0)) / (2 * step) for d in np.eye(3, dtype="f4")]
    shift = (pose(moved, step) - pose(moved, -step)) / (2 * step)
    return bool(np.allclose(by_moved, each, atol=0.02) and np.allclose(by_shift, shift, atol=0.02))


def sensors_in_batches():
    return mapped(lambda x: see(replace(HERE, x=x)), jnp.array([0.1, 0.15]))


def oracles_in_batches():
    return mapped(lambda x: sensing.measure_oracle(ARENA, replace(HERE, x=x), **AREA), jnp.array([0.1, 0.2]))


def beliefs_in_batches():
    def go(x, seed):
        moved, variances = sensing.drift((x, 0.0, 0.1), ODOMETRY, seed)
        belief = localisation.predict(localisation.known(replace(HERE, x=x)), *moved, variances)
        return localisation.correct(belief, ARENA.landmarks, SEEN)

    return mapped(go, jnp.array([0.05, 0.1]), jnp.array([1, 2], jnp.uint32))
