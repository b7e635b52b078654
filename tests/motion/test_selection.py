"""From the path to a command, on grids of several pitches, against plain Python and by hand."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.geometry.pose import Pose
from jaxbiped.mapping import Cell, GridSpec
from jaxbiped.motion.local_map import LocalMap
from jaxbiped.motion.primitives import Primitive
from jaxbiped.motion.selection import TURN_DEADBAND, cell_of, select, stride
from tests.reference import motion as plain

PAPER, FINE = GridSpec(), GridSpec(pitch=0.025)
COMPILED = jax.jit(select)


def command(spec, moves, *, at=None, yaw=0.0, ij=(10, 10), edits=(), looked=False):
    """The command on a floor with some cells edited: (i, j, class, level)."""
    classes, levels = np.full(spec.shape, Cell.FLOOR, np.int8), np.zeros(spec.shape, np.int8)
    for i, j, kind, level in edits:
        classes[i, j], levels[i, j] = kind, level
    at = at or ((ij[1] + 0.5) * spec.pitch, (ij[0] + 0.5) * spec.pitch)
    x, y, z, yaw = (jnp.float32(v) for v in (*at, 0.0, yaw))
    ij, moves, classes, levels, looked = map(jnp.asarray, (np.int32(ij), np.int32(moves), classes, levels, looked))
    return jax.device_get(COMPILED(LocalMap(classes, levels, ij, Pose(x, y, z, yaw), spec), moves, looked))


def test_stride():
    strides = {0.1: 1, 0.05: 1, 0.025: 2, 0.0125: 4, 0.01: 5}
    assert [stride(GridSpec(size_x=1.8, size_y=1.4, pitch=p, max_radius=0.1)) for p in strides] == list(
        strides.values()
    )


@pytest.mark.parametrize("direction", range(8))
def test_straight_to_the_next_centre(direction):
    got = command(PAPER, [direction])
    assert got.primitive == Primitive.STRAIGHT_FORWARD and not got.squat and got.rise == 0
    assert got.turn == pytest.approx(plain.wrap(direction * np.pi / 4), abs=1e-5)
    assert got.length == pytest.approx(0.05 * (2**0.5 if direction % 2 else 1), abs=1e-6)


def test_walk_takes_out_what_the_robot_stands_off_its_cell():
    got = command(PAPER, [0], at=(0.515, 0.535))
    assert got.turn == pytest.approx(np.arctan2(-0.01, 0.06), abs=1e-5)
    assert got.length == pytest.approx(np.hypot(0.06, 0.01), abs=1e-6)


def test_small_turns_are_not_played():
    assert command(PAPER, [0], yaw=0.9 * TURN_DEADBAND).turn == 0
    assert command(PAPER, [0], yaw=1.1 * TURN_DEADBAND).turn == pytest.approx(-1.1 * TURN_DEADBAND, abs=1e-6)


def bump(spec, first, level=1):
    """A bump on all cells from column `first` on."""
    return [(i, j, Cell.BUMP, level) for i in range(spec.shape[0]) for j in range(first, spec.shape[1])]


def test_step_up_and_down():
    up = command(PAPER, [0], edits=bump(PAPER, 11))
    assert (up.primitive, up.rise) == (Primitive.STEP_UP_BUMP, 1)
    assert abs(up.turn) < 1e-6 and up.length == pytest.approx(0.05, abs=1e-6)
    down = command(PAPER, [4], ij=(10, 11), yaw=np.pi, edits=bump(PAPER, 11))
    assert (down.primitive, down.rise) == (Primitive.STEP_DOWN_BUMP, -1)


def test_oblique_step_turns_square_to_the_edge():
    """The edge runs along y: though the path goes on obliquely, the robot steps along x."""
    got = command(PAPER, [1], edits=bump(PAPER, 11))
    assert abs(got.turn) < np.deg2rad(8)
    assert got.length == pytest.approx(0.05, abs=0.008)


def test_gate_is_passed_squatting_until_it_is_left():
    gate = [(10, 11, Cell.GATE, 0), (10, 12, Cell.GATE, 0)]
    for ij in ((10, 10), (10, 11), (10, 12)):
        got = command(PAPER, [0], ij=ij, edits=gate)
        assert got.primitive == Primitive.PASS_GATE and got.squat
    assert not command(PAPER, [0], ij=(10, 13), edits=gate).squat


def test_unmeasured_cell_is_looked_at_once():
    edits = [(11, 11, Cell.UNMEASURED, 0)]
    first = command(PAPER, [1], edits=edits)
    assert first.primitive == Primitive.LOOK and first.length == 0 and not first.squat and first.rise == 0
    assert first.turn == pytest.approx(np.pi / 4, abs=1e-5)
    assert command(PAPER, [1], edits=edits, looked=True).primitive == Primitive.STRAIGHT_FORWARD


def test_cells_in_one_line_are_one_primitive_on_a_fine_grid():
    assert command(FINE, [0, 0]).length == pytest.approx(0.05, abs=1e-6)
    assert command(FINE, [0, 1]).length == pytest.approx(0.025, abs=1e-6)
    assert command(FINE, [0, -1]).length == pytest.approx(0.025, abs=1e-6)
    assert command(FINE, [1, 1]).length == pytest.approx(0.05 * 2**0.5, abs=1e-6)


def test_cells_of_two_kinds_are_two_primitives_on_a_fine_grid():
    assert command(FINE, [0, 0], edits=[(10, 12, Cell.GATE, 0)]).length == pytest.approx(0.025, abs=1e-6)
    up = command(FINE, [0, 0], edits=bump(FINE, 11))
    assert up.primitive == Primitive.STEP_UP_BUMP and up.length == pytest.approx(0.05, abs=1e-6)
    before = command(FINE, [0, 0], edits=bump(FINE, 12))
    assert before.primitive == Primitive.STRAIGHT_FORWARD and before.length == pytest.approx(0.025, abs=1e-6)


@pytest.mark.parametrize("spec", [PAPER, FINE, GridSpec(pitch=0.1, size_x=2.0, size_y=2.0)])
def test_agrees_with_plain_python(spec):
    rng = np.random.default_rng(4)
    for _ in range(60):
        ij = rng.integers(8, 12, 2)
        kinds = rng.choice([0, 1, 1, 1, 2, 3], spec.shape).astype(np.int8)
        heights = np.where(kinds == Cell.BUMP, 1, 0).astype(np.int8)
        x, y = (np.float32((ij[::-1] + rng.uniform(0.1, 0.9, 2)) * spec.pitch)).tolist()
        yaw, looked = float(np.float32(rng.uniform(-3, 3))), bool(rng.random() < 0.5)
        moves = np.where(rng.random(stride(spec)) < 0.7, direction := int(rng.integers(8)), -1)
        moves[0] = direction
        edits = [(i, j, kinds[i, j], heights[i, j]) for i in range(spec.shape[0]) for j in range(spec.shape[1])]
        ours = command(spec, moves, at=(x, y), yaw=yaw, ij=ij, edits=edits, looked=looked)
        theirs = plain.select((x, y, yaw), tuple(ij), moves.tolist(), kinds, heights, looked, spec)
        for name in ("primitive", "rise", "squat"):
            assert getattr(ours, name) == getattr(theirs, name), name
        assert abs(plain.wrap(float(ours.turn) - theirs.turn)) < 1e-4
        assert float(ours.length) == pytest.approx(theirs.length, abs=1e-5)


def test_cell_of():
    for x, y in ((0.0, 0.0), (0.049, 0.051), (1.8, 1.4), (-5.0, 99.0), (0.9, 0.7)):
        ij = cell_of(jnp.float32(x), jnp.float32(y), PAPER)
        assert tuple(ij.tolist()) == plain.cell_of(x, y, PAPER)
