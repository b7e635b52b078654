"""The closed loop: sense, localise, map, plan, select, execute, until each mission has ended."""

from jaxbiped.mission.decision import decide
from jaxbiped.mission.executors import EXECUTORS, Execution, Executor, kinematic
from jaxbiped.mission.log import MissionLog
from jaxbiped.mission.oracle import OraclePlan, oracle_plan
from jaxbiped.mission.outcome import Code
from jaxbiped.mission.queue import Jobs, Result, Tally, compile_queue, stack
from jaxbiped.mission.settings import MissionConfig, Program, Settings, program
from jaxbiped.mission.state import Mind, World, start
from jaxbiped.mission.stepped import Mission, run_logged
from jaxbiped.mission.strategies import STRATEGIES, Strategy, find_strategy

__all__ = [
    "EXECUTORS",
    "STRATEGIES",
    "Code",
    "Execution",
    "Executor",
    "Jobs",
    "Mind",
    "Mission",
    "MissionConfig",
    "MissionLog",
    "OraclePlan",
    "Program",
    "Result",
    "Settings",
    "Strategy",
    "Tally",
    "World",
    "compile_queue",
    "decide",
    "find_strategy",
    "kinematic",
    "oracle_plan",
    "program",
    "run_logged",
    "stack",
    "start",
]
