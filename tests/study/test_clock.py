"""The compile clock against what was counted by hand, and against a real compilation."""

import time

import jax
import jax.numpy as jnp
import pytest

from jaxbiped.study.clock import CompileClock


def test_what_lies_within_another_counts_once():
    clock = CompileClock()
    for begin, end in [(0.0, 1.0), (2.0, 3.0), (4.0, 5.0), (1.5, 6.0), (7.0, 8.0)]:
        clock.add(begin, end)
    assert clock.seconds == pytest.approx(1 + 4.5 + 1)
    clock.add(0.5, 9.0)  # overlaps the first in part
    assert clock.seconds == pytest.approx(9)


def test_a_compilation_is_counted_once_and_no_run_is():
    clock, begin = CompileClock(), time.perf_counter()
    inner = jax.jit(lambda x: jnp.linalg.eigh(x + x.T)[0].sum())
    outer = jax.jit(lambda x: inner(x) + inner(2 * x))
    outer(jnp.ones((7, 7))).block_until_ready()
    spent = time.perf_counter() - begin
    compiling = clock.seconds
    assert 0 < compiling < spent
    for _ in range(3):
        outer(jnp.ones((7, 7))).block_until_ready()
    assert clock.seconds == compiling
