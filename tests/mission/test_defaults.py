"""Defaults that other fields decide: the same in Python as in a table, and never over what was given."""

import pytest

from jaxbiped.mission.config import MissionConfig
from jaxbiped.mission.defaults import BELOW_POINTS, BY_CHOICE, DECIDING, SWAYING
from jaxbiped.motion.config import RobotConfig
from jaxbiped.sensing.config import CameraConfig, NoiseConfig
from jaxbiped.sensing.presets import PRESETS


@pytest.mark.parametrize("choice", BY_CHOICE)
def test_what_is_declared_is_a_field_and_a_choice(choice):
    known = MissionConfig().model_dump()
    for value, fields in BY_CHOICE[choice].items():
        mission = MissionConfig(**{choice: value or "package.module:name"})
        for field, default in fields.items():
            part, name = field.split(".")
            assert name in known[part] and getattr(getattr(mission, part), name) == default
    assert choice in DECIDING


def test_a_part_made_in_python_counts_as_its_fields_that_were_set():
    for robot in ({"standing": 0.39}, RobotConfig(standing=0.39)):
        for executor, radius in (("kinematic", 0.10), ("sampled", SWAYING), ("native", SWAYING)):
            mission = MissionConfig(executor=executor, robot=robot)
            assert (mission.robot.radius, mission.robot.standing) == (radius, 0.39)
    assert MissionConfig(executor="native", robot=RobotConfig(radius=0.10)).robot.radius == 0.10
    assert MissionConfig(preset="real", stereo=NoiseConfig(sd=0.5)).stereo == PRESETS["real"].stereo.model_copy(
        update={"sd": 0.5}
    )
    assert MissionConfig(camera=CameraConfig(width=640)).camera == CameraConfig(width=640)


def test_defaults_by_sensor_and_by_limits():
    assert MissionConfig(sensor="stereo").mapping.below_points == BELOW_POINTS
    assert MissionConfig(sensor="stereo", mapping={"below_points": 3.0}).mapping.below_points == 3.0
    mission = MissionConfig(limits={"height_tolerance": 0.02})
    assert mission.robot.height_tolerance == 0.02
    assert MissionConfig(limits=mission.limits, robot={"height_tolerance": 0.01}).robot.height_tolerance == 0.01


def test_what_is_resolved_stays_as_it_is():
    mission = MissionConfig(executor="native", sensor="stereo", preset="real", robot={"radius": 0.11})
    assert MissionConfig.model_validate(mission.model_dump()) == mission
    assert MissionConfig.model_validate(mission) is mission


@pytest.mark.parametrize("wrong", [{"executor": ["native"]}, {"robot": 3}, {"preset": 3}, {"stereo": "good"}])
def test_what_is_wrong_is_said_of_the_field(wrong):
    (name,) = wrong
    with pytest.raises(ValueError, match=name):
        MissionConfig(**wrong)
