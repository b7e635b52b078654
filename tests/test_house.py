"""The order of the rooms: a room imports those before it, never those after it, and modules import each other one way.

Read from the sources, so that imports inside functions count; those under `if TYPE_CHECKING` do not.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

ROOT = Path(__file__).parents[1]
PACKAGE = "jaxbiped"
ROOMS = (
    *("core", "geometry", "formats", "arenas", "sensing", "stereo", "mapping", "localisation", "planning", "motion"),
    *("physics", "biped", "executors", "mission", "fitting", "statistics", "study", "report", "reproduction", "viewer"),
    *("api", "commands", "cli"),
)
FRONT = "api"  # the room of `import jaxbiped`, whose names are the public ones
AT_THE_TOP = {"cli": "cli", "__main__": "cli", "testing": FRONT}  # modules beside the rooms; all others are the core's
UPWARDS: dict[str, tuple[str, ...]] = {}  # imports of a later room, by file: the lines that do it
CIRCULAR = {  # imports that close a circle, by file: the lines that do it
    # A config is light to load; its traced form, which loads JAX, is made from it.
    "jaxbiped/mission/config.py": ("from jaxbiped.mission.params import mission_params",),
    # What is built in is registered when it is first asked for.
    "jaxbiped/executors/execution.py": (
        "from jaxbiped.executors import built_in",
        "from jaxbiped.executors.built_in import Kinematic, Sampled",
    ),
    "jaxbiped/mission/metric.py": ("from jaxbiped.mission import metrics",),
}


@dataclass(frozen=True)
class Import:
    """One module that a line imports."""

    file: str
    line: int
    text: str  # of the statement
    module: str  # that imports
    target: str  # that is imported


@cache
def modules() -> dict[str, Path]:
    """Files by the names of their modules."""
    files = sorted((ROOT / PACKAGE).rglob("*.py"))
    return {".".join(file.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__"): file for file in files}


@cache
def imports() -> tuple[Import, ...]:
    """All imports of the package's modules by each other."""
    return tuple(found for module, file in modules().items() for found in imports_of(module, file))


def imports_of(module: str, file: Path) -> Iterator[Import]:
    """Those of one module."""
    text = file.read_text()
    for node in statements(ast.parse(text)):
        assert not getattr(node, "level", 0), f"{file}:{node.lineno}: imports are absolute"
        for target in targets(node):
            yield Import(file.relative_to(ROOT).as_posix(), node.lineno, ast.unparse(node), module, target)


def statements(node: ast.AST) -> Iterator[ast.Import | ast.ImportFrom]:
    """Import statements at any depth."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.Import | ast.ImportFrom):
            yield child
        elif isinstance(child, ast.If) and ast.unparse(child.test).endswith("TYPE_CHECKING"):
            yield from statements(ast.Module(child.orelse, []))
        else:
            yield from statements(child)


def targets(node: ast.Import | ast.ImportFrom) -> Iterator[str]:
    """The modules of the package that a statement imports."""
    for alias in node.names:
        if isinstance(node, ast.Import):
            name = alias.name
        elif f"{node.module}.{alias.name}" in modules():
            name = f"{node.module}.{alias.name}"
        else:
            name = node.module or ""
            if name == PACKAGE and alias.name == "__version__":
                continue
        if name.partition(".")[0] == PACKAGE:
            yield name


def room(module: str) -> str:
    """The room that a module is in."""
    if module == PACKAGE:
        return FRONT
    first = module.split(".")[1]
    return first if first in ROOMS else AT_THE_TOP.get(first, "core")


def is_upwards(found: Import) -> bool:
    """Whether an import is of a later room; the package's own `__init__` loads what it lists when it is used."""
    return found.module != PACKAGE and ROOMS.index(room(found.target)) > ROOMS.index(room(found.module))


def is_listed(found: Import, known: dict[str, tuple[str, ...]]) -> bool:
    """Whether an import is one of the known ones."""
    return found.text in known.get(found.file, ())


def lines_of(known: dict[str, tuple[str, ...]]) -> set[tuple[str, str]]:
    """File and line of each of the known ones."""
    return {(file, line) for file, lines in known.items() for line in lines}


def reached(start: str, edges: dict[str, set[str]]) -> set[str]:
    """The modules that a module imports, by however many others."""
    seen: set[str] = set()
    waiting = [start]
    while waiting:
        new = edges.get(waiting.pop(), set()) - seen
        seen |= new
        waiting += new
    return seen


def edges_without(known: dict[str, tuple[str, ...]]) -> dict[str, set[str]]:
    """Which module imports which, but for the known lines. A package is its `__init__`."""
    edges: dict[str, set[str]] = {}
    for found in imports():
        if found.target != PACKAGE and not is_listed(found, known):
            edges.setdefault(found.module, set()).add(found.target)
    return edges


def told(found: Import) -> str:
    """File, line and what stands there."""
    return f"{found.file}:{found.line}: {found.text}"


def test_rooms_are_those_of_the_package():
    there = {path.parent.name for path in (ROOT / PACKAGE).glob("*/__init__.py")}
    assert there <= set(ROOMS), there - set(ROOMS)


def test_no_room_imports_a_later_one():
    wrong = [found for found in imports() if is_upwards(found)]
    assert [told(found) for found in wrong if not is_listed(found, UPWARDS)] == []
    left = {(found.file, found.text) for found in wrong}
    assert lines_of(UPWARDS) <= left, "one is mended: remove it from the list"


def test_no_modules_import_each_other():
    edges = edges_without(CIRCULAR)
    circles = [
        found
        for found in imports()
        if not is_listed(found, CIRCULAR) and found.module in {found.target, *reached(found.target, edges)}
    ]
    assert [told(found) for found in circles] == []
    closing = {
        (found.file, found.text)
        for found in imports()
        if is_listed(found, CIRCULAR) and found.module in reached(found.target, edges)
    }
    assert lines_of(CIRCULAR) == closing, "one is mended: remove it from the list"


def test_no_function_has_the_name_of_its_module():
    """Importing the module would set the package's attribute of that name."""
    wrong = []
    for module, file in modules().items():
        own = module.rpartition(".")[2]
        if file.name == "__init__.py":
            taken = {path.stem for path in file.parent.glob("*.py")} | {path.parent.name for path in packages(file)}
            listed = public(file)
            wrong += [f"{file.relative_to(ROOT)}: {name}" for name in sorted(listed & taken)]
        for node in ast.parse(file.read_text()).body:
            if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and node.name == own:
                wrong.append(f"{file.relative_to(ROOT)}:{node.lineno}: def {own}")
    assert wrong == []


def packages(file: Path) -> list[Path]:
    """The packages beside an `__init__`."""
    return sorted(file.parent.glob("*/__init__.py"))


def public(file: Path) -> set[str]:
    """The names that an `__init__` lists for `lazy_package`."""
    names: set[str] = set()
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "lazy_package" and len(node.args) > 1:
            listed = ast.literal_eval(node.args[1])
            names |= {word.rpartition(":")[2] for words in listed.values() for word in words.split()}
    return names
