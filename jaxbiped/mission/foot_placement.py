"""Foot placement: the edges that a robot measures on its way and remembers, and their effect on its command."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxbiped import mapping
from jaxbiped.geometry.pose import wrap_angle
from jaxbiped.mission.settings import MissionParams, MissionSpec
from jaxbiped.mission.state import AgentState
from jaxbiped.motion.edge_approach import Crossing, approach, next_crossing, remembered
from jaxbiped.motion.primitives import Command
from jaxbiped.sensing import edges
from jaxbiped.sensing.camera import mount
from jaxbiped.sensing.edges import Edge
from jaxbiped.sensing.view import View

SIDEWAYS = 0.1  # [m] lateral range around the robot's path within which a crossed edge is measured


def place_feet(
    mind: AgentState,
    view: View,
    command: Command,
    ij: Int[Array, "2"],
    directions: Int[Array, "n"],
    classes: Int[Array, "H W"],
    levels: Int[Array, "H W"],
    settings: MissionParams,
    program: MissionSpec,
) -> tuple[AgentState, Command]:
    """The command, or the one needed first to place the feet before the next edge; and the memory of edges.

    One robot. `directions` are the first `motion.edge_approach.foresight` moves of its path.
    """
    spec, pose = program.spec, mind.belief.pose
    crossing = next_crossing(pose, ij, directions, classes, levels, spec)
    known = remembered(mind.ahead, crossing)
    about = jax.tree.map(lambda k, c: jnp.where(known.known, k, c), known, crossing.edge)
    seen = look_for(about, crossing, mind, view, settings, program)
    ahead = edges.fuse(known, seen)
    command = approach(
        command, pose, ij, crossing, ahead, mind.ahead, mind.behind, classes, levels, mind.look, settings.footing, spec
    )
    # An edge that the path has left still exists.
    left = ~crossing.edge.known & mind.ahead.known & (mind.ahead.distance > 0)
    ahead = jax.tree.map(lambda new, old: jnp.where(left, old, new), ahead, mind.ahead)
    return replace(mind, ahead=ahead), command


def look_for(
    about: Edge, crossing: Crossing, mind: AgentState, view: View, settings: MissionParams, program: MissionSpec
) -> Edge:
    """The edge near the line `about` according to the present view; known only if the path crosses one.

    The map knows its direction only roughly, so the edge is also searched along the direction of the edge behind: the
    sides of most bumps are parallel.
    """
    spec = program.spec
    flat = mapping.level_view(view, mind.belief.pose.z, settings.mapping, spec) if not program.knows_pose else view
    flat = jax.lax.optimization_barrier(flat)  # otherwise the plane is fitted again at every point
    eye, aside = mount(settings.camera, mind.look, mind.squat), jnp.clip(crossing.along, -SIDEWAYS, SIDEWAYS)
    turned = wrap_angle(mind.behind.angle - about.angle)
    distance = about.distance * jnp.cos(turned) + crossing.along * jnp.sin(turned)
    parallel = replace(about, distance=distance, angle=mind.behind.angle)
    first, second = (edges.measure(flat, edge, aside, eye, spec.level_height) for edge in (about, parallel))
    usable = mind.behind.known & (jnp.abs(turned) < 1.0) & ~first.known
    seen = jax.tree.map(lambda a, b: jnp.where(usable, b, a), first, second)
    return replace(seen, known=seen.known & crossing.edge.known)


def walked(mind: AgentState, command: Command, moved: Float[Array, "3"], variances: Float[Array, "3"]) -> AgentState:
    """Update the edges known to the robot after a command, by odometry: an edge ahead may now be behind."""
    ahead, behind = (edges.predict(edge, moved, variances) for edge in (mind.ahead, mind.behind))
    stepped = command.rise != 0
    behind = jax.tree.map(lambda a, b: jnp.where(stepped, a, b), ahead, behind)
    return replace(mind, ahead=replace(ahead, known=ahead.known & ~stepped), behind=behind)
