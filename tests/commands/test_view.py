"""`jaxbiped view`: it serves what there is to be shown, and names in one line what it cannot show."""

import re
import subprocess
import sys
import urllib.request

import numpy as np
import pytest

from jaxbiped import cli
from jaxbiped.commands import view
from jaxbiped.mission.recording import save_log
from tests.study.test_stored_series import stored
from tests.viewer.test_viewer import seen

pytest.importorskip("viser")
ONCE = ("--once", "--port", "0")


@pytest.fixture
def result(tmp_path):
    """A folder of `jaxbiped run`."""
    folder = tmp_path / "run"
    folder.mkdir()
    save_log(folder / "mission.npz", seen(), {"scene": "a_scene", "strategy": "full", "config": {}})
    return folder


def refused(capsys, *argv):
    """The one line that a command line is refused with."""
    assert cli.main(("view", *map(str, argv))) == 2
    lines = capsys.readouterr().err.strip().splitlines()
    assert len(lines) == 1 and lines[0].startswith("jaxbiped: ")
    return lines[0]


def test_it_serves_while_it_waits(result, capsys, monkeypatch):
    asked = []

    def look():
        url = re.search(r"http://\S+", capsys.readouterr().out).group()
        asked.append((url, urllib.request.urlopen(url, timeout=20).status))

    monkeypatch.setattr(view, "wait", look)
    monkeypatch.setattr(view.webbrowser, "open", asked.append)
    assert cli.main(("view", str(result), "--port", "0")) == 0
    url, (same, status) = asked
    assert url == same and url.startswith("http://127.0.0.1:") and status == 200
    with pytest.raises(OSError):
        urllib.request.urlopen(url, timeout=5)


def test_the_address_reaches_a_pipe_while_it_waits(result):
    command = [sys.executable, "-m", "jaxbiped", "view", str(result), "--port", "0", "--no-browser"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        try:
            assert process.stdout.readline().startswith("a_scene, full")
            assert process.stdout.readline().startswith("http://127.0.0.1:")
        finally:
            process.terminate()


def test_it_says_what_it_shows_and_where(result, capsys):
    assert cli.main(("view", str(result), *ONCE)) == 0
    printed = capsys.readouterr().out.splitlines()
    assert printed[0] == "a_scene, full: reached: 104 s (1.7 min)"
    assert re.fullmatch(r"http://127\.0\.0\.1:\d+  \(Ctrl-C ends\)", printed[1]) and len(printed) == 2


@pytest.mark.parametrize(
    ("host", "name"), [("127.0.0.1", "127.0.0.1"), ("0.0.0.0", "localhost"), ("::1", "[::1]"), ("::", "localhost")]
)
def test_the_name_in_the_url(host, name):
    assert view.reached_at(host) == name


def damage(folder, how):
    """Make a results folder into something that cannot be shown."""
    path = folder / "mission.npz"
    if how == "cut":
        path.write_bytes(path.read_bytes()[:500])
    elif how == "format":
        arrays = dict(np.load(path))
        arrays["header"] = np.frombuffer(arrays["header"].tobytes().replace(b'"format": 1', b'"format": 7'), np.uint8)
        np.savez(path, **arrays)
    elif how == "config":
        save_log(path, seen(), {"config": {"speed": 3}})
    elif how == "empty":
        path.unlink()


@pytest.mark.parametrize(
    ("how", "said"),
    [
        ("cut", ["mission.npz", "is not the log of a mission, or is damaged"]),
        ("format", ["mission.npz: format", "reads logs of format 1", "got 7"]),
        ("config", ["mission.npz", "written by another version", "speed", "unknown key"]),
        ("empty", ["has nothing to show", "mission.npz", "manifest.json"]),
    ],
)
def test_what_is_no_result(result, capsys, how, said):
    damage(result, how)
    line = refused(capsys, result, *ONCE)
    assert all(part in line for part in said), line


def test_no_folder_and_options_that_do_not_fit(result, capsys):
    assert "no such results folder" in refused(capsys, result / "nothing", *ONCE)
    assert "goes with the folder of a study" in refused(capsys, result, *ONCE, "--strategy", "full")
    assert "arena: must be 0 to 0" in refused(capsys, result, *ONCE, "--arena", "4")
    assert "--port" in refused(capsys, result, "--port", "70000")
    assert "host: must be an address of this machine" in refused(capsys, result, *ONCE, "--host", "203.0.113.7")


def test_an_arena_that_a_study_does_not_have(tmp_path, capsys):
    folder = stored(tmp_path / "r")
    assert "must be an arena that was stored, 0 to 59 (got 60)" in refused(capsys, folder, *ONCE, "--arena", "60")
    assert "holds no config of missions" in refused(capsys, folder, *ONCE)
    (folder / "manifest.json").write_text('{"format": 99}')
    assert "reads manifests of format" in refused(capsys, folder, *ONCE)


def test_without_viser_it_says_what_to_install(result, capsys, monkeypatch):
    monkeypatch.setitem(sys.modules, "viser", None)
    assert refused(capsys, result) == "jaxbiped: `jaxbiped view` needs viser: pip install 'jaxbiped[view]'"
