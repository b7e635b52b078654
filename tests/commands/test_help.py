"""`--help` shows what most people need, on a screen; `--help-all` shows every option; neither loads much."""

import subprocess
import sys

import pytest

from jaxbiped import cli
from jaxbiped.commands.options.base import Options
from jaxbiped.commands.options.stored import StoredArgs
from jaxbiped.commands.options.strategies import DARES
from jaxbiped.commands.short_help import first_sentence
from jaxbiped.config import Model
from jaxbiped.core.names import STRATEGIES

BY_PLACE = {"scene", "file", "left", "right", "cloud", "folder", "folders", "result"}
SCREEN, COLUMNS = 40, 80
HEAVY = ("jax", "mujoco", "matplotlib", "scipy", "statsmodels", "polars", "cv2", "numba")


@pytest.fixture
def printed(capsys, monkeypatch):
    """What a command line prints that asks for help."""
    monkeypatch.setenv("COLUMNS", str(COLUMNS))

    def printed(*argv: str) -> str:
        with pytest.raises(SystemExit) as stop:
            cli.main(argv)
        assert stop.value.code == 0
        return capsys.readouterr().out

    return printed


def options_of(command: str) -> type[Options]:
    """The options of a command."""
    module, name, _, _ = cli.COMMANDS[command]
    return getattr(__import__(f"jaxbiped.commands.options.{module}", fromlist=[name]), name)


def flag(dotted: str) -> str:
    """A field as an option: those of the mission have no prefix."""
    return "--" + dotted.removeprefix("mission.").removesuffix("_file").replace("_", "-")


def leaves(model: type[Model], prefix: str = ""):
    """Dotted names of all fields of options that are no tables, but for those that the command line cannot set."""
    for name, field in model.model_fields.items():
        if isinstance(field.annotation, type) and issubclass(field.annotation, Model):
            yield from leaves(field.annotation, "" if name == "mission" else f"{prefix}{name}.")
        elif not any(str(item).startswith("Fixed") or getattr(item, "name", "") == "Fixed" for item in field.metadata):
            yield prefix + name


@pytest.mark.parametrize("command", sorted(cli.COMMANDS))
def test_short_help_fits_on_a_screen_and_names_the_basic_options(printed, command):
    for word in ("--help", "-h"):
        text = printed(command, word)
        lines = text.splitlines()
        assert lines[0].startswith(f"usage: jaxbiped {command}")
        assert len(lines) < SCREEN and max(map(len, lines)) <= COLUMNS, text
        assert f"jaxbiped {command} --help-all" in lines[-1]
    options = options_of(command)
    for name in options.BASIC:
        part, _, leaf = name.rpartition(".")
        model = options.model_fields[part].annotation if part else options
        assert leaf in model.model_fields, name
        assert leaf in BY_PLACE or f" {flag(name)}" in text, name


@pytest.mark.parametrize("command", sorted(cli.COMMANDS))
def test_help_all_lists_every_option(printed, command):
    text = printed(command, "--help-all")
    for name in leaves(options_of(command)):
        assert name in BY_PLACE or flag(name) in text, name


def test_help_of_a_results_folder(printed, tmp_path):
    assert "--first-point" in (text := printed("compare", str(tmp_path), "--help"))
    assert len(text.splitlines()) < SCREEN and "--margin-time" not in text
    text = printed("compare", str(tmp_path), "--help-all")
    assert all(flag(name) in text for name in leaves(StoredArgs) if name != "folders")


def test_defaults_are_those_of_the_file(printed, tmp_path):
    (tmp_path / "study.toml").write_text("arenas = 77\n[mission]\nexecutor = 'sampled'\n")
    for word in ("--help", "--help-all"):
        text = printed("compare", str(tmp_path / "study.toml"), word)
        assert "(default: 77)" in text and "(default: sampled)" in " ".join(text.replace("│", " ").split())


@pytest.mark.parametrize("command", ["run", "compare", "sweep"])
def test_strategies_are_explained(printed, command):
    for word in ("--help", "--help-all"):
        text = printed(command, word)
        assert all(f"  {name:<10}  {DARES[name]}" in text for name in STRATEGIES)
        assert "package.module:name" in text.rpartition("Strategies:")[2] and "registered" in text


def test_tune_names_the_strategies_that_it_takes(printed):
    assert "floor_only" in (text := printed("tune", "--help")) and "  blind_stop " not in text


def test_first_sentence():
    assert first_sentence("[m] A cell,\n  or .npz\n  files. Default: all.") == "[m] A cell, or .npz files."


def test_help_loads_little():
    """In one process for all commands: of the libraries, none that takes long."""
    code = f"""
import contextlib, io, sys
from jaxbiped import cli
with contextlib.redirect_stdout(io.StringIO()):
    for command in cli.COMMANDS:
        for word in ("--help", "--help-all"):
            with contextlib.suppress(SystemExit):
                cli.main([command, word])
print([name for name in {HEAVY} if name in sys.modules])
"""
    out = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert out.strip() == "[]"
