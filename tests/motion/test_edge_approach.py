"""From a path to feet that stand right before an edge: by hand, and in a loop with exact and with noisy motion."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping import Cell, GridSpec
from jaxbiped.motion import edge_approach as room
from jaxbiped.motion.config import FootingConfig
from jaxbiped.motion.local_map import LocalMap
from jaxbiped.motion.primitives import Command, Primitive
from jaxbiped.sensing import edges

SPEC, CONFIG = GridSpec(), FootingConfig()
FOOTING = CONFIG.traced()
MOVES = room.foresight(SPEC)


def ground(first=18, last=36, level=1):
    """A floor with a bump on columns `first` to `last`."""
    classes, levels = np.full(SPEC.shape, Cell.FLOOR, np.int8), np.zeros(SPEC.shape, np.int8)
    classes[:, first:last], levels[:, first:last] = Cell.BUMP, level
    return jnp.asarray(classes), jnp.asarray(levels)


def at(x, y=0.725, yaw=0.0, z=0.0, maps=None):
    pose, ij = Pose(*(jnp.float32(v) for v in (x, y, z, yaw))), jnp.array([int(y / 0.05), int(x / 0.05)])
    return LocalMap(*(maps or ground()), ij, pose, SPEC)


def crossing_of(x, yaw=0.0, moves=(0,) * MOVES, maps=None):
    return room.next_crossing(at(x, yaw=yaw, maps=maps), jnp.array(moves))


def line(distance, angle=0.0, rise=1, sd=0.001, known=True):
    number = [jnp.asarray(v, jnp.float32) for v in (distance, angle)]
    cov = jnp.diag(jnp.array([sd**2, (10 * sd) ** 2], jnp.float32))
    return edges.Edge(*number, cov, jnp.int32(rise), jnp.asarray(known))


def test_crossing_is_the_first_edge_of_the_path():
    found = crossing_of(0.775)
    assert bool(found.edge.known) and int(found.edge.rise) == 1
    assert float(found.edge.distance) == pytest.approx(0.125, abs=1e-6) and abs(float(found.edge.angle)) < 1e-6
    assert float(found.along) == pytest.approx(0.0, abs=1e-6)
    turned = crossing_of(0.775, yaw=0.5)
    assert float(turned.edge.angle) == pytest.approx(-0.5, abs=1e-6)
    assert int(crossing_of(0.975, moves=(4,) * MOVES).edge.rise) == -1


def test_oblique_path_crosses_to_the_side():
    found = crossing_of(0.775, moves=(1,) * MOVES)
    assert float(found.along) == pytest.approx(0.125, abs=1e-6)


def test_no_crossing_beyond_foresight_nor_beyond_the_unknown():
    assert not bool(crossing_of(0.525).edge.known)
    assert not bool(crossing_of(0.775, moves=(0, 0, -1, -1, -1, -1)[:MOVES]).edge.known)
    for kind in (Cell.UNMEASURED, Cell.OBSTACLE):
        classes, levels = ground()
        assert not bool(crossing_of(0.775, maps=(classes.at[14, 17].set(kind), levels)).edge.known)


def test_an_edge_that_leads_into_a_gate_is_crossed_like_any_other():
    classes, levels = ground(last=30)
    found = crossing_of(1.375, maps=(classes.at[:, 30:].set(Cell.GATE), levels))
    assert bool(found.edge.known) and int(found.edge.rise) == -1


def test_what_was_measured_is_remembered_while_it_fits():
    crossing = crossing_of(0.775)
    assert bool(room.remembered(line(0.105, 0.1), crossing).known)
    for other in (line(0.105, rise=-1), line(0.30), line(0.105, 1.5), line(0.105, known=False)):
        assert not bool(room.remembered(other, crossing).known)
    assert not bool(room.remembered(line(0.105), crossing_of(0.525)).known)


STRAIGHT = Command(*(jnp.asarray(v) for v in (0.0, 1, 0.05, 0, False)), left=jnp.zeros(()))


def command(local, crossing, measured, held=None, behind=None, looked=False, wanted=STRAIGHT):
    near = room.NearEdges(measured, held or edges.unknown(), behind or edges.unknown())
    return jax.device_get(room.approach(wanted, local, crossing, near, jnp.asarray(looked), FOOTING))


def decide(x, distance, angle=0.0, sd=0.001, **more):
    return command(at(x, yaw=-angle), crossing_of(x, yaw=-angle), line(distance, angle, sd=sd), **more)


def test_far_from_an_edge_it_follows_its_path():
    got = decide(0.675, 0.225)
    assert got.primitive == Primitive.STRAIGHT_FORWARD and got.length == pytest.approx(0.05) and got.turn == 0


def test_near_it_turns_square_and_walks_up():
    got = decide(0.775, 0.13, 0.4)
    assert got.turn == pytest.approx(0.4) and got.length == pytest.approx(0.13 - CONFIG.before_up, abs=1e-6)


def test_it_backs_off_where_it_cannot_turn():
    got = decide(0.825, 0.07, 0.5)
    assert got.turn == 0 and -0.06 <= got.length < 0


@pytest.mark.parametrize(("off", "angle", "what"), [(0.0, 0.0, 2), (0.003, 0.02, 2), (0.008, 0.0, 1), (-0.008, 0.0, 1)])
def test_it_steps_only_from_the_right_place(off, angle, what):
    got = decide(0.825, CONFIG.before_up + off, angle)
    assert got.primitive == what
    assert got.length == pytest.approx(CONFIG.length if what == 2 else off, abs=1e-6) and got.rise == (what == 2)


def test_it_looks_once_where_it_is_not_sure():
    assert decide(0.825, CONFIG.before_up, sd=0.005).primitive == Primitive.LOOK
    assert decide(0.825, CONFIG.before_up, sd=0.005, looked=True).primitive == Primitive.STEP_UP_BUMP


def test_it_steps_aside_for_both_feet_to_land():
    """The bump ends 4 cm to the right of the way."""
    classes, levels = ground()
    classes, levels = classes.at[:14].set(Cell.FLOOR), levels.at[:14].set(0)
    local = at(0.775, y=0.74, maps=(classes, levels))
    crossing = room.next_crossing(local, jnp.zeros(MOVES, jnp.int32))
    got = command(local, replace(crossing, edge=line(0.125)), line(0.125))
    assert got.primitive == Primitive.NONE and 0.03 < got.left <= 0.1 and got.length == 0


def test_after_a_step_it_leaves_the_edge_before_it_turns():
    local = at(0.925, z=0.03)
    nowhere = crossing_of(0.525)
    turning = replace(STRAIGHT, turn=jnp.asarray(1.5))
    got = command(local, nowhere, edges.unknown(), behind=line(-0.025), wanted=turning)
    assert got.turn == 0 and got.length == pytest.approx(CONFIG.clear_up - 0.025, abs=1e-6)
    got = command(local, nowhere, edges.unknown(), behind=line(-0.08), wanted=turning)
    assert got.turn == pytest.approx(1.5)


def test_it_does_not_turn_away_from_an_edge_with_its_toes_at_it():
    local = at(0.825)
    turning = replace(STRAIGHT, turn=jnp.asarray(1.0))
    got = command(local, crossing_of(0.525), edges.unknown(), held=line(0.075), wanted=turning)
    assert got.turn == 0 and got.length < 0


@jax.jit
def decision(x, y, z, yaw, truth, behind, looked, classes, levels, moves):
    """What the robot does at a true pose, with the edge measured as it is."""
    ij = jnp.stack([y, x]) // 0.05
    local = LocalMap(classes, levels, ij.astype(jnp.int32), Pose(x, y, z, yaw), SPEC)
    crossing = room.next_crossing(local, moves)
    measured = replace(truth, known=crossing.edge.known)
    near = room.NearEdges(measured, measured, behind)
    return room.approach(STRAIGHT, local, crossing, near, looked, FOOTING)


@pytest.mark.parametrize("noisy", [False, True])
@pytest.mark.parametrize("up", [True, False])
def test_it_comes_to_step_from_the_right_place(up, noisy):
    """From anywhere 9 to 16 cm before an edge, in any direction towards it; noise of 2 % and 1 degree a move."""
    rng = np.random.default_rng(5)
    edge_x, rise = 0.9, 1 if up else -1
    classes, levels = ground(18, 36) if up else ground(0, 18)
    stand = CONFIG.before_up if up else CONFIG.before_down
    for _ in range(25):
        x, y, yaw = edge_x - rng.uniform(0.09, 0.16), rng.uniform(0.5, 0.9), rng.uniform(-0.8, 0.8)
        looked = False
        for _ in range(8):
            truth = line(edge_x - x, -yaw, rise)
            z = np.float32(0.0 if up else 0.03)
            got = jax.device_get(decision(*(np.float32(v) for v in (x, y)), z, np.float32(yaw), truth, edges.unknown(),
                                          np.bool_(looked), classes, levels, jnp.zeros(MOVES, jnp.int32)))  # fmt: skip
            yaw += got.turn + noisy * (abs(got.turn) + abs(got.length) > 0) * rng.normal(0, 0.017)
            if got.rise:
                break
            length = got.length * (1 + noisy * rng.normal(0, 0.02))
            x, y = x + length * np.cos(yaw) - got.left * np.sin(yaw), y + length * np.sin(yaw) + got.left * np.cos(yaw)
            looked = got.primitive == Primitive.LOOK
            reach = 0.05 * abs(np.cos(yaw)) + 0.075 * abs(np.sin(yaw)) if up else 0.045 * abs(np.sin(yaw))
            assert edge_x - x > reach - 0.003  # no foot on the edge, no ankle over it
        assert got.rise == rise
        assert edge_x - x == pytest.approx(stand, abs=CONFIG.tolerance + 1e-4) and abs(yaw) < 0.06
