"""The world: arenas, random families, and scenes written by hand."""

from jaxbiped.arenas.arena import CIRCLE, SQUARE, Arena, Landmarks
from jaxbiped.arenas.families import FAMILIES, sample
from jaxbiped.arenas.population import Population, PopulationConfig
from jaxbiped.arenas.scene import SceneConfig, load_scene, to_arena

__all__ = [
    "CIRCLE",
    "FAMILIES",
    "SQUARE",
    "Arena",
    "Landmarks",
    "Population",
    "PopulationConfig",
    "SceneConfig",
    "load_scene",
    "sample",
    "to_arena",
]
