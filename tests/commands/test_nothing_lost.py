"""A result is stored, whole, before anything is printed about it, and no state of the terminal loses it."""

import errno
import io
import os
import shutil
import sys
from pathlib import Path

import pytest

from jaxbiped import cli, files
from tests.commands.made_up import CASES


class Watched(io.StringIO):
    """Standard output that notes what was stored when a word first came, and fails from then on."""

    def __init__(self, case, error):
        super().__init__()
        self.case, self.error, self.seen, self.stored = case, error, "", None

    def write(self, text):
        self.seen += text
        if self.stored is None and self.case.said in self.seen:
            self.stored = all(os.path.exists(path) for path in self.case.stored)
        if self.stored is not None:
            raise OSError(self.error, os.strerror(self.error))
        return len(text)


@pytest.fixture(params=CASES)
def case(request, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    CASES[request.param].prepare(tmp_path, monkeypatch)
    return CASES[request.param]


@pytest.mark.parametrize(
    ("error", "status"), [(errno.EPIPE, 0), (errno.ENOSPC, 2)], ids=["closed pipe", "full disk behind it"]
)
def test_it_is_stored_before_it_is_printed_and_stays(case, monkeypatch, capsys, error, status):
    output = Watched(case, error)
    monkeypatch.setattr("sys.stdout", output)
    assert cli.main(case.argv) == status
    assert output.stored is True
    assert all(os.path.exists(path) for path in case.stored) and not hidden()
    lines = capsys.readouterr().err.splitlines()
    wanted = "jaxbiped: standard output: cannot be written: no space left on device"
    assert [line for line in lines if line.startswith("jaxbiped: ")] == ([wanted] if status else [])


def test_a_full_disk_leaves_nothing_half_written(case, monkeypatch, capsys):
    before = everything()

    def full_disk(*_):
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(files.os, "fsync", full_disk)
    assert cli.main(case.argv) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if line.startswith("jaxbiped: ")]
    assert len(lines) == 1 and "no space left on device" in lines[0] and "cannot be written" in lines[0]
    assert everything() == before


@pytest.mark.skipif(sys.platform != "linux", reason="other systems refuse such names")
@pytest.mark.parametrize("name", ["plan", "classify"])
def test_names_of_files_that_are_no_text_cost_no_result(tmp_path, monkeypatch, capsys, name):
    monkeypatch.chdir(tmp_path)
    CASES[name].prepare(tmp_path, monkeypatch)
    given = Path(CASES[name].argv[1])
    odd = os.fsdecode(b"r\xe9") + given.suffix
    shutil.copy(given, odd)
    assert cli.main([name, odd, *CASES[name].argv[2:]]) == 0
    assert all(os.path.exists(path) for path in CASES[name].stored)
    assert f"r?{given.suffix}" in capsys.readouterr().out


def everything():
    return sorted(os.path.join(place, name) for place, _, names in os.walk(".") for name in names)


def hidden():
    return [path for path in everything() if path.endswith(".part")]


def test_every_command_that_stores_something_is_here():
    assert {case.argv[0] for case in CASES.values()} | {"view", "cache"} == set(cli.COMMANDS)
