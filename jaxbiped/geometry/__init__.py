"""Poses in the plane, upright boxes, and rays that meet them."""

from jaxbiped.core.lazy_package import lazy_package

lazy_package(
    __name__,
    {
        "boxes": "Boxes ceiling_height covers footprint_extent ground_height plan_distance",
        "pose": "Pose to_robot to_world wrap_angle",
        "rays": "cast_boxes",
    },
)
