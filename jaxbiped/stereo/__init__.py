"""A real stereo camera: rectified pairs to disparity, and to points."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "calibration": "StereoCamera ideal",
        "matching": "Disparity MatchParams match",
        "points": "Points to_points",
    },
)
