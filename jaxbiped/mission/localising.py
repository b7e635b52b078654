"""The believed pose of a robot after a measurement: from landmarks, as in the paper, or without them.

Written for one robot; `decision.perceive` maps it.
"""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, UInt32

from jaxbiped.executors.world_state import WorldState
from jaxbiped.geometry.pose import Pose
from jaxbiped.localisation.kalman_filter import Belief, correct, predict_seen
from jaxbiped.localisation.scan_match import add_walls, find_walls, match, picture_shape
from jaxbiped.mapping import level_view
from jaxbiped.mission.params import ICP, VISUAL, MissionParams, MissionSpec
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import AgentState, Anchor
from jaxbiped.sensing.camera import mount
from jaxbiped.sensing.motion import track
from jaxbiped.sensing.view import Sightings, View


def localise(agent: AgentState, view: View, sightings: Sightings, setup: MissionSetup) -> AgentState:
    """The agent after a view has updated the robot's pose."""
    spec = setup.spec
    if spec.localisation == "landmarks":
        return replace(agent, belief=correct(agent.belief, setup.arena.landmarks, sightings))
    if spec.localisation in VISUAL:
        agent = replace(agent, belief=by_motion(agent, sightings))
    if spec.localisation in ICP:
        agent = by_walls(agent, view, setup.params, spec)
    if spec.localisation in VISUAL:
        zero = jnp.zeros(3)
        here = Anchor(agent.belief, agent.look, agent.squat, zero, zero, jnp.ones_like(agent.fresh))
        agent = replace(agent, anchor=here)
    return agent


def by_motion(agent: AgentState, sightings: Sightings) -> Belief:
    """The belief from visual motion since the last view if it was measured; otherwise from dead reckoning."""
    anchor, motion = agent.anchor, sightings.motion
    belief, good = predict_seen(anchor.belief, anchor.moved, anchor.variances, motion)
    good = good & anchor.some
    pose = Pose(belief.pose.x, belief.pose.y, agent.belief.pose.z, belief.pose.yaw)  # heights are counted
    return choose(good, Belief(pose, belief.cov), agent.belief)


def by_walls(agent: AgentState, view: View, params: MissionParams, spec: MissionSpec) -> AgentState:
    """The agent after the walls in view were matched to those measured before, and added to them."""
    grid, image = spec.grid, spec.image
    flat = jax.lax.optimization_barrier(level_view(view, agent.belief.pose.z, params.mapping, grid))
    shape, step = picture_shape(view.x.shape[-1], image.width, image.height)
    walls = find_walls(flat, shape, step, agent.belief.pose.z)
    belief = match(agent.belief, walls, agent.outlines, grid)
    return replace(agent, belief=belief, outlines=add_walls(agent.outlines, walls, belief.pose, grid))


def choose(good: Bool[Array, ""], new: Belief, old: Belief) -> Belief:
    """One belief or the other."""
    return jax.tree.map(lambda a, b: jnp.where(good, a, b), new, old)


def anchor_after_odometry(agent: AgentState, moved: Float[Array, "3"], variances: Float[Array, "3"]) -> AgentState:
    """The agent after a command, by odometry."""
    if agent.anchor is None:
        return agent
    return replace(agent, anchor=replace(agent.anchor, moved=moved, variances=variances))


def sightings_without_landmarks(
    view: View,
    world: WorldState,
    agent: AgentState,
    setup: MissionSetup,
    seed: UInt32[Array, ""],
) -> Sightings:
    """The motion that a robot without landmarks measures, according to the ray-cast sensor.

    Deviation: for a simulated biped this is the motion of its feet, regardless of its body.
    """
    params, image = setup.params, setup.spec.image
    zero = jnp.zeros_like(setup.arena.landmarks.x)
    none = Sightings(zero, zero, zero, zero > 0)
    if setup.spec.localisation not in VISUAL:
        return none
    at = mount(params.camera, agent.anchor.look, agent.anchor.squat)
    camera, reach = params.camera, params.stereo.max_range
    motion = track(view, world.pose, world.before, at, camera, params.visual, image, reach, seed)
    return replace(none, motion=replace(motion, seen=motion.seen & agent.anchor.some))
