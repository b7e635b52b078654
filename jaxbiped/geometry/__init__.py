"""Poses in the plane, upright boxes, and rays that meet them."""

from jaxbiped.geometry.boxes import Boxes, ceiling_height, covers, footprint_extent, ground_height, plan_distance
from jaxbiped.geometry.pose import Pose, to_robot, to_world, wrap_angle
from jaxbiped.geometry.rays import cast_boxes

__all__ = [
    "Boxes",
    "Pose",
    "cast_boxes",
    "ceiling_height",
    "covers",
    "footprint_extent",
    "ground_height",
    "plan_distance",
    "to_robot",
    "to_world",
    "wrap_angle",
]
