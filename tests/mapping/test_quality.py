"""How right the map of ray-cast views is, against the truth of random arenas.

Bounds are what this test measures, less a margin of a few cells: a change that costs quality fails here. Published
figures for rendered stereo, ten arenas with ten random views each: .95 of cells right, .996 within one cell;
precision and recall of floor .97 and .97, obstacle .97 and .91, bump .80 and 1.00, gate .70 and .61.
"""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.arenas import sample
from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping import gridmap
from jaxbiped.mapping.grid import Cell, GridSpec
from jaxbiped.mapping.truth import truth_grid
from jaxbiped.sensing import presets, raycast
from jaxbiped.sensing.config import CameraConfig, NoiseConfig
from tests.mapping.scenes import BODY, PARAMS

SPEC, CAMERA = GridSpec(), CameraConfig()
ARENAS, VIEWS = 24, 10  # four of each family


@jax.jit
def worlds():
    arenas = jax.vmap(lambda k: sample(jax.random.key(0), k))(jnp.arange(ARENAS))
    return arenas, jax.vmap(lambda arena: truth_grid(arena, SPEC, BODY))(arenas)


@jax.jit
def explore(arenas, poses, seeds, stereo):
    """Classes and levels after all views of each arena."""

    def one(arena, poses, seeds):
        def look(grid_map, pose_seed):
            view = raycast.measure(arena, pose_seed[0], CAMERA.traced(), stereo, CAMERA.image, pose_seed[1])
            return gridmap.update(grid_map, view, pose_seed[0], BODY, PARAMS, SPEC), None

        grid_map, _ = jax.lax.scan(look, gridmap.empty(SPEC), (poses, seeds))
        return gridmap.classify(grid_map, PARAMS, SPEC)

    return jax.vmap(one)(arenas, poses, seeds)


def random_poses(rng, arena, truth):
    """Poses on floor or bump that look across the middle of the area."""
    classes, levels = truth
    cells = rng.permutation(np.argwhere((classes == Cell.FLOOR) | (classes == Cell.BUMP)))[:VIEWS]
    x, y = (cells[:, 1] + 0.5) * SPEC.pitch, (cells[:, 0] + 0.5) * SPEC.pitch
    yaw = np.arctan2(0.7 - y, 0.9 - x) + rng.uniform(-1.4, 1.4, VIEWS)
    return x, y, levels[tuple(cells.T)] * SPEC.level_height, yaw


def aimed_poses(rng, arena, truth):
    """Poses 25 to 80 cm before a lintel or a bump (the middle, where there is none), looking at it."""
    boxes = arena.boxes
    targets = np.flatnonzero(boxes.used & (boxes.overhead | (boxes.top < 0.07)))
    poses = []
    for k in range(VIEWS):
        x, y, yaw = 0.9, 0.7, 0.0
        if len(targets):
            x, y, yaw = (float(v[targets[k % len(targets)]]) for v in (boxes.x, boxes.y, boxes.yaw))
        while True:
            away = rng.uniform(0.25, 0.8)
            along = yaw + rng.choice([0, np.pi]) + rng.uniform(-0.3, 0.3)
            px, py = x - away * np.cos(along), y - away * np.sin(along)
            cell = int(py // SPEC.pitch), int(px // SPEC.pitch)
            if 0.1 < px < 1.7 and 0.1 < py < 1.3 and truth[0][cell] in (Cell.FLOOR, Cell.BUMP):
                break
        poses.append((px, py, truth[1][cell] * SPEC.level_height, along + rng.uniform(-0.2, 0.2)))
    return np.transpose(poses)


def mapped(choose, preset):
    """Classes and levels of all arenas as mapped, and as they truly are."""
    rng = np.random.default_rng(0)
    arenas, truth = jax.tree.map(np.asarray, worlds())
    each = [jax.tree.map(lambda leaf, k=k: leaf[k], (arenas, truth)) for k in range(ARENAS)]
    poses = [choose(rng, *one) for one in each]
    poses = Pose(*(np.float32([pose[axis] for pose in poses]) for axis in range(4)))
    seeds = rng.integers(0, 2**32, (ARENAS, VIEWS), np.uint32)
    return jax.tree.map(np.asarray, explore(arenas, poses, seeds, preset.traced())), truth


def around(mask):
    """Whether a cell or one of its eight neighbours is in the mask [B, H, W]."""
    padded = np.pad(mask, ((0, 0), (1, 1), (1, 1)))
    height, width = mask.shape[1:]
    return np.any([padded[:, i : i + height, j : j + width] for i in range(3) for j in range(3)], axis=0)


def figures(got, truth):
    """Shares of the measured cells: right, right within one cell, and (precision, recall) of each class."""
    classes, expected = got[0], truth[0]
    measured = classes != Cell.UNMEASURED
    result = {"measured": measured.mean(), "right": (classes == expected)[measured].mean()}
    near = np.any([(classes == kind) & around(expected == kind) for kind in Cell], axis=0)
    result["within one cell"] = near[measured].mean()
    for kind in (Cell.FLOOR, Cell.BUMP, Cell.GATE, Cell.OBSTACLE):
        called, true = classes == kind, (expected == kind) & measured
        result[kind.name] = (called & true).sum() / called.sum(), (called & true).sum() / true.sum()
        near_called, near_true = around(called), around(expected == kind)
        result[kind.name + " within one cell"] = near_true[called].mean(), near_called[true].mean()
    stood = (classes == Cell.BUMP) & (expected == Cell.BUMP)
    result["levels of bumps"] = (got[1] == truth[1])[stood].mean()
    return result


BOUNDS = {
    (random_poses, "rendered"): {
        "right": 0.97,
        "within one cell": 0.992,
        "FLOOR": (0.975, 0.98),
        "BUMP": (0.92, 0.965),
        "GATE": (0.83, 0.68),
        "OBSTACLE": (0.94, 0.89),
        "BUMP within one cell": (0.99, 0.99),
        "OBSTACLE within one cell": (0.985, 0.975),
        "levels of bumps": 0.975,
    },
    (aimed_poses, "rendered"): {
        "right": 0.97,
        "within one cell": 0.992,
        "BUMP": (0.92, 0.965),
        "GATE": (0.85, 0.92),
        "GATE within one cell": (0.93, 0.99),
        "OBSTACLE within one cell": (0.985, 0.97),
    },
    (random_poses, "real"): {"right": 0.962, "within one cell": 0.988, "BUMP within one cell": (0.98, 0.98)},
    (random_poses, "ideal"): {"right": 0.975, "within one cell": 0.994},
}
PRESETS = {name: preset.stereo for name, preset in presets.PRESETS.items()}


@pytest.mark.parametrize(("choose", "preset"), BOUNDS, ids=[f"{c.__name__}, {p}" for c, p in BOUNDS])
def test_quality(choose, preset):
    got = figures(*mapped(choose, PRESETS[preset]))
    for name, least in BOUNDS[choose, preset].items():
        assert (np.asarray(got[name]) >= least).all(), (name, got[name], least)


def test_tilt_of_a_degree_costs_little():
    tilted = figures(*mapped(random_poses, NoiseConfig(attitude_sd=1.0)))
    assert tilted["right"] >= 0.965 and min(tilted["BUMP within one cell"]) >= 0.97
