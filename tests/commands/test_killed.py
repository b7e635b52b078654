"""The real commands, killed by SIGKILL midway, against runs that were not."""

import os
import signal
import subprocess
import sys
import time

import pytest

from jaxbiped.study import shard_files, store

SWEEP = """
arenas = 12
shard = 2
strategies = ["full", "floor_only"]
[mission]
sensor = "oracle"
[[axes]]
field = "costs.c3"
values = [5, 20]
"""
COMPARE = ["--arenas", "12", "--shard", "2", "--strategies", "full", "floor_only", "--sensor", "oracle"]


def start(tmp_path, *argv):
    """A command in a process of its own, whose compilations are kept for the next one where JAX can."""
    environment = os.environ | {"JAX_COMPILATION_CACHE_DIR": str(tmp_path / "cache")}
    return subprocess.Popen([sys.executable, "-m", "jaxbiped.cli", *argv], cwd=tmp_path, env=environment)


@pytest.mark.slow  # three processes, each of which compiles the closed loop
@pytest.mark.parametrize("command", ["compare", "sweep"])
def test_killed_and_resumed_is_never_stopped(tmp_path, command):
    (tmp_path / "s.toml").write_text(SWEEP)
    argv = [command, *(["s.toml"] if command == "sweep" else COMPARE), "--out"]
    assert start(tmp_path, *argv, "whole").wait() == 0
    child = start(tmp_path, *argv, "cut")
    while len(shard_files.shard_paths(tmp_path / "cut")) < 2:
        assert child.poll() is None
        time.sleep(0.001)
    child.send_signal(signal.SIGKILL)
    child.wait()
    done = {path.name: path.stat().st_mtime_ns for path in shard_files.shard_paths(tmp_path / "cut")}
    assert 2 <= len(done) < 6 and store.read_manifest(tmp_path / "cut").state == "running"
    assert start(tmp_path, *argv, "cut", "--resume").wait() == 0
    (cut, after), (whole, _) = (store.read(tmp_path / name) for name in ("cut", "whole"))
    assert cut.equals(whole) and after.state == "finished" and after.resumed == 1
    for path in shard_files.shard_paths(tmp_path / "whole"):
        assert (tmp_path / "cut" / "rows" / path.name).read_bytes() == path.read_bytes()
    again = {path.name: path.stat().st_mtime_ns for path in shard_files.shard_paths(tmp_path / "cut")}
    assert all(again[name] == moment for name, moment in done.items())  # nothing that was stored was computed anew
