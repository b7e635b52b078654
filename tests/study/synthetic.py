"""Rows of a made-up study with the structure of a real one: hard families, ties, failures, two ways round a bump."""

from __future__ import annotations

import numpy as np
import polars as pl

from jaxbiped.statistics import schema

HANDICAP = {"full": 0.0, "bump_aware": 0.4, "gate_aware": 0.9, "floor_only": 1.2, "blind_stop": 2.4}
DETOUR = {"bump": 0.35, "stairs": 0.30, "mixed": 0.20, "gate": 0.05}  # [m] of floor_only over the crossing, on average


def rows(arenas: int = 240, seed: int = 0, strategies: tuple[str, ...] = schema.STRATEGIES) -> pl.DataFrame:
    """One row per arena and strategy, paired: an arena's luck is shared by its strategies."""
    rng = np.random.default_rng(seed)
    columns = {name: [] for name in schema.SCHEMA}
    for arena in range(arenas):
        family = schema.FAMILIES[arena % len(schema.FAMILIES)]
        difficulty, luck, straight = rng.random(), rng.normal(), 0.8 + 0.6 * rng.random()
        for strategy in strategies:
            blind = strategy == "blind_stop"
            hard = HANDICAP[strategy] * (family in DETOUR or blind) + 1.6 * difficulty
            reached = luck + 0.5 * rng.normal() + 1.8 > hard
            crosses = strategy in ("full", "bump_aware") and family in ("bump", "stairs", "mixed")
            detour = 0 if crosses else rng.exponential(DETOUR.get(family, 0.02) + 1e-9) * (family != "clutter")
            distance = np.round((straight + detour) / 0.05) * 0.05
            time = distance / 0.05 * 26 + 192 * crosses + 5 * rng.integers(0, 6)
            code = "reached" if reached else rng.choice(["no_path", "stuck", "collided", "fell", "out_of_steps"])
            share = 1.0 if reached else rng.random()
            reachable = bool(reached or rng.random() < 0.5)
            values = (0, arena, family, difficulty, strategy, str(code), bool(reached))
            values += (distance, time) if reached else (None, None)
            values += (
                distance * share,
                time * share,
                int(30 * share),
                int(28 * share),
                0.05 if reached else 0.6,
                0.01,
                0.02,
            )
            values += (reachable, *((60.0, distance) if reachable else (None, None)))
            values += (int(28 * share), None, 60.0)  # plans, their time, and what the first costs
            for name, value in zip(columns, values, strict=True):
                columns[name].append(value)
    return pl.DataFrame(columns, schema=schema.SCHEMA)
