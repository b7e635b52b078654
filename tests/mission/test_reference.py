"""The compiled loop against the plain one: same arena, same seed, same noise, same decisions."""

from dataclasses import fields, replace

import numpy as np
import pytest

from jaxbiped.mapping.grid import Cell
from jaxbiped.mission.outcome import Code
from tests.mission.conftest import SPEC
from tests.mission.replay import BORDER, Close, replay
from tests.reference import mission as reference

# Sums of a hundred float32 terms, and commands computed from poses that are off by as much.
METRES, SECONDS, RADIANS = 1e-4, 0.01, 1e-3
# A point within 1e-7 m of a voxel's border may fall on either side, and then a cell may be classed otherwise. Missions
# that part over such a cell may be this share of all. (None of the first 88 that were tried did.)
MAY_PART = 0.05
BORDER_POINTS = 3e-4  # share of all points that lay at such borders, at most: up to 1.8e-4 was seen
MEAN_BORDER_POINTS = 5e-5  # the same on average, of which 1.8e-5 was seen
# What may come out either way is as little as this: of points, those near one of the six faces of their voxel (by
# chance `6 * BORDER`); of rays, those that a tie of the sensor decides, and of fits of the floor, those at whose
# thresholds a point lies. 9e-5 and 0.004 of them did come out otherwise.
ON_BORDERS, RAYS, FITS = 2 * 6 * BORDER, 3e-4, 0.02
ON_BUMPS = 14  # number of a mission that meets many


@pytest.fixture(scope="session")
def plain(population):
    """The population's missions by the reference."""
    arenas, params, seeds, _ = population
    return [reference.run(*each, SPEC, keep=True) for each in zip(arenas, params, seeds, strict=True)]


def same_command(step, log, t):
    """Whether the t-th commands of both are the same but for rounding."""
    ours, theirs = log.command, step.command
    discrete = all(getattr(ours, name)[t] == getattr(theirs, name) for name in ("primitive", "rise", "squat"))
    return discrete and abs(ours.turn[t] - theirs.turn) < RADIANS and abs(ours.length[t] - theirs.length) < METRES


def parted_at(mission, log):
    """The first decision at which the two differ, None where there is none."""
    count = min(len(mission.steps), len(log.classes))
    return next((t for t in range(count) if not same_command(mission.steps[t], log, t)), None)


def test_missions_are_the_same(population, plain, played):
    parted = []
    for k, mission in enumerate(plain):
        same = played.code[k] == mission.code and played.decisions[k] == mission.decisions
        same &= abs(played.distance[k] - mission.distance) < METRES and abs(played.time[k] - mission.time) < SECONDS
        if not same:
            parted.append((k, population[3][k], Code(mission.code).name, Code(int(played.code[k])).name))
    assert len(parted) <= MAY_PART * len(plain), parted
    assert {mission.code for mission in plain} >= {Code.REACHED, Code.NO_PATH, Code.STUCK}


def test_maps_and_commands_are_the_same_until_a_point_lies_on_a_border(plain, stepped):
    share = []
    for k, (mission, log) in enumerate(zip(plain, stepped, strict=True)):
        at = parted_at(mission, log)
        for t, step in enumerate(mission.steps[: None if at is None else at + 1]):
            moved = np.abs(step.votes - log.votes[t]).sum() / step.votes.sum()
            other = (step.classes != log.classes[t]) | (step.levels != log.levels[t])
            assert moved < BORDER_POINTS, (k, t)
            assert moved > 0 or not other.any(), (k, t, "same points, other map")
            assert t != at or other.any(), (k, t, "same map, other command")
            share.append(moved)
    assert len(share) > 300 and np.mean(share) < MEAN_BORDER_POINTS


@pytest.fixture(scope="session")
def replayed(population, stepped):
    """Every decision of the compiled loop, done again by the plain one."""
    return [replays(*each) for each in zip(stepped, *population[:2], strict=True)]


def replays(log, arena, setting):
    """What was close in each decision of one mission."""
    maps = [None, *(moment.grid_map for moment in log.moments[:-1])]
    return [replay(*each, arena, setting, SPEC) for each in zip(log.moments, maps, strict=True)]


def test_every_count_is_the_same_but_for_what_lies_on_a_border(replayed):
    """`replay` raises where a ray, a count, a height or a vote differs by more than what rounding decides."""
    close = [each for mission in replayed for each in mission]
    total = {field.name: sum(getattr(each, field.name) for each in close) for field in fields(Close)}
    assert len(close) > 500 and total["points"] > 500_000
    assert 0 < total["borders"] < ON_BORDERS * total["points"], total
    assert total["rays"] < RAYS * total["points"] and total["fits"] < FITS * len(close), total


def edited(leaf, place, change):
    """A copy of an array with one element changed."""
    leaf = np.array(leaf)
    leaf[place] = change(leaf[place])
    return leaf


def spoil(moment, before, what):
    """A decision in which one thing is as no rounding makes it."""
    grid_map, view = moment.grid_map, moment.view
    added = grid_map.evidence - before.evidence
    full = np.unravel_index(added.argmax(), added.shape)
    cell = full[:2]
    if what == "a point less":
        return replace(moment, grid_map=replace(grid_map, evidence=edited(grid_map.evidence, full, lambda n: n - 64)))
    if what == "a point elsewhere":
        other = (*cell, full[2] + 1)
        moved = edited(edited(grid_map.evidence, full, lambda n: n - 64), other, lambda n: n + 64)
        return replace(moment, grid_map=replace(grid_map, evidence=moved))
    if what == "a height":
        rise = edited(grid_map.surfaces.rise, (0, *cell), lambda n: n + 1e-4 * grid_map.surfaces.weight[0, *cell])
        return replace(moment, grid_map=replace(grid_map, surfaces=replace(grid_map.surfaces, rise=rise)))
    if what == "a vote for another class":
        votes = np.array(grid_map.votes)
        votes[cell] = votes[cell][::-1]
        return replace(moment, grid_map=replace(grid_map, votes=votes))
    if what == "another class":
        far = tuple(np.argwhere(moment.classes == Cell.FLOOR)[-1])
        return replace(moment, classes=edited(moment.classes, far, lambda _: Cell.GATE))
    ray = np.flatnonzero(view.weight)[0]
    if what == "a ray":
        return replace(moment, view=replace(view, x=edited(view.x, ray, lambda x: x + 1e-4)))
    return replace(moment, view=replace(view, weight=edited(view.weight, ray, lambda _: 0)))


@pytest.mark.parametrize(
    "what",
    [
        "a point less",
        "a point elsewhere",
        "a height",
        "a vote for another class",
        "another class",
        "a ray",
        "a ray less",
    ],
)
def test_one_thing_that_no_rounding_explains_is_seen(population, stepped, what):
    before, moment = stepped[0].moments[1:3]
    arena, setting = (each[0] for each in population[:2])
    replay(moment, before.grid_map, arena, setting, SPEC)
    with pytest.raises(AssertionError):
        replay(spoil(moment, before.grid_map, what), before.grid_map, arena, setting, SPEC)


@pytest.mark.parametrize("name, by", [("step_tolerance", 0.001), ("height_tolerance", -0.002), ("step", 0.004)])
def test_another_tolerance_is_seen(population, stepped, name, by):
    """A body that bears 1 mm more, 2 mm less, or steps a little higher: one mission on bumps already tells."""
    log, arena, setting = (each[ON_BUMPS] for each in (stepped, *population[:2]))
    replays(log, arena, setting)
    body = replace(setting.body, **{name: np.float32(getattr(setting.body, name) + by)})
    with pytest.raises(AssertionError, match="votes of cells"):
        replays(log, arena, replace(setting, body=body))


def test_all_strategies_and_families_took_part(population, plain):
    arenas, _, _, names = population
    assert len(set(names)) == 5
    assert len({int(arena.family) for arena in arenas}) == 6
    assert any(step.command.rise for mission in plain for step in mission.steps)
    assert any(step.command.squat for mission in plain for step in mission.steps)
