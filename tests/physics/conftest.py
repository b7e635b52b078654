"""Backends that are dear to make, made once."""

import pytest

from jaxbiped import physics
from tests.physics.models import BATCH, FIELDS, HOPPER, WATCH, own_fields


@pytest.fixture(scope="session")
def native():
    return physics.make("native", HOPPER, BATCH, watch=WATCH)


@pytest.fixture(scope="session")
def mjx():
    """Compiled once for the whole session; `test_mjx` checks that it was."""
    return physics.make("mjx", HOPPER, BATCH, watch=WATCH, fields=FIELDS)


@pytest.fixture(params=["native", "mjx"])
def backend(request):
    """Both, at the model's own fields and initial state."""
    made = request.getfixturevalue(request.param)
    yield made
    made.set_fields(own_fields(made.model))
    made.reset()
