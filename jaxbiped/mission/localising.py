"""The believed pose of a robot after a measurement: from landmarks, as in the paper, or without them.

Written for one robot; `decision.perceive` maps it.
"""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
from jaxtyping import Array, Bool, Float, UInt32

from jaxbiped.arenas.arena import Arena, Landmarks
from jaxbiped.geometry.pose import Pose
from jaxbiped.localisation.kalman_filter import Belief, correct, predict_seen
from jaxbiped.localisation.scan_match import add_walls, find_walls, match, picture_shape
from jaxbiped.mapping import level_view
from jaxbiped.mission.settings import ICP, VISUAL, MissionParams, MissionSpec
from jaxbiped.mission.state import AgentState, Anchor, WorldState
from jaxbiped.sensing.camera import mount
from jaxbiped.sensing.motion import track
from jaxbiped.sensing.view import Sightings, View


def localise(
    mind: AgentState,
    view: View,
    sightings: Sightings,
    landmarks: Landmarks,
    settings: MissionParams,
    program: MissionSpec,
) -> AgentState:
    """The mind after a view has updated the robot's pose."""
    if program.localisation == "landmarks":
        return replace(mind, belief=correct(mind.belief, landmarks, sightings))
    if program.localisation in VISUAL:
        mind = replace(mind, belief=by_motion(mind, sightings))
    if program.localisation in ICP:
        mind = by_walls(mind, view, settings, program)
    if program.localisation in VISUAL:
        zero = jnp.zeros(3)
        here = Anchor(mind.belief, mind.look, mind.squat, zero, zero, jnp.ones_like(mind.fresh))
        mind = replace(mind, anchor=here)
    return mind


def by_motion(mind: AgentState, sightings: Sightings) -> Belief:
    """The belief from visual motion since the last view if it was measured; otherwise from dead reckoning."""
    anchor, motion = mind.anchor, sightings.motion
    belief, good = predict_seen(anchor.belief, anchor.moved, anchor.variances, motion)
    good = good & anchor.some
    pose = Pose(belief.pose.x, belief.pose.y, mind.belief.pose.z, belief.pose.yaw)  # heights are counted
    return choose(good, Belief(pose, belief.cov), mind.belief)


def by_walls(mind: AgentState, view: View, settings: MissionParams, program: MissionSpec) -> AgentState:
    """The mind after the walls in view were matched to those measured before, and added to them."""
    spec, image = program.spec, program.image
    flat = jax.lax.optimization_barrier(level_view(view, mind.belief.pose.z, settings.mapping, spec))
    shape, step = picture_shape(view.x.shape[-1], image.width, image.height)
    walls = find_walls(flat, shape, step, mind.belief.pose.z)
    belief = match(mind.belief, walls, mind.outlines, spec)
    return replace(mind, belief=belief, outlines=add_walls(mind.outlines, walls, belief.pose, spec))


def choose(good: Bool[Array, ""], new: Belief, old: Belief) -> Belief:
    """One belief or the other."""
    return jax.tree.map(lambda a, b: jnp.where(good, a, b), new, old)


def carried_on(mind: AgentState, moved: Float[Array, "3"], variances: Float[Array, "3"]) -> AgentState:
    """The mind after a command, by odometry."""
    if mind.anchor is None:
        return mind
    return replace(mind, anchor=replace(mind.anchor, moved=moved, variances=variances))


def unmarked(
    view: View,
    world: WorldState,
    mind: AgentState,
    arena: Arena,
    settings: MissionParams,
    program: MissionSpec,
    seed: UInt32[Array, ""],
) -> Sightings:
    """The motion that a robot without landmarks measures, according to the ray-cast sensor.

    Deviation: for a simulated biped this is the motion of its feet, regardless of its body.
    """
    zero = jnp.zeros_like(arena.landmarks.x)
    none = Sightings(zero, zero, zero, zero > 0)
    if program.localisation not in VISUAL:
        return none
    at = mount(settings.camera, mind.anchor.look, mind.anchor.squat)
    camera, reach = settings.camera, settings.stereo.max_range
    motion = track(view, world.pose, world.before, at, camera, settings.visual, program.image, reach, seed)
    return replace(none, motion=replace(motion, seen=motion.seen & mind.anchor.some))
