"""The style of figures: matplotlib's defaults, whatever the user's matplotlibrc sets for fonts, sizes and colours."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import matplotlib

OF_WINDOWS = ("backend", "backend_fallback", "interactive", "toolbar")  # which do not concern our figures
PLAIN = {name: matplotlib.rcParamsDefault[name] for name in matplotlib.rcParamsDefault if name not in OF_WINDOWS}
INSIDE: ContextVar[bool] = ContextVar("inside", default=False)


@contextmanager
def own_style(changes: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Context in which figures are made and saved; also a decorator (`@own_style()`).

    Nested in another one it changes only `changes`, so that a page can have its own colours.

    Args:
      changes: matplotlib parameters.
    """
    base = {} if INSIDE.get() else PLAIN
    token = INSIDE.set(True)
    try:
        with matplotlib.rc_context({**base, **(changes or {})}):
            yield
    finally:
        INSIDE.reset(token)
