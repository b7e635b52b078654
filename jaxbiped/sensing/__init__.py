"""The robot's measurements: points, landmarks and its own motion.

Functions are written for one arena; the mission maps them.
"""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "camera": "Camera ImageSpec",
        "config": "CameraConfig LandmarkConfig NoiseConfig OdometryConfig VisualConfig",
        "landmarks": "LandmarkNoise sight:sight_landmarks",
        "motion": "VisualNoise",
        "noise": "StereoNoise",
        "odometry": "OdometryNoise drift",
        "oracle": "measure:measure_oracle",
        "presets": "PRESETS SensorConfig sensor_preset",
        "raycast": "measure:measure_raycast",
        "sensor": "Sensor",
        "view": "Motion Sightings View",
    },
)
