"""Programs are compiled for few sizes."""

import numpy as np

from jaxbiped.core.sizes import fill, filled


def test_sizes_are_powers_of_two():
    assert [filled(n, 8) for n in (0, 1, 7, 8, 9, 16, 17, 1000)] == [8, 8, 8, 8, 16, 16, 32, 1024]
    for n in range(1, 300):
        size = filled(n, 1)
        assert size >= n > size / 2 and size & (size - 1) == 0


def test_rows_are_filled_up_with_the_last_one():
    made = fill({"a": np.arange(6).reshape(3, 2), "b": np.array([1.5, 2.5, 3.5], np.float32)}, 5)
    assert made["a"].tolist() == [[0, 1], [2, 3], [4, 5], [4, 5], [4, 5]]
    assert made["b"].tolist() == [1.5, 2.5, 3.5, 3.5, 3.5] and made["b"].dtype == np.float32
    assert fill(np.arange(3), 3).tolist() == [0, 1, 2]
