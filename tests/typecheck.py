"""Run-time checks of shapes in signatures: functions only.

Fields of a pytree may hold anything while JAX maps over it (shapes, axes, tracers), so the constructors
of the dataclasses stay unchecked.
"""

import beartype


def check(function):
    """The type checker that jaxtyping's import hook calls on every function of the package."""
    return function if "__init__" in function.__qualname__ else beartype.beartype(function)
