"""The options of a mission: the config for users. `mission.params` has its traced form, and loads JAX."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import pydantic

from jaxbiped.config import Model
from jaxbiped.core.names import SIMULATED as SIMULATED
from jaxbiped.core.registry import EXECUTORS as EXECUTORS_OWN
from jaxbiped.core.registry import SENSORS as SENSORS_OWN
from jaxbiped.core.registry import known_name
from jaxbiped.executors.config import WalkConfig as WalkConfig
from jaxbiped.mapping.config import MapConfig
from jaxbiped.mission.defaults import BELOW_POINTS as BELOW_POINTS
from jaxbiped.mission.defaults import SWAYING as SWAYING
from jaxbiped.mission.defaults import with_defaults
from jaxbiped.motion.config import HEIGHT_TOLERANCE, DurationConfig, RobotConfig
from jaxbiped.sensing.config import CameraConfig, LandmarkConfig, NoiseConfig, OdometryConfig, VisualConfig
from jaxbiped.sensing.presets import PRESETS, sensor_preset

if TYPE_CHECKING:
    from jaxbiped.mapping.grid import GridSpec
    from jaxbiped.mission.params import MissionParams
    from jaxbiped.mission.strategies import Strategy
    from jaxbiped.planning.costs import Costs

# [m] largest radius of a body in a sweep; static, since it sets how many cells the map visits around each
MAX_RADIUS = 0.15
HEADROOM = 12  # levels that a map holds above the highest ground: those within a standing robot of 38.5 cm
RENDERED = ("stereo",)  # sensors that measure on the host
SENSORS, EXECUTORS = ("raycast", "oracle", *RENDERED), ("kinematic", "sampled", *SIMULATED)  # built-in ones
VISUAL = ("visual", "both")  # localisations that measure motion between two views
ICP = ("icp", "both")  # those that measure the pose from previously measured walls


def known_sensor(name: str) -> str:
    """A registered name, or `package.module:name`, from which nothing is imported here."""
    return known_name(name, SENSORS, SENSORS_OWN, "sensor")


def known_executor(name: str) -> str:
    """The same for an executor."""
    return known_name(name, EXECUTORS, EXECUTORS_OWN, "executor")


SensorName = Annotated[str, pydantic.AfterValidator(known_sensor)]
ExecutorName = Annotated[str, pydantic.AfterValidator(known_executor)]

# Bounded so that differences between sums of costs along a path survive in single precision.
Cost = Annotated[float, pydantic.Field(ge=0.0, le=1e4)]


class CostConfig(Model):
    """Costs of Eq. (1) on a pitch of 5 cm; the paper's values (3.1). For other pitches see
    `planning.Costs.at_pitch`."""

    c0: Annotated[float, pydantic.Field(ge=0.1, le=1e3)] = 1.0
    """Distance, per cell. Never zero: each cell of a path must come nearer to the goal."""
    c1: Cost = 1.0
    """Floor to floor."""
    c2: Cost = 5.0
    """Through a gate, squatting."""
    c3: Cost = 10.0
    """Up or down one step."""
    c4: Cost = 100.0
    """Into an unmeasured cell."""

    def traced(self) -> Costs:
        """The same as arrays."""
        import jax.numpy as jnp

        from jaxbiped.planning.costs import Costs

        return Costs(**{name: jnp.float32(value) for name, value in self.model_dump().items()})


class LimitConfig(Model):
    """Conditions that end a mission."""

    goal_radius: Annotated[float, pydantic.Field(gt=0.0, le=1.0)] = 0.10
    """[m] The goal is reached within this distance (paper, 3.1)."""
    max_decisions: Annotated[int, pydantic.Field(ge=1, le=100_000)] = 150
    """Decisions after which a mission ends as out of steps."""
    max_looks: Annotated[int, pydantic.Field(ge=1, le=100_000)] = 4
    """Successive measurements without a path, a quarter turn apart, after which the robot gives up: once around."""
    edge_tolerance: Annotated[float, pydantic.Field(ge=0.0, le=0.1)] = 0.02
    """[m] Largest error of an edge's position under the robot without a fall; simulated bipeds fell from 0.025 on."""
    height_tolerance: Annotated[float, pydantic.Field(ge=0.0, le=0.1)] = HEIGHT_TOLERANCE
    """[m] Largest error of the ground's height after a step; simulated bipeds tolerated -12 to +8 mm."""
    start_sd: tuple[float, float] = (0.002, 0.005)
    """[m, rad] Standard deviations of the initial pose."""


class MissionConfig(Model):
    """One kind of mission. Every default is the paper's value, unless stated otherwise."""

    sensor: SensorName = "raycast"
    """The robot's sensor: raycast (noisy rays), oracle (the truth), stereo, or package.module:name. Rays have the
    noise of a stereo camera; the pictures of `stereo` are rendered and matched on the host."""
    preset: str = "rendered"
    """How well the camera measures: ideal, rendered, real, or a sensor file (.toml). It is the default of each number
    of `stereo` and `landmarks`. A file, as `jaxbiped fit-sensor` writes it, may say how many rays the camera has, too.
    What is given beside it wins; the rays need only divide the camera's size as it then is."""
    executor: ExecutorName = "kinematic"
    """How it moves: kinematic (exactly), sampled (as simulated bipeds did), native or mjx (simulated), or
    package.module:name. What simulated bipeds did is in `library`; `native` is MuJoCo's own batch."""
    localisation: Literal["landmarks", "odometry", "visual", "icp", "both"] = "landmarks"
    """What corrects dead reckoning: landmarks, odometry (nothing), visual (the motion that two views tell), icp (walls
    measured before), or both (the last two). The paper has the first alone; without landmarks there are none
    in the arena. The sensor `oracle` knows the pose."""
    pitch: Annotated[float, pydantic.Field(gt=0.0, le=1.0)] = 0.05
    """[m] of the 2D grid, and of the 3D grid in plan (paper, 3.1)."""
    corner_cutting: bool = False
    """May a diagonal move pass one blocked cell?"""
    planner: Literal["cell", "heading"] = "cell"
    """What is planned: the cell path of least cost by Eq. 1 (the paper's), or the heading path, of the least time over
    cells and headings, turns counted. Of the costs, C4 alone still counts for `heading`."""
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
    def _fill_in(cls, data: Any) -> Any:
        return with_defaults(data) if isinstance(data, dict) else data

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
        from jaxbiped.mapping.grid import MOST_GROUNDS, GridSpec

        spec = GridSpec(size_x=size_xy[0], size_y=size_xy[1], pitch=self.pitch, max_radius=MAX_RADIUS)
        low, high = (round(height / spec.level_height) for height in heights)
        grounds = min(max(spec.ground_levels, high + 1), MOST_GROUNDS)
        lowest = max(min(spec.lowest, low - 1), -8)
        above = max(spec.levels + spec.lowest, min(grounds + HEADROOM, 32))
        return replace(spec, lowest=lowest, levels=above - lowest, ground_levels=grounds)

    def params(self, strategy: str | Strategy) -> MissionParams:
        """The traced part, for one strategy or the one of a name."""
        from jaxbiped.mission.params import mission_params

        return mission_params(self, strategy)

    settings = params  # its former name, which scripts may use
