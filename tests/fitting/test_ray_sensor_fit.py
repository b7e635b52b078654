"""With how many rays the ray-cast sensor is fitted to a stereo camera."""

import numpy as np
import pytest

from jaxbiped.fitting import ray_sensor_fit
from jaxbiped.fitting.ray_sensor_fit import choices, fewest_rays
from jaxbiped.fitting.sensor_agreement import Place
from jaxbiped.mission.params import MissionConfig
from jaxbiped.mission.sensor_rig import StereoRig
from jaxbiped.sensing.config import CameraConfig

CAMERA = CameraConfig()


def test_fewest_rays_come_first_and_divide_the_picture():
    found = [(rays.columns, rays.rows) for rays in choices(CAMERA)]
    assert found == [(64, 48), (64, 64), (128, 96), (128, 128), (256, 192)]
    assert all(CAMERA.width % columns == CAMERA.height % rows == 0 for columns, rows in found)


def test_numbers_of_rays_that_do_not_divide_the_picture_are_left_out():
    larger = CameraConfig(width=640, height=480)
    assert [(rays.columns, rays.rows) for rays in choices(larger)] == [(64, 48), (128, 96)]


@pytest.mark.parametrize(
    ("wrong", "wanted"),  # cells of 1,000 that differ with each number of rays
    [((90, 60, 30, 24, 20), (128, 128)), ((10, 5, 5, 5, 5), (64, 48)), ((90, 80, 70, 60, 50), (256, 192))],
)
def test_as_few_rays_as_come_close_enough_and_else_the_most(monkeypatch, wrong, wanted):
    """Maps of a pretended sensor differ from those of rendered pairs in a known number of cells."""
    differ = dict(zip([(rays.columns, rays.rows) for rays in choices(CAMERA)], wrong, strict=True))

    def pretend(_, look, config):
        count = 0 if config.sensor == "stereo" else differ[config.camera.columns, config.camera.rows]
        return np.where(np.arange(1000).reshape(25, 40) < count, 4, 1).astype(np.int8), None

    monkeypatch.setattr(ray_sensor_fit, "fused", pretend)
    monkeypatch.setattr(ray_sensor_fit, "looking", lambda config, rig: None)
    places, rig = [object.__new__(Place)] * 2, object.__new__(StereoRig)  # nobody looks at these
    rays, same = fewest_rays(places, rig, MissionConfig(sensor="stereo"))
    assert (rays.columns, rays.rows) == wanted and same == pytest.approx(1 - differ[wanted] / 1000)
