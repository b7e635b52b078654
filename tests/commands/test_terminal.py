"""Terminals that break: closed, full, narrow, without our signs; signals; real processes of a command that is small."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from jaxbiped import __version__, cli
from tests.study.test_stored_series import stored

ROOT = Path(__file__).parents[2]
PROGRAM = f"{sys.executable} -m tests.commands.pretended"
UNWRITTEN = "jaxbiped: standard output: cannot be written: no space left on device"
FULL = pytest.mark.skipif(not os.path.exists("/dev/full"), reason="this system has no /dev/full")


def shell(here, line, **environment):
    """A line of bash in an empty folder; a variable that is None is unset."""
    both = os.environ | {"PYTHONPATH": str(ROOT), "COLUMNS": "80"} | environment
    both = {name: value for name, value in both.items() if value is not None}
    line = f"set -o pipefail; {line}"
    return subprocess.run(["bash", "-c", line], cwd=here, env=both, capture_output=True, timeout=300, check=False)


@pytest.mark.parametrize(
    ("end", "status", "said"),
    [
        ("| head -1", 0, ""),
        ("| true", 0, ""),
        (">&-", 0, ""),
        ("2>&-", 0, ""),
        ("<&-", 0, ""),
        ("<&- >&- 2>&-", 0, ""),
        pytest.param("2> /dev/full", 0, "", marks=FULL),
        pytest.param(
            "> /dev/full", 2, "jaxbiped: standard output: cannot be written: no space left on device", marks=FULL
        ),
        pytest.param("> /dev/full 2>&1", 2, "", marks=FULL),
    ],
)
def test_output_that_ends_costs_no_result(tmp_path, end, status, said):
    done = shell(tmp_path, f"{PROGRAM} pretend {end}")
    told = [line for line in done.stderr.decode().splitlines() if not line.startswith("busy ")]
    assert (done.returncode, told) == (status, [said] if said else [])
    assert sorted(os.listdir(tmp_path / "out")) == ["first.txt", "ready"]


@pytest.mark.parametrize("words", ["--help", "--version", "pretend --help", "nothing"])
@pytest.mark.parametrize("end", ["| true", ">&-", pytest.param("> /dev/full", marks=FULL)])
def test_help_needs_no_reader(tmp_path, words, end):
    done = shell(tmp_path, f"{PROGRAM} {words} {end}")
    wrong = words == "nothing" or "full" in end
    assert done.returncode == (2 if wrong else 0)
    lines = done.stderr.decode().splitlines()
    assert len(lines) == wrong and all(line.startswith("jaxbiped: ") for line in lines)


@pytest.mark.parametrize(
    "environment",
    [
        {"PYTHONIOENCODING": "ascii"},
        {"LC_ALL": "C", "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0"},
        {"TERM": "dumb"},
        {"TERM": None, "FORCE_COLOR": "1"},
        {"COLUMNS": "1"},
        {"COLUMNS": "0"},
        {"COLUMNS": "wide"},
    ],
    ids=lambda environment: ", ".join(f"{name}={value}" for name, value in environment.items()),
)
def test_terminals_that_can_show_little(tmp_path, environment):
    done = shell(
        tmp_path, f"{PROGRAM} pretend && {PROGRAM} pretend --help > help && {PROGRAM} pretend --walk", **environment
    )
    assert done.returncode == 2 and (tmp_path / "out").is_dir() and (tmp_path / "help").stat().st_size > 200
    last = done.stderr.decode().splitlines()[-1].removeprefix("\x1b[?25h")  # shows the cursor again, after the bar
    assert last.startswith("jaxbiped: ") and "--walk: is not an option" in last and "\x1b" not in last
    if "ascii" in environment.values() or "C" in environment.values():
        assert b'1 x 2 - 3 +- 4 deg -> "5"' in done.stdout


def test_the_package_is_a_program(tmp_path):
    assert shell(tmp_path, f"{sys.executable} -m jaxbiped --version").stdout == f"jaxbiped {__version__}\n".encode()


def test_a_slow_reader_that_does_not_block_gets_everything(tmp_path):
    reading, writing = os.pipe()
    os.set_blocking(writing, False)
    both = os.environ | {"PYTHONPATH": str(ROOT)}
    with subprocess.Popen([*PROGRAM.split(), "pretend"], cwd=tmp_path, env=both, stdout=writing) as child:
        os.close(writing)
        while not (tmp_path / "out").exists():
            time.sleep(0.05)
        time.sleep(0.5)
        with open(reading, "rb") as output:
            assert output.read().count(b"\xc3\x97 2") == 3000
    assert child.returncode == 0


def half_way(here, others=()):
    """The command, once it has begun to write its folder, which is none of the `others`."""
    both = os.environ | {"PYTHONPATH": str(ROOT)}
    child = subprocess.Popen([*PROGRAM.split(), "pretend", "--work", "60"], cwd=here, env=both, stderr=subprocess.PIPE)
    while not [path for path in here.glob(".out.*.part/ready") if path.parent.name not in others]:
        assert child.poll() is None
        time.sleep(0.02)
    return child


@pytest.mark.parametrize(("number", "word"), [(signal.SIGTERM, "terminated"), (signal.SIGHUP, "terminal closed")])
def test_a_command_that_is_asked_to_end_leaves_nothing(tmp_path, number, word):
    child = half_way(tmp_path)
    child.send_signal(number)
    said = child.communicate()[1].decode()
    assert child.returncode == 128 + number and said.endswith(f"jaxbiped: {word}\n") and not os.listdir(tmp_path)


def test_what_a_killed_command_left_is_swept_up_by_the_next_and_what_a_living_one_writes_is_not(tmp_path):
    killed, living = half_way(tmp_path), None
    try:
        killed.kill()
        killed.communicate()
        (left,) = os.listdir(tmp_path)
        living = half_way(tmp_path, [left])
        (now,) = os.listdir(tmp_path)
        assert now != left
        assert shell(tmp_path, f"{PROGRAM} pretend").returncode == 0
        assert sorted(os.listdir(tmp_path)) == [now, "out"] and (tmp_path / now / "ready").exists()
    finally:
        for child in (killed, living):
            if child and child.returncode is None:
                child.terminate()
                child.communicate()
    assert os.listdir(tmp_path) == ["out"]


def test_nohup_is_respected(tmp_path):
    line = f"trap '' HUP; {PROGRAM} pretend --work 3 & child=$!; sleep 0.1; until ls -d .out.*; do sleep 0.1; done; "
    done = shell(tmp_path, line + "kill -HUP $child; wait $child")
    assert done.returncode == 0 and (tmp_path / "out").is_dir()


def test_compare_into_the_folder_of_a_stopped_study_says_resume(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    stored(tmp_path / "cut")
    manifest = tmp_path / "cut" / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"finished"', '"stopped"'))
    assert cli.main(["compare", "--arenas", "6", "--out", "cut"]) == 2
    assert "--resume continues" in capsys.readouterr().err
    manifest.write_text(manifest.read_text().replace('"stopped"', '"finished"'))
    assert cli.main(["compare", "--arenas", "6", "--out", "cut"]) == 2
    assert "must be a folder that does not exist yet" in capsys.readouterr().err


def test_a_real_command_into_a_pipe_that_closes(tmp_path):
    """The others: test_nothing_lost."""
    stored(tmp_path / "r", arenas=12)
    done = shell(tmp_path, f"{sys.executable} -m jaxbiped compare r --resamples 50 --out out | head -1")
    assert done.returncode == 0 and not done.stderr
    assert sorted(os.listdir(tmp_path / "out")) == ["comparison.md", "report.html"]
