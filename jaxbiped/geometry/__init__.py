"""Poses in the plane, upright boxes and height fields, and rays that meet them."""

from jaxbiped.geometry.boxes import Boxes, ceiling_height, covers, footprint_extent, ground_height, plan_distance
from jaxbiped.geometry.height_field import HeightField, cast_rays, on_field, surface_height
from jaxbiped.geometry.pose import Pose, to_robot, to_world, wrap_angle
from jaxbiped.geometry.rays import cast_boxes

__all__ = [
    "Boxes",
    "HeightField",
    "Pose",
    "cast_boxes",
    "cast_rays",
    "ceiling_height",
    "covers",
    "footprint_extent",
    "ground_height",
    "on_field",
    "plan_distance",
    "surface_height",
    "to_robot",
    "to_world",
    "wrap_angle",
]
