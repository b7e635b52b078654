"""The static part of missions in arenas of one kind, rejected if a component does not support their terrain."""

from __future__ import annotations

from jaxbiped.arenas.ground import WITH_TERRAIN, no_terrain_for
from jaxbiped.executors.execution import find_executor
from jaxbiped.geometry.height_field import HeightField
from jaxbiped.mission.params import MissionConfig, MissionSpec, mission_spec
from jaxbiped.mission.sensors import find_sensor


def checked_spec(config: MissionConfig, size_xy: tuple[float, float], terrain: HeightField | None) -> MissionSpec:
    """See `params.mission_spec`.

    Raises:
      InputError: a pitch that does not divide the size [m]; terrain that the sensor or the executor does not support.
    """
    for kind, choice in (("sensor", config.sensor), ("executor", config.executor)):
        if terrain is not None and not (choice in WITH_TERRAIN[kind] or knows_terrain(kind, choice)):
            raise no_terrain_for(f"{kind} {choice}")
    return mission_spec(config, size_xy, terrain)


def knows_terrain(kind: str, name: str) -> bool:
    """Whether a user's sensor or executor supports terrain."""
    component = find_sensor(name) if kind == "sensor" else find_executor(name)
    return component is not None and component.on_terrain
