"""`jaxbiped cache` shows what is kept, and clears that and nothing else."""

import os

import pytest

from jaxbiped import cli
from jaxbiped.commands.cache import amount
from jaxbiped.core import kept_files
from jaxbiped.core.cache_location import VARIABLE


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
    return tmp_path / "kept"


def said(capsys, *words) -> str:
    assert cli.main(["cache", *words]) == 0
    return capsys.readouterr().out


def test_an_empty_cache_is_shown_and_cleared(folder, capsys):
    for words in ((), ("--clear",), ()):
        text = said(capsys, *words)
        assert f"{folder} (does not exist yet)" in text and "0 Numba kernels" in text and "0 XLA programs" in text
    assert not folder.exists()


def test_what_is_kept_is_counted_and_cleared_and_no_other_file(folder, capsys):
    for k in range(3):
        assert kept_files.write(folder / "kernels" / f"v{k}" / "grids", b"x\n", bytes(1000))
        assert kept_files.write(folder / "programs" / "p" / f"jit_f-{k}", b"y\n", bytes(2000))
    (folder / "mine.txt").write_text("precious")
    text = said(capsys)
    assert "3 Numba kernels, 3.1 kB" in text and "3 XLA programs, 6.1 kB, at most 500 MB" in text
    assert said(capsys) == text  # looking changes nothing
    assert said(capsys, "--clear").endswith("cleared\n")
    assert sorted(path.name for path in folder.rglob("*")) == ["kernels", "mine.txt", "programs"]
    assert "0 Numba kernels" in said(capsys)


def test_no_cache_at_all(monkeypatch, capsys):
    monkeypatch.setenv(VARIABLE, "off")
    assert said(capsys) == said(capsys, "--clear") == "nothing is kept: JAXBIPED_CACHE is off\n"


def test_places_that_are_no_folders_or_cannot_be_written_to(tmp_path, monkeypatch, capsys):
    (tmp_path / "file").write_text("mine")
    for place, what in (
        (tmp_path / "file", "(not a folder: nothing is kept)"),
        (tmp_path / "file" / "below", "(not writable: nothing is added)"),
        (tmp_path, "\n"),
    ):
        monkeypatch.setenv(VARIABLE, str(place))
        for words in ((), ("--clear",)):
            assert f"{place} {what}".replace(" \n", "\n") in said(capsys, *words)
    assert (tmp_path / "file").read_text() == "mine"


def test_what_cannot_be_removed_is_named_in_one_line(folder, monkeypatch, capsys):
    for name in ("a", "b"):
        kept_files.write(folder / "programs" / "p" / name, b"y\n", b"")
    unlink = os.unlink

    def refuse(path, *rest, **more):
        if os.path.basename(path) == "a":
            raise PermissionError(13, "Permission denied")
        unlink(path, *rest, **more)

    monkeypatch.setattr("jaxbiped.commands.cache.Path.unlink", lambda path, missing_ok=False: refuse(path))
    assert cli.main(["cache", "--clear"]) == 2
    line = capsys.readouterr().err
    assert line.count("\n") == 1 and "cannot be removed: permission denied" in line and str(folder) in line
    assert [path.name for path in folder.rglob("*") if path.is_file()] == ["a"]


@pytest.mark.parametrize(
    ("size", "shown"), [(0, "0 B"), (999, "999 B"), (1000, "1 kB"), (123456789, "123 MB"), (5 * 10**12, "5e+03 GB")]
)
def test_amounts(size, shown):
    assert amount(size) == shown
