"""Planning over (cell, heading) with the durations of the primitives: the time-optimal path, including turns."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "edge_direction": "crossing_faces",
        "field": "HeadingField heading_field",
        "path": "heading_path path_time",
        "times": "Moves Times heading_moves",
    },
)
