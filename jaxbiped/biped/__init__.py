"""The robot in simulation: its model, kinematics, the ZMP gait, optimisation, and verification of its primitives."""

from jaxbiped.core.lazy_loading import lazy_package

lazy_package(__name__, {})
