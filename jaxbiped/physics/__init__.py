"""Batches of simulations of any MJCF, in MuJoCo's own batch or in MJX, behind one protocol."""

from jaxbiped.physics.backend import WARNINGS, Backend, Rollout, State, explain
from jaxbiped.physics.make import BACKENDS, make

__all__ = ["BACKENDS", "WARNINGS", "Backend", "Rollout", "State", "explain", "make"]
