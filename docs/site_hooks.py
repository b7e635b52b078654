"""Hooks of the guide's build: figures that README shows, too, are kept in one place, outside of `docs`."""

import re
from pathlib import Path

from mkdocs.structure.files import File

FIGURES = Path(__file__).parents[1] / "sweeps" / "figures"


def on_files(files, config):
    """Add the figures to the site, in its folder `figures`."""
    for path in sorted(FIGURES.glob("*.png")):
        files.append(File.generated(config, f"figures/{path.name}", abs_src_path=str(path)))
    return files


def on_page_markdown(markdown, page, config, files):
    """Links to `../sweeps/figures`, which are right in the repository, lead to that folder."""
    return re.sub(r"\]\(\.\./((?:\.\./)*)sweeps/figures/", r"](\1figures/", markdown)
