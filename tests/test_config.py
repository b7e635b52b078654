"""Whatever is wrong with a config is said in our words: those of the library that found it are not for people."""

import importlib
import math
import pkgutil
import re

import jaxbiped
from jaxbiped.config import Model, parse
from jaxbiped.errors import InputError

NASTY = (
    None, True, 0, -1, 1.5, -1e9, 1e300, 10**30, 10**400, math.nan, math.inf, "", "x", "1", "none", b"\xff", (), [1],
    [[]], ["a", "b", "c", "d", "e"], [math.nan] * 3, [1e9] * 3, list(range(50)), {}, {"x": 1},
    {"kind": "none"}, object(),
)  # fmt: skip
THEIRS = re.compile(r"should|[Ff]ield required|instance|valid|np\.|pydantic|Assertion|Unable|Extra|input\b")


def models():
    """Every model of the package."""
    for module in pkgutil.walk_packages(jaxbiped.__path__, "jaxbiped."):
        if not module.name.endswith("__main__"):
            importlib.import_module(module.name)
    waiting, found = [Model], []
    while waiting:
        some = waiting.pop().__subclasses__()
        waiting += some
        found += [model for model in some if model.__module__.startswith("jaxbiped.")]
    return found


def test_every_field_of_every_model_refuses_in_our_words():
    tried, refused, theirs = 0, 0, []
    for model in models():
        for name in (*model.model_fields, "no_such_field"):
            for value in NASTY:
                tried += 1
                try:
                    parse(model, {name: value}, file="some.toml")
                except InputError as error:
                    refused += 1
                    text = str(error).split(" (got ")[0]
                    if "\n" in str(error) or THEIRS.search(text):
                        theirs.append(f"{model.__name__}.{name}: {text}")
    assert refused > 2000 and tried > refused
    assert not theirs
