"""Foot placement: the edges that a robot measures on its way and remembers, and their effect on its command."""

from __future__ import annotations

from dataclasses import replace

import jax
import jax.numpy as jnp
from jaxtyping import Array, Float, Int

from jaxbiped import mapping
from jaxbiped.geometry.pose import wrap_angle
from jaxbiped.mission.params import MissionParams, MissionSpec
from jaxbiped.mission.setup import MissionSetup
from jaxbiped.mission.state import AgentState
from jaxbiped.motion.edge_approach import Crossing, NearEdges, approach, next_crossing, remembered
from jaxbiped.motion.local_map import LocalMap
from jaxbiped.motion.primitives import Command
from jaxbiped.sensing import edges
from jaxbiped.sensing.camera import mount
from jaxbiped.sensing.edges import Edge
from jaxbiped.sensing.view import View

SIDEWAYS = 0.1  # [m] lateral range around the robot's path within which a crossed edge is measured


def place_feet(
    agent: AgentState,
    view: View,
    command: Command,
    local: LocalMap,
    directions: Int[Array, "n"],
    setup: MissionSetup,
) -> tuple[AgentState, Command]:
    """The command, or the one needed first to place the feet before the next edge; and the memory of edges.

    One robot. `directions` are the first `motion.edge_approach.foresight` moves of its path.
    """
    params, spec = setup.params, setup.spec
    crossing = next_crossing(local, directions)
    known = remembered(agent.ahead, crossing)
    about = jax.tree.map(lambda k, c: jnp.where(known.known, k, c), known, crossing.edge)
    seen = look_for(about, crossing, agent, view, params, spec)
    ahead = edges.fuse(known, seen)
    near = NearEdges(measured=ahead, held=agent.ahead, behind=agent.behind)
    command = approach(command, local, crossing, near, agent.look, params.footing)
    # An edge that the path has left still exists.
    left = ~crossing.edge.known & agent.ahead.known & (agent.ahead.distance > 0)
    ahead = jax.tree.map(lambda new, old: jnp.where(left, old, new), ahead, agent.ahead)
    return replace(agent, ahead=ahead), command


def look_for(
    about: Edge, crossing: Crossing, agent: AgentState, view: View, params: MissionParams, spec: MissionSpec
) -> Edge:
    """The edge near the line `about` according to the present view; known only if the path crosses one.

    The map knows its direction only roughly, so the edge is also searched along the direction of the edge behind: the
    sides of most bumps are parallel.
    """
    grid = spec.grid
    flat = mapping.level_view(view, agent.belief.pose.z, params.mapping, grid) if not spec.knows_pose else view
    flat = jax.lax.optimization_barrier(flat)  # otherwise the plane is fitted again at every point
    eye, aside = mount(params.camera, agent.look, agent.squat), jnp.clip(crossing.along, -SIDEWAYS, SIDEWAYS)
    turned = wrap_angle(agent.behind.angle - about.angle)
    distance = about.distance * jnp.cos(turned) + crossing.along * jnp.sin(turned)
    parallel = replace(about, distance=distance, angle=agent.behind.angle)
    first, second = (edges.measure(flat, edge, aside, eye, grid.level_height) for edge in (about, parallel))
    usable = agent.behind.known & (jnp.abs(turned) < 1.0) & ~first.known
    seen = jax.tree.map(lambda a, b: jnp.where(usable, b, a), first, second)
    return replace(seen, known=seen.known & crossing.edge.known)


def update_edges(
    agent: AgentState, command: Command, moved: Float[Array, "3"], variances: Float[Array, "3"]
) -> AgentState:
    """Update the edges known to the robot after a command, by odometry: an edge ahead may now be behind."""
    ahead, behind = (edges.predict(edge, moved, variances) for edge in (agent.ahead, agent.behind))
    stepped = command.rise != 0
    behind = jax.tree.map(lambda a, b: jnp.where(stepped, a, b), ahead, behind)
    return replace(agent, ahead=replace(ahead, known=ahead.known & ~stepped), behind=behind)
