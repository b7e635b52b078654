"""The surface that a cloud of points covers, voxel by voxel: however densely it was sampled, and how high it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float, Float32, Int64

from jaxbiped.mapping.grid import GridSpec

AT_ONCE = 1_000_000  # points that are put into voxels at a time: memory stays bounded
MOST_WAITING = 16_000_000  # cubes that are remembered before those seen twice are struck out
CUBE = 0.01  # [m] points of one cube this wide count once


@dataclass(frozen=True)
class Slices:
    """The parts of voxels, about 1 cm high, in which a cloud has points; sorted by place."""

    voxel: Int64[np.ndarray, "n"]  # index into a flat grid [H W Z]
    surface: Float32[np.ndarray, "n"]  # [cm2]
    height: Float32[np.ndarray, "n"]  # [m] mean of the points


def cover_voxels(
    points: Float[np.ndarray, "N 3"], spec: GridSpec, origin_xy: tuple[float, float]
) -> Float32[np.ndarray, "H W Z"]:
    """Surface [cm2] seen in each voxel, however densely: its cubes of about 1 cm that hold a point.

    Points that are not finite, or outside the grid, count nothing.
    """
    slices = cover_slices(points, spec, origin_xy)
    shape = (*spec.shape, spec.levels)
    return np.bincount(slices.voxel, slices.surface, np.prod(shape)).astype(np.float32).reshape(shape)


def cover_slices(points: Float[np.ndarray, "N 3"], spec: GridSpec, origin_xy: tuple[float, float]) -> Slices:
    """The same for slices of voxels. A cube of a slice counts once; in the mean height each point does."""
    (rows, columns), depth = spec.shape, spec.levels
    sides = np.array([max(round(side / CUBE), 2) for side in (spec.pitch, spec.pitch, spec.level_height)])
    corner = np.array([*origin_xy, (spec.lowest - 0.5) * spec.level_height])
    unit = np.array([spec.pitch, spec.pitch, spec.level_height]) / sides
    cubes = np.array([columns, rows, depth]) * sides

    def slice_of(x, y, z):
        """Index into a flat grid of slices."""
        return (y // sides[1] * columns + x // sides[0]) * depth * sides[2] + z

    pending, waiting = [np.zeros(0, np.int64)], 0
    sums = np.zeros(0, np.int64), np.zeros((0, 2))
    for some in chunks(len(points)):
        part = np.asarray(points[some], np.float64)
        with np.errstate(invalid="ignore"):
            index = np.floor((part - corner) / unit)
            inside = ((index >= 0) & (index < cubes)).all(1)
        x, y, z = index[inside].astype(np.int64).T
        added = np.stack([np.ones(len(z)), part[inside, 2]], axis=1)
        sums = sums_by(np.concatenate([sums[0], slice_of(x, y, z)]), np.concatenate([sums[1], added]))
        pending.append(distinct((y * cubes[0] + x) * cubes[2] + z))
        waiting += len(pending[-1])
        if waiting > MOST_WAITING:
            pending, waiting = [distinct(np.concatenate(pending))], 0
    keys = distinct(np.concatenate(pending))
    covered = slice_of(keys // cubes[2] % cubes[0], keys // cubes[2] // cubes[0], keys % cubes[2])
    (at, (number, height)), count = (sums[0], sums[1].T), sums_by(covered, np.ones((len(covered), 1)))[1][:, 0]
    surface = (count * (unit[0] * unit[1] / CUBE**2)).astype(np.float32)
    return Slices(at // sides[2], surface, (height / np.maximum(number, 1)).astype(np.float32))


def sums_by(
    keys: Int64[np.ndarray, "n"], values: Float[np.ndarray, "n k"]
) -> tuple[Int64[np.ndarray, "m"], Float[np.ndarray, "m k"]]:
    """The distinct keys in order, and the sums of the values of each."""
    order = np.argsort(keys, kind="stable")
    keys = keys[order]
    first = np.flatnonzero(np.concatenate([[True], keys[1:] != keys[:-1]])[: len(keys)])
    return keys[first], np.add.reduceat(values[order], first, axis=0) if len(first) else values


def distinct(keys: Int64[np.ndarray, "n"]) -> Int64[np.ndarray, "m"]:
    """Sorted, each once. (By a sort: for integers, `np.unique` hashes, and takes ten times as long.)"""
    keys = np.sort(keys)
    return keys[np.concatenate([[True], keys[1:] != keys[:-1]])] if len(keys) else keys


def chunks(count: int):
    """Slices of at most AT_ONCE."""
    return (slice(start, start + AT_ONCE) for start in range(0, count, AT_ONCE))
