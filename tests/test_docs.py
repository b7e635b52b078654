"""README and the guide say what is there: links, commands, options, paths, names and code. Nothing is played."""

import ast
import importlib
import importlib.util
import re
import shlex
from functools import cache
from pathlib import Path

import pydantic
import pytest
import yaml

import figures
import jaxbiped
from figure_marks import unmarked
from jaxbiped import cli
from jaxbiped.core import registry

ROOT = Path(__file__).parents[1]
GUIDE = ROOT / "docs"
PAGES = [ROOT / "README.md", *sorted(GUIDE.rglob("*.md"))]
FENCE = re.compile(r"^```\{?\.?(\w*)\}?\n(.*?)^```$", re.MULTILINE | re.DOTALL)
SNIPPET = re.compile(r'^--8<-- "(.+)"$', re.MULTILINE)
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
PLACE = re.compile(r"(?<![\w/.-])(?:sweeps|configs|tests|docs|jaxbiped)/[\w./*-]*\w")
MODULE = re.compile(r"(?<![\w/.\[-])jaxbiped(?:\.[A-Za-z_]\w*)+")
GROUPS = {
    held.group
    for held in (registry.STRATEGIES, registry.FAMILIES, registry.SENSORS, registry.EXECUTORS, registry.METRICS)
}
PLACEHOLDERS = {"sweeps/studies/NAME.toml"}
pages = pytest.mark.parametrize("page", PAGES, ids=lambda path: path.relative_to(ROOT).as_posix())


@cache
def seen(page: Path) -> str:
    """A page without the marks round its figures, as readers see it."""
    return unmarked(page.read_text())


def prose(page: Path) -> str:
    """A page without its blocks of code."""
    return FENCE.sub("", seen(page))


def spans(page: Path) -> list[str]:
    """What a page has in code type: its inline spans and the lines of its shell blocks, each on one line."""
    inline = re.findall(r"`([^`]+)`", prose(page))
    lines = [line for kind, text in FENCE.findall(seen(page)) if kind == "sh" for line in text.splitlines()]
    quoted = re.findall(r'"(jaxbiped [^"{]*)', seen(page))  # in a script that submits one
    parts = (part for text in (*inline, *lines, *quoted) for part in text.split("&&"))
    return [" ".join(part.split()) for part in parts]


def blocks(page: Path) -> list[str]:
    """Its blocks of Python, with the files that they are made of."""
    found = [text for kind, text in FENCE.findall(seen(page)) if kind == "python"]
    return [SNIPPET.sub(lambda match: (ROOT / match[1]).read_text(), text) for text in found]


def words(span: str) -> list[str]:
    """Of a command line, without its comment."""
    return shlex.split(re.sub(r"\s#.*", "", span).replace("[", " ").replace("]", " "))


def options_of(model: type[pydantic.BaseModel], prefix: str = "") -> set[str]:
    """The names of a command's options, as tyro makes them."""
    found = set()
    for name, field in model.model_fields.items():
        names = [item.name for item in field.metadata if hasattr(item, "metavar") and item.name is not None]
        shown = names[0] if names else name
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, pydantic.BaseModel):
            found |= options_of(kind, f"{prefix}{shown}." if shown else prefix)
        else:
            found |= {f"{prefix}{shown}", *([f"no-{prefix}{shown}"] if kind is bool else [])}
    return {name.replace("_", "-") for name in found}


@cache
def options(command: str) -> frozenset[str]:
    """What a command takes, on studies and on folders."""
    kinds = [cli.COMMANDS[command][:2], *([cli.ON_FOLDERS[command]] if command in cli.ON_FOLDERS else [])]
    modules = [(importlib.import_module(f"jaxbiped.commands.options.{module}"), name) for module, name in kinds]
    return frozenset({"help", "help-all"}.union(*(options_of(getattr(module, name)) for module, name in modules)))


@cache
def script_options(path: Path) -> frozenset[str]:
    """What a script of `sweeps` takes: of argparse what it adds, of tyro the arguments of its `main`."""
    text = path.read_text()
    found = re.findall(r'"--([\w-]+)"', text)
    if "tyro.cli(main)" in text:
        main = next(node for node in ast.parse(text).body if getattr(node, "name", None) == "main")
        for item in (*main.args.args, *main.args.kwonlyargs):
            own = item.arg.replace("_", "-")
            found += [own, f"no-{own}"]
    return frozenset(found)


def given(line: list[str]) -> list[str]:
    """The options in the words of a command line."""
    return [word[2:].partition("=")[0].replace("_", "-") for word in line if word.startswith("--") and len(word) > 2]


def slug(heading: str) -> str:
    """The anchor of a heading."""
    return re.sub(r"[-\s]+", "-", re.sub(r"[^\w\s-]", "", heading).strip().lower())


def test_readme_is_short():
    lines = (ROOT / "README.md").read_text().splitlines()
    assert len(lines) <= 150
    assert not [line for line in lines if len(line) > 120 and not line.startswith("|")]


@pages
def test_lines_of_prose_are_no_longer_than_others(page):
    lines = [line for line in prose(page).splitlines() if not line.startswith(("|", "!["))]
    assert not [line for line in lines if len(line) > 120]


@pages
def test_links_and_pictures_exist(page):
    for target in LINK.findall(prose(page)):
        if target.startswith("http"):
            continue
        path, _, anchor = target.partition("#")
        there = (page.parent / path).resolve() if path else page
        assert there.exists() and there.is_relative_to(ROOT), target
        if anchor:
            assert anchor in {slug(text) for text in re.findall(r"^#+ (.+)$", prose(there), re.MULTILINE)}, target


@pages
def test_commands_and_their_options_exist(page):
    scripts = {name for path in (ROOT / "sweeps").rglob("*.py") for name in script_options(path)}
    anywhere = scripts.union(*map(options, cli.COMMANDS))
    targets = set(re.findall(r"^([\w-]+):", (ROOT / "Makefile").read_text(), re.MULTILINE))
    for span in spans(page):
        if not re.match(r"(--|(\.venv/bin/)?jaxbiped |python |make )", span):
            continue
        line = words(span)
        known = anywhere
        if line[0].endswith("jaxbiped"):
            command = line[1]
            if command in ("--help", "COMMAND"):
                continue
            assert command in cli.COMMANDS, span
            known = options(command)
        elif line[0] == "make":
            assert line[1] in targets, span
        elif line[:2] == ["python", "-m"]:
            found = importlib.util.find_spec(line[2])
            assert found, span
            known = script_options(Path(found.origin))
        elif line[0] == "python":
            known = script_options(ROOT / line[1])
        assert set(given(line)) <= known, span


@pages
def test_paths_exist(page):
    for place in PLACE.findall(seen(page)):
        assert place in PLACEHOLDERS or list(ROOT.glob(place)), place
    for path in SNIPPET.findall(seen(page)):
        assert (ROOT / path).is_file(), path


@pages
def test_modules_and_public_names_exist(page):
    public = set(jaxbiped.__all__) | jaxbiped.modules_ | {"__all__"}
    for name in re.findall(r"\bjb\.([A-Za-z_]\w*)", seen(page)):
        assert name in public, name
    for name in MODULE.findall(seen(page)):
        assert name in GROUPS or name.partition(".")[2] in public or is_there(name), name


def is_there(name: str) -> bool:
    """Whether a dotted name is a module, or something that a module defines; nothing of it is imported."""
    path = ROOT.joinpath(*name.split("."))
    if path.is_dir() or path.with_suffix(".py").is_file():
        return True
    holder, own = path.parent.with_suffix(".py"), path.name
    if not holder.is_file():
        return False
    return own in {getattr(node, "name", None) for node in ast.parse(holder.read_text()).body}


@pages
def test_python_compiles(page):
    for block in blocks(page):
        # A block may be the body of a function that is told in part.
        compile(block, str(page), "exec")
        for name in re.findall(r"\bjb\.([A-Za-z_]\w*)", block):
            assert name in jaxbiped.__all__ or name in jaxbiped.modules_, name


class Loader(yaml.SafeLoader):
    """Of mkdocs.yml, whose `!relative` is mkdocs' own."""


Loader.add_constructor("!relative", lambda loader, node: loader.construct_scalar(node))


def test_every_page_is_in_the_navigation():
    def leaves(node):
        if isinstance(node, str):
            return [node]
        return [leaf for item in (node.values() if isinstance(node, dict) else node) for leaf in leaves(item)]

    listed = leaves(yaml.load((ROOT / "mkdocs.yml").read_text(), Loader)["nav"])
    assert sorted(listed) == sorted(path.relative_to(GUIDE).as_posix() for path in PAGES[1:])


def test_the_reference_has_every_public_name():
    listed = re.findall(r"^::: jaxbiped\.(\w+)$", (GUIDE / "reference.md").read_text(), re.MULTILINE)
    assert sorted(listed) == sorted(jaxbiped.__all__)


def test_the_drawing_and_the_table_have_every_room():
    rooms = sorted(path.parent.name for path in (ROOT / "jaxbiped").glob("*/__init__.py"))
    table = re.findall(r"^\| `(\w+)` \|", (GUIDE / "architecture.md").read_text(), re.MULTILINE)
    drawn = re.findall(r'y="\d+">(\w+)</text>', re.sub(r"<text class.*?</text>", "", drawing()))
    assert sorted(table) == rooms
    assert sorted(drawn) == rooms


def drawing() -> str:
    """The text of the drawing."""
    return (GUIDE / "architecture.svg").read_text()


def test_figures_are_those_of_their_file():
    assert figures.check(ROOT) == []


def test_figures_of_readme_are_those_of_the_guide():
    rows = [line for line in seen(ROOT / "README.md").splitlines() if re.match(r"\| .*\[.*\d.*\]", line)]
    guide = "\n".join(seen(path) for path in PAGES[1:])
    numbers = [[cell.strip() for cell in row.split("|") if re.search(r"\d", cell)] for row in rows]
    lines = [line for line in guide.splitlines() if line.startswith("|")]
    assert len(rows) > 15
    for cells in numbers:
        assert any(all(cell in line for cell in cells) for line in lines), cells
