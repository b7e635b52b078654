"""Options of `jaxbiped cache`."""

from __future__ import annotations

from jaxbiped.commands.options.base import Options


class CacheArgs(Options):
    """Show what is kept on disk so that programs start sooner: machine code of kernels, and XLA executables.

    It is in the user's cache folder, or where JAXBIPED_CACHE says; with JAXBIPED_CACHE=off nothing is kept.
    """

    clear: bool = False
    """Remove everything."""
