# SPDX-License-Identifier: BSD-3-Clause
"""What the report of an Earth rate says, from its plain document."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from allanite.experiments.reversals.sides import is_vertical, sides_of
from allanite.plain_files.counted import plural
from allanite.views.blocks import (
    Banner,
    Cell,
    Details,
    Hero,
    Page,
    PageBlock,
    References,
    Text,
    drawn,
    equation,
    findings,
    pairs,
    table,
)
from allanite.views.report.measurement import judgement, known_facts, measurement_page, rate_budget
from allanite.views.wording import (
    DEG_H,
    EarthRateWording,
    angle,
    axis_facts,
    budget_lines,
    capitalised,
    check_lines,
    contradictions,
    duration,
    dwell_direction,
    earth_rate_lines,
    function_of_latitude,
    model_words,
    signed,
    tone,
    turn_words,
    unstated_words,
    with_sd,
)

__all__ = ["ROSENBERG", "SEED", "checks_table", "contradiction_banners", "estimates_table", "page"]

Json = Mapping[str, Any]
_MOST_DWELLS = 400

SEED = (
    "F. O. Silva, R. R. Jeronymo, F. A. Pavan, R. T. Tosin, Caracterização de sensores MEMS através da variância de "
    "Allan para a filtragem de ruídos estocásticos."
)
ROSENBERG = (
    "B. Rosenberg, Random coefficients models, Annals of Economic and Social Measurement 2 (1973) 399: regression by "
    "the filter of the noise."
)
_COHERENT = (
    "A bias that follows the turns exactly (magnetic field, gravity on a leaning table) cannot be told from the Earth "
    "by any estimator: only a contradiction to the known rate, or dwells to the east and west, would show it."
)
_COHERENT_OVER = (
    "A bias that follows the turns exactly cannot be told from the Earth by any estimator. Gravity along the axis is "
    "reversed with it, so its g-sensitivity is such a bias; a magnetic field may make another. Only a contradiction to "
    "the known rate shows them."
)
_GRAVITY = (
    "Turning the axis over reverses gravity along it: a g-sensitivity adds its value times 1 g over the sine of the "
    "latitude to the Earth rate, and no column tells the two apart."
)
BIRGE = (
    "R. T. Birge, The calculation of errors by the method of least squares, Phys. Rev. 40 (1932) 207: the ratio that "
    "widens."
)


def page(document: Json) -> Page:
    """The page of an Earth rate."""
    return measurement_page(
        document,
        title=document.get("source") or "Earth rate",
        kicker="Earth rate from one turned axis",
        facts=_facts(document),
        parts={
            "verdict": _verdict,
            "pictures": _pictures,
            "checks": _checks,
            "findings": findings,
            "record": _record,
            "method": _method,
        },
    )


def _facts(document: Json) -> list[tuple[str, str]]:
    known = [d for d in document["dwells"] if d["sign"] != 0]
    first = document["first"]
    return [
        ("Channel", document["channel"]),
        ("Length", duration(document["duration"])),
        ("Turns", str(len(document["reversals"]["turns"]))),
        ("Dwells used", str(len(known))),
        ("Latitude", angle(document["latitude"])),
        ("First dwell", "not known" if first == "unknown" else first),
    ]


# -- verdict ----------------------------------------------------------------------------------------------


def _verdict(document: Json) -> list[PageBlock]:
    verdict = document["verdict"]
    advice = [words for words in document["advice"] if words not in document["reason"]]
    blocks = [*contradiction_banners(document), *judgement(document, advice)]
    if document["rate"] is None:
        return blocks
    lines = earth_rate_lines(document)
    main, known = lines[0], lines[-1]
    blocks.append(
        Hero(
            main.value,
            "deg/h",
            f"{100 * document['confidence']:g} % interval {main.range} deg/h",
            f"{main.seconds} deg/s {main.seconds_range}; the Earth turns at {known.value} deg/h",
            tone(verdict),
        )
    )
    blocks += estimates_table(
        lines, f"Earth rate by each estimator, with {100 * document['confidence']:g} % intervals."
    )
    return [*blocks, *_axis(document), *_budget(document)]


def _axis(document: Json) -> list[PageBlock]:
    """What the axis itself saw, and what is expected of it."""
    facts = axis_facts(document)
    return [known_facts(facts)] if facts else []


def contradiction_banners(document: Json) -> list[PageBlock]:
    """Where the signal contradicts the turns that were given."""
    return [Banner("fatal", "Signal and list contradict each other.", w) for w in contradictions(document)]


def estimates_table(lines: Iterable[EarthRateWording], caption: str) -> list[PageBlock]:
    """Estimates in deg/h and deg/s; the one that counts stands out."""
    rows, kept = [], []
    for line in lines:
        rows.append(
            (
                Cell(text=capitalised(line.name), below=line.note),
                Cell(text=line.value, below=line.range, look="value"),
                Cell(text=line.seconds, below=line.seconds_range, look="value"),
            )
        )
        kept.append(line.kept)
    return table(("Estimator", "deg/h", "deg/s"), rows, caption=caption, kept=kept)


def _budget(document: Json) -> list[PageBlock]:
    rows = budget_lines(document)
    if not rows:
        return [
            Text(
                unstated_words(document, "was"),
                note=True,
            )
        ]
    widened = document["inflation"]
    note = f" The noise is widened {widened:.2f} times." if widened > 1 else ""
    return rate_budget(rows, note)


# -- pictures ---------------------------------------------------------------------------------------------


def _pictures(document: Json) -> list[PageBlock]:
    if document["rate"] is None:
        return []
    value, (plus, minus) = signed(document["rate"], DEG_H, 2), sides_of(document["first"])
    return [
        *drawn(
            "running",
            document,
            "The estimate as the record grows, with its interval: regression and pairs. The line is the known rate. "
            "The width of the band is what the noise allows at each moment, whatever the estimate does.",
            f"Running estimate of the Earth rate, ending at {value} deg/h.",
            view="running",
        ),
        *drawn(
            "dwells",
            document,
            f"The means of the dwells, {plus} and {minus}: their distance is twice the Earth rate times the "
            f"{function_of_latitude(document)} of the latitude. What both have in common is the bias and its drift.",
            f"Mean rate of each dwell against time, {plus} and {minus} apart.",
            view="dwells",
        ),
        *drawn(
            "residuals",
            document,
            "What the fit leaves of each dwell.",
            "Residuals of the dwells against time.",
            view="residuals",
        ),
        *drawn(
            "dead-time",
            document,
            "The estimate for other times left out after each turn. A slope to the left says that something goes on "
            "after the turns.",
            "Estimate of the Earth rate against dead time.",
            view="dead-time",
        ),
        *drawn(
            "estimators",
            document,
            "The estimators side by side with their intervals, and the known rate.",
            "Estimates of the Earth rate by regression, pairs and triples.",
            view="estimators",
        ),
    ]


# -- checks, record, method -------------------------------------------------------------------------------


def checks_table(checks: Iterable[Json], caption: str) -> list[PageBlock]:
    """Each question put to the residuals, with its answer; those that did not pass first."""
    rows = [
        (
            Cell(text=capitalised(line.name), below=line.says),
            Cell(text="passed" if line.passed else "not passed", look="good" if line.passed else "fatal"),
            line.measure,
            line.chance,
        )
        for line in check_lines(checks)
    ]
    return table(("Check", "Answer", "χ² (expected)", "Chance"), rows, caption=caption)


def _checks(document: Json) -> list[PageBlock]:
    blocks = checks_table(
        document["checks"],
        "Questions put to what the fit leaves. Chance: of so large a value if the noise model holds.",
    )
    for name, (value, sd) in document["nuisances"].items():
        blocks.append(Text(f"Fitted beside the rate: {name}, {with_sd(value, sd, 'deg/h', DEG_H)}."))
    level, sd = document["bias"]
    name = (
        "Bias at the beginning of the record" if document["rate"] is not None else "Bias and Earth together"
    )
    blocks.append(Text(f"{name}: {with_sd(level, sd, 'deg/h', DEG_H)}."))
    if document["rate"] is not None:
        blocks.append(Text(_COHERENT_OVER if is_vertical(document["first"]) else _COHERENT, note=True))
    return blocks


def _record(document: Json) -> list[PageBlock]:
    blocks = drawn(
        "record-figure",
        document,
        "The record: lowest and highest value of each block, with the turns marked.",
        f"Raw record of {document['channel']} with {plural(len(document['reversals']['turns']), 'turn')}.",
        view="record",
        recording=document.get("overview"),
    )
    blocks.append(
        pairs(
            [
                ("Turns", turn_words(document["reversals"], document["dwells"])),
                ("Averaged over", duration(document["block"])),
                ("Noise model", document.get("model_name") or document["model_source"]),
                ("Its terms", model_words(document["model"])),
            ]
        )
    )
    rows = [
        (
            str(i),
            f"{d['start']:.2f} to {d['stop']:.2f}",
            dwell_direction(document, d["sign"]),
            signed(d["mean"], DEG_H, 1),
            signed(d["residual"], DEG_H, 1),
        )
        for i, d in enumerate(document["dwells"][:_MOST_DWELLS], 1)
    ]
    more = len(document["dwells"]) - len(rows)
    caption = f"The first {_MOST_DWELLS} dwells; {more} more are in dwells.csv." if more > 0 else ""
    dwells = table(
        ("Dwell", "From, to [s]", "Axis", "Mean [deg/h]", "Left by the fit [deg/h]"), rows, caption=caption
    )
    turned = bool(document["reversals"]["turns"])
    return [*blocks, Details(f"All {plural(len(document['dwells']), 'dwell')}", dwells)] if turned else blocks


def _method(document: Json) -> list[PageBlock]:
    over = is_vertical(document["first"])
    axis, (plus, minus) = "vertical" if over else "horizontal", sides_of(document["first"])
    return [
        Text(
            f"One {axis} axis at the latitude φ, pointing {plus} or {minus}, sees the {axis} part of the Earth's "
            "rotation, its bias, and noise:"
        ),
        *equation("turned_over" if over else "turned"),
        *([Text(_GRAVITY)] if over else []),
        Text(
            "The columns x are what is fitted beside the rate, if anything: a rotation that settles after each turn, a "
            "warm-up, a temperature. The coefficients follow by generalised least squares, V being the covariance of "
            "the noise model; a Kalman filter of the noise whitens the means of the blocks:"
        ),
        *equation("least_squares"),
        Text("Beside it stand the estimator of the seed paper, and one in which a linear drift cancels:"),
        *equation("pairs_over" if over else "pairs"),
        Text(
            "If the dwells scatter more than the noise model says (chance below 1 %), the standard deviation is "
            "multiplied by the root of chi-square over its expectation. A rate below three standard deviations is "
            "“not resolved”; one whose interval excludes the known rate is “inconsistent with Earth”."
        ),
        References([SEED, ROSENBERG, BIRGE]),
    ]
