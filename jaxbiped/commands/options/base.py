"""What the options of every command share: which of them most people need, and what is said below them."""

from __future__ import annotations

from typing import ClassVar

from jaxbiped.config import Model


class Options(Model):
    """Base of the options of a command."""

    BASIC: ClassVar[tuple[str, ...]] = ()
    """Options that `--help` shows, in this order, `mission.sensor` for one of a group; none: all of them. The rest are
    shown by `--help-all`."""
    NOTES: ClassVar[str] = ""
    """Lines below the options in both."""
