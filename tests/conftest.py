"""Shared by all tests: shapes of public signatures are checked at run time, here and nowhere else."""

import os
from pathlib import Path

from jaxtyping import install_import_hook

import tests.typecheck  # noqa: F401

ROOT = Path(__file__).parents[1]
MODULES = [".".join(file.relative_to(ROOT).with_suffix("").parts) for file in (ROOT / "jaxbiped").rglob("*.py")]
# Numba compiles functions as they are written, not wrapped in a check.
COMPILED = "jaxbiped.planning.kernels", "jaxbiped.mapping.kernels", "jaxbiped.core.xla_ffi"
# Compiled kernels: one folder for all processes of the suite, which is not the user's.
os.environ.setdefault("JAXBIPED_CACHE", str(ROOT / ".pytest_cache" / "jaxbiped"))
install_import_hook(
    [name for name in MODULES if not name.startswith(COMPILED) and not name.endswith("__init__")],
    "tests.typecheck.check",
)
