"""Code shared by all rooms."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(__name__, {})
