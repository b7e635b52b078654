"""One decision of the compiled loop, done again by the plain one from the same state, count by count.

Both round, and what rounding decides may come out either way: a point on the border of a voxel, a disparity half way
between two steps of its quantum, a height at a tolerance. Each such case is found here from the plain loop's own
numbers, and tried both ways; what no choice of ways explains is an error. So nothing depends on how often the rounding
of a processor falls one way or the other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import product

import numpy as np

from jaxbiped.executors.world_state import WorldState
from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping.grid import Cell, GridSpec
from jaxbiped.mapping.gridmap import GridMap
from jaxbiped.mapping.relief import FACE, Surfaces
from jaxbiped.mission.mission_step import SENSE
from jaxbiped.sensing.counter_rng import fold
from jaxbiped.sensing.view import View
from tests.reference import mapping, sensing

ULP = 2.0**-23  # of a float32 from 1 to 2, as coordinates in metres are
POINT = 16 * ULP  # [m] a point of up to 2 m, of some ten operations
# [sides of a voxel] A coordinate of up to 40 sides, after as many operations and after the plane of sums of a thousand
# terms: off by 5e-6 at most, as seen.
BORDER = 1e-5
# How far what the sensor starts from is moved, to see what it then decides otherwise: a disparity of up to 60 px, and
# where the robot really stands.
DISPARITY, PLACE = 60 * 4 * ULP, 16 * ULP  # [px], [m, rad]
MOVED = 1e-5  # [m] by which that moves a point of which nothing else is decided
HEIGHT = 1e-6  # [m] a mean of heights, at a tolerance; and lengths in the fit of the floor, at its thresholds
SUM = 1e-5  # a sum of thousand float32 terms, relative
MOST_WAYS = 4096  # that are tried for the points on borders of one view


@dataclass(frozen=True)
class Moment:
    """One decision of the compiled loop: what it started from, and what came of it."""

    world: WorldState  # before
    look: np.ndarray  # [] whether it looked down
    view: View  # as measured
    pose: Pose  # as then believed
    grid_map: GridMap  # with this view
    classes: np.ndarray  # [H, W]
    levels: np.ndarray  # [H, W]
    ij: np.ndarray  # [2]


@dataclass(frozen=True)
class Close:
    """How many cases of one decision could have come out either way, and how many did come out the other way."""

    points: int  # that counted
    borders: int  # of these on a border
    rays: int  # that the sensor decided otherwise
    fits: int  # of the floor; 0 or 1
    cells: int  # in which a height decided otherwise


def replay(moment: Moment, before: GridMap | None, arena, params, spec) -> Close:
    """Do one decision again; AssertionError where it differs by more than what rounding decides.

    Args:
      before: the compiled loop's map before this view; None where this is the first.
    """
    grid, map_params = spec.grid, params.mapping
    if before is None:
        before, pose = mapping.empty(grid), moment.pose
        before = mapping.mark_footprint(before, pose.x, pose.y, pose.z, params.limits.body_radius, grid)
    rays = check_view(moment, arena, params, spec)
    added = moment.grid_map.evidence - before.evidence
    surfaces = moment.grid_map.surfaces, before.surfaces
    fitted = fits(moment, map_params, grid)
    found = next((f for f in fitted if f.explains(added) and f.explains_heights(*surfaces)), None)
    assert found is not None, "counts or heights that no choice of sides explains"
    cells = check_votes(moment, before, added, params.body, map_params, grid)
    check_classes(moment, map_params, grid)
    return Close(found.count, len(found.options), rays, int(not found.first), cells)


def apart(one: View, other: View, most: float) -> np.ndarray:
    """Which rays of two views gave another point, or a point only in one."""
    both = [np.stack([view.x, view.y, view.z]) for view in (one, other)]
    return (one.weight != other.weight) | ((np.abs(both[0] - both[1]) > most).any(0) & (one.weight > 0))


def check_view(moment: Moment, arena, params, spec) -> int:
    """Number of rays that differ; each must be one that the plain sensor decides so when it is moved a little."""
    world = moment.world
    seed = fold(world.seed, SENSE, world.decisions)

    def measure(bias=0.0, **moved):
        pose = replace(world.pose, **{name: getattr(world.pose, name) + by for name, by in moved.items()})
        noise = replace(params.stereo, bias=params.stereo.bias + bias)
        return sensing.measure_raycast(arena, pose, params.camera, noise, spec.image, seed, moment.look, world.squat)

    plain = measure()
    other = apart(moment.view, plain, POINT)
    if other.any():
        moves = [{"bias": DISPARITY}, *({name: PLACE} for name in ("x", "y", "yaw"))]
        moves += [{name: -by for name, by in move.items()} for move in moves]
        tried = [measure(**{name: np.float32(by) for name, by in move.items()}) for move in moves]
        explained = np.any([apart(plain, view, MOVED) & ~apart(moment.view, view, MOVED) for view in tried], axis=0)
        assert not (other & ~explained).any(), f"rays {np.flatnonzero(other & ~explained)}"
    return int(other.sum())


def fits(moment: Moment, map_params, grid: GridSpec):
    """The points of a view brought level by the plain fit; then by that fit with its thresholds moved a little."""
    view, support = moment.view, moment.pose.z
    yield Placed(mapping.level_view(view, support, map_params, grid), moment.pose, map_params, grid, first=True)
    for name, by in product(("border", "reaches", "plain"), (HEIGHT, -HEIGHT)):
        level = mapping.level_view(view, support, map_params, grid, **{name: by})
        yield Placed(level, moment.pose, map_params, grid, first=False)


class Placed:
    """The points of one view on the grid: those that lie well within a voxel, and those that may fall into several."""

    def __init__(self, view, pose, map_params, grid, first):
        self.map_params, self.grid, self.first = map_params, grid, first
        at, self.height, self.weight, self.near = mapping.coordinates(view, pose, map_params, grid)
        shape = (*grid.shape, grid.levels)
        sides = []
        for signs in product((-1, 1), repeat=3):
            index, inside = mapping.voxels_at(at + BORDER * np.array(signs)[:, None], grid)
            index[:, ~inside] = 0
            sides.append(np.where(inside, np.ravel_multi_index(index.astype(int), shape), -1))
        sides = np.array(sides)
        self.count = sides.shape[1]
        self.index = sides[0]  # in a flat grid, -1 beyond it
        self.options = {n: np.unique(sides[:, n]) for n in np.flatnonzero((sides != sides[0]).any(0))}

    def counts(self):
        """Points in each voxel, as they count."""
        inside = self.index >= 0
        shape = (*self.grid.shape, self.grid.levels)
        sums = np.bincount(self.index[inside], self.weight[inside], np.prod(shape)).astype(np.float32)
        sums[sums < self.map_params.voxel_points * np.float32(self.grid.cell_share)] = 0
        return sums.reshape(shape)

    def explains(self, added) -> bool:
        """Whether the points, each on a border on one of its sides, are these counts; they then lie on those sides."""
        ways = product(*self.options.values())
        for _, way in zip(range(MOST_WAYS), ways, strict=False):
            self.index[list(self.options)] = way
            if np.array_equal(self.counts(), added):
                return True
        return False

    def explains_heights(self, after, before) -> bool:
        """Whether the sums of heights are these, but for points that are as high as where a face begins."""
        inside = self.index >= 0
        shape = (*self.grid.shape, self.grid.levels)
        voxels = np.array(np.unravel_index(self.index[inside], shape))
        height, weight = self.height[inside], (self.weight * self.near)[inside]
        ways = [mapping.add_surfaces(before, voxels, height, weight, self.grid, FACE + by) for by in (-HEIGHT, HEIGHT)]
        most = ways[0].weight  # the lower a face begins, the more points are of the top
        for name, error in (("weight", SUM * most), ("rise", (SUM * self.grid.level_height + HEIGHT) * most)):
            ours, both = getattr(after, name), np.array([getattr(way, name) for way in ways])
            if ((ours < both.min(0) - error) | (ours > both.max(0) + error)).any():
                return False
        return True


def check_votes(moment: Moment, before: GridMap, added, body, map_params, grid: GridSpec) -> int:
    """Number of cells that were classed otherwise, each by a height at a tolerance; all other votes are the same."""
    after = moment.grid_map
    count = added.sum(-1)
    count[count < map_params.view_points * np.float32(grid.cell_share)] = 0

    def other(by=0.0, between=0.0):
        """Where the votes differ, with the body's tolerances moved, and levels moved apart."""
        tolerances = {name: getattr(body, name) + np.float32(by) for name in ("step_tolerance", "height_tolerance")}
        shift = between * np.where(np.arange(grid.ground_levels) % 2, 1, -1)[:, None, None]
        surfaces = Surfaces(after.surfaces.weight, (after.surfaces.rise + shift * after.surfaces.weight))
        kinds = mapping.c_obstacles(after.evidence, surfaces, replace(body, **tolerances), map_params, grid)
        plain = mapping.add_votes(before, count, *kinds)
        return (plain.votes != after.votes).any(-1) | (plain.level_votes != after.level_votes).any(-1)

    first = other()
    if first.any():
        left = first.copy()
        for by, between in ((HEIGHT, 0), (-HEIGHT, 0), (0, HEIGHT / 2), (0, -HEIGHT / 2)):
            left &= other(by, between)
        assert not left.any(), f"votes of cells {np.argwhere(left).tolist()}"
    return int(first.sum())


def check_classes(moment: Moment, map_params, grid: GridSpec) -> None:
    """The map is what the votes make of it; the robot's own cell can be stood on."""
    classes, levels = mapping.classify(moment.grid_map, map_params, grid)
    ij, level = tuple(moment.ij), int(np.round(moment.pose.z / np.float32(grid.level_height)))
    if classes[ij] != Cell.GATE:
        classes[ij] = Cell.BUMP if level else Cell.FLOOR
    levels[ij] = level
    assert np.array_equal(classes, moment.classes) and np.array_equal(levels, moment.levels), "the map of the votes"
