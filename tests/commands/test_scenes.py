"""`jaxbiped compare SCENE...`: scenes that come first are the arenas."""

from pathlib import Path

import pytest

from jaxbiped.cli import with_scenes
from jaxbiped.errors import InputError

SCENES = Path(__file__).parents[2] / "configs" / "scenes"
TWO = [str(SCENES / "experiment_1.toml"), str(SCENES / "experiment_2.toml")]
STUDY = str(Path(__file__).parents[2] / "configs" / "studies" / "compare.toml")


@pytest.mark.parametrize("first", [TWO, TWO[:1]])
def test_files_become_families_with_an_arena_each(first):
    assert with_scenes([*first, "--seed", "3"]) == ["--families", *first, "--arenas", str(len(first)), "--seed", "3"]
    assert with_scenes([*first, "--arenas=40"]) == ["--families", *first, "--arenas=40"]


def test_a_folder_stands_for_its_scenes():
    words = with_scenes([str(SCENES)])
    files = [str(path) for path in sorted(SCENES.glob("*.toml"))]
    assert words == ["--families", *files, "--arenas", str(len(files))]


@pytest.mark.parametrize("words", [[], ["--arenas", "5"], [STUDY], [STUDY, "--seed", "1"], ["nothing.toml"]])
def test_all_else_is_left_as_it_is(words):
    assert with_scenes(list(words)) == words


def test_a_results_folder_is_none_of_scenes(tmp_path):
    (tmp_path / "manifest.json").write_text("{}")
    (tmp_path / "a.toml").write_text(Path(TWO[0]).read_text())
    assert with_scenes([str(tmp_path)]) == [str(tmp_path)]
    (tmp_path / "manifest.json").unlink()
    assert with_scenes([str(tmp_path)])[0] == "--families"


def test_a_file_among_them_that_is_none_is_named(tmp_path):
    for other in (STUDY, str(tmp_path / "no.toml"), str(tmp_path)):
        with pytest.raises(InputError, match="is not a scene like the others"):
            with_scenes([TWO[0], other])
    broken = tmp_path / "broken.toml"
    broken.write_text("start = [")
    with pytest.raises(InputError, match=r"broken\.toml: is not valid TOML"):
        with_scenes([TWO[0], str(broken)])
