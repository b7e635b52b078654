"""The content of an arena as triangles: its floor, boxes, landmarks and goal; also the colours of heights."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import trimesh
from jaxtyping import Float, Int, UInt8
from matplotlib import colormaps
from matplotlib.colors import to_rgb

from jaxbiped.arenas.arena import DISC_RADIUS, SQUARE_SIDE
from jaxbiped.mission.log import MissionLog, Outline
from jaxbiped.report.pictures import GOAL_RADIUS, INK

Colour = tuple[int, int, int]

FLOOR_DEPTH, RIM = 0.012, 0.015  # [m] depth of the floor's slab, and its margin around the arena
BELOW = 0.0015  # [m] offset of the slab below the floor, to avoid flicker
MARK_HEIGHT, RING_HEIGHT = 0.0045, 0.006  # [m]: above the tiles of the map
RING_WIDTH, DASHES, SEGMENTS = 0.008, 16, 64
FLOOR_COLOUR, MARKS = (120, 124, 132), {"circle": (226, 58, 46), "square": (28, 92, 230)}
BOX_COLOURS = {"obstacle": (196, 92, 78), "bump": (116, 156, 205), "gate": (152, 118, 190)}
TALL, THROUGH = 0.15, 0.5  # [m] height from which boxes are transparent, and their opacity
LOWEST, HIGHEST = -0.03, 0.45  # [m] of the scale of heights


@dataclass(frozen=True)
class Solid:
    """A mesh of one colour, in the world."""

    name: str  # parts are joined by slashes
    vertices: Float[np.ndarray, "V 3"]  # [m]
    faces: Int[np.ndarray, "F 3"]
    colour: Colour
    opacity: float = 1.0


def rgb(colour: str) -> Colour:
    """A colour by name or `#rrggbb`."""
    return tuple(round(255 * channel) for channel in to_rgb(colour))


def solids(log: MissionLog) -> tuple[Solid, ...]:
    """Everything in an arena that does not move."""
    found = [floor(log)]
    found += [prism(f"arena/box_{k}", outline) for k, outline in enumerate(log.outlines)]
    for k, mark in enumerate(log.landmarks):
        if mark.kind == "circle":
            mesh = trimesh.creation.cylinder(DISC_RADIUS, 0.001, sections=SEGMENTS)
        else:
            mesh = trimesh.creation.box((SQUARE_SIDE, SQUARE_SIDE, 0.001))
        mesh.apply_transform(trimesh.transformations.rotation_matrix(mark.yaw, (0, 0, 1)))
        mesh.apply_translation((*mark.xy, MARK_HEIGHT))
        found.append(solid(f"landmarks/{mark.kind}_{k}", mesh, MARKS[mark.kind]))
    return (*found, *goal(log))


def floor(log: MissionLog) -> Solid:
    """A slab under the arena."""
    width, depth = (float(side) for side in log.size_xy)
    mesh = trimesh.creation.box((width + 2 * RIM, depth + 2 * RIM, FLOOR_DEPTH))
    mesh.apply_translation((width / 2, depth / 2, -FLOOR_DEPTH / 2 - BELOW))
    return solid("arena/floor", mesh, FLOOR_COLOUR)


def prism(name: str, outline: Outline) -> Solid:
    """A box of an arena. One that could hide the robot is drawn transparent."""
    top, bottom = max(outline.top, outline.bottom + 1e-3), outline.bottom
    corners = np.asarray(outline.corners_xy, float)
    vertices = np.concatenate([np.column_stack([corners, np.full(4, z)]) for z in (bottom, top)])
    sides = [[k, (k + 1) % 4, (k + 1) % 4 + 4, k + 4] for k in range(4)]
    quads = np.array([[3, 2, 1, 0], [4, 5, 6, 7], *sides])
    separate = vertices[quads].reshape(-1, 3)  # corners shared by faces would be shaded smoothly
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    faces = (4 * np.arange(len(quads))[:, None, None] + halves).reshape(-1, 3)
    return Solid(name, separate, faces, BOX_COLOURS[outline.kind], THROUGH if top > TALL else 1.0)


def goal(log: MissionLog) -> tuple[Solid, ...]:
    """A cross, a dashed circle within which the goal counts as reached, and a ring at the robot's start."""
    x, y = (float(value) for value in log.goal_xy)
    parts = [arc(GOAL_RADIUS, 2 * math.pi * k / DASHES, 0.6 * 2 * math.pi / DASHES) for k in range(DASHES)]
    for angle in (math.pi / 4, -math.pi / 4):
        bar = trimesh.creation.box((0.09, RING_WIDTH * 1.6, 0.001))
        bar.apply_transform(trimesh.transformations.rotation_matrix(angle, (0, 0, 1)))
        parts.append(bar)
    cross = trimesh.util.concatenate(parts)
    cross.apply_translation((x, y, RING_HEIGHT))
    begin = arc(0.05, 0.0, 2 * math.pi)
    begin.apply_translation((*log.true_xyyaw[0, :2], RING_HEIGHT))
    return solid("goal", cross, rgb(INK)), solid("start", begin, rgb(INK))


def arc(radius: float, start: float, angle: float) -> trimesh.Trimesh:
    """A flat strip along a circle around the origin, visible from above and from below."""
    count = max(2, round(SEGMENTS * angle / (2 * math.pi))) + 1
    at = start + np.linspace(0, angle, count)
    ring = [np.column_stack([r * np.cos(at), r * np.sin(at), np.zeros(count)]) for r in (radius - RING_WIDTH, radius)]
    k = np.arange(count - 1)
    faces = np.concatenate([np.column_stack([k, k + count, k + 1]), np.column_stack([k + 1, k + count, k + count + 1])])
    return trimesh.Trimesh(np.concatenate(ring), np.concatenate([faces, faces[:, ::-1]]), process=False)


def solid(name: str, mesh: trimesh.Trimesh, colour: Colour, opacity: float = 1.0) -> Solid:
    """A mesh of `trimesh`, each face with its own corners, so that edges are sharp."""
    vertices = np.asarray(mesh.vertices)[mesh.faces].reshape(-1, 3)
    return Solid(name, vertices, np.arange(len(vertices)).reshape(-1, 3), colour, opacity)


def height_colours(z: Float[np.ndarray, "*n"]) -> UInt8[np.ndarray, "*n 3"]:
    """Heights [m] as colours, from dark blue (floor) to yellow (a head's height)."""
    share = np.clip((np.asarray(z, float) - LOWEST) / (HIGHEST - LOWEST), 0, 1)
    return np.round(255 * np.asarray(colormaps["viridis"](share))[..., :3]).astype(np.uint8)
