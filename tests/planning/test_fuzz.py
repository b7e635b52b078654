"""The planning functions refuse what they cannot use, and are right about the rest: in any rank, type and transform.

What must be refused is tried in a child process, so that a crash is seen. It compiles nothing: fields and paths are
made up there, and what is refused reaches no kernel.
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from jax import lax

from jaxbiped import planning
from jaxbiped.errors import InputError
from jaxbiped.planning import Costs, Rules, Times
from tests import fuzzing
from tests.fuzzing import same
from tests.planning import adversarial

B, H, W = 6, 5, 7
RNG = np.random.default_rng(0)
CLASSES, LEVELS, GOALS = adversarial.maps(RNG, (H, W), B)
STARTS = np.stack([RNG.integers(0, H, B), RNG.integers(0, W, B)], -1)
EDGES = RNG.uniform(0, 9, (B, 8, H, W)).astype(np.float32)
FIELD = planning.CostToGo(np.ones((B, H, W), np.float32), np.ones(B, np.int32), np.ones(B, bool))
PATH = planning.Path(
    np.zeros((B, 10, 2), np.int32),
    np.zeros((B, 9), np.int8),
    np.ones(B, np.int32),
    np.ones(B, np.float32),
    np.ones(B, bool),
)
MOVES = planning.Moves(np.ones((B, 8, H, W), np.float32), np.zeros((B, 8, H, W), np.int8))
HEADINGS = planning.HeadingField(MOVES.time, MOVES, np.ones(B, np.float32), np.ones(B, bool))
YAW = np.linspace(-4, 4, B).astype(np.float32)
FACING = np.arange(B)

GRIDS = {"classes": CLASSES, "levels": LEVELS}
ARGUMENTS = {
    planning.edge_costs: GRIDS,
    planning.field: GRIDS | {"goal_ij": GOALS},
    planning.cost_to_go: {"edge_costs": EDGES, "goal_ij": GOALS},
    planning.read_path: {"field": FIELD, "edge_costs": EDGES, "start_ij": STARTS, "max_length": 9, "heading": FACING},
    planning.next_step: GRIDS
    | {"field_cost": FIELD.cost, "costs": Costs(), "rules": Rules(), "ij": STARTS, "heading": FACING, "length": 2},
    planning.path_cost: GRIDS | {"costs": Costs(), "start_ij": STARTS, "goal_ij": GOALS, "heading": FACING},
    planning.move_counts: GRIDS | {"path": PATH},
    planning.heading_moves: GRIDS | {"times": Times(), "rules": Rules()},
    planning.heading_field: GRIDS | {"goal_ij": GOALS},
    planning.heading_path: {"field": HEADINGS, "start_ij": STARTS, "yaw": YAW, "max_length": 9},
    planning.path_time: {"moves": HEADINGS.moves, "turn": HEADINGS.turn, "path": PATH, "yaw": YAW},
}
CELLS = ("goal_ij", "start_ij", "ij")
REAL = ("edge_costs", "field_cost", "yaw", "turn")


def test_bad_arguments_are_refused_and_odd_ones_are_right():
    fuzzing.run(__name__)


def wrong_values(name, value):
    """What must be refused in place of an argument."""
    yield from (None, "x", object(), [[1], [1, 2]], np.array(["x"]), value.astype(complex))
    yield np.concatenate([value, value])  # a batch that does not broadcast
    if value.ndim > 1:
        yield value[..., None, None, None]
    if name != "edge_costs":  # of which another size is another grid
        yield np.concatenate([value, value[..., :1]], -1)
    if name in CELLS:
        yield from (value + 0.7, value[..., :1], value[..., 0], np.full(value.shape, True), 3, [])
    elif name in REAL:
        yield np.full(value.shape, True)
    else:
        yield from (value.astype(np.float32), np.full(value.shape, np.nan), value > 0)
    if name == "classes":
        yield from (value + 9, value - 9, value.astype(np.int64) + 2**32, value[0, 0], value[:, :3], 1)
    if name == "levels":
        yield from (value.astype(int) + 1000, value[:, :3], np.repeat(value, 50, 0), 0)
    if name == "heading":
        yield from (np.full(B, 8), np.full(B, -2), np.zeros(B))


def cases():
    tried = {}
    for function, arguments in ARGUMENTS.items():
        for name, value in arguments.items():
            if isinstance(value, np.ndarray) or name == "field_cost":
                for k, wrong in enumerate(wrong_values(name, np.asarray(value))):
                    if wrong is None and name == "heading":
                        continue
                    call = partial(function, **arguments | {name: wrong})
                    tried[f"{function.__name__}({name}: {k})"] = call
                    if isinstance(wrong, np.ndarray) and wrong.dtype.kind in "if" and statically_wrong(name, wrong):
                        tried[f"{function.__name__}({name}: {k}, traced)"] = partial(
                            traced, function, arguments, name, wrong
                        )
        tried |= unpaired(function, arguments)
    return tried | {"static arguments": static_arguments, "astar": reference}


def statically_wrong(name, wrong):
    """Whether shape or dtype tell."""
    valid = np.asarray({"ij": STARTS}.get(name, next(a[name] for a in ARGUMENTS.values() if name in a)))
    return wrong.shape != valid.shape or wrong.dtype.kind != valid.dtype.kind


def traced(function, arguments, name, wrong):
    jax.eval_shape(lambda value: function(**arguments | {name: value}), wrong)


def unpaired(function, arguments):
    """Costs, rules and times that are no numbers or of another batch."""
    parts = {"costs": Costs(), "rules": Rules(), "times": Times()}
    taken = [p for p in parts if p in arguments or (p in ("costs", "rules") and function is planning.field)]
    out = {}
    for name in taken:
        first = next(iter(parts[name].__dict__))
        for wrong in ("x", None, np.ones((B, 2)), np.ones(B + 1), [[1], [1, 2]], 1j):
            bad = replace(parts[name], **{first: wrong})
            out[f"{function.__name__}({name}.{first}={str(wrong)[:20]})"] = partial(function, **arguments | {name: bad})
    return out


LONG = (planning.heading_field, planning.heading_moves, planning.heading_path, planning.path_cost, planning.next_step)


@pytest.mark.parametrize(
    "function", [pytest.param(f, marks=pytest.mark.slow if f in LONG else (), id=f.__name__) for f in ARGUMENTS]
)
def test_any_rank_and_type_gives_the_same(function):
    """One arena without a batch axis, two batch axes, int64 and JAX arrays."""
    arguments = ARGUMENTS[function]
    whole = function(**arguments)
    arrays = {name: value for name, value in arguments.items() if hasattr(value, "ndim") or hasattr(value, "__dict__")}
    pick = lambda index: {  # noqa: E731
        name: jax.tree.map(lambda leaf: np.asarray(leaf)[index] if np.ndim(leaf) else leaf, value)
        for name, value in arrays.items()
    }
    one = function(**arguments | pick(2))
    assert same(one, jax.tree.map(lambda leaf: leaf[2], whole)), "one arena"
    square = {
        name: jax.tree.map(
            lambda leaf: np.asarray(leaf).reshape(2, 3, *leaf.shape[1:]) if np.ndim(leaf) else leaf, value
        )
        for name, value in arrays.items()
    }
    two = function(**arguments | square)
    assert same(jax.tree.map(lambda leaf: leaf.reshape(B, *leaf.shape[2:]), two), whole), "two batch axes"
    wide = {
        name: value.astype(np.int64) if isinstance(value, np.ndarray) and value.dtype.kind == "i" else value
        for name, value in arrays.items()
    }
    assert same(function(**arguments | wide), whole), "int64"
    assert same(function(**arguments | jax.tree.map(jnp.asarray, arrays)), whole), "JAX arrays"
    assert same(jax.jit(lambda a: function(**arguments | a))(arrays), whole), "jit"


def refuses(function, **arguments):
    try:
        function(**arguments)
    except InputError:
        return True
    return False


def static_arguments():
    goals, read = GRIDS | {"goal_ij": GOALS}, ARGUMENTS[planning.read_path]
    bad = [
        (planning.field, GRIDS),
        *((function, goals | {"method": "dial"}) for function in (planning.field, planning.heading_field)),
        *((planning.heading_field, goals | {"pitch": pitch}) for pitch in (0, -1, np.nan, np.inf, "x", None)),
        *((planning.read_path, read | {"max_length": length}) for length in (-1, 2.5, "x", None)),
        (planning.read_path, read | {"edge_costs": EDGES[:, :4]}),
    ]
    return all(refuses(function, **arguments) for function, arguments in bad)


def test_traced_maps_with_a_cell_of_no_class_do_not_converge():
    """A map with a cell of no class, where values are not known: it does not converge; its neighbours do."""
    jitted = jax.jit(lambda c, v: planning.field(c, v, goal_ij=GOALS))
    headings = jax.jit(lambda c, v: planning.heading_field(c, v, goal_ij=GOALS))
    for bad in (9, -1, 5, 127, -128, 2**20):
        classes = CLASSES.astype(np.int32)
        classes[1, 2, 3] = bad
        for function in (jitted, headings):
            out = function(classes, LEVELS)
            assert out.converged.tolist() == [k != 1 for k in range(B)] and np.isinf(out.cost[1]).all(), bad
    levels, classes = LEVELS.astype(np.int32), CLASSES.copy()
    classes[1, 2, 3], levels[1, 2, 3] = 1, 300
    out = jitted(classes, levels)
    assert out.converged.tolist() == [k != 1 for k in range(B)]
    edges = jax.jit(planning.edge_costs)(classes, levels)
    assert np.isinf(edges[1, :, 2, 3]).all()


def test_goals_beyond_int32_are_outside():
    """Where an int32 of 2**32 would be the first cell."""
    for far in (2**31, 2**32, -(2**32), 2**62):
        out = planning.field(CLASSES, LEVELS, goal_ij=np.full((B, 2), far))
        assert np.isinf(out.cost).all() and out.converged.all()


def test_levels_of_cells_that_nobody_stands_on_are_not_read():
    levels = np.where((CLASSES == 0) | (CLASSES == 4), 10**6, LEVELS.astype(int))
    assert same(*(planning.field(CLASSES, given, goal_ij=GOALS) for given in (levels, LEVELS)))


def test_nested_lists_are_arrays():
    out = planning.field([[1, 1], [4, 1]], [[0, 0], [0, 0]], goal_ij=[1, 1])
    assert out.cost.tolist() == [[4.0, 2.0], [np.inf, 0.0]]


def test_grids_without_cells_and_batches_without_arenas():
    for shape in ((0, 4, 5), (3, 0, 5)):
        none, goal = np.zeros(shape, np.int8), np.zeros((shape[0], 2), int)
        assert planning.field(none, none, goal_ij=goal).cost.shape == shape
        assert planning.cost_to_go(planning.edge_costs(none, none), goal).cost.shape == shape
        assert planning.heading_field(none, none, goal_ij=goal).cost.shape == (shape[0], 8, *shape[1:])
        field, edges = planning.field(none, none, goal_ij=goal), planning.edge_costs(none, none)
        path = planning.read_path(field, edges, goal, 2)
        assert path.directions.shape == (shape[0], 2) and not path.valid.any()
        step = planning.next_step(field.cost, none, none, Costs(), Rules(), goal, np.full(shape[0], -1), length=3)
        assert (step == -1).all() and step.shape == (shape[0], 3)
        assert np.isinf(planning.path_cost(Costs(), none, none, start_ij=goal, goal_ij=goal)).all()


@pytest.mark.parametrize("everything", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_vmap_scan_and_jit_within_each_other(everything):
    """`vmap` and `scan`, alone and within each other, of one map and of batches."""

    def plan(goal_ij, classes):
        field = planning.field(classes, LEVELS[0], goal_ij=goal_ij)
        if not everything:
            return field
        edges = planning.edge_costs(classes, LEVELS[0])
        path = planning.read_path(planning.cost_to_go(edges, goal_ij), edges, [0, 0], H * W)
        headings = planning.heading_field(classes, LEVELS[0], goal_ij=goal_ij)
        cost = planning.path_cost(Costs(), classes, LEVELS[0], start_ij=[0, 0], goal_ij=goal_ij)
        return field, path, headings, cost, planning.heading_path(headings, [0, 0], 0.5, 9)

    single = [plan(goal, classes) for goal, classes in zip(GOALS, CLASSES, strict=True)]
    wanted = jax.tree.map(lambda *leaves: jnp.stack(leaves), *single)
    goals, classes = jnp.asarray(GOALS), jnp.asarray(CLASSES)
    assert same(jax.jit(jax.vmap(plan))(goals, classes), wanted), "jit of vmap"
    scanned = jax.jit(lambda *a: lax.scan(lambda _, row: (None, plan(*row)), None, a)[1])(goals, classes)
    assert same(scanned, wanted), "scan"
    batches = goals.reshape(3, 2, 2), classes.reshape(3, 2, H, W)
    nested = jax.jit(lambda *a: lax.scan(lambda _, row: (None, jax.vmap(plan)(*row)), None, a)[1])(*batches)
    assert same(jax.tree.map(lambda leaf: leaf.reshape(B, *leaf.shape[2:]), nested), wanted)


def test_vmap_twice_with_axes_of_its_own():
    many = jax.vmap(jax.vmap(lambda c, g: planning.field(c, LEVELS[0], goal_ij=g).cost, (None, 0)), (0, None), 1)
    out = many(jnp.asarray(CLASSES), jnp.asarray(GOALS))
    assert same(out, planning.field(CLASSES, LEVELS[0], goal_ij=GOALS[:, None]).cost)


def test_gradients_count_moves_or_say_what_to_use():
    """That of `path_cost` counts the moves; a field says what to use, and is no obstacle where nothing asks for it."""

    def cost(costs, classes, levels, start_ij, goal_ij):
        return planning.path_cost(costs, classes, levels, start_ij=start_ij, goal_ij=goal_ij)

    counts = jax.vmap(jax.grad(cost), (None, 0, 0, 0, 0))(Costs(), CLASSES, LEVELS, STARTS, GOALS)
    edges = planning.edge_costs(CLASSES, LEVELS)
    path = planning.read_path(planning.cost_to_go(edges, GOALS), edges, STARTS, H * W)
    wanted = planning.move_counts(path, CLASSES, LEVELS).per_cost()
    assert fuzzing.close(counts, wanted), "counts"
    asked = (
        lambda c: planning.field(CLASSES, LEVELS, Costs(c0=c), goal_ij=GOALS).cost.sum(),
        lambda c: planning.cost_to_go(EDGES * c, GOALS).cost.sum(),
        lambda c: planning.heading_field(CLASSES, LEVELS, Times(turn=c), goal_ij=GOALS).cost.sum(),
    )
    for function in asked:
        ways = (
            (jax.grad(function), 1.0),
            (jax.jit(jax.grad(function)), 1.0),
            (jax.vmap(jax.grad(function)), jnp.ones(2)),
        )
        for differentiated, value in ways:
            try:
                differentiated(value)
            except InputError as error:
                assert "planning.path_" in str(error)
            else:
                raise AssertionError("a field was differentiated")
    still = jax.grad(lambda x: x * planning.field(CLASSES[0], LEVELS[0], goal_ij=GOALS[0]).converged)
    assert still(1.0) == 1.0


def test_fields_that_did_not_converge_have_no_paths():
    """Costs that are NaN or negative; and a field that says itself that it is wrong."""
    for bad in (np.nan, -1.0, -np.inf):
        c1 = np.ones(B, np.float32)
        c1[2] = bad
        out = planning.field(CLASSES, LEVELS, Costs(c1=c1), goal_ij=GOALS)
        assert out.converged.tolist() == [k != 2 for k in range(B)]
    edges = planning.edge_costs(CLASSES, LEVELS)
    field = planning.cost_to_go(edges, GOALS)
    wrong = replace(field, converged=jnp.zeros(B, bool))
    valid = [planning.read_path(given, edges, STARTS, H * W).valid for given in (field, wrong)]
    assert valid[0].any() and not valid[1].any()


def reference():
    edges = EDGES[0]
    bad = (
        {"edge_costs": edges[:4]}, {"edge_costs": -edges}, {"edge_costs": edges * np.nan}, {"edge_costs": "x"},
        {"edge_costs": EDGES}, {"start_ij": (0.5, 1)}, {"start_ij": (1,)}, {"goal_ij": (1, 2, 3)}, {"goal_ij": None},
        {"heading": 8}, {"heading": -2}, {"heading": 0.5},
    )  # fmt: skip
    valid = {"edge_costs": edges, "start_ij": (0, 0), "goal_ij": (1, 1)}
    return all(refuses(planning.astar, **valid | wrong) for wrong in bad)


def test_programs_of_double_precision_give_the_same_bits():
    def all_of_them():
        edges = planning.edge_costs(CLASSES, LEVELS)
        fields = [planning.cost_to_go(np.asarray(edges, np.float64), GOALS, method=m) for m in ("auto", "wavefront")]
        path = planning.read_path(fields[0], edges, STARTS, H * W)
        return edges, fields, path, planning.heading_field(CLASSES, LEVELS, goal_ij=GOALS)

    single = all_of_them()
    with jax.enable_x64(True):
        assert same(all_of_them(), single)
