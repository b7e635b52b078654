"""The numbered examples run as they are written, on few arenas."""

import runpy
import sys
from pathlib import Path

import pytest

EXAMPLES = sorted((Path(__file__).parents[1] / "sweeps" / "examples").glob("[0-9]*.py"))
LONGEST = {"01": 10, "02": 25, "03": 25, "06": 25}  # lines of those that show how little is needed; 80 of any other


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_are_short_and_use_the_public_names_alone(path):
    text = path.read_text()
    lines = [line for line in text.splitlines() if line.strip()]
    assert len(lines) <= LONGEST.get(path.stem[:2], 80)
    assert "import jaxbiped as jb" in text and "from jaxbiped" not in text and "import jaxbiped." not in text
    assert text.startswith('"""') and path.name in text.split('"""')[1]


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_run(path, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", [str(path), "out" if path.stem.startswith("05") else "6"])
    monkeypatch.syspath_prepend(path.parent)  # as `python path` does
    runpy.run_path(str(path), run_name="__main__")
    said = capsys.readouterr().out
    assert "full" in said or "bump_aware" in said
