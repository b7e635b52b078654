"""An executor that moves as simulated bipeds were measured to: `sampled`."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jaxtyping import Array, Bool, Float, Int, UInt32

from jaxbiped.arenas.arena import Arena
from jaxbiped.arenas.ground import ground_height
from jaxbiped.executors.contact_rules import body_touches, edges, feet_touch, off_ground
from jaxbiped.executors.execution import ODOMETRY, PLAY, Execution
from jaxbiped.executors.motion_library import PLAYED, Library
from jaxbiped.executors.params import ExecutorParams
from jaxbiped.executors.world_state import WorldState
from jaxbiped.geometry.pose import Pose, to_robot, to_world, wrap_angle
from jaxbiped.motion.primitives import Command, Primitive, duration
from jaxbiped.sensing import counter_rng
from jaxbiped.sensing.counter_rng import fold
from jaxbiped.sensing.odometry import drift

STRAIGHT, TURN, UP, DOWN, SQUAT, SIDE = range(len(PLAYED))
WAY = (1 / 3, 2 / 3, 1.0)  # fractions of its path at which the body is checked against boxes


def sampled(arena: Arena, world: WorldState, command: Command, params: ExecutorParams) -> Execution:
    """Displacements, falls and stops as measured in simulation (`params.library`); time is Table 2's.

    Turn, sideways step and primitive are drawn one after another. Each ends where requested, plus the mean error of the
    trials on the mild set and a normal error with their covariance, and falls as often as there. A step over an edge
    succeeds as often as in the trials with the edge at that distance and yaw, taken from the true arena on the paths of
    the two feet. A rise ahead of a straight step stops the toes; a robot that ends nearer to an edge than the trials on
    rims allow falls. Torso and head, swaying as measured, and the feet collide with true boxes and terrain where those
    of the simulated biped would. Getting down and up displaces nothing: it was 0.1 mm. On terrain the robot ends at the
    height of the ground between its feet, if that is within tolerance.

    Odometry counts the true displacement with the drift of every executor. Consumes the channels PLAY and ODOMETRY of
    the mission's seed.
    """
    library, limits = params.library, params.limits
    length, _, offset = library.feet
    seed = fold(world.seed, PLAY, world.decisions)
    walks = (command.primitive == Primitive.STRAIGHT_FORWARD) | (command.primitive == Primitive.PASS_GATE)
    climbs = command.rise != 0
    kind = jnp.where(command.rise > 0, UP, jnp.where(command.rise < 0, DOWN, jnp.where(command.squat, SQUAT, STRAIGHT)))
    none = jnp.zeros(())
    left = jnp.asarray(command.left, jnp.float32)
    turned, fell_turning = draw(library, jnp.int32(TURN), jnp.stack([none, none, command.turn]), fold(seed, 0))
    aside, fell_aside = draw(library, jnp.int32(SIDE), jnp.stack([none, left, none]), fold(seed, 1))
    asked = jnp.stack([jnp.where(walks | climbs, command.length, 0.0), none, none])
    ahead, fell_ahead = draw(library, kind, asked, fold(seed, 2))

    at = moved_by(world.pose, turned)
    begun = moved_by(at, aside)
    rises, drops = edges(arena, begun, offset, limits.rise)
    nearest = jnp.min(rises) - length / 2
    stopped = walks & (ahead[0] > nearest) & (ahead[0] + library.rims[0] <= jnp.min(rises))
    ahead = ahead.at[0].set(jnp.where(stopped, jnp.maximum(nearest, 0.0), ahead[0]))
    after = moved_by(begun, ahead)
    height = world.pose.z + command.rise * limits.rise
    if arena.terrain is not None:
        ground = ground_height(arena, after.x, after.y)
        height = jnp.where(jnp.abs(ground - height) <= limits.height_tolerance, ground, height)
    after = Pose(after.x, after.y, height, after.yaw)
    stands = stand_probability(library, kind, command.length, jnp.where(command.rise > 0, rises, drops))
    trips = climbs & (counter_rng.uniform(seed, 0, 3) >= stands)
    slides = off_ground(arena, after, offset, library.rims, limits.height_tolerance)

    moves = (turned != 0).any() | (aside != 0).any() | (ahead != 0).any()
    sway = jnp.where(moves, library.sway[kind], 0.0)
    head = jnp.where(command.squat, params.body.squatting, params.body.standing)
    highest = jnp.maximum(world.pose.z, after.z)
    poses = [Pose(at.x, at.y, highest, wrap_angle(world.pose.yaw + part * command.turn)) for part in (0.5, 1.0)]
    for part in WAY:
        x, y = (a + part * (b - a) for a, b in ((at.x, after.x), (at.y, after.y)))
        poses.append(Pose(x, y, highest, after.yaw))
    collided = jnp.zeros((), bool)
    for pose in poses:
        collided = collided | body_touches(arena, pose, head, sway)
        collided = collided | feet_touch(arena, pose, library.feet, highest + params.body.step)

    dx, dy = to_robot(world.pose, after.x, after.y)
    true = (dx, dy, wrap_angle(after.yaw - world.pose.yaw))
    moved, variances = drift(true, params.odometry, fold(world.seed, ODOMETRY, world.decisions))
    width, depth = arena.size_xy[0], arena.size_xy[1]
    return Execution(
        pose=after,
        moved=jnp.stack(moved),
        variances=variances,
        time=duration(command, params.durations),
        distance=jnp.hypot(dx, dy),
        collided=collided,
        fell=(fell_turning | fell_aside | fell_ahead | trips | slides) & ~collided,
        outside=(after.x < 0) | (after.x > width) | (after.y < 0) | (after.y > depth),
    )


def draw(
    library: Library, kind: Int[Array, ""], asked: Float[Array, "3"], seed: UInt32[Array, ""]
) -> tuple[Float[Array, "3"], Bool[Array, ""]]:
    """Displacement (x, y) [m] and yaw [rad] of one primitive, and whether it falls. Zero if nothing is requested.

    Mean and covariance of the error grow with the length or the angle, as for successive steps; those of a step over an
    edge do not: it was measured at the length at which it is played. Movements to the right are mirrored.
    """
    request = library.request[kind]
    size = jnp.dot(asked, request) / jnp.dot(request, request)
    side = jnp.where((kind == TURN) | (kind == SIDE), jnp.sign(size), 1.0) * jnp.array([0.0, 1.0, 1.0])
    mirror = side + jnp.array([1.0, 0.0, 0.0])
    size = jnp.where((kind == UP) | (kind == DOWN), jnp.sign(jnp.abs(size)), jnp.abs(size))
    noise = library.root[kind] @ counter_rng.normal(seed, np.arange(3))
    error = mirror * (size * library.bias[kind] + jnp.sqrt(size) * noise)
    falls = 1.0 - (1.0 - library.falls[kind]) ** size
    return jnp.where(size > 0, asked + error, 0.0), counter_rng.uniform(seed, 3) < falls


def stand_probability(
    library: Library, kind: Int[Array, ""], length: Float[Array, ""], edge: Float[Array, "2"]
) -> Float[Array, ""]:
    """Success rate of a step of a length [m] whose edge is at these distances [m] from the middle of the two feet.

    Bilinear between the trials; beyond them the nearest one. For a step longer or shorter than those tried, the nominal
    distance of the edge changes by half the difference.
    """
    which = jnp.where(kind == UP, 0, 1)
    yaw = jnp.arctan2(edge[1] - edge[0], 2 * library.feet[2])
    off = jnp.mean(edge) - library.ahead[which] - (length - library.request[kind, 0]) / 2
    row, column = (
        jnp.interp(value, axis, jnp.arange(len(axis), dtype=jnp.float32))
        for value, axis in ((off, library.edge), (yaw, library.yaw))
    )
    i, j = (jnp.clip(jnp.floor(at), 0, size - 2).astype(jnp.int32) for at, size in zip(
        (row, column), library.stands.shape[1:], strict=True))  # fmt: skip
    u, v = row - i, column - j
    corner = lambda a, b: library.stands[which, i + a, j + b]  # noqa: E731
    return (1 - u) * ((1 - v) * corner(0, 0) + v * corner(0, 1)) + u * ((1 - v) * corner(1, 0) + v * corner(1, 1))


def moved_by(pose: Pose, displacement: Float[Array, "3"]) -> Pose:
    """A pose after a displacement in its own frame."""
    x, y = to_world(pose, displacement[0], displacement[1])
    return Pose(x, y, pose.z, wrap_angle(pose.yaw + displacement[2]))
