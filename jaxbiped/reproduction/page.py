"""The page of the reproduction: the content of `reproduction.html`, in order."""

from __future__ import annotations

import json
from collections.abc import Mapping

from jaxbiped.report.grid import Grid, to_grid, typeset
from jaxbiped.report.page import Key, Page, Section, render
from jaxbiped.report.words import signed
from jaxbiped.reproduction import EXPERIMENTS, PUBLISHED, Experiment, fit_measuring
from jaxbiped.reproduction.account import GATE_CARRIES, other_reading
from jaxbiped.reproduction.findings import Findings
from jaxbiped.reproduction.making import making_of
from jaxbiped.reproduction.pictures import KEY, growing
from jaxbiped.reproduction.population import population_section, saved_sheet
from jaxbiped.reproduction.reasons import FAR, WORTH, distance_reason, relative, time_reason
from jaxbiped.reproduction.robot import robot_plots
from jaxbiped.reproduction.tables import (
    account_sheet,
    endings_sheet,
    experiment_sheet,
    fit_sheet,
    mishap_sheet,
    table_1_sheet,
    table_2_sheet,
)

PAGE = "reproduction.html"
TITLE = "The paper, reproduced"
LIMITATIONS = (
    "The layouts of the experiments are not in the paper's text. Each scene file says what is known and what is "
    "chosen; distances depend on what is chosen.",
    "The paper's robot walked once in each experiment, so its figures have no interval.",
    "The paper's Table 2 says 48 s for a gate. It is read here as 48 s for each cell of 5 cm, as C2 = 5 suggests.",
    "Simulated bipeds play their primitives fast; the clock counts the times of Table 2.",
)


def build(
    found: Findings, *, seed: int, fidelity: str, facts: Mapping[str, str], commands: tuple[str, ...], config: dict
) -> str:
    """The page as HTML."""
    answers = tuple(typeset(text) for text in answer(found))
    page = Page(
        title=TITLE,
        kicker=f"jaxbiped · {fidelity} · seed {seed}",
        answer=answers,
        keys=keys(found),
        sections=sections(found),
        limitations=LIMITATIONS,
        commands=commands,
        facts=dict(facts),
        config=json.dumps(config, indent=2, sort_keys=True),
        warnings=warnings(found),
    )
    return render(page)


def warnings(found: Findings) -> tuple[str, ...]:
    """The experiments that did not end at the goal."""
    said = []
    for item in EXPERIMENTS:
        shown = found.shown[item.number]
        if not shown.reached:
            said.append(f"Experiment {item.number} ({item.title}) did not reach its goal: {label(shown.code.label)}.")
    return tuple(said)


def label(code: str) -> str:
    """A code as displayed."""
    return code.replace("_", " ")


def answer(found: Findings) -> list[str]:
    """The sentences at the top."""
    solved = [item.number for item in EXPERIMENTS if found.shown[item.number].reached]
    said = [f"{len(solved)} of the paper's 6 experiments reach their goal."]
    near = [item.number for item in PUBLISHED if close(item, found)]
    said.append(
        f"Of the four with a published time, {len(near)} end within {100 * WORTH:.0f} % of it"
        + (f" ({numbered(near)})." if near else ".")
    )
    right = [item.number for item in PUBLISHED if walks_as_far(item, found)]
    said.append(
        f"Distances are within {100 * FAR:.0f} cm of the paper's (travelled in experiments 4 and 5, else straight) in "
        f"{len(right)} of them" + (f": {numbered(right)}." if right else ".")
    )
    if found.fit:
        said.append(
            f"The one free number, the time of a measurement, is fitted to those four times: {found.fit.seconds:.1f} s "
            f"(default: {found.default:g} s)."
        )
    return said


def numbered(numbers: list[int]) -> str:
    """As in "experiments 3, 5 and 6"."""
    *most, last = map(str, numbers)
    return f"experiments {', '.join(most)} and {last}" if most else f"experiment {last}"


def close(item: Experiment, found: Findings) -> bool:
    """Whether the mission shown takes about as long as the paper's."""
    shown = found.shown[item.number]
    return shown.reached and abs(relative(shown.time(found.measure), 60 * item.minutes)) <= WORTH


def walks_as_far(item: Experiment, found: Findings) -> bool:
    """Whether the mission shown walks about as far as the paper's."""
    shown = found.shown[item.number]
    return shown.reached and item.way is not None and abs(shown.distance - item.way) <= FAR


def reasons(found: Findings) -> list[str]:
    """Why figures differ, one sentence or two each."""
    said = []
    for item in EXPERIMENTS:
        shown = found.shown[item.number]
        said.append(distance_reason(item, shown, found.shortest.get(item.number)))
        said.append(time_reason(item, shown, found.measure, found.gate_depth, found.config.robot.radius))
    return [text for text in said if text]


def keys(found: Findings) -> tuple[Key, ...]:
    """The four published times."""
    cards = []
    for item in PUBLISHED:
        shown = found.shown[item.number]
        name = f"Experiment {item.number}, {item.title}"
        if not shown.reached:
            cards.append(Key(name, label(shown.code.label), f"paper: {item.minutes:.1f} min", False))
            continue
        off = 100 * relative(shown.time(found.measure), 60 * item.minutes)
        value = f"{shown.time(found.measure) / 60:.1f} min"
        said = typeset(f"paper: {item.minutes:.1f} min, {signed(off, 0)} %")
        cards.append(Key(name, value, said, close(item, found)))
    return tuple(cards)


def sections(found: Findings) -> tuple[Section, ...]:
    """All sections; those of skipped parts are left out."""
    tables = tuple(to_grid(experiment_sheet(found, table)) for table in (3, 4, None))
    fitted = (to_grid(fit_sheet(found.fit, found.shown)), *other_gate(found)) if found.fit else ()
    spent = to_grid(account_sheet(found, [item.number for item in PUBLISHED]))
    why = tuple(typeset(text) for text in reasons(found))
    made = [Section("Tables 3 and 4", why, grids=(*tables, *fitted, spent))]
    if found.table_1:
        made.append(Section("Table 1", grids=(to_grid(table_1_sheet(found)), to_grid(endings_sheet(found)))))
    if found.table_2:
        made.append(Section("Table 2", grids=(to_grid(table_2_sheet(found.table_2)),)))
    made += populations(found)
    made += [experiment(item, found) for item in EXPERIMENTS]
    made.append(making(found))
    if found.endings:
        made.append(Section("What cannot work", grids=(to_grid(mishap_sheet(found.endings)),)))
    return tuple(made)


def other_gate(found: Findings) -> tuple[Grid, ...]:
    """The fit with another meaning of the 48 s for a gate in Table 2; figures elsewhere do not use it."""
    shown = {number: other_reading(each) for number, each in found.shown.items()}
    records = [other_reading(each) for some in found.experiments.values() for each in some]
    fit = fit_measuring(records, PUBLISHED, shown)
    if not fit:
        return ()
    title = f"If the 48 s of Pass-gate were for {100 * GATE_CARRIES:.0f} cm instead of each cell: a"
    return (to_grid(fit_sheet(fit, shown, title)),)


def experiment(item: Experiment, found: Findings) -> Section:
    """The pictures of one experiment."""
    log = found.logs[item.number]
    robots, why = robot_plots(item, log, found.config.walk.biped)
    text = (KEY,) if item is EXPERIMENTS[0] else ()
    title = f"Experiment {item.number}: {item.title} (Fig. {item.figure} of the paper)"
    return Section(title, (*text, why) if why else text, (*growing(log), *robots))


def making(found: Findings) -> Section:
    """How the map of the last experiment was made, after its third measurement."""
    item = EXPERIMENTS[-1]
    log = found.logs[item.number]
    t = min(2, max(len(log.time) - 2, 0))
    plots = making_of(log, t, found.config.robot)
    return Section(f"How a map is made: experiment {item.number} (Figs. 3 and 5 to 7 of the paper)", (), tuple(plots))


def populations(found: Findings) -> list[Section]:
    """The population behind the example of experiments 4 and 5."""
    if not found.populations:
        return []
    summary = Section("The population behind the example", grids=(to_grid(saved_sheet(found.populations)),))
    return [summary, *(population_section(each, found.measure) for each in found.populations)]
