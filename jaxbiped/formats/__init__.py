"""Other people's files."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(__name__, {"elevation": "Elevation load_elevation save_elevation"})
