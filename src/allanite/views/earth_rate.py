# SPDX-License-Identifier: BSD-3-Clause
"""What a measurement of the Earth rate says: its verdict, the rate by each estimator, and what speaks against it."""

from __future__ import annotations

import math
from collections.abc import Iterator

from allanite.experiments.earth_rate import EarthRateEstimate
from allanite.experiments.earth_rate.words import widened_words
from allanite.experiments.reversals.sides import direction_of, is_vertical, sides_of
from allanite.plain_files.counted import plural
from allanite.quantities.earth import DEG_H
from allanite.quantities.number_words import duration, with_sd
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import (
    Details,
    Hero,
    Page,
    PageBlock,
    References,
    Text,
    drawn,
    equation,
    pairs,
    table,
)
from allanite.views.rates import (
    BIRGE,
    ROSENBERG,
    SEED,
    checks_table,
    contradiction_banners,
    estimates_table,
    rate_budget,
)
from allanite.views.result_page import advice, findings_of, pictures, result_page, verdict_banner
from allanite.views.wording.rates import angle, budget_lines, check_wordings, model_words, signed
from allanite.views.wording.turned_axis import (
    axis_facts,
    earth_rate_lines,
    function_of_latitude,
    turn_words,
    unstated_words,
)

__all__ = ["rows", "view"]

_MOST_DWELLS = 400

_RUNNING = (
    "The estimate as the record grows, with its interval: regression and pairs. The line is the known "
    "rate. The width of the band is the uncertainty from the noise at each time, independent of the estimate."
)
_DEAD_TIME = (
    "The estimate for other dead times after each turn. A slope at the left means that a disturbance "
    "continues after the turns."
)
_COHERENT = (
    "No estimator can separate a bias that follows the turns exactly (magnetic field, gravity on a tilted "
    "table) from the Earth's rotation. Only a contradiction with the known rate, or dwells to the east "
    "and west, would show it."
)
_COHERENT_OVER = (
    "No estimator can separate a bias that follows the turns exactly from the Earth's rotation. Gravity "
    "along the axis reverses with it, so the g-sensitivity is such a bias; a magnetic field may cause "
    "another. Only a contradiction with the known rate shows them."
)
_GRAVITY = (
    "Turning the axis over reverses gravity along it: a g-sensitivity adds its value times 1 g over the sine of the "
    "latitude to the Earth rate, and the two are not separable."
)


def view(document: ResultDocument[EarthRateEstimate]) -> Page:
    """The page of an Earth rate."""
    result = document.result
    return result_page(
        document,
        title=result.source or "Earth rate",
        kicker="Earth rate from one turned axis",
        facts=_facts(result),
        sections={
            "verdict": ("Verdict", [*_verdict(document)]),
            "pictures": ("Pictures", [*_pictures(result)]),
            "checks": ("Checks", [*_checks(result)]),
            "findings": ("Findings", findings_of(document)),
            "record": ("Record", [*_record(document)]),
            "method": ("Method", _method(result)),
        },
    )


def _facts(result: EarthRateEstimate) -> list[tuple[str, str]]:
    return [
        ("Channel", result.channel),
        ("Length", duration(result.duration)),
        ("Turns", str(len(result.reversals.turns))),
        ("Dwells used", str(sum(d.sign != 0 for d in result.dwells))),
        ("Latitude", angle(result.latitude)),
        ("First dwell", "not known" if result.first == "unknown" else result.first),
    ]


# -- verdict ----------------------------------------------------------------------------------------------


def _verdict(document: ResultDocument[EarthRateEstimate]) -> Iterator[PageBlock]:
    result = document.result
    yield from contradiction_banners(document.findings or ())
    yield verdict_banner(result.verdict, result.reason)
    yield from advice(words for words in result.advice if words not in result.reason)
    if math.isnan(result.rate):
        return
    percent = f"{100 * result.confidence:g} % interval"
    lines = earth_rate_lines(result)
    main, known = lines[0], lines[-1]
    yield Hero(
        main.value,
        "deg/h",
        f"{percent} {main.range} deg/h",
        f"{main.seconds} deg/s {main.seconds_range}; the Earth turns at {known.value} deg/h",
        result.verdict.tone,
    )
    yield from estimates_table(lines, "Earth rate by each estimator.", f", {percent}")
    yield pairs(axis_facts(result))
    yield from _budget(result)


def _budget(result: EarthRateEstimate) -> Iterator[PageBlock]:
    yield from rate_budget(budget_lines(result.budget)) or [
        Text(unstated_words(result.first), note=True, brief=True)
    ]
    if widened := widened_words(result.inflation, result.checks):
        yield Text(widened, note=True, brief=True)


# -- pictures ---------------------------------------------------------------------------------------------


def _pictures(result: EarthRateEstimate) -> Iterator[PageBlock]:
    if math.isnan(result.rate):
        return
    value, (plus, minus) = signed(result.rate, DEG_H, 2), sides_of(result.first)
    dwells = (
        f"The means of the dwells, {plus} and {minus}: their distance is twice the Earth rate times the "
        f"{function_of_latitude(result.first)} of the latitude. The common part is the bias and its drift."
    )
    shown = {
        "running": (_RUNNING, f"Running estimate of the Earth rate, ending at {value} deg/h."),
        "dwells": (dwells, f"Mean rate of each dwell against time, {plus} and {minus} apart."),
        "residuals": ("Residual of each dwell.", "Residuals of the dwells against time."),
        "dead-time": (_DEAD_TIME, "Estimate of the Earth rate against dead time."),
        "estimators": (
            "The estimators with their intervals, and the known rate.",
            "Estimates of the Earth rate by regression, pairs and triples.",
        ),
    }
    yield from pictures(result, shown)


# -- checks, record, method -------------------------------------------------------------------------------


def _checks(result: EarthRateEstimate) -> Iterator[PageBlock]:
    yield from checks_table(
        check_wordings(result.checks),
        "Checks of the residuals. Chance: the probability of so large a value if the noise model is right.",
    )
    separable = not math.isnan(result.rate)
    bias = with_sd(*result.bias, "deg/h", DEG_H)
    yield pairs(
        [
            *(("Fitted beside it", _nuisance(name, *fit)) for name, fit in result.nuisances.items()),
            ("Bias", f"{bias}, at the beginning of the record")
            if separable
            else ("Bias and Earth together", bias),
        ]
    )
    if separable:
        yield Text(_COHERENT_OVER if is_vertical(result.first) else _COHERENT, note=True)


def _nuisance(name: str, value: float, sd: float) -> str:
    """A decay, or what the level does with a temperature."""
    unit = "deg/h" if name.startswith(("warm-up ", "settling ")) else "deg/h/°C"
    return f"{name}, {with_sd(value, sd, unit, DEG_H)}"


def _record(document: ResultDocument[EarthRateEstimate]) -> Iterator[PageBlock]:
    result, overview = document.result, document.overview
    yield from drawn(
        "record-figure",
        result,
        "The record: lowest and highest value of each block, with the turns marked.",
        f"Raw record of {result.channel} with {plural(len(result.reversals.turns), 'turn')}.",
        view="record",
        recording=None if overview is None else overview.to_json(),
    )
    unknown = "unknown: the sign of the rate is arbitrary (--first north, south, up or down)"
    yield pairs(
        [
            ("Turns", turn_words(result.reversals)),
            ("Direction", unknown if result.first == "unknown" else f"{result.first} first"),
            ("Latitude", angle(result.latitude)),
            ("Length", f"{duration(result.duration)}, in means over {duration(result.block)}"),
            ("Noise", f"{document.model_name or result.model_source}: {model_words(result.model)}"),
        ]
    )
    if result.reversals.turns:
        yield Details(f"All {plural(len(result.dwells), 'dwell')}", _dwells(result))


def _dwells(result: EarthRateEstimate) -> list[PageBlock]:
    lines = [
        (
            str(i),
            f"{d.start:.2f} to {d.stop:.2f}",
            direction_of(result.first, d.sign),
            signed(d.mean, DEG_H, 1),
            signed(d.residual, DEG_H, 1),
        )
        for i, d in enumerate(result.dwells[:_MOST_DWELLS], 1)
    ]
    more = len(result.dwells) - len(lines)
    caption = f"The first {_MOST_DWELLS} dwells; {more} more are in dwells.csv." if more > 0 else ""
    heads = ("Dwell", "From, to [s]", "Axis", "Mean [deg/h]", "Residual [deg/h]")
    return table(heads, lines, caption=caption)


def _method(result: EarthRateEstimate) -> list[PageBlock]:
    over = is_vertical(result.first)
    axis, (plus, minus) = "vertical" if over else "horizontal", sides_of(result.first)
    return [
        Text(
            f"One {axis} axis at the latitude φ, pointing {plus} or {minus}, senses the {axis} part of "
            "the Earth's rotation, its bias, and noise:"
        ),
        *equation("turned_over" if over else "turned"),
        *([Text(_GRAVITY)] if over else []),
        Text(
            "The columns x are the optional further regressors: a rotation that settles after each turn, "
            "a warm-up, a temperature. The coefficients follow by generalized least squares with V, the "
            "covariance of the noise model; a Kalman filter of the noise whitens the means of the blocks:"
        ),
        *equation("least_squares"),
        Text("For comparison: the estimator of the seed paper, and one in which a linear drift cancels:"),
        *equation("pairs_over" if over else "pairs"),
        Text(
            "If the dwells scatter more than the noise model predicts (p below 1 %), the standard "
            "deviation is multiplied by the root of chi-square over its expectation. A rate below three "
            "standard deviations is "
            "“not resolved”; one whose interval excludes the known rate is “inconsistent with Earth”."
        ),
        References([SEED, ROSENBERG, BIRGE]),
    ]


def rows(result: EarthRateEstimate) -> Iterator[dict[str, object]]:
    """One row of a table for each dwell, in people's units."""

    def in_deg_h(value: float) -> str:
        return f"{value / DEG_H:.6g}" if math.isfinite(value) else ""

    for i, d in enumerate(result.dwells, 1):
        yield {
            "number": i,
            "start_s": f"{d.start:.6f}",
            "stop_s": f"{d.stop:.6f}",
            "direction": direction_of(result.first, d.sign),
            "mean_deg_h": in_deg_h(d.mean),
            "sd_deg_h": in_deg_h(d.sd),
            "residual_deg_h": in_deg_h(d.residual),
        }
