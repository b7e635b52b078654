"""Location of compiled programs on disk between processes: in the user's cache folder."""

from __future__ import annotations

import os
import sys
from pathlib import Path

VARIABLE = "JAXBIPED_CACHE"  # a folder, or "off"
OFF = "off"
KERNELS, PROGRAMS = "kernels", "programs"  # folders in it
MOST_PROGRAMS = 500_000_000  # maximum size of all executables in bytes


def cache_folder() -> Path | None:
    """The folder, which need not exist; None if nothing is to be kept."""
    asked = os.environ.get(VARIABLE, "").strip()
    if asked.lower() == OFF:
        return None
    try:
        if asked:
            return Path(asked).expanduser()
        home = Path.home()
    except RuntimeError:  # a process without a home directory, or an unknown user
        return None
    if sys.platform == "darwin":
        return home / "Library" / "Caches" / "jaxbiped"
    return Path(os.environ.get("XDG_CACHE_HOME") or home / ".cache") / "jaxbiped"
