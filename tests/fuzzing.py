"""Nasty arguments, each tried in one child process without the run-time checks of `tests/conftest.py`.

So what is tested are the checks of the package itself; and a crash of the process, which no exception shows, names its
case. A table is a module with `cases()`: {name: function without arguments}. A case must raise `InputError` in one
line, or return True: the result is right.
"""

from __future__ import annotations

import importlib
import os
import subprocess
import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path

import jax
import numpy as np

from jaxbiped.errors import InputError

ROOT = Path(__file__).parents[1]


def run(module: str) -> None:
    """Try the cases of a module in a child process, and fail with what went wrong."""
    quick = "--xla_backend_optimization_level=0 --xla_llvm_disable_expensive_passes=true"  # to compile
    environment = os.environ | {"JAX_PLATFORMS": "cpu", "PYTHONPATH": str(ROOT), "XLA_FLAGS": quick}
    command = [sys.executable, "-m", "tests.fuzzing", module]
    done = subprocess.run(command, check=False, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=600)
    lines = done.stdout.splitlines()
    wrong = [line for line in lines if line.startswith("WRONG")]
    last = lines[-1] if lines else "none"
    assert done.returncode == 0, f"exit status {done.returncode} after: {last}\n{done.stderr[-3000:]}"
    assert not wrong, "\n".join(wrong)
    assert lines and lines[-1].startswith("done"), done.stderr[-3000:]


def spoiled(name: str, function: Callable, arguments: dict[str, object], optional: tuple[str, ...] = ()) -> dict:
    """Cases: each leaf of the arguments of a function spoiled in every way that must be refused.

    Arrays in rank, size and type, both when called and under `jit`; other arguments replaced by what they are not.

    Args:
      arguments: valid ones, by name.
      optional: names, or last parts of them, of leaves that may be None.
    """
    leaves, structure = jax.tree_util.tree_flatten_with_path(arguments)
    cases = {}

    def given(k, value):
        return jax.tree.unflatten(structure, [value if i == k else leaf for i, (_, leaf) in enumerate(leaves)])

    for k, (path, leaf) in enumerate(leaves):
        place = f"{name}({jax.tree_util.keystr(path, simple=True, separator='.')}"
        if not isinstance(leaf, (np.ndarray, np.generic, jax.Array)):
            for wrong in ("x", object(), [1, [2]]):
                cases[f"{place}={type(wrong).__name__})"] = partial(called, function, given(k, wrong))
            continue
        for what, wrong in ways(np.asarray(leaf)).items():
            if wrong is None and place.endswith(optional):
                continue
            cases[f"{place}: {what})"] = partial(called, function, given(k, wrong))
            if what in ("another rank", "another type", "another size"):
                cases[f"{place}: {what}, traced)"] = partial(traced, function, given(k, wrong), k)
    return cases


def ways(leaf: np.ndarray) -> dict[str, object]:
    """An array spoiled."""
    kinds = {"f": np.bool_, "i": np.float32, "u": np.float32, "b": np.int8}
    wrong = {
        "another rank": leaf[None],
        "another type": leaf.astype(kinds[leaf.dtype.kind]),
        "complex": leaf.astype(np.complex64),
        "text": np.full(leaf.shape, "x"),
        "ragged": [[1.0], [1.0, 2.0]],
        "nothing": None,
    }
    if leaf.ndim:
        wrong |= {"another size": np.concatenate([leaf, leaf[-1:]]), "a scalar": leaf.reshape(-1)[0]}
    return wrong


def called(function: Callable, arguments: dict[str, object]) -> None:
    """Call a function with arguments that it must refuse."""
    function(**arguments)


def traced(function: Callable, arguments: dict[str, object], k: int) -> None:
    """The same where the values of leaf `k` are not known, as under `jit`."""
    leaves, structure = jax.tree.flatten(arguments)

    def of_one(leaf):
        return function(**jax.tree.unflatten(structure, [*leaves[:k], leaf, *leaves[k + 1 :]]))

    jax.eval_shape(of_one, leaves[k])


def same(*trees: object) -> bool:
    """Whether trees of arrays are equal to the last bit, NaN equal to NaN."""
    first, *others = (jax.tree.leaves(tree) for tree in trees)
    equal = all(len(other) == len(first) for other in others)
    return equal and all(
        np.array_equal(a, b, equal_nan=np.asarray(a).dtype.kind == "f")
        for other in others
        for a, b in zip(first, other, strict=True)
    )


def mapped(function: Callable, *arguments: object) -> bool:
    """Whether `vmap` and `scan` of a function, under `jit`, give the same for the rows [rows, ...] of arguments."""
    each = jax.jit(lambda *a: jax.lax.scan(lambda _, row: (None, function(*row)), None, a)[1])(*arguments)
    return close(each, jax.jit(jax.vmap(function))(*arguments))


def close(a: object, b: object) -> bool:
    """Whether trees of arrays are equal, real numbers to rounding."""
    pairs = zip(jax.tree.leaves(a), jax.tree.leaves(b), strict=True)
    return all(np.allclose(x, y, rtol=1e-5, atol=1e-5, equal_nan=np.asarray(x).dtype.kind == "f") for x, y in pairs)


def outcome(case: Callable[[], object]) -> str:
    """What became of a case, in one line."""
    try:
        result = case()
    except InputError as error:
        text = str(error)
        plain = text and "\n" not in text and "np." not in text and "Traced" not in text
        return f"refused: {text}" if plain else f"WRONG message: {text!r}"
    except BaseException as error:
        return f"WRONG error: {type(error).__name__}: {' '.join(str(error).split())[:200]}"
    return "right" if result is True else f"WRONG result: {result!r}"[:300]


def main() -> None:
    """Print one line before and one after each case, so that a crash is known by its last line."""
    tried = importlib.import_module(sys.argv[1]).cases()
    for name, case in tried.items():
        print(f"try {name}", flush=True)
        told = outcome(case)
        print(f"{told.split()[0] if told.startswith('WRONG') else 'ok'} {name}: {told}", flush=True)
    print(f"done {len(tried)}", flush=True)


if __name__ == "__main__":
    main()
