"""A real stereo camera: rectified pairs to disparity, and to points."""

from jaxbiped.sensing.stereo.calibration import StereoCamera, ideal
from jaxbiped.sensing.stereo.matching import Disparity, MatchParams, match
from jaxbiped.sensing.stereo.points import Points, to_points

__all__ = ["Disparity", "MatchParams", "Points", "StereoCamera", "ideal", "match", "to_points"]
