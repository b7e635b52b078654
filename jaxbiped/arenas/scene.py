"""Scenes written by hand, in TOML: one arena per file."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Annotated, Literal, Protocol, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np
import pydantic

from jaxbiped.arenas.arena import CIRCLE, SQUARE, Arena, Landmarks
from jaxbiped.arenas.families import LANDMARKS_X, MAX_BOXES
from jaxbiped.arenas.ground import HOLE, rises_near, terrain_height
from jaxbiped.config import Model, load
from jaxbiped.core.signatures import checked
from jaxbiped.errors import InputError
from jaxbiped.formats.elevation import load_elevation
from jaxbiped.geometry.boxes import Boxes
from jaxbiped.geometry.height_field import HeightField

Metres = Annotated[float, pydantic.Field(ge=-1000.0, le=1000.0)]
Positive = Annotated[float, pydantic.Field(gt=0.0, le=1000.0)]
Angle = Annotated[float, pydantic.Field(ge=-2 * math.pi, le=2 * math.pi)]
Fraction = Annotated[float, pydantic.Field(ge=0.0, le=1.0)]
Point = tuple[Metres, Metres]

# For the paper's robot: no box between a step above the ground and its head may be nearer to the start or the goal.
LOWEST, HIGHEST = -0.2, 0.69  # [m] heights of ground for start and goal: the levels of a map
START_CLEARANCE, STEP, STANDING, SQUATTING = 0.08, 0.03, 0.385, 0.34  # [m]


class BoxConfig(Model):
    """An upright box."""

    centre: Point
    """[m] Centre in plan."""
    size: tuple[Positive, Positive]
    """[m] Full sizes along the box's own x and y."""
    yaw: Angle = 0.0
    """[rad] Anticlockwise from the world's x."""
    bottom: Annotated[float, pydantic.Field(ge=0.0, le=10.0)] = 0.0
    """[m] Height of the underside; above 0 the box hangs overhead."""
    top: Annotated[float, pydantic.Field(gt=0.0, le=10.0)]
    """[m] Height of the top."""
    contrast: Fraction = 1.0
    """Texture contrast: 0 is plain, and cannot be measured by stereo."""

    @pydantic.model_validator(mode="after")
    def _upright(self):
        if self.top <= self.bottom:
            raise ValueError(f"top must be above bottom ({self.bottom:g} m)")
        return self


class LandmarkConfig(Model):
    """A landmark, flat on the floor."""

    kind: Literal["circle", "square"]
    """A disc of 7.5 cm radius or a square of 5 cm (paper, 3.1)."""
    at: Point
    """[m] Centre."""
    yaw: Angle = 0.0
    """[rad]"""


class TerrainConfig(Model):
    """The ground as an elevation map; elsewhere the floor is at 0."""

    file: Annotated[str, pydantic.Field(min_length=1)]
    """The map (`jaxbiped.formats.elevation`); a relative path starts at the folder of the scene."""
    cell: Positive | None = None
    """[m] Size of a pixel of a picture."""
    range: tuple[Metres, Metres] | None = None
    """[m] Heights of the darkest and the brightest possible value in a picture."""
    hole: float | None = None
    """Value of unmeasured pixels in a picture. There is no ground there."""
    scale: Positive = 1.0
    """Factor of all three axes: scales a building to the robot's size."""
    origin: Point | None = None
    """[m] Position of the first height, at the smallest x and y; by default that in the file."""
    floor: Annotated[float, pydantic.Field(ge=-1e4, le=1e4)] = 0.0
    """[m] Height in the map, after `scale`, that becomes 0 in the arena."""


class SceneConfig(Model):
    """One arena."""

    name: Annotated[str, pydantic.Field(min_length=1, max_length=80)]
    size: tuple[Positive, Positive] = (1.80, 1.40)
    """[m] The area, from the origin (paper, 3.1)."""
    start: tuple[Metres, Metres, Angle]
    """[m, m, rad] Initial pose of the robot."""
    goal: Point
    """[m] The point to reach within 10 cm."""
    floor_contrast: Fraction = 1.0
    boxes: tuple[BoxConfig, ...] = ()
    landmarks: tuple[LandmarkConfig, ...] = ()
    terrain: TerrainConfig | None = None


@checked()
def load_scene(path: str | Path) -> tuple[str, Arena]:
    """Name and arena of a scene file.

    Raises:
      InputError: the first error in the file; start, goal or a box outside the area; start or goal inside an
        obstacle; a terrain that cannot be read, or start or goal where it has no ground to stand on.
    """
    scene = load(SceneConfig, path)
    try:
        terrain = to_terrain(scene, Path(path).parent)
    except InputError as error:
        if error.file is not None:  # it is from the map
            raise
        raise error.within(path) from None
    _check(scene, path, terrain)
    return scene.name, replace(to_arena(scene), terrain=terrain)


def to_terrain(scene: SceneConfig, folder: Path) -> HeightField | None:
    """The terrain of a scene in `folder`, cut to its area; None if it has none.

    Raises:
      InputError: the map cannot be used, or lies outside the area.
    """
    given = scene.terrain
    if given is None:
        return None
    options = {name: getattr(given, name) for name in ("cell", "range", "hole", "scale")}
    elevation = load_elevation(folder / given.file, prefix="terrain.", **options)
    origin = np.array(elevation.origin_xy if given.origin is None else given.origin, float)
    rows, columns = elevation.heights.shape
    first = np.floor(-origin / elevation.pitch).astype(int).clip(0)
    last = np.ceil((np.array(scene.size) - origin) / elevation.pitch).astype(int).clip(max=(columns - 1, rows - 1))
    if (last <= first).any():
        wide, deep = elevation.size_xy
        message = (
            f"must place the terrain, {wide:g} x {deep:g} m, inside the area of {scene.size[0]:g} x {scene.size[1]:g} m"
        )
        raise InputError(message, field="terrain.origin", value=origin)
    heights = elevation.heights[first[1] : last[1] + 1, first[0] : last[0] + 1]
    return replace(elevation, heights=heights, origin_xy=origin + first * elevation.pitch).field(given.floor)


@checked()
def to_arena(scene: SceneConfig) -> Arena:
    """The arena of a scene without its terrain (see `to_terrain`), with at least as many slots as a random arena.

    So both share compiled programs.
    """
    slots = max(MAX_BOXES, len(scene.boxes))
    rows = np.zeros((8, slots), np.float32)
    for m, box in enumerate(scene.boxes):
        half_x, half_y = box.size[0] / 2, box.size[1] / 2
        rows[:, m] = (*box.centre, box.yaw, half_x, half_y, box.bottom, box.top, box.contrast)
    x, y, yaw, half_x, half_y, bottom, top, contrast = rows
    used = np.arange(slots) < len(scene.boxes)
    boxes = Boxes(x, y, yaw, half_x, half_y, bottom, top, bottom > 0, contrast, used)
    slots = max(len(LANDMARKS_X), len(scene.landmarks))
    marks = np.zeros((3, slots), np.float32)
    kind = np.zeros(slots, np.int32)
    for n, mark in enumerate(scene.landmarks):
        marks[:, n] = (*mark.at, mark.yaw)
        kind[n] = CIRCLE if mark.kind == "circle" else SQUARE
    used = np.arange(slots) < len(scene.landmarks)
    arena = Arena(
        size_xy=np.array(scene.size, np.float32),
        boxes=boxes,
        landmarks=Landmarks(*marks, kind, used),
        start_xyyaw=np.array(scene.start, np.float32),
        goal_xy=np.array(scene.goal, np.float32),
        floor_contrast=np.float32(scene.floor_contrast),
        family=np.int32(-1),
        difficulty=np.float32(0.0),
    )
    return jax.device_put(arena)


def _check(scene: SceneConfig, path: str | Path, terrain: HeightField | None) -> None:
    size_x, size_y = scene.size
    for field, (x, y) in (("start", scene.start[:2]), ("goal", scene.goal)):
        if not (0 < x < size_x and 0 < y < size_y):
            raise InputError(
                f"must lie inside the area of {size_x:g} x {size_y:g} m", file=path, field=field, value=[x, y]
            )
    for n, mark in enumerate(scene.landmarks):
        if not (0 <= mark.at[0] <= size_x and 0 <= mark.at[1] <= size_y):
            raise InputError("must lie inside the area", file=path, field=f"landmarks.{n}.at", value=list(mark.at))
    for m, box in enumerate(scene.boxes):
        cos, sin = abs(math.cos(box.yaw)), abs(math.sin(box.yaw))
        reach_x = (cos * box.size[0] + sin * box.size[1]) / 2
        reach_y = (sin * box.size[0] + cos * box.size[1]) / 2
        x, y = box.centre
        slack = 1e-6  # [m] a box may end exactly at the rim
        if x - reach_x < -slack or x + reach_x > size_x + slack or y - reach_y < -slack or y + reach_y > size_y + slack:
            raise InputError(
                f"the box must lie inside the area of {size_x:g} x {size_y:g} m",
                file=path,
                field=f"boxes.{m}",
                value=list(box.centre),
            )
    for field, point, head in (("start", scene.start[:2], STANDING), ("goal", scene.goal, SQUATTING)):
        base = base_height(terrain, point)
        if base == HOLE:
            raise InputError("must not lie in a hole of the terrain", file=path, field=field, value=list(point))
        if not LOWEST <= base <= HIGHEST:
            message = f"must lie on terrain from {LOWEST:g} to {HIGHEST:g} m; terrain.floor moves it up or down"
            raise InputError(message, file=path, field=field, value=f"{base:.3g} m at {list(point)}")
        ground = max((box.top for box in scene.boxes if box.bottom == 0 and distance(box, point) == 0), default=base)
        ground = max(ground, base)
        if ground > base + 2 * STEP:
            raise InputError("must not lie on an obstacle", file=path, field=field, value=list(point))
        for m, box in enumerate(scene.boxes):
            between = box.top > ground + STEP + 1e-6 and box.bottom < ground + head
            if between and distance(box, point) < START_CLEARANCE:
                message = f"must be at least {START_CLEARANCE:g} m away from boxes.{m}, an obstacle there"
                raise InputError(message, file=path, field=field, value=list(point))


@runtime_checkable
class Measures(Protocol):
    """The robot's measures that warnings read; `motion.robot.RobotConfig` has them."""

    body_radius: float  # [m]
    standing: float  # [m]
    step: float  # [m]
    step_tolerance: float  # [m]


def scene_warnings(arena: Arena, robot: Measures, level_height: float) -> tuple[str, ...]:
    """Warnings about a scene before this robot walks in it: one line each, with the start first.

    The robot starts in an obstacle (`load_scene` only rejects what is an obstacle to the paper's robot, and no terrain
    that only rises beside it), or a box is a
    trap: higher than the robot's step above its ground, and lower than an obstacle by its level alone (from
    `level_height` [m] times a half on). Such ground differs from a bump only by a few millimetres.
    """
    boxes = [BoxConfig(**box) for box in _rows(arena)]
    x, y = (float(v) for v in arena.start_xyyaw[:2])
    base = base_height(arena.terrain, (x, y))
    ground = max([base, *(box.top for box in boxes if box.bottom == 0 and distance(box, (x, y)) == 0)])
    bears, found = robot.step + robot.step_tolerance, []
    if arena.terrain is not None:
        limits = jnp.float32(robot.body_radius), jnp.float32(ground + bears + 1e-6)
        if bool(rises_near(arena.terrain, jnp.float32(x), jnp.float32(y), *limits)):
            found.append(
                f"start: this robot, {robot.body_radius:g} m in radius, starts in terrain more than a step above its "
                f"ground of {ground:.3g} m (at [{x:g}, {y:g}])"
            )
    for m, box in enumerate(boxes):
        between = box.top > ground + bears + 1e-6 and box.bottom < ground + robot.standing - 1e-6
        if between and distance(box, (x, y)) < robot.body_radius:
            found.append(
                f"start: this robot, {robot.body_radius:g} m in radius, starts in boxes.{m} (at [{x:g}, {y:g}])"
            )
    obstacle = (math.ceil(robot.step / level_height + 0.5 - 1e-9) - 0.5) * level_height
    for m, box in enumerate(boxes):
        under = [b.top for b in boxes if b.bottom == 0 and b.top < box.top and distance(b, box.centre) == 0]
        rise = box.top - max([base_height(arena.terrain, box.centre), *under])
        if box.bottom == 0 and bears + 1e-6 < rise < obstacle - 1e-6:
            found.append(
                f"boxes.{m}.top: is {rise:g} m high, more than this robot's step of {robot.step:g} m and less than the "
                f"{obstacle:g} m from which it is an obstacle by its level (got {box.top:g})"
            )
    return tuple(found)


def base_height(terrain: HeightField | None, point: tuple[float, float]) -> float:
    """Height [m] of terrain, or of the floor, at a point (x, y) [m]; `HOLE` in a hole."""
    if terrain is None:
        return 0.0
    return round(float(terrain_height(terrain, *(jnp.float32(value) for value in point))), 6)


def _rows(arena: Arena) -> list[dict]:
    """The boxes in use in one arena as fields of `BoxConfig`, with numbers as they were written."""
    leaves = (arena.boxes.x, arena.boxes.y, arena.boxes.half_x, arena.boxes.half_y, arena.boxes.yaw, arena.boxes.bottom,
              arena.boxes.top)  # fmt: skip
    used = np.flatnonzero(np.asarray(arena.boxes.used))
    rows = [[round(float(leaf[m]), 6) for leaf in map(np.asarray, leaves)] for m in used]
    return [
        {"centre": (x, y), "size": (2 * a, 2 * b), "yaw": yaw, "bottom": low, "top": top}
        for x, y, a, b, yaw, low, top in rows
    ]


def distance(box: BoxConfig, point: tuple[float, float]) -> float:
    """Distance [m] in plan from a point to a box; 0 inside."""
    dx, dy = point[0] - box.centre[0], point[1] - box.centre[1]
    along = math.cos(box.yaw) * dx + math.sin(box.yaw) * dy
    across = math.cos(box.yaw) * dy - math.sin(box.yaw) * dx
    return math.hypot(max(abs(along) - box.size[0] / 2, 0), max(abs(across) - box.size[1] / 2, 0))
