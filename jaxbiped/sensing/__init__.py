"""What the robot measures: points, landmarks, its own motion, and from these its pose.

Functions are written for one arena; the mission maps them.
"""

from jaxbiped.sensing.camera import Camera, CameraConfig, ImageSpec
from jaxbiped.sensing.landmarks import LandmarkConfig, LandmarkNoise
from jaxbiped.sensing.landmarks import sight as sight_landmarks
from jaxbiped.sensing.localisation import Belief, correct, known, predict
from jaxbiped.sensing.motion import VisualConfig, VisualNoise
from jaxbiped.sensing.noise import NoiseConfig, StereoNoise
from jaxbiped.sensing.odometry import OdometryConfig, OdometryNoise, drift
from jaxbiped.sensing.oracle import measure as measure_oracle
from jaxbiped.sensing.presets import PRESETS, SensorConfig, sensor_preset
from jaxbiped.sensing.raycast import measure as measure_raycast
from jaxbiped.sensing.sensor import Sensor
from jaxbiped.sensing.view import Motion, Sightings, View

__all__ = [
    "PRESETS",
    "Belief",
    "Camera",
    "CameraConfig",
    "ImageSpec",
    "LandmarkConfig",
    "LandmarkNoise",
    "Motion",
    "NoiseConfig",
    "OdometryConfig",
    "OdometryNoise",
    "Sensor",
    "SensorConfig",
    "Sightings",
    "StereoNoise",
    "View",
    "VisualConfig",
    "VisualNoise",
    "correct",
    "drift",
    "known",
    "measure_oracle",
    "measure_raycast",
    "predict",
    "sensor_preset",
    "sight_landmarks",
]
