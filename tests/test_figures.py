"""Numbers of the guide, on made-up pages: filled from their file, compared with it, and printed again."""

import pytest

import figures
from figure_marks import unmarked

FILE = """
[speed]
command = "python say.py"
commit = "0123abc"
machine = "a machine"
seconds = 1
tolerance = "10 %"
figures.ratio = { value = "5.8", pattern = 'ratio ([\\d.]+|nan)' }
figures.share = { value = "90.2 % [87.5, 92.3]", pattern = 'share (.*) %', tolerance = 0.5 }

[long]
command = "python never.py"
commit = "0123abc"
machine = "a machine"
seconds = 700
tolerance = 0

[long.figures]
count = "1,093"
table = '''
| a | b |
|---|---|
| 1 | 2 |
'''
"""
README = """# Title

It is <!--figure:speed.ratio-->?<!--/--> times as fast, of <!--figure:long.count-->1<!--/--> arenas; again
<!--a comment--> <!--figure:speed.ratio--><!--/-->.

| share | of |
|---|---|
| <!--figure:speed.share-->?<!--/--> | <!--figure:long.count-->?<!--/--> |
"""
GUIDE = """# Page

<!--figure:long.table-->
| old |
<!--/-->

The end.
"""
SAY = "print('ratio 6.1, share 90.4 [87.5, 92.0] %')"


@pytest.fixture
def root(tmp_path):
    """A checkout with a file of figures and two pages that are not filled yet."""
    (tmp_path / "docs").mkdir()
    (tmp_path / "docs" / "figures.toml").write_text(FILE)
    (tmp_path / "docs" / "page.md").write_text(GUIDE)
    (tmp_path / "README.md").write_text(README)
    (tmp_path / "say.py").write_text(SAY)
    return tmp_path


def refused(root, capsys, *words):
    """The one line on stderr of what cannot be used."""
    assert figures.main(words, root) == 2
    said = capsys.readouterr().err.splitlines()
    assert len(said) == 1
    return said[0]


def test_pages_are_filled_from_the_file_and_agree_with_it_then(root, capsys):
    assert figures.main(["check"], root) == 1
    said = capsys.readouterr().out.splitlines()
    assert said[0] == "README.md:3: speed.ratio: shows '?', the file has '5.8'" and len(said) == 6
    assert figures.main(["fill"], root) == 0
    assert capsys.readouterr().out == "README.md: filled\ndocs/page.md: filled\n"
    assert figures.main(["check"], root) == 0 and figures.main(["fill"], root) == 0
    assert capsys.readouterr().out == ""
    text = (root / "README.md").read_text()
    assert "| <!--figure:speed.share-->90.2 % [87.5, 92.3]<!--/--> | <!--figure:long.count-->1,093<!--/--> |" in text
    assert "It is 5.8 times as fast, of 1,093 arenas; again\n<!--a comment--> 5.8." in unmarked(text)
    assert "<!--figure:long.table-->\n| a | b |\n|---|---|\n| 1 | 2 |\n<!--/-->" in (root / "docs/page.md").read_text()


def test_a_figure_that_no_page_shows_is_named(root, capsys):
    (root / "docs" / "page.md").write_text("# Nothing\n")
    figures.main(["fill"], root)
    assert figures.main(["check"], root) == 1
    assert "docs/figures.toml: long.table: no page shows it" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("of <!--figure:speed.ratoi-->5.8<!--/-->", "README.md:1: is not in docs/figures.toml (got 'speed.ratoi')"),
        ("one\n\nof <!--figure:speed.ratio-->5.8", "README.md:3: mark is not closed"),
        ("of <!--figure:speed.ratio-->5.8, <!--figure:speed.ratio-->5.8<!--/-->", "is not closed"),
        ("of <!--figure:speed.ratio-->5.8 and <!--/", "README.md:1: marks are"),
        ("of <!--figure:speed.ratio 5.8", "README.md:1: marks are"),
        ("of 5.8<!--/--> and", "README.md:1: closes a mark that is not open"),
        ("of <!-- figure:speed.ratio -->5.8<!--/-->", "README.md:1: marks are"),
        ("of <!--figure:ratio-->5.8<!--/-->", "README.md:1: marks are"),
        ("of\n<!--figure:speed.ratio-->5.8<!--/-->", "README.md:2: a mark cannot begin a line"),
        ("- <!--figure:speed.ratio-->5.8<!--/-->", "README.md:1: a mark cannot begin a line"),
        ("of `<!--figure:speed.ratio-->5.8<!--/-->`", "README.md:1: marks inside code"),
        ("```\nof <!--figure:speed.ratio-->5.8<!--/-->\n```", "README.md:2: marks inside code"),
        ("of <!--figure:speed.ratio-->5.8\n<!--/-->", "README.md:1: marks of several lines"),
        ("of <!--figure:long.table-->2<!--/-->", "README.md:1: marks have lines of their own"),
        ("<!--figure:speed.ratio-->\n5.8\n<!--/-->", "README.md:1: marks have lines of their own"),
    ],
)
@pytest.mark.parametrize("action", ["fill", "check"])
def test_marks_that_cannot_be_used_are_named_by_their_line_and_nothing_is_written(root, capsys, text, said, action):
    (root / "README.md").write_text(text)
    assert said in refused(root, capsys, action)
    assert (root / "README.md").read_text() == text and (root / "docs" / "page.md").read_text() == GUIDE


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('commit = "0123abc"', "", "speed: commit: is required"),
        ('tolerance = "10 %"', 'tolerance = "ten"', "speed: tolerance.absolute: must be a number (got 'ten')"),
        ('tolerance = "10 %"', "tolerance = nan", "speed: tolerance.absolute: must be finite"),
        ('count = "1,093"', 'count = "1,093"\ncount = "1,094"', "defines a key a second time"),
        ("[long]", "[speed]", "defines a key a second time"),
        ("ratio ([", "ratio ((", "speed: figures.ratio.pattern"),
        (", pattern = 'share (.*) %'", "", "figures.share must have a pattern, as the command takes under 60 s"),
        ('"5.8"', '""', "speed: figures.ratio.value: must have at least 1 character(s)"),
        ('"5.8"', '"5<!--8-->"', "speed: figures.ratio.value: must hold no comment"),
    ],
)
def test_a_file_that_cannot_be_used_is_named_with_its_field(root, capsys, old, new, said):
    assert old in FILE
    (root / "docs" / "figures.toml").write_text(FILE.replace(old, new, 1))
    for action in ("fill", "check", "rerun"):
        assert said in refused(root, capsys, action)


def test_a_missing_file_is_named(root, capsys):
    (root / "docs" / "figures.toml").unlink()
    assert "docs/figures.toml" in refused(root, capsys, "check")


def test_what_takes_under_a_minute_is_printed_again_and_compared_within_its_tolerance(root, capsys):
    assert figures.main(["rerun"], root) == 0
    assert capsys.readouterr().out == "speed: python say.py\n"
    (root / "say.py").write_text("print('ratio 6.5, share 90.2 [87.5, 92.9] %')")
    assert figures.main(["rerun", "speed"], root) == 1
    assert capsys.readouterr().out.splitlines()[1:] == [
        "speed.ratio: the file has 5.8, the command prints 6.5 (tolerance 10 %)",
        "speed.share: the file has 90.2 % [87.5, 92.3], the command prints 90.2 [87.5, 92.9] (tolerance 0.5)",
    ]


def test_what_a_command_writes_is_not_in_the_way_of_the_next_time(root):
    (root / "say.py").write_text(f"import os\nos.mkdir('results')\n{SAY}")
    assert figures.main(["rerun"], root) == 0 and figures.main(["rerun"], root) == 0
    assert not (root / "results").exists()


@pytest.mark.parametrize("said", ["ratio nan, share 90.2 [87.5, 92.3] %", "ratio 5.8, share 90.2 [87.5] %"])
def test_nan_and_numbers_that_are_missing_differ(root, capsys, said):
    (root / "say.py").write_text(f"print({said!r})")
    assert figures.main(["rerun"], root) == 1
    assert len(capsys.readouterr().out.splitlines()) == 2


@pytest.mark.parametrize(
    ("script", "said"),
    [
        ("", "command: prints nothing (got 'python say.py')"),
        ("print('ratio')", "speed.ratio.pattern: finds nothing in what the command prints"),
        ("import sys\nsys.exit('no disk\\nis left')", "command: fails with exit status 1: is left"),
        ("raise SystemExit(3)", "command: fails with exit status 3: nothing on stderr"),
    ],
)
def test_commands_that_say_nothing_of_use_are_named(root, capsys, script, said):
    (root / "say.py").write_text(script)
    assert said in refused(root, capsys, "rerun")


@pytest.mark.parametrize(
    ("command", "said"),
    [
        ("nobody-has-this", "command: cannot be run"),
        ("python 'say", "speed: command: No closing quotation"),
        (" ", "speed: command: must name a program"),
    ],
)
def test_commands_that_cannot_be_run_are_named(root, capsys, command, said):
    (root / "docs" / "figures.toml").write_text(FILE.replace("python say.py", command, 1))
    assert said in refused(root, capsys, "rerun")


def test_only_runs_under_a_minute_can_be_asked_for(root, capsys):
    for name in ("long", "nobody"):
        assert f"is no run that takes under 60 s (got '{name}')" in refused(root, capsys, "rerun", name)


@pytest.mark.parametrize(
    ("text", "found"),
    [
        ("90.2 % [87.5, 92.3]", [90.2, 87.5, 92.3]),
        ("-9.0 cm [-12.3, -6.8]", [-9.0, -12.3, -6.8]),
        ("+0.48", [0.48]),
        ("32, 36, 12", [32, 36, 12]),
        ("131,072 of 1,000,000", [131072, 1000000]),
        ("19 / 55, 12-24", [19, 55, 12, 24]),
        ("1e-5", [1e-5]),
        ("none", []),
    ],
)
def test_numbers_are_read_as_people_write_them(text, found):
    assert figures.numbers(text) == found
