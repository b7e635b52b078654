"""Tables of the page: the paper's four, how missions spent their time, and the missions that cannot succeed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from jaxbiped.motion.grid_units import CELL
from jaxbiped.report.tables import Row, Sheet
from jaxbiped.report.words import NONE, number, signed
from jaxbiped.reproduction.account import KINDS, MEASURE, Measuring, Record
from jaxbiped.reproduction.findings import Findings
from jaxbiped.reproduction.mishaps import Ending
from jaxbiped.reproduction.paper import EXPERIMENTS, TABLE_1, Experiment
from jaxbiped.reproduction.reasons import relative
from jaxbiped.reproduction.table_1 import SCENES
from jaxbiped.reproduction.table_2 import Verified


def ended(records: Sequence[Record]) -> str:
    """As in "5 of 5", or with the codes of the others."""
    codes = [each.code.label.replace("_", " ") for each in records]
    good = codes.count("reached")
    others = [f"{codes.count(code)} {code}" for code in dict.fromkeys(codes) if code != "reached"]
    return ", ".join([f"{good} of {len(codes)}", *others])


def spread(values: Sequence[float], shown: float, digits: int) -> str:
    """The figure shown, with the smallest and the greatest if there are several."""
    if len(values) < 2:
        return number(shown, digits)
    return f"{shown:.{digits}f} [{min(values):.{digits}f}, {max(values):.{digits}f}]"


def experiment_row(item: Experiment, found: Findings) -> Row:
    """One experiment: how its missions ended, distance and time beside the paper's, and the time at the default."""
    records, shown = found.experiments[item.number], found.shown[item.number]
    reached = [each for each in records if each.reached]
    name = f"{item.number}, {item.title}"
    if not reached:
        return (name, ended(records), NONE, way(item), NONE, NONE, paper_minutes(item), NONE, NONE)
    measure = found.measure
    times = [each.time(measure) / 60 for each in reached]
    time, distance = shown.time(measure) / 60, 100 * shown.distance
    off = signed(100 * relative(time, item.minutes), 0) if item.minutes else NONE
    return (
        name,
        ended(records),
        spread([100 * each.distance for each in reached], distance, 0),
        way(item),
        signed(100 * relative(shown.distance, item.way), 0) if item.way else NONE,
        spread(times, time, 1),
        paper_minutes(item),
        off,
        number(shown.time(found.default) / 60, 1),
    )


def way(item: Experiment) -> str:
    """The paper's distance, and its kind."""
    if item.distance:
        return f"{100 * item.distance:.0f}"
    return f"{100 * item.straight:.0f} straight" if item.straight else NONE


def paper_minutes(item: Experiment) -> str:
    """The paper's time."""
    return number(item.minutes, 1)


def experiment_sheet(found: Findings, table: int | None) -> Sheet:
    """Table 3 or 4 of the paper; None: the experiments without published figures."""
    title = {
        3: "Table 3: around the bump, and over it",
        4: "Table 4: over two bumps, and through the gate",
        None: "Experiments 1 and 2, for which the paper gives no figures",
    }[table]
    rows = tuple(experiment_row(item, found) for item in EXPERIMENTS if item.table == table)
    columns = ("experiment", "reached", "distance\ncm", "paper's\ncm", "off\n%", "time\nmin", "paper's\nmin", "off\n%")
    columns += (f"at {found.default:g} s\nmin",)
    count = max(len(records) for records in found.experiments.values())
    notes = (
        f"Each is the mission with the median time of {count}; followed by the smallest and the greatest."
        if count > 1
        else "One mission each.",
        f"Time: with the fitted {found.measure:.1f} s for a measurement; in the last column with the default.",
    )
    if table is None:
        columns, keep = (*columns[:3], columns[5], columns[8]), (0, 1, 2, 5, 8)
        rows = tuple(tuple(row[k] for k in keep) for row in rows)
    return Sheet(title, columns, (rows,), notes)


def fit_sheet(fit: Measuring, records: Mapping[int, Record], title: str = "") -> Sheet:
    """The one free parameter, and the residuals.

    Args:
      records: the record shown for each experiment.
      title: text before the fitted number.
    """
    rows = []
    for item in EXPERIMENTS:
        if item.number not in fit.residuals:
            continue
        shown, left = records[item.number], fit.residuals[item.number]
        rows.append((
            f"{item.number}, {item.title}",
            number(shown.moving / 60, 1),
            str(shown.measurements),
            number(shown.time(fit.seconds) / 60, 1),
            number(item.minutes, 1),
            signed(left / 60, 1),
            signed(100 * left / (60 * item.minutes), 0),
            number(fit.alone[item.number], 1),
        ))  # fmt: skip
    columns = (
        "experiment",
        "moving\nmin",
        "measurements",
        "time\nmin",
        "paper's\nmin",
        "off\nmin",
        "off\n%",
        "alone\ns",
    )
    rms = np.sqrt(np.mean(np.square(list(fit.residuals.values())))) if fit.residuals else 0.0
    return Sheet(
        f"{title or 'A'} measurement takes {fit.seconds:.1f} s",
        columns,
        (tuple(rows),),
        (
            f"Least squares over {fit.missions} missions of the four experiments with a published time; of the "
            f"missions shown, {rms / 60:.1f} min remain (root mean square). Nothing else is fitted.",
            "Alone: the duration of a measurement according to this experiment alone.",
        ),
    )


def account_sheet(found: Findings, numbers: Sequence[int]) -> Sheet:
    """How the missions shown spent their time."""
    rows = []
    for kind in KINDS:
        cells = [kind]
        for number_ in numbers:
            shown = found.shown[number_]
            part = shown.parts[kind]
            seconds = shown.measurements * found.measure if kind == MEASURE else part.seconds
            cells += [str(part.count), f"{seconds / 60:.1f}" if part.count else NONE]
        rows.append(tuple(cells))
    total = ["all"]
    for number_ in numbers:
        shown = found.shown[number_]
        total += [f"{100 * shown.distance:.0f} cm", f"{shown.time(found.measure) / 60:.1f}"]
    columns = ("action", *(f"{n}: {what}" for n in numbers for what in ("times", "min")))
    return Sheet("Where the time went, by experiment", columns, (tuple(rows), (tuple(total),)))


def table_1_sheet(found: Findings) -> Sheet:
    """What each strategy passed and measured, beside the paper's statements about the works that it represents."""
    rows = []
    for name, (works, said) in TABLE_1.items():
        ours = [found.table_1[name, scene] for scene in SCENES]
        cells = [f"{'O' if each.passed else 'X'} ({'M' if each.measured else 'U'})" for each in ours]
        both = [f"{a} / {b}" for a, b in zip(cells, said, strict=False)]
        rows.append((name, works, *both, *cells[len(said) :]))
    names = [scene.removeprefix("table_1_") for scene in SCENES]
    columns = ("strategy", "stands for", *(f"{name}\nours / paper's" for name in names[:-1]), f"{names[-1]}\nours")
    return Sheet(
        "Table 1: what each strategy passes and measures",
        columns,
        (tuple(rows),),
        (
            "O: its mission in the scene whose only path leads there reached the goal; X: it did not. M: that class is "
            "where it should be, in the map that the mission ended with; U: it is not. “Both”: a bump, then a gate.",
            "All strategies here have the same camera and map, so they measure alike. The robots of the "
            "other works have other sensors: hence U in the paper.",
        ),
    )


def endings_sheet(found: Findings) -> Sheet:
    """How each mission of Table 1 ended."""
    rows = []
    for name in TABLE_1:
        cells = [found.table_1[name, scene] for scene in SCENES]
        rows.append((name, *(each.code.replace("_", " ") for each in cells)))
    columns = ("strategy", *(scene.removeprefix("table_1_") for scene in SCENES))
    return Sheet("How these missions ended", columns, (tuple(rows),))


def table_2_sheet(verified: Sequence[Verified]) -> Sheet:
    """The primitives."""
    rows = []
    for each in verified:
        share = each.success
        rows.append((
            each.title,
            number(each.paper, 0),
            number(each.duration, 0),
            each.carries,
            each.off,
            f"{100 * share.estimate:.0f} [{100 * share.low:.0f}, {100 * share.high:.0f}]",
            f"{1e3 * each.margin:.0f}",
            f"{1e3 * each.least_margin:.0f}",
        ))  # fmt: skip
    columns = ("primitive", "paper's\ns", "ours\ns", "carries", "error\nmm", "success\n%", "ZMP\nmm", "worst\nmm")
    trials = verified[0].trials if verified else 0
    return Sheet(
        "Table 2: the primitives, simulated",
        columns,
        (tuple(rows),),
        (
            f"Success, with Wilson's interval, in {trials} trials each with other friction, masses, bump heights and "
            "gate positions (the mild set of `jaxbiped primitives`). Error: undisturbed end pose minus the "
            f"request. Paper: for {100 * CELL:.0f} cm, 45 degrees, or one edge; ours for its own displacement.",
            "ZMP: smallest margin of the zero moment point within the soles, undisturbed and worst on the mild set.",
        ),
    )


def mishap_sheet(endings: Sequence[Ending]) -> Sheet:
    """Missions that cannot succeed."""
    rows = [
        (
            each.mishap.what,
            each.mission.code.label.replace("_", " "),
            "yes" if each.named else "no",
            number(100 * each.mission.distance, 0),
            str(each.mission.measurements),
        )
        for each in endings
    ]
    columns = ("what is wrong", "ended", "names it", "distance\ncm", "measurements")
    return Sheet("Missions that cannot succeed", columns, (tuple(rows),))
