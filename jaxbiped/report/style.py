"""How figures look: as matplotlib comes, whatever the user's matplotlibrc says of fonts, TeX, sizes and colours."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from typing import Any

import matplotlib

OF_WINDOWS = ("backend", "backend_fallback", "interactive", "toolbar")  # which our figures do not have
PLAIN = {name: matplotlib.rcParamsDefault[name] for name in matplotlib.rcParamsDefault if name not in OF_WINDOWS}
INSIDE: ContextVar[bool] = ContextVar("inside", default=False)


@contextmanager
def own_style(changes: Mapping[str, Any] | None = None) -> Iterator[None]:
    """Figures are made, and saved, in this context; also a decorator (`@own_style()`).

    Inside another one it changes only what `changes` says, so that a page can have its own colours.

    Args:
      changes: of matplotlib's parameters.
    """
    base = {} if INSIDE.get() else PLAIN
    token = INSIDE.set(True)
    try:
        with matplotlib.rc_context({**base, **(changes or {})}):
            yield
    finally:
        INSIDE.reset(token)
