"""Batch evaluation, in JAX, of grid-map motion planning for legged robots.

Built in is the method of Yamashita, Kitaoka and Kaneko, "Motion Planning of Biped Robot Equipped with Stereo Camera
Using Grid Map" (2011), called "the paper" in every docstring of this package. The names below are what sweep scripts
need; each is loaded when it is first used. The rooms follow the paper's Fig. 2: arenas, sensing, mapping,
localisation, planning, motion, mission; then statistics, study and report. A room uses the rooms before it, never
those after it.
"""

from jaxbiped.core.lazy_loading import lazy_package

__version__ = "0.1.0"

lazy_package(
    __name__,
    {
        "api.study": "RandomArenas Scenes Study",
        "api.registration": "register",
        "api.single_mission": "PlayedMission play",
        "api.run": "evaluate load sweep",
        "api.results": "Results",
        "api.stored": "compare",
        "api.map_plan": "plan",
        "arenas.arena": "Arena",
        "arenas.config": "PopulationConfig",
        "arenas.make": "make_arena",
        "arenas.scene": "BoxConfig:Box SceneConfig:Scene to_arena",
        "arenas.source": "Family",
        "errors": "InputError",
        "core.class_grid": "ClassGrid",
        "mapping.grid": "Cell",
        "mission.config": "CostConfig MissionConfig",
        "mission.metric": "Metric",
        "executors.execution": "Execution Executor",
        "executors.built_in": "Kinematic Sampled",
        "mission.host_sensor": "HostSensor",
        "mission.outcome": "Code",
        "mission.sensors": "Oracle RayCast Sensor",
        "mission.strategies": "Strategy",
        "motion.config": "DurationConfig RobotConfig",
        "planning.costs": "DIRECTIONS Costs Rules",
        "planning.host_planner": "HostPlanner",
        "planning.planners": "GridPlanner HeadingPlanner Planner Problem Route StraightLine",
        "planning.ways": "cells_along free_cells",
        "sensing.view": "View",
    },
    modules="arenas geometry mapping mission motion physics planning report sensing study testing",
)
