"""Prints the CPU seconds of the first and of the second start of commands, of this version and of another one.

    python -m sweeps.benchmarks.startup [FOLDER]

FOLDER: a checkout of the other version; without it there is nothing to compare with. Each version has an empty cache
folder of its own (JAXBIPED_CACHE, and JAX's own cache for versions that know no other). The two take turns, so that
both have the same machine. Seconds are of user and system together: other load changes them less than the time that
passes.
"""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parents[2]
FIELD = """
import numpy as np
from jaxbiped import planning
classes = np.ones((1, 28, 36), np.int8)
print(planning.field(classes, 0 * classes, goal_ij=np.array([[3, 4]])).converged)
"""
MAP = str(HERE / "tests" / "data" / "rooms.yaml")
SCENE = str(HERE / "configs" / "scenes" / "experiment_5.toml")
WRONG = 2  # exit status
PROGRAMS = {
    "--help": ("-m", "jaxbiped", "--help"),
    "compare --help": ("-m", "jaxbiped", "compare", "--help"),
    "run, a wrong option": ("-m", "jaxbiped", "run", SCENE, "--speed", "3"),
    "first planning.field": ("-c", FIELD),
    "plan": ("-m", "jaxbiped", "plan", MAP, "--start", "-0.8", "-0.3", "--goal", "0.7", "0.6", "--out"),
    "run": ("-m", "jaxbiped", "run", SCENE, "--out"),
}


def main() -> None:
    """Print the table."""
    versions = {"here": HERE} | ({"there": Path(sys.argv[1]).resolve()} if len(sys.argv) > 1 else {})
    titles = [f"{name}, {start}" for name in versions for start in ("first", "second")]
    print(
        f"{'[CPU s]':<22}"
        + "".join(f"{title:>15}" for title in titles)
        + ("   second, here / there" * (len(titles) > 2))
    )
    with tempfile.TemporaryDirectory() as room:
        for row, words in PROGRAMS.items():
            spent = {name: [] for name in versions}
            for turn in range(2):
                for name, folder in versions.items():
                    spent[name].append(seconds(words, folder, Path(room) / name, f"{row.split()[0]}-{turn}"))
            numbers = [value for name in versions for value in spent[name]]
            share = f"{spent['here'][1] / spent['there'][1]:>15.3f}" if len(versions) > 1 else ""
            print(f"{row:<22}" + "".join(f"{value:>15.2f}" for value in numbers) + share, flush=True)


def seconds(words: tuple[str, ...], folder: Path, room: Path, out: str) -> float:
    """CPU seconds of one process of the version in `folder`."""
    room.mkdir(exist_ok=True)
    places = {"PYTHONPATH": str(folder), "JAXBIPED_CACHE": str(room / "cache")}
    if not (folder / "jaxbiped" / "core" / "program_cache.py").exists():
        places |= {"JAX_COMPILATION_CACHE_DIR": str(room / "jax"), "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0"}
    command = [sys.executable, *words, *([str(room / out)] if words[-1] == "--out" else [])]
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        command, cwd=room, env=os.environ | places, capture_output=True, text=True, check=False, timeout=3600
    )
    if done.returncode != (WRONG if "--speed" in words else 0):
        sys.exit(f"{folder}: {' '.join(words)}: exit status {done.returncode}\n{done.stderr}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


if __name__ == "__main__":
    main()
