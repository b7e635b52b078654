"""Notes on strategies, printed below the options of commands that take them."""

from __future__ import annotations

from jaxbiped.core.names import STRATEGIES

DARES = {
    "full": "steps over bumps and passes gates",
    "bump_aware": "steps over bumps; gates are obstacles to it",
    "gate_aware": "passes gates; bumps are obstacles to it",
    "floor_only": "walks around bumps and gates",
    "blind_stop": "walks straight to the goal and stops at anything but floor",
}
OWN = "or your own: package.module:name, or a name that a package registered"


def strategy_notes(names: tuple[str, ...] = STRATEGIES, own: bool = True) -> str:
    """A line for each built-in strategy and, with `own`, one for all others."""
    lines = [f"  {name:<10}  {DARES[name]}" for name in names]
    return "\n".join(["Strategies:", *lines, *([f"  {OWN}"] if own else [])])
