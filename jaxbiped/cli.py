"""The command line: `jaxbiped COMMAND ...`. Each command is a module with its options and its `main`."""

from __future__ import annotations

import contextlib
import importlib
import io
import itertools
import re
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pydantic

from jaxbiped import __version__, surroundings
from jaxbiped.config import Model, input_error, load_toml, parse
from jaxbiped.errors import InputError
from jaxbiped.terminal import Sink, Terminated, ended_by_signals, lasting_streams

# command: (module of it and of its options, name of these, one line, whether a TOML file may come first and give the
# defaults). What a command needs is loaded only once its options are known to be valid.
COMMANDS = {
    "compare": ("compare", "CompareArgs", "compare strategies on random arenas, with statistics", True),
    "sweep": ("sweep", "SweepArgs", "sweep numbers of the config, many points in one program", True),
    "run": ("run", "RunArgs", "run one mission in a scene, with pictures", False),
    "plan": ("plan", "PlanArgs", "plan on a map that you have: Moving AI, ROS map_server, class grid", False),
    "stereo": ("stereo", "StereoArgs", "map what a real stereo pair shows", False),
    "classify": ("classify", "ClassifyArgs", "map a point cloud or an elevation map", False),
    "primitives": ("primitives", "PrimitivesArgs", "verify the motion primitives in simulation", False),
    "tune": ("tune", "TuneArgs", "tune the costs on random arenas, and evaluate them on others", True),
    "fit-sensor": ("fit_sensor", "FitSensorArgs", "fit the noise of the ray-cast sensor to rendered pairs", False),
    "reproduce": (
        "reproduce",
        "ReproduceArgs",
        "repeat the paper's experiments, its figures and ours on one page",
        False,
    ),
    "report": ("report", "ReportArgs", "rewrite the tables and figures of a results folder", False),
    "cache": ("cache", "CacheArgs", "show or clear the cache that makes programs start sooner", False),
    "view": ("view", "ViewArgs", "show missions in the browser", False),
}
# The command if its first argument is a results folder: another module, other options.
ON_FOLDERS = {"compare": ("stored", "StoredArgs")}
ON_SCENES = ("compare",)  # commands whose first arguments may be scenes, or a folder of them
WITHOUT_DEVICES = ("cache",)
WRONG_INPUT = 2  # exit status


def main(argv: Sequence[str] | None = None) -> int:
    """Run a command; the entry point of the package.

    A command runs to its end whatever happens to the terminal: see `jaxbiped.terminal`.

    Returns:
      The exit status: 0, 1 for a result that is a failure, 2 for input that cannot be used and output that cannot be
      written (one line on stderr), 130 when interrupted, 143 when terminated.
    """
    argv = list(sys.argv[1:] if argv is None else argv)
    with lasting_streams() as output:
        try:
            with ended_by_signals():
                status = answer(argv)
            return settled(status, output)
        except InputError as error:
            return refuse(error)
        except Terminated as signal:
            print(f"jaxbiped: {signal}", file=sys.stderr)
            return signal.status
        except KeyboardInterrupt:
            print("jaxbiped: interrupted", file=sys.stderr)
            return 130
        except SystemExit as stop:  # of --help
            if settled(0, output):
                return WRONG_INPUT
            raise stop


def refuse(error: InputError) -> int:
    """Print the one-line message, and return the exit status."""
    print(f"jaxbiped: {error}", file=sys.stderr)
    return WRONG_INPUT


def settled(status: int, output: Sink) -> int:
    """The exit status of a command that ended with `status`, once its output is written or has failed to be."""
    output.flush()
    problem = output.problem()
    return refuse(problem) if problem else status


def answer(argv: list[str]) -> int:
    """Run what the command line asks for: a command, or the program's own help; return the exit status."""
    if not argv or argv[0] in ("-h", "--help"):
        print(usage())
        return 0 if argv else WRONG_INPUT
    if argv[0] == "--version":
        print(f"jaxbiped {__version__}")
        return 0
    if argv[0] not in COMMANDS:
        raise InputError(f"must be one of {', '.join(COMMANDS)}", field="command", value=argv[0])
    try:
        with surroundings.settled():
            return dispatch(argv[0], argv[1:])
    except InputError:
        raise
    except Exception as error:  # of a library: perhaps about the environment
        found = surroundings.culprit(error)
        if found is None:
            raise
        raise found from None


def dispatch(name: str, rest: list[str]) -> int:
    """Parse the options of a command, and run it."""
    import tyro

    from jaxbiped.commands.early_options import with_early
    from jaxbiped.commands.short_help import is_asked, print_help

    module_name, options_name, _, takes_file = COMMANDS[name]
    if name in ON_SCENES:
        rest = with_scenes(rest)
    if name in ON_FOLDERS and rest and Path(rest[0]).is_dir():
        (module_name, options_name), takes_file = ON_FOLDERS[name], False
    options: type[Model] = getattr(importlib.import_module(f"jaxbiped.commands.options.{module_name}"), options_name)
    extra = {}
    path = Path(rest.pop(0)) if takes_file and rest and not rest[0].startswith("-") else None
    data = load_toml(path) if path else {}
    data = with_early(data, rest, options, path)
    if data or path:
        required = {name for name, field in options.model_fields.items() if field.is_required()}
        known = defaults(options, data | dict.fromkeys(required, "-"), path)
        extra["default"] = known.model_copy(update=dict.fromkeys(required, tyro.MISSING))
    if is_asked(rest):
        print_help(options, name, rest, extra.get("default"))
        raise SystemExit(0)
    said = io.StringIO()
    try:
        with contextlib.redirect_stderr(said):
            args = tyro.cli(options, prog=f"jaxbiped {name}", args=rest, description=options.__doc__, **extra)
    except pydantic.ValidationError as error:
        raise input_error(error) from None
    except SystemExit as stop:
        if not stop.code:
            raise
        raise one_line(said.getvalue(), name, rest) from None
    if name not in WITHOUT_DEVICES:
        surroundings.check_devices()
    return importlib.import_module(f"jaxbiped.commands.{module_name}").main(args)


def with_scenes(rest: list[str]) -> list[str]:
    """Options in which leading scene files, or a leading folder of them, become families with one arena each."""
    first = list(itertools.takewhile(lambda word: not word.startswith("-"), rest))
    files = [Path(word) for word in first]
    if len(files) == 1 and files[0].is_dir() and not (files[0] / "manifest.json").exists():
        files = sorted(files[0].glob("*.toml")) or files
    is_scene = [path.suffix == ".toml" and path.is_file() and "start" in load_toml(path) for path in files]
    if not files or not (all(is_scene) or (len(files) > 1 and any(is_scene))):
        return rest
    for path, fits in zip(files, is_scene, strict=True):
        if not fits:
            raise InputError("is not a scene like the others: it must be a TOML file with start and goal", file=path)
    options = rest[len(first) :]
    count = [] if any(word.split("=")[0] == "--arenas" for word in options) else ["--arenas", str(len(files))]
    return ["--families", *map(str, files), *count, *options]


def defaults(options: type[Model], data: dict[str, Any], path: Path | None) -> Model:
    """The defaults of the options: from the file, or derived from the command line alone."""
    if path is not None:
        return parse(options, data, file=path)
    try:
        return options.model_validate(data)
    except pydantic.ValidationError as error:
        raise input_error(error, prefix="--") from None


def one_line(box: str, name: str, rest: Sequence[str] = ()) -> InputError:
    """Turn the error that tyro draws as a box into one line in our words.

    The message stands between the box's title and its first rule. Rules are drawn with lines or, if the terminal has
    none, with dashes, one of them under the title.

    Args:
      name: of the command; `rest` is what it was given.
    """
    rows = [row for line in box.splitlines() if (row := line.strip("│| "))]
    rows = itertools.dropwhile(is_rule, rows[1:])
    message = " ".join(itertools.takewhile(lambda row: not is_rule(row), rows))
    message = re.sub(r"\[/?bold\]", "", message)
    listed = f"`jaxbiped {name} --help-all` lists the options of {name}"
    if found := re.match(r"Unrecognized options: (.*)", message):
        words = found[1].split(", ")
        if not words[0].startswith("-"):
            return InputError(f"is an unexpected argument; {listed}", field=words[0])
        meant = re.search(r"Perhaps you meant:[\s│|]*(--[\w.-]+)", box)
        hint = f"did you mean {meant[1]}?" if meant else listed
        return InputError(f"is not an option of jaxbiped {name}; {hint}", field=words[0].partition("=")[0])
    if found := re.match(r"Missing value for argument '(.*?)'. Expected (\d+)", message):
        many = int(found[2])
        return InputError(f"must be given {f'{many} values' if many > 1 else 'a value'}", field=found[1])
    if message.startswith("Missing from"):
        lines = itertools.dropwhile(lambda line: "Missing from" not in line, box.splitlines())
        lines = itertools.takewhile(lambda line: not is_rule(line.strip("│| ")), lines)
        missing = [found[1] for line in lines if (found := re.match(r". {5}(\S.*?)[ │|]*$", line))]  # not their texts
        return InputError(f"must be given; {listed}", field=", ".join(missing) or None)
    if found := re.match(r"invalid choice (.*) for argument '(.*?)'. Expected one of \((.*?),?\)", message):
        return InputError(f"must be one of {found[3].replace(chr(39), '')} (got {found[1]})", field=found[2])
    if found := re.match(r"Error parsing (\S+): no type matching (.*?) could be instantiated from \[(.*?)\]", message):
        kinds = [kind for kind in re.findall(r"\{(.*?)\}", found[2]) if kind != "None"]
        wanted = " or ".join(map(in_words, kinds))
        return InputError(f"must be {wanted} (got {found[3].replace(chr(39), '').replace(',', '')})", field=found[1])
    number = re.match(
        r"Error parsing (\S+): (invalid literal for int|could not convert string to float)[^:]*: (.*)", message
    )
    if number:
        whole = "whole " * number[2].startswith("invalid")
        return InputError(f"must be a {whole}number (got {number[3]})", field=number[1])
    model = re.match(
        r"Error parsing (\S+): .*? for \w+ (?:(?!Value error)(\S+) )?(.*?) \[type=\w+, input_value=(.*?), input_type",
        message,
    )
    if model:
        place, field, what, value = model.groups()
        place = place.lstrip("-").removeprefix("mission.")
        field = ".".join(part for part in (place if place[:1].islower() else "", field) if part)
        what = re.sub(r"^[A-Z]\w* should (be|have)", r"must \1", what.removeprefix("Value error, "))
        what = re.sub(r" after validation, not \d+$", "", what)
        return InputError(f"{what} (got {value})", field=f"--{field.replace('_', '-')}")
    if not message or message.startswith("Could not create"):
        return InputError(f"cannot be used; {listed}", field="options", value=" ".join(rest))
    return InputError(message)


def in_words(kind: str) -> str:
    """What tyro's name for a kind of argument means."""
    words = kind.split()
    if set(words) <= {"FLOAT", "INT"}:
        whole = "whole " if set(words) == {"INT"} else ""
        return f"{len(words)} {whole}numbers" if len(words) > 1 else f"a {whole}number"
    return kind


def is_rule(row: str) -> bool:
    """Whether a row is a rule in a box, or its border."""
    return row.startswith("╰") or set(row) <= set("─-")


def usage() -> str:
    """The text of `jaxbiped --help`."""
    lines = "\n".join(f"  {name:<10} {summary}" for name, (_, _, summary, _) in COMMANDS.items())
    end = "`jaxbiped COMMAND --help` shows the options that most people need, --help-all all of them."
    return f"usage: jaxbiped COMMAND [options]\n\n{lines}\n\n{end}"


if __name__ == "__main__":
    sys.exit(main())
