"""A mission to show: its log, and everything else that the viewer needs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from jaxbiped.config import parse
from jaxbiped.errors import InputError
from jaxbiped.mission.log import MissionLog
from jaxbiped.mission.params import MissionConfig
from jaxbiped.mission.recording import load_log


@dataclass(frozen=True)
class Shown:
    """One mission."""

    log: MissionLog
    config: MissionConfig
    title: str  # the arena's name and the strategy
    ending: str  # the outcome, in a sentence
    note: str = ""  # further remarks


def shown(path: Path) -> Shown:
    """The mission in a file written by `mission.recording.save_log`.

    Raises:
      InputError: not a log, a damaged one, or one whose config this version does not know.
    """
    log, facts = load_log(path)
    config = config_of(facts, path)
    title = ", ".join(str(facts[name]) for name in ("scene", "strategy") if name in facts) or path.stem
    seeds = [each["seed"] for each in (facts, facts.get("args", {})) if "seed" in each]
    seed = f", seed {seeds[0]}" if seeds else ""
    note = f"sensor {config.sensor}, executor {config.executor}{seed}"
    return Shown(log, config, title, ending(log, facts), note)


def config_of(facts: Mapping[str, Any], path: Path) -> MissionConfig:
    """The mission's config according to the file; defaults for missing values."""
    said = facts.get("args", {})
    brief = {name: said[name] for name in ("sensor", "executor") if name in said}
    try:
        return parse(MissionConfig, facts.get("config", brief), file=path)
    except InputError as error:
        raise InputError(f"was written by another version: {error}", file=path) from None


def ending(log: MissionLog, facts: Mapping[str, Any]) -> str:
    """The outcome of a mission, as text."""
    outcome = log.outcome.replace("_", " ") or "not ended"
    measured = f", {facts['measurements']} measurements" if "measurements" in facts else ""
    walked = f"{100 * facts['distance']:.0f} cm in " if "distance" in facts else ""
    return f"{outcome}: {walked}{log.time[-1]:.0f} s ({log.time[-1] / 60:.1f} min){measured}"
