"""Two sensors in the same places: how close their maps and missions are to each other and to the truth."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int8, UInt32

from jaxbiped import mapping
from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.families import FAMILIES, SIZE_X, SIZE_Y
from jaxbiped.executors.world_state import WorldState
from jaxbiped.geometry.pose import Pose
from jaxbiped.jax_settings import with_own_settings
from jaxbiped.mapping import Cell, GridSpec
from jaxbiped.mapping.truth import truth_grid
from jaxbiped.mission.arena_batch import draw
from jaxbiped.mission.mission_step import sense
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.params import MissionConfig, MissionParams, MissionSpec, mission_spec
from jaxbiped.mission.recorded_driver import run_bare
from jaxbiped.mission.sensor_rig import SensorRig
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import AgentState, start
from jaxbiped.sensing.presets import RayConfig
from jaxbiped.sensing.view import View

AREA = (SIZE_X, SIZE_Y)
AWAY = (0.25, 0.80)  # [m] in front of the target of a view
LOW = 0.07  # [m] boxes that are no higher, or that hang, are targets first
TRIALS = 200  # places tried for an aimed view
RATIO = 0.10  # largest relative difference in distance and time of equal missions


@dataclass(frozen=True)
class Place:
    """One arena and the places from which it is viewed; all on the host."""

    arena: Arena
    classes: Int8[np.ndarray, "H W"]  # the truth
    levels: Int8[np.ndarray, "H W"]
    seed: int  # seed of the noise of its missions
    poses: tuple[Pose, ...]  # aimed at gates, bumps and obstacles in turn


def worlds(seed: int, first: int, count: int, views: int, config: MissionConfig) -> Iterator[Place]:
    """Arenas of the population of `seed`, starting at `first`, and `views` places in each; the same for all sensors."""
    grid, body = config.grid(AREA), config.robot.body()
    batch, seeds = draw(jax.random.key(seed), first + jnp.arange(count), FAMILIES)
    truth = jax.jit(jax.vmap(lambda arena: truth_grid(arena, grid, body)))(batch)
    batch, seeds, truth = jax.device_get((batch, seeds, truth))
    for k in range(count):
        arena, (classes, levels) = jax.tree.map(lambda leaf, k=k: leaf[k], (batch, truth))
        rng = np.random.default_rng([seed, first + k])
        poses = tuple(aimed(rng, arena, classes, levels, n, grid) for n in range(views))
        yield Place(arena, classes, levels, int(seeds[k]), poses)


def aimed(
    rng: np.random.Generator,
    arena: Arena,
    classes: Int8[np.ndarray, "H W"],
    levels: Int8[np.ndarray, "H W"],
    number: int,
    grid: GridSpec,
) -> Pose:
    """A place on the ground from which view `number` looks at a lintel or a bump or, if there are none, at any box."""
    boxes = arena.boxes
    targets = np.flatnonzero(boxes.used & (boxes.overhead | (boxes.top < LOW)))
    others = np.flatnonzero(boxes.used)
    targets = targets if len(targets) and number % 3 else others
    x, y, across = grid.size_x / 2, grid.size_y / 2, 0.0
    if len(targets):
        x, y, across = (float(v[targets[number % len(targets)]]) for v in (boxes.x, boxes.y, boxes.yaw))
    for trial in range(TRIALS):
        away = rng.uniform(*AWAY)
        sector = 0.3 if trial < TRIALS // 2 else np.pi  # otherwise from any side
        along = across + rng.choice([0, np.pi]) + rng.uniform(-sector, sector)
        px, py = x - away * np.cos(along), y - away * np.sin(along)
        i, j = int(py // grid.pitch), int(px // grid.pitch)
        if 0.1 < px < grid.size_x - 0.1 and 0.1 < py < grid.size_y - 0.1 and classes[i, j] in (Cell.FLOOR, Cell.BUMP):
            break
    else:
        (px, py), along, (i, j) = arena.start_xyyaw[:2], float(arena.start_xyyaw[2]), (0, 0)
    yaw = along + rng.uniform(-0.2, 0.2)
    return Pose(*(np.float32(v) for v in (px, py, levels[i, j] * grid.level_height, yaw)))


Look = Callable[[Place, Pose, int], View]


def looking(config: MissionConfig, rig: SensorRig | None) -> Look:
    """The view of a robot at a known place: a function of the world, the place and the number of the view."""
    params, spec = config.params("full"), mission_spec(config, AREA)
    measure = rig.see if rig else measured

    def look(world: Place, pose: Pose, number: int) -> View:
        setup = setup_in(world, params, spec)
        place, agent = standing(setup, jnp.asarray(world.seed, jnp.uint32)[None], pose, jnp.int32(number))
        view, _ = measure(place, agent, setup)
        return jax.tree.map(lambda leaf: leaf[0], view)

    return look


def setup_in(place: Place, params: MissionParams, spec: MissionSpec) -> MissionSetup:
    """A mission in the arena of a place, with a leading axis of 1."""
    return jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], MissionSetup(place.arena, params, spec))


@with_own_settings
@jax.jit
def measured(world: WorldState, agent: AgentState, setup: MissionSetup):
    """The measurement of a sensor that is in JAX."""
    return jax.vmap(partial(sense, body_pose=None))(world, agent, setup)


@with_own_settings
@jax.jit
def standing(setup: MissionSetup, seed: UInt32[Array, "1"], pose: Pose, number: Array) -> tuple[WorldState, AgentState]:
    """A robot that stands at a pose and knows it, before its measurement of this number."""
    world, agent = jax.vmap(start)(setup, seed)
    pose = jax.tree.map(lambda leaf: jnp.asarray(leaf)[None], pose)
    return replace(world, pose=pose, decisions=number[None]), replace(agent, belief=replace(agent.belief, pose=pose))


@with_own_settings
def fused(world: Place, look: Look, config: MissionConfig) -> tuple[Int8[np.ndarray, "H W"], Int8[np.ndarray, "H W"]]:
    """Classes and levels of the map of all views of a world, each from its known place."""
    grid, params = config.grid(AREA), config.params("full")
    grid_map = mapping.empty(grid)
    for number, pose in enumerate(world.poses):
        grid_map = add(grid_map, look(world, pose, number), pose, params.body, params.mapping, grid)
    return jax.device_get(mapping.classify(grid_map, params.mapping, grid))


def with_rays(config: MissionConfig, rays: RayConfig) -> MissionConfig:
    """The same missions, with this many cast rays."""
    camera = config.camera.model_copy(update=rays.model_dump())
    return config.model_copy(update={"sensor": "raycast", "camera": camera})


def agreement(stereo: Int8[np.ndarray, "B H W"], ours: Int8[np.ndarray, "B H W"]) -> tuple[float, float]:
    """Share of equal cells in two sensors' maps: of all cells, and of those that both measured."""
    both, equal = (stereo != Cell.UNMEASURED) & (ours != Cell.UNMEASURED), stereo == ours
    return float(equal.mean()), float(equal[both].mean())


add = jax.jit(mapping.update, static_argnames=("spec", "refit"))


@dataclass(frozen=True)
class Outcome:
    """How one mission ended."""

    code: Code
    distance: float  # [m]
    time: float  # [s]


@with_own_settings
def mission(world: Place, config: MissionConfig, rig: SensorRig | None) -> Outcome:
    """One mission of strategy `full` in a world."""
    arena, params = jax.tree.map(jnp.asarray, (world.arena, config.params("full")))
    end = run_bare(MissionSetup(arena, params, mission_spec(config, AREA)), jnp.uint32(world.seed), rig)
    return Outcome(Code(int(end.code[0])), float(end.distance[0]), float(end.time[0]))


def same(one: Outcome, other: Outcome, lost: bool = True) -> bool:
    """Whether two missions ended alike: the same code, and distance and time within `RATIO`.

    Args:
      lost: also compare how far missions came that did not reach their goal, and when they gave up; otherwise only
        their code.
    """
    if one.code != other.code or (one.code != Code.REACHED and not lost):
        return one.code == other.code
    return all(abs(a - b) <= RATIO * max(a, b) for a, b in ((one.distance, other.distance), (one.time, other.time)))


@dataclass(frozen=True)
class Score:
    """Measured cells of maps compared to the truth."""

    right: float  # share of the measured cells
    near: float  # the same, within one cell
    recall: dict[str, float]  # of each class, within one cell: of its true cells that were measured
    precision: dict[str, float]  # of its cells in the maps


def score(maps: Sequence[Int8[np.ndarray, "H W"]], truths: Sequence[Int8[np.ndarray, "H W"]]) -> Score:
    """The score of maps of the same size."""
    called, true = np.stack(maps), np.stack(truths)
    known = called != Cell.UNMEASURED
    close = np.any([(called == kind) & around(true == kind) for kind in Cell], axis=0)
    recall, precision = {}, {}
    for kind in (Cell.FLOOR, Cell.BUMP, Cell.GATE, Cell.OBSTACLE):
        ours, theirs = called == kind, (true == kind) & known
        recall[kind.name.lower()] = mean(around(ours)[theirs])
        precision[kind.name.lower()] = mean(around(true == kind)[ours])
    return Score(mean((called == true)[known]), mean(close[known]), recall, precision)


def around(mask: Bool[np.ndarray, "B H W"]) -> Bool[np.ndarray, "B H W"]:
    """Cells of a mask, and their eight neighbours."""
    _, height, width = mask.shape
    padded = np.pad(mask, ((0, 0), (1, 1), (1, 1)))
    return np.any([padded[:, i : i + height, j : j + width] for i in range(3) for j in range(3)], axis=0)


def mean(values: Float[np.ndarray, "n"] | Bool[np.ndarray, "n"]) -> float:
    """The mean; NaN if there are no values."""
    return float(np.mean(values)) if len(values) else float("nan")
