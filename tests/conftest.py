"""Shared by all tests: shapes of public signatures are checked at run time, here and nowhere else."""

from jaxtyping import install_import_hook

import tests.typecheck  # noqa: F401

install_import_hook("jaxbiped", "tests.typecheck.check")
