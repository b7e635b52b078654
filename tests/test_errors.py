"""What an error says of the value that it got."""

import numpy as np
import pytest

from jaxbiped.errors import InputError


@pytest.mark.parametrize(
    ("value", "said"),
    [
        (np.float64(0.5), "0.5"),
        (np.int8(3), "3"),
        (np.bool_(True), "True"),
        (np.array([1.5, 2.0]), "[1.5, 2.0]"),
        ((np.float32(0.25), [np.int64(7)], {"a": np.float64(1.0)}), "(0.25, [7], {'a': 1.0})"),
        ("text", "'text'"),
    ],
)
def test_values_are_said_as_python_writes_them(value, said):
    assert str(InputError("must be less", field="f", value=value)) == f"f: must be less (got {said})"
