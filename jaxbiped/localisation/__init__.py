"""The robot's believed pose: the extended Kalman filter, and scan matching."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(__name__, {"kalman_filter": "Belief correct known predict"})
