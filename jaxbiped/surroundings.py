"""Settings in the user's shell and rc files, kept from breaking the package or changing its results.

Variables that say where to compute, what to keep on disk and what to log are respected. Those that change how JAX and
Numba compute are overridden, so that rows are the same in every shell. Unusable values are reported in one line.
"""

from __future__ import annotations

import contextlib
import os
import re
import subprocess
import sys
import traceback
import warnings
from collections.abc import Iterator
from pathlib import Path

from jaxbiped.errors import InputError

# Full names: devices; caches on disk; logs, dumps and tracebacks; processes of a cluster.
RESPECTED = re.compile(
    r"JAX_(PLATFORMS|PLATFORM_NAME|NUM_CPU_DEVICES|DEFAULT_DEVICE|\w+_VISIBLE_DEVICES|PJRT_\w+"
    r"|COMPILATION_CACHE_\w+|ENABLE_COMPILATION_CACHE|PERSISTENT_CACHE_\w+|RAISE_PERSISTENT_CACHE_ERRORS"
    r"|LOG_COMPILES|LOGGING_LEVEL|DEBUG_LOG_MODULES|EXPLAIN_CACHE_MISSES|DUMP_IR_\w+|TRACEBACK_\w+|INCLUDE_\w+"
    r"|COORDINATOR_\w+|NUM_PROCESSES|PROCESS_ID|LOCAL_DEVICE_IDS)"
    r"|NUMBA_(CACHE_DIR|DEBUG_CACHE)"
)
PREFIXES = ("JAX_", "NUMBA_")
# Prefixes of variables read by our libraries: they distinguish errors of the libraries from ours.
READ = (*PREFIXES, "XLA_", "MUJOCO_", "PYOPENGL_", "MPL", "MATPLOTLIB", "POLARS_", "CUDA_", "TPU_", "PJRT_")
OF_DEVICES = ("JAX_PLATFORMS", "JAX_PLATFORM_NAME", "JAX_NUM_CPU_DEVICES", "JAX_DEFAULT_DEVICE")
PARSE_FLAGS = "from jaxlib import xla_client; xla_client.CompileOptions()"  # XLA terminates a process with bad flags
FLAGS_TIME = 60.0  # [s] time limit for that
LOGGED = re.compile(r"^[EF]\d{4} \S+ +\d+ \S+\] (.*?)\.?$", re.MULTILINE)  # an error in XLA's log format


# Set, not removed: for unset variables, Numba reads a .numba_config.yaml in the working folder.
SET = {"NUMBA_DISABLE_JIT": "0", "MPLBACKEND": "agg", "MATPLOTLIBRC": os.devnull}


@contextlib.contextmanager
def settled() -> Iterator[None]:
    """Override what would change our results or fail, in a block in which JAX, Numba and matplotlib are imported.

    Raises:
      InputError: XLA would terminate this process for its flags, or a matplotlibrc in this folder is not text.
    """
    foreign = {name for name in os.environ if name.startswith(PREFIXES) and not RESPECTED.fullmatch(name)}
    before = {name: os.environ.pop(name, None) for name in foreign | SET.keys()}
    os.environ.update(SET)
    try:
        with warnings.catch_warnings():
            warnings.showwarning = tell
            if os.environ.get("PYTHONWARNINGS"):
                warnings.resetwarnings()  # "error" would turn any library's warning into an error
                warnings.simplefilter("default")
            check_matplotlibrc(Path("matplotlibrc"))
            if os.environ.get("XLA_FLAGS") and "jax" not in sys.modules:
                check_flags(os.environ["XLA_FLAGS"])
            yield
    finally:
        for name in SET:
            os.environ.pop(name, None)
        os.environ.update({name: value for name, value in before.items() if value is not None})


def tell(message: Warning | str, category: type[Warning], filename: str, lineno: int, file=None, line=None) -> None:
    """Like `warnings.showwarning`, but in one line and without the line of code."""
    text = " ".join(str(message).split())
    print(f"jaxbiped: warning: {text}", file=sys.stderr if file is None else file)


def check_matplotlibrc(file: Path) -> None:
    """Raise `InputError` if matplotlib would fail to read its settings: it looks in the working folder first."""
    if file.is_file():
        try:
            file.read_text(encoding="utf-8")
        except (OSError, UnicodeDecodeError) as error:
            why = ": it is not in UTF-8" if isinstance(error, UnicodeDecodeError) else ""
            message = f"cannot be read as text{why}; matplotlib would read its settings from it"
            raise InputError(message, file=file) from None


def check_flags(flags: str) -> None:
    """Raise `InputError` if XLA rejects its flags, as tested in a separate process."""
    try:
        command = [sys.executable, "-c", PARSE_FLAGS]
        run = subprocess.run(command, check=False, capture_output=True, text=True, timeout=FLAGS_TIME)
    except (OSError, subprocess.SubprocessError):
        return  # then XLA has to report it
    if run.returncode and (said := LOGGED.search(run.stderr)):
        raise InputError(f"cannot be used: {said[1]}", field="XLA_FLAGS", value=flags)


def check_devices() -> None:
    """Raise `InputError` if JAX finds no devices, with the variable that selects them."""
    import jax

    try:
        jax.devices()
    except Exception as error:  # RuntimeError, AssertionError, ... by backend
        asked = next((name for name in OF_DEVICES if os.environ.get(name)), None)
        if asked is None:
            raise
        said = first_line(error) or "no such device here"
        raise InputError(f"no devices: {said}", field=asked, value=os.environ[asked]) from None


def culprit(error: Exception) -> InputError | None:
    """The one-line error about a variable named in a library's error; None if it names none that is set."""
    said = first_line(error)
    for name, value in os.environ.items():
        if name.startswith(READ) and value and re.search(rf"\b{name}\b", said, re.IGNORECASE):
            return InputError(f"cannot be used: {said}", field=name, value=value)
    return named_window_system(error)


def named_window_system(error: BaseException) -> InputError | None:
    """The one-line error about `MUJOCO_GL` if MuJoCo failed to import the library that it names, of which it raises
    whatever that library does: for OSMesa an `AttributeError` about `glGetError`."""
    asked = os.environ.get("MUJOCO_GL", "")
    files = [frame.filename for frame in traceback.extract_tb(error.__traceback__)]
    if not asked or not any(Path(file).parts[-3:] == ("rendering", "classic", "gl_context.py") for file in files):
        return None
    said = first_line(error) or type(error).__name__
    return InputError(f"its library cannot be loaded: {said}", field="MUJOCO_GL", value=asked)


def first_line(error: Exception) -> str:
    """The first line of an error's message."""
    return (str(error).strip().splitlines() or [""])[0]
