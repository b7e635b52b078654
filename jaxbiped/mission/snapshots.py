"""The record of one decision in a log, and of the arena in which it was made."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float

from jaxbiped import planning
from jaxbiped.arenas.arena import CIRCLE, Arena
from jaxbiped.core.ready_programs import ready_jit
from jaxbiped.executors.world_state import WorldState
from jaxbiped.geometry.pose import to_world
from jaxbiped.mapping import level_view
from jaxbiped.mapping.cobstacles import occupied_levels
from jaxbiped.mission.decision import DecisionTrace
from jaxbiped.mission.log import Ground, Mark, Outline, Walk
from jaxbiped.mission.params import MissionParams, MissionSpec


def moment(world: WorldState, thought: DecisionTrace, params: MissionParams, spec: MissionSpec, action: str) -> dict:
    """The record of one decision in a log."""
    points, counts, voxels = jax.device_get(as_mapped(thought, params, spec))
    plan = planned_way(thought, params, spec)
    world, pose, seen, measuring = jax.device_get((world, thought.pose, thought.landmarks, params.durations.measure))
    return {
        "classes": np.asarray(thought.classes)[0],
        "levels": np.asarray(thought.levels)[0],
        "true_xyyaw": pose_of(world),
        "estimated_xyyaw": np.array([float(v[0]) for v in (pose.x, pose.y, pose.yaw)]),
        "plan": plan,
        "time": float(np.float32(world.time[0]) + np.float32(measuring)),
        "action": action,
        "z": float(world.pose.z[0]),
        "squat": bool(world.squat[0]),
        "seen": int(seen[0].sum()),
        "points": points[counts],
        "voxels": voxels,
    }


@ready_jit(static_argnames=("spec",))
def as_mapped(
    thought: DecisionTrace, params: MissionParams, spec: MissionSpec
) -> tuple[Float[Array, "N 3"], Bool[Array, "N"], Bool[Array, "H W Z"]]:
    """The points of a view as used by the map [m, believed world], which of them count, and occupied voxels."""
    grid, mapping = spec.grid, params.mapping
    view, evidence, pose = jax.tree.map(lambda leaf: leaf[0], (thought.view, thought.evidence, thought.pose))
    if not spec.knows_pose:
        view = level_view(view, pose.z, mapping, grid)
    points = jnp.stack([*to_world(pose, view.x, view.y), view.z + pose.z], axis=-1)
    counts = (view.weight > 0) & (view.x**2 + view.y**2 < mapping.max_range**2) & jnp.all(jnp.isfinite(points), axis=-1)
    bits = jnp.arange(grid.levels + grid.lowest, dtype=jnp.uint32)
    return points, counts, (occupied_levels(evidence, mapping, grid)[..., None] >> bits) & 1 != 0


def walk_of(walked: list[list[np.ndarray]]) -> Walk | None:
    """States after each decision, each group spread evenly over the time from its moment to the next."""
    states = [state for lot in walked for state in lot]
    if not states:
        return None
    moment = [t + np.arange(len(lot)) / len(lot) for t, lot in enumerate(walked) if lot]
    return Walk(np.stack(states), np.concatenate(moment).astype(np.float32))


def nothing(world: WorldState, spec: MissionSpec) -> dict:
    """The only moment of a mission that ended before it began."""
    blank = np.zeros(spec.grid.shape, np.int8)
    here = pose_of(world)
    return {
        "classes": blank,
        "levels": blank,
        "true_xyyaw": here,
        "estimated_xyyaw": here,
        "plan": np.zeros((0, 2)),
        "time": 0.0,
        "action": "Start",
        "z": float(np.asarray(world.pose.z)[0]),
        "squat": bool(np.asarray(world.squat)[0]),
        "seen": 0,
        "points": np.zeros((0, 3), np.float32),
        "voxels": np.zeros((*spec.grid.shape, spec.grid.levels + spec.grid.lowest), bool),
    }


def pose_of(world: WorldState) -> Float[np.ndarray, "3"]:
    """True (x, y, yaw) of the only mission of a batch."""
    return np.array([float(np.asarray(v)[0]) for v in (world.pose.x, world.pose.y, world.pose.yaw)])


def agent_pose(agent) -> Float[np.ndarray, "3"]:
    """Believed (x, y, yaw) of the only mission of a batch."""
    pose = agent.belief.pose
    return np.array([float(np.asarray(v)[0]) for v in (pose.x, pose.y, pose.yaw)])


def planned_way(thought: DecisionTrace, params: MissionParams, spec: MissionSpec) -> Float[np.ndarray, "n 2"]:
    """Cell centres [m] of the planned path, starting at the robot's cell; empty if there is none."""
    grid = spec.grid
    moves = np.asarray(way(thought, params))[0]
    moves = moves[: np.argmax(moves < 0)] if np.any(moves < 0) else moves
    if len(moves) == 0:
        return np.zeros((0, 2))
    cells = np.asarray(thought.problem.start_ij)[0] + np.vstack(
        [np.zeros((1, 2), int), np.cumsum(planning.DIRECTIONS[moves], axis=0)]
    )
    return (cells[:, ::-1] + 0.5) * grid.pitch


@ready_jit
def way(thought: DecisionTrace, params: MissionParams):
    """Moves of the planned path, of which `decide` reads the first."""
    return params.planner.whole_way(thought.problem, thought.route)


def outlines(arena: Arena) -> tuple[Outline, ...]:
    """Footprints of the true boxes."""
    boxes = jax.device_get(arena.boxes)
    found = []
    for m in np.flatnonzero(boxes.used):
        cos, sin = np.cos(boxes.yaw[m]), np.sin(boxes.yaw[m])
        local = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [boxes.half_x[m], boxes.half_y[m]]
        corners = local @ np.array([[cos, sin], [-sin, cos]]) + [boxes.x[m], boxes.y[m]]
        kind = "gate" if boxes.overhead[m] else "bump" if boxes.top[m] <= 0.0601 else "obstacle"
        found.append(Outline(corners, kind, float(boxes.bottom[m]), float(boxes.top[m]), way_of(arena, m)))
    return tuple(found)


def ground(arena: Arena) -> Ground | None:
    """The true terrain."""
    if arena.terrain is None:
        return None
    terrain = jax.device_get(arena.terrain)
    return Ground(np.asarray(terrain.heights), np.asarray(terrain.origin_xy, float), float(terrain.pitch))


def way_of(arena: Arena, m: int | np.integer) -> tuple[float, float, float, float] | None:
    """The motion of one box; None if all boxes of the arena stand still."""
    movers = arena.movers
    return movers and tuple(float(value[m]) for value in (movers.dx, movers.dy, movers.speed, movers.phase))


def marks(arena: Arena) -> tuple[Mark, ...]:
    """The landmarks."""
    known = jax.device_get(arena.landmarks)
    return tuple(
        Mark(
            (float(known.x[n]), float(known.y[n])),
            float(known.yaw[n]),
            "circle" if known.kind[n] == CIRCLE else "square",
        )
        for n in np.flatnonzero(known.used)
    )
