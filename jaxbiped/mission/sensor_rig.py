"""Sensors that run on the host, for missions that are stepped there: each robot's view, measured one by one."""

from __future__ import annotations

from dataclasses import replace
from typing import Protocol, runtime_checkable

import jax
import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, UInt32

from jaxbiped.executors.world_state import BodyPose, WorldState
from jaxbiped.geometry.pose import Pose
from jaxbiped.mission.config import RENDERED as RENDERED
from jaxbiped.mission.mission_step import SENSE
from jaxbiped.mission.params import VISUAL, MissionConfig, MissionParams
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import AgentState
from jaxbiped.sensing.camera import Mount, mount, placed
from jaxbiped.sensing.config import CameraConfig
from jaxbiped.sensing.counter_rng import fold
from jaxbiped.sensing.noise import attitude_error
from jaxbiped.sensing.shot import Shot
from jaxbiped.sensing.view import Sightings, View


@runtime_checkable
class SensorRig(Protocol):
    """The sensor of robots that are stepped on the host."""

    def see(
        self,
        world: WorldState,
        agent: AgentState,
        setup: MissionSetup,
        body_pose: BodyPose | None = None,
        count: int | None = None,
    ) -> tuple[View, Sightings]:
        """The measurement of each robot of a batch, as in `mission_step.sense`: the same places, attitudes and seeds.

        Args:
          body_pose: [B] true pose of each robot's body; None: upright, except for a random tilt.
          count: rows from this one on are padding, and may get any value.
        """
        ...

    def picture(self) -> Shot | None:
        """The picture of the last measurement; None if there is none."""
        ...


class StereoRig:
    """The sensor `stereo` for the robots of one process; to be used, and closed, in the thread that created it."""

    def __init__(self, camera: CameraConfig, localisation: str = "landmarks"):
        """
        Args:
          localisation: how robots localise; arenas have landmarks only if it uses them.

        Raises:
          InputError: nothing can be rendered on this machine.
        """
        from jaxbiped.stereo.measure import StereoSensor  # loads MuJoCo and its renderer

        self.sensor = StereoSensor(camera)
        self.marked, self.tracker = localisation == "landmarks", None
        if localisation in VISUAL:
            from jaxbiped.stereo.tracking import Tracker

            self.tracker = Tracker(self.sensor.rig)
        self.last: Shot | None = None

    def see(
        self,
        world: WorldState,
        agent: AgentState,
        setup: MissionSetup,
        body_pose: BodyPose | None = None,
        count: int | None = None,
    ) -> tuple[View, Sightings]:
        """See `SensorRig`; padding gets the values of the last row before it."""
        params = setup.params
        placing = jax.device_get((where(world, agent, params, body_pose), agent.belief.pose, params.stereo.max_range))
        arena, spread = jax.device_get((setup.arena, params.landmarks))
        if not self.marked:
            arena = replace(arena, landmarks=replace(arena.landmarks, used=np.zeros_like(arena.landmarks.used)))
        names, moved = jax.device_get((view_names(world, agent), agent.anchor.moved)) if self.tracker else (None, None)
        seen = []
        for k in range(count or len(world.code)):
            one, spread_one, (eye, believed, max_range) = jax.tree.map(lambda v, k=k: v[k], (arena, spread, placing))
            origin, basis, at, seed = eye
            self.last = self.sensor(one, origin, basis, at, believed, float(max_range), spread_one, int(seed))
            sightings = self.last.sightings
            if self.tracker:
                now, then = (self.sensor.shown + row[k].tobytes() for row in names)
                sightings = replace(sightings, motion=self.tracker(self.last, at, now, then, moved[k].astype(float)))
            seen.append((self.last.view, sightings))
        seen += seen[-1:] * (len(world.code) - len(seen))
        return jax.tree.map(lambda *rows: np.stack(rows), *seen)

    def picture(self) -> Shot | None:
        """See `SensorRig`."""
        return self.last

    def close(self) -> None:
        """Free the resources of the graphics driver."""
        self.sensor.close()


def rig_for(config: MissionConfig) -> StereoRig | None:
    """The host sensor of missions with this config; None if their sensor is in JAX."""
    return StereoRig(config.camera, config.localisation) if config.sensor in RENDERED else None


def try_rig(config: MissionConfig) -> None:
    """Reject, before anything is printed or written, a sensor that does not work on this machine.

    Raises:
      InputError: nothing can be rendered here.
    """
    if rig := rig_for(config):
        rig.close()


@jax.jit
def view_names(world: WorldState, agent: AgentState) -> tuple[UInt32[Array, "B 6"], UInt32[Array, "B 6"]]:
    """Identifiers of this view of each robot within its arena, and of the view before it; zeros before the first. Views
    of two missions with the same identifier are the same."""

    def name(pose: Pose, decision: Int[Array, ""], look: Bool[Array, ""], squat: Bool[Array, ""], seed) -> Array:
        held = 2 * look.astype(jnp.uint32) + squat.astype(jnp.uint32)
        place = jax.lax.bitcast_convert_type(jnp.stack([pose.x, pose.y, pose.yaw]).astype(jnp.float32), jnp.uint32)
        return jnp.concatenate([place, jnp.stack([decision.astype(jnp.uint32), held, seed])])

    def one(world: WorldState, agent: AgentState):
        anchor = agent.anchor
        then = name(world.before, world.decisions - 1, anchor.look, anchor.squat, world.seed)
        now = name(world.pose, world.decisions, agent.look, world.squat, world.seed)
        return now, jnp.where(anchor.some, then, jnp.uint32(0))

    return jax.vmap(one)(world, agent)


@jax.jit
def where(
    world: WorldState, agent: AgentState, params: MissionParams, body_pose: BodyPose | None
) -> tuple[Float[Array, "B 3"], Float[Array, "B 3 3"], Mount, UInt32[Array, "B"]]:
    """Each robot's true left camera: its centre [m] and its axes; its believed position; the view's seed."""

    def one(world, agent, params, body_pose):
        seed = fold(world.seed, SENSE, world.decisions)
        at = mount(params.camera, agent.look, world.squat)
        if body_pose is None:
            return *placed(world.pose, at, *attitude_error(params.stereo, seed)), at, seed
        return *placed(body_pose.pose, at, body_pose.roll, body_pose.pitch), at, seed

    return jax.vmap(one)(world, agent, params, body_pose)
