"""The public names for type checkers; `__init__.py` loads them when they are used. A test compares the two."""

from jaxbiped import arenas as arenas
from jaxbiped import geometry as geometry
from jaxbiped import mapping as mapping
from jaxbiped import mission as mission
from jaxbiped import motion as motion
from jaxbiped import physics as physics
from jaxbiped import planning as planning
from jaxbiped import report as report
from jaxbiped import sensing as sensing
from jaxbiped import study as study
from jaxbiped import testing as testing
from jaxbiped.api.map_plan import plan as plan
from jaxbiped.api.registration import register as register
from jaxbiped.api.results import Results as Results
from jaxbiped.api.run import evaluate as evaluate
from jaxbiped.api.run import load as load
from jaxbiped.api.run import sweep as sweep
from jaxbiped.api.single_mission import PlayedMission as PlayedMission
from jaxbiped.api.single_mission import play as play
from jaxbiped.api.stored import compare as compare
from jaxbiped.api.study import RandomArenas as RandomArenas
from jaxbiped.api.study import Scenes as Scenes
from jaxbiped.api.study import Study as Study
from jaxbiped.arenas.arena import Arena as Arena
from jaxbiped.arenas.config import PopulationConfig as PopulationConfig
from jaxbiped.arenas.make import make_arena as make_arena
from jaxbiped.arenas.scene import BoxConfig as _BoxConfig
from jaxbiped.arenas.scene import SceneConfig as _SceneConfig
from jaxbiped.arenas.scene import to_arena as to_arena
from jaxbiped.arenas.source import Family as Family
from jaxbiped.core.class_grid import ClassGrid as ClassGrid
from jaxbiped.errors import InputError as InputError
from jaxbiped.executors.built_in import Kinematic as Kinematic
from jaxbiped.executors.built_in import Sampled as Sampled
from jaxbiped.executors.execution import Execution as Execution
from jaxbiped.executors.execution import Executor as Executor
from jaxbiped.mapping.grid import Cell as Cell
from jaxbiped.mission.config import CostConfig as CostConfig
from jaxbiped.mission.config import MissionConfig as MissionConfig
from jaxbiped.mission.host_sensor import HostSensor as HostSensor
from jaxbiped.mission.metric import Metric as Metric
from jaxbiped.mission.outcome import Code as Code
from jaxbiped.mission.sensors import Oracle as Oracle
from jaxbiped.mission.sensors import RayCast as RayCast
from jaxbiped.mission.sensors import Sensor as Sensor
from jaxbiped.mission.strategies import Strategy as Strategy
from jaxbiped.motion.config import DurationConfig as DurationConfig
from jaxbiped.motion.config import RobotConfig as RobotConfig
from jaxbiped.planning.costs import DIRECTIONS as DIRECTIONS
from jaxbiped.planning.costs import Costs as Costs
from jaxbiped.planning.costs import Rules as Rules
from jaxbiped.planning.host_planner import HostPlanner as HostPlanner
from jaxbiped.planning.planners import GridPlanner as GridPlanner
from jaxbiped.planning.planners import HeadingPlanner as HeadingPlanner
from jaxbiped.planning.planners import Planner as Planner
from jaxbiped.planning.planners import Problem as Problem
from jaxbiped.planning.planners import Route as Route
from jaxbiped.planning.planners import StraightLine as StraightLine
from jaxbiped.planning.ways import cells_along as cells_along
from jaxbiped.planning.ways import free_cells as free_cells
from jaxbiped.sensing.view import View as View

Box = _BoxConfig
Scene = _SceneConfig
__version__: str
__all__: list[str]
