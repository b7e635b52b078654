"""The world: arenas, random families, and scenes written by hand."""

from jaxbiped.arenas.arena import CIRCLE, SQUARE, Arena, Landmarks
from jaxbiped.arenas.families import FAMILIES, KNOWN, MOVING, sample
from jaxbiped.arenas.movers import Movers, at_time, only
from jaxbiped.arenas.population import Population, PopulationConfig
from jaxbiped.arenas.scene import SceneConfig, load_scene, scene_warnings, to_arena

__all__ = [
    "CIRCLE",
    "FAMILIES",
    "KNOWN",
    "MOVING",
    "SQUARE",
    "Arena",
    "Landmarks",
    "Movers",
    "Population",
    "PopulationConfig",
    "SceneConfig",
    "at_time",
    "load_scene",
    "only",
    "sample",
    "scene_warnings",
    "to_arena",
]
