"""One list of names."""

import sys

import pytest

from jaxbiped.core.registry import Registry
from jaxbiped.errors import InputError


@pytest.fixture
def registry():
    made = Registry("thing", "jaxbiped.nothing")
    made.add("one", 1)
    return made


def plain(thing, name):
    return name, thing


def test_names_are_found_in_their_order(registry):
    registry.add("a", 2)
    assert list(registry) == ["one", "a"] and registry.find("a", plain) == 2 and "a" in registry and len(registry) == 2


def test_two_of_one_name_are_refused_and_one_twice_is_not(registry):
    registry.add("one", 1)
    with pytest.raises(InputError, match="two thing entries cannot have one name"):
        registry.add("one", 2)
    assert registry.add("one", 3, replace=True) == 3


@pytest.mark.parametrize("name", ["", "two", "one ", "a:b:c", "os.path", ":x", "x:", "x:1", "../x:y", "x y:z"])
def test_names_that_are_not_known_list_those_that_are(registry, name):
    with pytest.raises(InputError, match=r"must be one of one, or package\.module:name"):
        registry.find(name, plain)


def test_modules_are_imported_from_the_working_directory_and_named_where_they_fail(registry, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "lab_one.py").write_text("thing = 5\n")
    (tmp_path / "lab_two.py").write_text("import nothing_of_this_name\n")
    (tmp_path / "lab_three.py").write_text("def :\n")
    path = list(sys.path)
    assert registry.find("lab_one:thing", plain) == ("thing", 5)
    for place, match in [
        ("lab_one:other", "module lab_one has no other"),
        ("lab_two:thing", "module lab_two cannot be imported: ModuleNotFoundError: No module named 'nothing_of_this"),
        ("lab_three:thing", "module lab_three cannot be imported: SyntaxError"),
        ("lab_four:thing", "module lab_four cannot be imported: ModuleNotFoundError"),
    ]:
        with pytest.raises(InputError, match=match):
            registry.find(place, plain)
    assert sys.path == path and not registry.knows("lab_one:thing")
