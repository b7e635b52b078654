"""Poses in the plane, upright boxes and height fields, and ray casting."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "boxes": "Boxes ceiling_height covers footprint_extent ground_height plan_distance",
        "height_field": "HeightField cast_rays on_field surface_height",
        "pose": "Pose to_robot to_world wrap_angle",
        "rays": "cast_boxes",
    },
)
