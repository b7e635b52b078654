"""Other people's files."""

from jaxbiped.formats.elevation import Elevation, load_elevation, save_elevation

__all__ = ["Elevation", "load_elevation", "save_elevation"]
