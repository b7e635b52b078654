"""The world: arenas, random families, and scenes written by hand."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(
    __name__,
    {
        "arena": "CIRCLE SQUARE Arena Landmarks",
        "config": "PopulationConfig",
        "families": "FAMILIES KNOWN MOVING sample",
        "moving_boxes": "Movers at_time only",
        "population": "Population",
        "scene": "SceneConfig load_scene scene_warnings to_arena",
    },
)
