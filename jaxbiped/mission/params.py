"""Everything that a mission depends on besides its arena: the traced form of the config."""

from __future__ import annotations

import functools
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jax
import jax.numpy as jnp

from jaxbiped.config import Model
from jaxbiped.core.component import traced_component as traced_component
from jaxbiped.errors import InputError
from jaxbiped.executors.execution import find_executor
from jaxbiped.executors.motion_library import Library, load_library
from jaxbiped.executors.params import Limits as Limits
from jaxbiped.geometry.height_field import HeightField, height_range
from jaxbiped.mapping import Body, GridSpec, MapParams
from jaxbiped.mission.config import BELOW_POINTS as BELOW_POINTS
from jaxbiped.mission.config import ICP as ICP
from jaxbiped.mission.config import MAX_RADIUS as MAX_RADIUS
from jaxbiped.mission.config import SIMULATED as SIMULATED
from jaxbiped.mission.config import SWAYING as SWAYING
from jaxbiped.mission.config import VISUAL as VISUAL
from jaxbiped.mission.config import CostConfig as CostConfig
from jaxbiped.mission.config import LimitConfig as LimitConfig
from jaxbiped.mission.config import MissionConfig as MissionConfig
from jaxbiped.mission.metric import Metric
from jaxbiped.mission.sensors import find_sensor
from jaxbiped.mission.strategies import Strategy, StrategyFlags, find_strategy
from jaxbiped.motion.primitives import Durations
from jaxbiped.motion.robot import Footing
from jaxbiped.planning import Costs
from jaxbiped.planning.planners import GridPlanner, HeadingPlanner, Planner
from jaxbiped.sensing.camera import Camera, ImageSpec
from jaxbiped.sensing.landmarks import LandmarkNoise
from jaxbiped.sensing.motion import VisualNoise
from jaxbiped.sensing.noise import StereoNoise
from jaxbiped.sensing.odometry import OdometryNoise


@jax.tree_util.register_dataclass
@dataclass(frozen=True)
class MissionParams:
    """Every number that a sweep may change. All leaves are traced, scalars or with a leading batch axis."""

    strategy: StrategyFlags
    planner: Planner
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
    metrics: tuple[Metric, ...] = ()  # additional columns of rows
    sensor: Any = None  # `Sensor`; None: on the host
    executor: Any = None  # `Executor`; None: a simulated biped


@dataclass(frozen=True)
class MissionSpec:
    """What determines array shapes and code paths: one mission program is compiled for each of these. Hashable."""

    grid: GridSpec
    image: ImageSpec
    sensor: str
    executor: str
    footing: bool = False  # whether feet are placed by measured edges; else by cells only
    localisation: str = "landmarks"
    fading: bool = False  # whether the map forgets what has moved
    knows_pose: bool = False  # whether the robot does, and its points have no attitude error to remove

    @property
    def spec(self) -> GridSpec:
        """`grid` by its former name, which sensors may read."""
        return self.grid


def mission_spec(
    config: MissionConfig, size_xy: tuple[float, float], terrain: HeightField | None = None
) -> MissionSpec:
    """The static part of a config for arenas of one size [m] with such terrain, whose heights are concrete.

    Raises:
      InputError: a pitch that does not divide the size, or wall matching with a sensor without pictures.
    """
    heights = (0.0, 0.0) if terrain is None else height_range(terrain)
    sensor, executor = find_sensor(config.sensor), find_executor(config.executor)
    places_feet = True if executor is None else executor.places_feet
    footing = places_feet if config.foot_placement is None else config.foot_placement
    knows_pose = sensor is not None and sensor.knows_pose
    if config.localisation in ICP and not (sensor is None or sensor.is_picture or knows_pose):
        raise InputError(
            f"needs a picture, and {config.sensor} measures none", field="localisation", value=config.localisation
        )
    return MissionSpec(
        config.grid(size_xy, heights),
        config.camera.image,
        config.sensor,
        config.executor,
        footing,
        localisation="landmarks" if knows_pose else config.localisation,
        fading=config.mapping.fade is not None,
        knows_pose=knows_pose,
    )


PLANNERS = {"cell": GridPlanner(), "heading": HeadingPlanner()}  # for strategies without their own


def mission_params(config: MissionConfig, strategy: str | Strategy) -> MissionParams:
    """The traced form of a config, for one strategy, given as object or by name."""
    limits = config.limits
    sd, sd_yaw = limits.start_sd
    strategy = find_strategy(strategy) if isinstance(strategy, str) else strategy
    return MissionParams(
        strategy=strategy.flags(config.corner_cutting),
        planner=PLANNERS[config.planner] if strategy.planner is None else traced_component(strategy.planner),
        costs=numbers(config.costs),
        durations=numbers(config.durations),
        body=numbers(config.robot, "body"),
        camera=numbers(config.camera),
        stereo=numbers(config.stereo),
        landmarks=numbers(config.landmarks),
        odometry=numbers(config.odometry),
        visual=numbers(config.visual),
        mapping=numbers(config.mapping, "params"),
        library=library_numbers(config.library),
        footing=numbers(config.robot.footing),
        limits=Limits(
            goal_radius=jnp.float32(limits.goal_radius),
            max_decisions=jnp.int32(limits.max_decisions),
            max_looks=jnp.int32(limits.max_looks),
            edge_tolerance=jnp.float32(limits.edge_tolerance),
            height_tolerance=jnp.float32(limits.height_tolerance),
            body_radius=jnp.float32(config.robot.body_radius),
            rise=jnp.float32(GridSpec().level_height),
            start_variance=jnp.array([sd**2, sd**2, sd_yaw**2], jnp.float32),
        ),
        sensor=traced_component(find_sensor(config.sensor)),
        executor=traced_component(find_executor(config.executor)),
    )


@functools.lru_cache(maxsize=256)
def numbers(config: Model, form: str = "traced"):
    """The traced form of a part of a config, made once for all points of a sweep that share the part."""
    return getattr(config, form)()


@functools.lru_cache(maxsize=8)
def library_numbers(path: Path | None) -> Library:
    """The same for a library file."""
    return load_library(path).traced()
