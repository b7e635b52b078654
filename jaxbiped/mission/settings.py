"""Everything a mission depends on besides its arena: the config for people, and its traced form."""

from __future__ import annotations

import functools
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Literal

import jax
import jax.numpy as jnp
import pydantic
from jaxtyping import Array, Float, Int

from jaxbiped.config import Model
from jaxbiped.errors import InputError
from jaxbiped.geometry.height_field import HeightField, height_range
from jaxbiped.mapping import Body, GridSpec, MapConfig, MapParams
from jaxbiped.mapping.grid import MOST_GROUNDS
from jaxbiped.mission.footwork import WalkConfig
from jaxbiped.mission.library import Library, load_library
from jaxbiped.mission.strategies import Strategy, strategy
from jaxbiped.motion.primitives import DurationConfig, Durations
from jaxbiped.motion.robot import HEIGHT_TOLERANCE, Footing, RobotConfig
from jaxbiped.planning import Costs
from jaxbiped.sensing.camera import Camera, CameraConfig, ImageSpec
from jaxbiped.sensing.landmarks import LandmarkConfig, LandmarkNoise
from jaxbiped.sensing.motion import VisualConfig, VisualNoise
from jaxbiped.sensing.noise import NoiseConfig, StereoNoise
from jaxbiped.sensing.odometry import OdometryConfig, OdometryNoise
from jaxbiped.sensing.presets import PRESETS, sensor_preset

# [m] greatest radius of a body in a sweep; static, since it sets how many cells the map visits around each
MAX_RADIUS = 0.15
HEADROOM = 12  # levels above that of the highest ground that a map holds: those within a standing robot of 38.5 cm
SWAYING = 0.125  # [m] default of `robot.radius` for all executors but `kinematic`: a walking biped sways, and its
# stereo camera, as wide as the body, sweeps 12 cm to either side
BELOW_POINTS = 50.0  # default of `mapping.below_points` for rendered stereo; others keep the map that was published
SIMULATED = ("native", "mjx")  # executors that are simulated bipeds
VISUAL = ("visual", "both")  # localisations that measure the motion between two views
ICP = ("icp", "both")  # those that measure the pose by walls that were measured before

# Bounded so that sums of costs along a path keep their differences in single precision.
Cost = Annotated[float, pydantic.Field(ge=0.0, le=1e4)]


class CostConfig(Model):
    """Costs of Eq. (1) on a pitch of 5 cm; the paper's values (3.1). Other pitches: `planning.Costs.at_pitch`."""

    c0: Annotated[float, pydantic.Field(ge=0.1, le=1e3)] = 1.0
    """Distance, a cell. Never free: a path must come nearer to its goal with each cell."""
    c1: Cost = 1.0
    """Floor to floor."""
    c2: Cost = 5.0
    """Through a gate, squatting."""
    c3: Cost = 10.0
    """Up or down one step."""
    c4: Cost = 100.0
    """Into what is unmeasured."""

    def traced(self) -> Costs:
        """The same as arrays."""
        return Costs(**{name: jnp.float32(value) for name, value in self.model_dump().items()})


class LimitConfig(Model):
    """When a mission ends."""

    goal_radius: Annotated[float, pydantic.Field(gt=0.0, le=1.0)] = 0.10
    """[m] reached when this near to the goal (paper, 3.1)."""
    max_decisions: Annotated[int, pydantic.Field(ge=1, le=100_000)] = 150
    """Decisions after which a mission is out of steps."""
    max_looks: Annotated[int, pydantic.Field(ge=1, le=100_000)] = 4
    """Measurements in a row that show no path, each a quarter turn on, after which the robot gives up: once around."""
    edge_tolerance: Annotated[float, pydantic.Field(ge=0.0, le=0.1)] = 0.02
    """[m] that an edge may lie off under the robot before it falls; simulated bipeds fell from 0.025 on."""
    height_tolerance: Annotated[float, pydantic.Field(ge=0.0, le=0.1)] = HEIGHT_TOLERANCE
    """[m] that the ground may be off the height stepped to; simulated bipeds took -12 to +8 mm."""
    start_sd: tuple[float, float] = (0.002, 0.005)
    """[m, rad] how well the robot knows where it starts."""


class MissionConfig(Model):
    """One kind of mission. Every default is the paper's value, or named where it is chosen."""

    sensor: Literal["raycast", "oracle", "stereo"] = "raycast"
    """`stereo`: pairs of pictures, rendered and matched on the host."""
    preset: str = "rendered"
    """How well the camera measures, the default of each number of `stereo` and `landmarks`: ideal, rendered, real, or a
    sensor file (.toml), as `jaxbiped fit-sensor` writes it, which says how many rays the camera has, too. What is given
    beside it wins; the rays need only divide the camera's size as it then is."""
    executor: Literal["kinematic", "sampled", "native", "mjx"] = "kinematic"
    """`sampled`: moves as simulated bipeds were measured to (`library`). `native` and `mjx`: simulated bipeds, in
    MuJoCo's own batch or in MJX."""
    localisation: Literal["landmarks", "odometry", "visual", "icp", "both"] = "landmarks"
    """How the robot knows where it stands: dead reckoning, corrected by landmarks, by nothing (`odometry`), by the
    motion that two views tell (`visual`), by walls measured before (`icp`), or by the last two. The paper has the
    first alone; without landmarks there are none in the arena. The sensor `oracle` knows the pose."""
    pitch: Annotated[float, pydantic.Field(gt=0.0, le=1.0)] = 0.05
    """[m] of the 2D grid, and of the 3D grid in plan (paper, 3.1)."""
    corner_cutting: bool = False
    """May an oblique move pass one blocked cell?"""
    planner: Literal["cell", "heading"] = "cell"
    """`cell`: the least cost by Eq. 1 (the paper's). `heading`: the least time over cells and headings, turns counted;
    of the costs, C4 alone still counts there."""
    foot_placement: bool | None = None
    """Are the feet placed by measured edges? Else edges are crossed from cell to cell, as in the paper. By default for
    all executors but `kinematic`."""
    costs: CostConfig = CostConfig()
    durations: DurationConfig = DurationConfig()
    robot: RobotConfig = RobotConfig()
    camera: CameraConfig = CameraConfig()
    stereo: NoiseConfig = NoiseConfig()
    landmarks: LandmarkConfig = LandmarkConfig()
    odometry: OdometryConfig = OdometryConfig()
    visual: VisualConfig = VisualConfig()
    mapping: MapConfig = MapConfig()
    limits: LimitConfig = LimitConfig()
    walk: WalkConfig = WalkConfig()
    library: Path | None = None
    """What `sampled` draws from, a file that `jaxbiped primitives` wrote; by default the one of the default robot."""

    @pydantic.model_validator(mode="before")
    @classmethod
    def _fill_in(cls, data):
        """What is not given comes from the preset, field by field; the radius depends on who walks, the rule of
        walls on what it sees with."""
        if isinstance(data, dict) and data.get("executor", "kinematic") != "kinematic":
            robot = data.get("robot", {})
            data = data | {"robot": {"radius": SWAYING} | robot if isinstance(robot, dict) else robot}
        if isinstance(data, dict):
            limits, robot = data.get("limits", {}), data.get("robot", {})
            bears = limits.get("height_tolerance") if isinstance(limits, dict) else None
            bears = getattr(limits, "height_tolerance", bears)  # a config, or something wrong
            if isinstance(robot, dict) and bears is not None:
                data = data | {"robot": {"height_tolerance": bears} | robot}
        if isinstance(data, dict) and data.get("sensor") == "stereo":
            rules = data.get("mapping", {})
            data = data | {"mapping": {"below_points": BELOW_POINTS} | rules if isinstance(rules, dict) else rules}
        try:
            preset = sensor_preset(data.get("preset", "rendered"))
        except (InputError, AttributeError, TypeError):
            return data  # what is wrong is said of the field itself
        filled = {}
        for name in ("stereo", "landmarks"):
            given = data.get(name, {})
            filled[name] = getattr(preset, name).model_dump() | given if isinstance(given, dict) else given
        camera = data.get("camera", {})
        if preset.rays and isinstance(camera, dict):
            filled["camera"] = preset.rays.model_dump() | camera
        return data | filled

    @pydantic.field_validator("preset")
    @classmethod
    def _known(cls, name: str) -> str:
        if name not in PRESETS and not name.endswith(".toml"):
            raise ValueError(f"must be one of {', '.join(PRESETS)} or a .toml file")
        sensor_preset(name)
        return name

    def grid(self, size_xy: tuple[float, float], heights: tuple[float, float] = (0.0, 0.0)) -> GridSpec:
        """The static grid of an area [m]; InputError when the pitch does not divide it.

        Args:
          heights: [m] lowest and highest ground of its terrain. It may be stood on in as many levels as there are,
            at most `MOST_GROUNDS`, and above the highest of them there is room for the robot's head; 32 levels hold
            both up to 20 levels of ground (57 cm).
        """
        spec = GridSpec(size_x=size_xy[0], size_y=size_xy[1], pitch=self.pitch, max_radius=MAX_RADIUS)
        low, high = (round(height / spec.level_height) for height in heights)
        grounds = min(max(spec.ground_levels, high + 1), MOST_GROUNDS)
        lowest = max(min(spec.lowest, low - 1), -8)
        above = max(spec.levels + spec.lowest, min(grounds + HEADROOM, 32))
        return replace(spec, lowest=lowest, levels=above - lowest, ground_levels=grounds)

    def settings(self, strategy_name: str) -> Settings:
        """The traced part, for one strategy."""
        limits = self.limits
        sd, sd_yaw = limits.start_sd
        return Settings(
            strategy=strategy(strategy_name, self.corner_cutting),
            costs=numbers(self.costs),
            durations=numbers(self.durations),
            body=numbers(self.robot, "body"),
            camera=numbers(self.camera),
            stereo=numbers(self.stereo),
            landmarks=numbers(self.landmarks),
            odometry=numbers(self.odometry),
            visual=numbers(self.visual),
            mapping=numbers(self.mapping, "params"),
            library=library_numbers(self.library),
            footing=numbers(self.robot.footing),
            limits=Limits(
                goal_radius=jnp.float32(limits.goal_radius),
                max_decisions=jnp.int32(limits.max_decisions),
                max_looks=jnp.int32(limits.max_looks),
                edge_tolerance=jnp.float32(limits.edge_tolerance),
                height_tolerance=jnp.float32(limits.height_tolerance),
                body_radius=jnp.float32(self.robot.body_radius),
                rise=jnp.float32(GridSpec().level_height),
                start_variance=jnp.array([sd**2, sd**2, sd_yaw**2], jnp.float32),
            ),
        )


@functools.lru_cache(maxsize=256)
def numbers(config: Model, form: str = "traced"):
    """The traced form of a part of a config, made once for all the points of a sweep that share the part."""
    return getattr(config, form)()


@functools.lru_cache(maxsize=8)
def library_numbers(path: Path | None) -> Library:
    """The same of a library file."""
    return load_library(path).traced()


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Limits:
    """`LimitConfig`, traced, and the radius of the body that collides."""

    goal_radius: Float[Array, "*B"]  # [m]
    max_decisions: Int[Array, "*B"]
    max_looks: Int[Array, "*B"]
    edge_tolerance: Float[Array, "*B"]  # [m]
    height_tolerance: Float[Array, "*B"]  # [m]
    body_radius: Float[Array, "*B"]  # [m]
    rise: Float[Array, "*B"]  # [m] that a step up or down goes: one level
    start_variance: Float[Array, "*B 3"]  # [m2, m2, rad2]


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class Settings:
    """Every number that a sweep may change. All leaves are traced, scalars or with a leading batch axis."""

    strategy: Strategy
    costs: Costs
    durations: Durations
    body: Body
    camera: Camera
    stereo: StereoNoise
    landmarks: LandmarkNoise
    odometry: OdometryNoise
    visual: VisualNoise
    mapping: MapParams
    library: Library
    footing: Footing
    limits: Limits


@dataclass(frozen=True)
class Program:
    """What sets array shapes and code paths: a mission program is compiled once for each of these. Hashable."""

    spec: GridSpec
    image: ImageSpec
    sensor: str
    executor: str
    footing: bool = False  # feet are placed by measured edges; else by cells alone
    planner: str = "cell"  # "heading": over cells and headings, by time
    localisation: str = "landmarks"
    fading: bool = False  # the map forgets what has moved


def program(config: MissionConfig, size_xy: tuple[float, float], terrain: HeightField | None = None) -> Program:
    """The static part of a config for arenas of one size [m], and with such terrain, whose heights are concrete."""
    heights = (0.0, 0.0) if terrain is None else height_range(terrain)
    footing = config.executor != "kinematic" if config.foot_placement is None else config.foot_placement
    return Program(
        config.grid(size_xy, heights),
        config.camera.image,
        config.sensor,
        config.executor,
        footing,
        config.planner,
        localisation="landmarks" if config.sensor == "oracle" else config.localisation,
        fading=config.mapping.fade is not None,
    )
