"""Planning over (cell, heading) with the times of the primitives: the time-optimal way, turns included."""

from jaxbiped.planning.heading.crossing import crossing_faces
from jaxbiped.planning.heading.field import HeadingField, heading_field
from jaxbiped.planning.heading.path import heading_path, path_time
from jaxbiped.planning.heading.times import Moves, Times, heading_moves

__all__ = [
    "HeadingField",
    "Moves",
    "Times",
    "crossing_faces",
    "heading_field",
    "heading_moves",
    "heading_path",
    "path_time",
]
