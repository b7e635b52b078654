"""Options of `jaxbiped cache`."""

from __future__ import annotations

from jaxbiped.commands.options.base import Options


class CacheArgs(Options):
    """Show what is kept on disk so that programs start sooner: machine code of kernels, and XLA's executables.

    It lies in the user's cache folder, or where JAXBIPED_CACHE says; JAXBIPED_CACHE=off keeps nothing.
    """

    clear: bool = False
    """Remove all of it."""
