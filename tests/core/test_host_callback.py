"""Python functions inside compiled programs: what goes in and out is what NumPy would have."""

from concurrent.futures import ThreadPoolExecutor
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from jaxbiped.core.host_callback import host_call


def shape_of(*arrays):
    return [jax.ShapeDtypeStruct(a.shape, a.dtype) for a in arrays]


@pytest.mark.parametrize("dtype", [np.bool_, np.int8, np.int32, np.uint32, np.float32])
@pytest.mark.parametrize("shape", [(), (1,), (0,), (3, 4), (2, 0, 5), (2, 3, 4, 5)])
def test_arrays_of_every_kind(dtype, shape):
    given = np.random.default_rng(0).integers(0, 2, shape).astype(dtype)
    seen = []

    def double(array):
        seen.append((array.dtype, array.shape))
        return [array.copy(), ~array if dtype == np.bool_ else array + np.array(1, dtype)]

    one, two = jax.jit(lambda a: host_call(double, shape_of(given, given), a))(given)
    np.testing.assert_array_equal(one, given)
    np.testing.assert_array_equal(two, ~given if dtype == np.bool_ else given + np.array(1, dtype))
    assert seen == [(given.dtype, given.shape)]


def add(array, count):
    return [array + count]


def loop(array, rounds):
    def turn(k, total):
        return host_call(add, shape_of(total), total, k.astype(jnp.float32))[0]

    return jax.lax.fori_loop(0, rounds, turn, array)


def test_in_loops_and_in_many_threads_at_once():
    program = jax.jit(partial(loop, rounds=300))
    with ThreadPoolExecutor(4) as pool:
        results = list(pool.map(program, [jnp.full(50, float(k)) for k in range(12)]))
    for k, result in enumerate(results):
        np.testing.assert_array_equal(result, np.full(50, k + 300 * 299 / 2, np.float32))


def test_an_error_does_not_end_the_process(capfd):
    def broken(array):
        raise RuntimeError("no answer")

    jax.block_until_ready(jax.jit(lambda a: host_call(broken, shape_of(a), a))(jnp.zeros(3)))
    assert "RuntimeError: no answer" in capfd.readouterr().err
