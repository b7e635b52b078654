"""The real command line with one command more, `pretend`, for tests in processes of their own: `python -m` this.

It stores a folder, prints much of what is hard to print, and says what JAX computes; it loads nothing else.
"""

from __future__ import annotations

import hashlib
import sys
import time
from pathlib import Path

from rich.console import Console
from rich.progress import track
from rich.table import Table

from jaxbiped import cli
from jaxbiped.commands.options.base import Options
from jaxbiped.files import new_folder, write_whole

LINES = 3000  # more than a pipe holds


class PretendArgs(Options):
    """Store a folder, and print about it."""

    out: Path = Path("out")
    work: float = 0.0
    """[s] to be busy while the folder is half-written."""
    draw: bool = False
    """Store also a figure, and what numbers JAX draws."""


def main(args: PretendArgs) -> int:
    with new_folder(args.out) as folder:
        write_whole(folder / "first.txt", lambda file: file.write(b"1"))
        if args.draw:
            draw(folder)
        (folder / "ready").touch()
        for _ in track(range(10), description="busy", console=Console(stderr=True)):
            time.sleep(args.work / 10)
    table = Table(title="× − ± ° ≤ …")
    table.add_column("Ωmega")
    table.add_row("µ")
    Console().print(table)
    for _ in range(LINES):
        print("1 × 2 − 3 ± 4° → “5”")
    return 0


def draw(folder: Path) -> None:
    """What depends on the settings of JAX and of matplotlib."""
    import jax
    import jax.numpy as jnp
    import numba
    from matplotlib.figure import Figure

    from jaxbiped.report.pictures import save_figure
    from jaxbiped.report.style import own_style

    matrix = jax.random.normal(jax.random.key(1), (64, 64))
    values = (matrix @ matrix) + jnp.arange(64) / 3 + jnp.zeros((1, 64), jnp.int32)
    nan = jax.jit(lambda x: x / x)(0.0)
    digest = hashlib.sha256(bytes(memoryview(jax.device_get(values)))).hexdigest()
    (folder / "numbers.txt").write_text(f"{values.dtype} {digest} {nan} {numba.njit(lambda x: 2 * x)(21)}")

    @own_style()
    def picture() -> Figure:
        figure = Figure(figsize=(2, 2))
        ax = figure.subplots()
        ax.plot([0, 1])
        ax.set_title("x_1 & 100 %")
        return figure

    save_figure(picture(), folder / "figure.png")


if __name__ == "__main__":
    cli.COMMANDS["pretend"] = ("pretend", "PretendArgs", "pretend", False)
    for place in ("commands", "commands.options"):
        sys.modules[f"jaxbiped.{place}.pretend"] = sys.modules["__main__"]
    sys.exit(cli.main())
