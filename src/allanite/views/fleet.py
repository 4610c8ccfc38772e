# SPDX-License-Identifier: BSD-3-Clause
"""What a fleet says: which units stand out, the population of each coefficient, what changes it, lot by lot."""

from __future__ import annotations

import math
from collections.abc import Iterator

from allanite.quantities.display_units import coefficient_unit
from allanite.quantities.number_words import number, probability, upper_limit
from allanite.quantities.quantity import Quantity
from allanite.quantities.verdict import Tone
from allanite.stability.fleet.results import (
    Capability,
    CoefficientPopulation,
    CovariateEffect,
    FleetPopulation,
    LotRatio,
    StandingOut,
)
from allanite.stability.fleet.words import by_channel, counted, named
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Cell, Page, PageBlock, References, Text, pairs, table
from allanite.views.result_page import pictures, result_page, verdict_banner

__all__ = ["coefficient_rows", "correlation_rows", "drift_rows", "lot_rows", "standing_out_rows", "view"]

#: A spread of the logarithm beyond this is shown as a factor.
_FACTOR = 0.3
_LEAST_SHARE = 1e-4
_LOOKS = {Tone.GOOD: "good", Tone.FATAL: "fatal"}
#: Units that stand out which a page lists; the table beside it has all of them.
_MOST = 20

_PICTURES = {
    "population": (
        "Each coefficient relative to its middle: the middle with its interval, the prediction interval of the next "
        "unit, the tolerance bound, and the units that stand out."
    ),
    "density": (
        "Density of all units in each coefficient, with that of the population and the units that stand out. A unit "
        "that gives an upper limit lies below it; the curve of the units is smoothed."
    ),
    "correlations": "Correlation of coefficients over units, numbered as in the table, with intervals.",
    "lots": "Each lot over the middle of all lots, with its interval.",
}
_METHOD = (
    "The logarithm of a coefficient is the sum of the middle, the effects of the conditions, a part of the lot, a part "
    "of the unit, and a part of the log. Every log takes part with its whole likelihood: one that only sets an upper "
    "limit counts as a limit, not as zero. The parts are normal; those of the units have a wide component where the "
    "fleet needs it. Scales and middle are integrated over all values that the logs allow [1, 2]; the bound of a share "
    "of the units is a one-sided tolerance limit [3]."
)
_DISCOVERIES = (
    "A unit is compared with what its lot and conditions let expect. The smallest probability of its coefficients is "
    "adjusted for their number [4]; units are then chosen by the step-up procedure [5], so that the stated share of "
    "them is expected to be false."
)
_TOGETHER = (
    "Correlations are of normal scores of the estimates, over what lot and conditions let expect; pairs are chosen by "
    "Holm's procedure. The uncertainty of the logs weakens a correlation. Two coefficients of one channel also share "
    "the errors of their logs."
)
_DRIFTS = (
    "A unit drifts where the slope of its logarithm over the dates of its logs differs from zero, by their profiles "
    "and the spread of repeats; a change of the whole fleet counts. Units are chosen by the step-up procedure [5]."
)
_LIMITS = (
    "A coefficient meets its limit where the whole interval of the share of units above it lies below the allowed "
    "share, and does not meet it where the interval lies above. The index is the distance of the limit from the median "
    "over that of the 99.865 % quantile from it, of the logarithm [6]."
)
_REFERENCES = (
    "A. Gelman, “Prior distributions for variance parameters in hierarchical models”, Bayesian Anal. 1 (2006) 515.",
    "T. Minka, “Expectation propagation for approximate Bayesian inference”, UAI 17 (2001) 362.",
    "ISO 16269-6:2014, “Statistical interpretation of data — Determination of statistical tolerance intervals”.",
    "R. Simes, “An improved Bonferroni procedure for multiple tests of significance”, Biometrika 73 (1986) 751.",
    "Y. Benjamini, Y. Hochberg, “Controlling the false discovery rate”, J. R. Stat. Soc. B 57 (1995) 289.",
    "ISO 22514-2:2017, “Process capability and performance of time-dependent process models”.",
)


def view(document: ResultDocument[FleetPopulation]) -> Page:
    """The page of a fleet."""
    result, made = document.result, document.provenance
    return result_page(
        document,
        title=("" if made is None else made.source) or "Fleet",
        kicker="Units of one type",
        facts=[
            ("Logs", str(result.logs)),
            ("Failed", str(result.failed) if result.failed else ""),
            ("Turned, left out", str(len(result.turned)) if result.turned else ""),
            ("Units", str(result.units)),
            ("Channels", ", ".join(dict.fromkeys(c.channel for c in result.coefficients))),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "effects": ("Conditions", _effects(result)),
            "lots": ("Lots", _lots(result)),
            "drifts": ("Drifts", _drifts(result)),
            "correlations": ("Correlations", _correlations(result)),
            "pictures": ("Pictures", pictures(result, _PICTURES)),
            "method": ("Method", _method(result)),
        },
    )


def _verdict(result: FleetPopulation) -> Iterator[PageBlock]:
    yield verdict_banner(result.verdict, result.reason, result.names_standing_out)
    yield from _capability(result)
    yield from table(
        ("Unit", "Lot", "Coefficient", "Ratio", "Deviations", "Chance"),
        [_outlying(s) for s in result.standing_out[:_MOST]],
        caption="Units that stand out: ratio to what their lot and conditions let expect, in standard deviations.",
    )
    yield from table(
        ("Coefficient", "Middle", "Next unit", _bound_head(result), "Resolved"),
        [_population(c) for c in result.coefficients],
        caption=(
            "The population: median, prediction interval of the next unit, tolerance bound, and logs that resolve the "
            "coefficient."
        ),
    )
    yield from table(
        ("Coefficient", "Between units", "Between lots", "Between repeats"),
        [_spreads(c) for c in result.coefficients],
        caption="Standard deviations, relative to the coefficient.",
    )
    if result.left_out:
        yield Text(f"Too few units resolve {by_channel(result.left_out)}; these are left out.", brief=True)


def _outlying(s: StandingOut) -> tuple[str, ...]:
    ratio = "–" if math.isnan(s.ratio) else f"× {number(s.ratio)}"
    return s.unit, s.lot or "–", f"{s.symbol} of {s.channel}", ratio, f"{s.deviations:+.1f}", probability(s.p)


def _capability(result: FleetPopulation) -> Iterator[PageBlock]:
    if result.capability_verdict is None:
        return
    names = [f"{c.symbol} of {c.channel}" for c in result.coefficients]
    yield verdict_banner(result.capability_verdict, result.capability_reason, names)
    yield from table(
        ("Coefficient", "Limit", "Units above it", "Index", "Verdict"),
        [_beside_limit(c, c.capability) for c in result.coefficients if c.capability],
        caption=(
            "Beside the limits: the share of all units above the limit, and the capability index (Cpk) of the "
            f"logarithm, with {100 * result.confidence:g} % intervals."
        ),
    )


def _beside_limit(c: CoefficientPopulation, beside: Capability) -> tuple[str | Cell, ...]:
    unit, factor = coefficient_unit(c.kind, c.symbol, c.middle.unit)
    return (
        f"{c.channel} {c.symbol} [{unit}]",
        number(beside.limit / factor, 4),
        _share(beside.share),
        beside.index.shown(),
        Cell(text=beside.verdict.value, look=_LOOKS.get(beside.verdict.tone, "")),
    )


def _share(share: Quantity) -> str:
    """In percent; ends below a hundredth of a percent are those of a model, not of units."""
    value, low, high = (
        f"{number(100 * e, 2)}" if e >= _LEAST_SHARE else "0" for e in (share.value, share.lower, share.upper)
    )
    return f"{value} [{low}, {high}] %" if high != "0" else f"< {100 * _LEAST_SHARE:g} %"


def _bound_head(result: FleetPopulation) -> str:
    return f"{100 * result.coefficients[0].content:g} % of units"


def _population(c: CoefficientPopulation) -> tuple[str, ...]:
    unit, factor = coefficient_unit(c.kind, c.symbol, c.middle.unit)
    low, high = (number(end / factor) for end in c.next_unit)
    return (
        f"{c.channel} {c.symbol} [{unit}]",
        c.middle.shown(factor),
        f"{low} to {high}",
        upper_limit(c.tolerance[1] / factor),
        f"{c.resolved} of {c.logs}",
    )


def _spreads(c: CoefficientPopulation) -> tuple[str, ...]:
    parts = (c.spread, c.between_lots, c.between_repeats)
    return f"{c.channel} {c.symbol}", *("–" if part is None else _spread(part) for part in parts)


def _spread(spread: Quantity) -> str:
    """Standard deviation of the logarithm, in percent or as a factor."""
    if (spread.value if spread.resolved else spread.upper) <= _FACTOR:
        return f"{spread.shown(0.01)} %"
    value, low, high = (math.exp(min(e, 50.0)) for e in (spread.value, spread.lower, spread.upper))
    if not spread.resolved:
        return upper_limit(high) + " times"
    return f"{number(value, 2)} [{number(low, 2)}, {number(high, 2)}] times"


# -- what changes it --------------------------------------------------------------------------------------


def _effects(result: FleetPopulation) -> list[PageBlock]:
    rows = [_effect(c, e) for c in result.coefficients for e in c.effects]
    return table(
        ("Coefficient", "Condition", "Reference", "Change", "Significant"),
        rows,
        caption=f"Change for one unit of each condition, with its {100 * result.confidence:g} % interval.",
    )


def _effect(c: CoefficientPopulation, effect: CovariateEffect) -> tuple[str, ...]:
    percent = Quantity.of(*_percent(effect.change), "1")
    sure = effect.change.lower > 0 or effect.change.upper < 0
    per = {"1": effect.name, "degC": "°C"}.get(effect.unit_of_measure, effect.unit_of_measure)
    at = f"{effect.reference:.2f}" if effect.name == "date" else number(effect.reference)
    unit = " °C" if effect.unit_of_measure == "degC" else ""
    return (
        f"{c.channel} {c.symbol}",
        effect.name,
        f"{at}{unit}",
        f"{percent.shown()} %/{per}",
        "yes" if sure else "no",
    )


def _percent(change: Quantity) -> tuple[float, tuple[float, float]]:
    value, low, high = (100 * math.expm1(min(e, 50.0)) for e in (change.value, change.lower, change.upper))
    return value, (low, high)


def _lots(result: FleetPopulation) -> list[PageBlock]:
    return table(
        ("Coefficient", "Lot", "Units", "Ratio to the middle", "Differs"),
        [_lot(c, lot) for c in result.coefficients for lot in c.of_lots],
        caption=f"Each lot over the middle of all lots, with its {100 * result.confidence:g} % interval.",
        brief=False,
    )


def _lot(c: CoefficientPopulation, lot: LotRatio) -> tuple[str, ...]:
    differs = lot.ratio.lower > 1 or lot.ratio.upper < 1
    return f"{c.channel} {c.symbol}", lot.lot, str(lot.units), lot.ratio.shown(), "yes" if differs else "no"


def _drifts(result: FleetPopulation) -> list[PageBlock]:
    return table(
        ("Unit", "Lot", "Coefficient", "Logs", "Change", "Chance"),
        [
            (
                d.unit,
                d.lot or "–",
                f"{d.symbol} of {d.channel}",
                str(d.logs),
                _per_year(d.slope),
                probability(d.p),
            )
            for d in result.drifts[:_MOST]
        ],
        caption=(
            f"Units that change over their repeats, {len(result.drifts)} of {result.repeated} coefficients; about "
            f"{100 * result.false_discovery_rate:g} % of them are false alarms."
        ),
    )


def _per_year(slope: Quantity) -> str:
    return f"{Quantity.of(*_percent(slope), '1').shown()} %/year"


def _correlations(result: FleetPopulation) -> list[PageBlock]:
    shown = result.correlations[:_MOST]
    family = f"the chance that any is false is at most {100 * (1 - result.confidence):.2g} %"
    return table(
        ("", "Coefficient", "Coefficient", "Correlation", "Units", "Left out"),
        [
            (str(i), c.first, c.second, c.correlation.shown(), str(c.units), str(c.left_out))
            for i, c in enumerate(shown, 1)
        ],
        caption=(
            f"Correlations that differ from zero over units: {len(result.correlations)} of {result.pairs} pairs; "
            f"{family}. Left out: units that resolve one of the two."
        ),
        brief=False,
    )


def _method(result: FleetPopulation) -> list[PageBlock]:
    wide = [
        (f"{c.symbol} of {c.channel}, wide part", f"{c.wide_share.shown(0.01)} % of units")
        for c in result.coefficients
        if c.wide_share is not None
    ]
    limited = result.capability_verdict is not None
    rows = [
        ("Intervals", f"{100 * result.confidence:g} %; “<” is an upper limit"),
        ("Bound", f"{_bound_head(result)} lie below it with {100 * result.confidence:g} % confidence"),
        ("False discoveries", f"{100 * result.false_discovery_rate:g} % of the units that stand out"),
        (
            "Allowed share",
            f"{100 * (1 - result.coefficients[0].content):.4g} % of units above a limit" if limited else "",
        ),
        ("Logs that failed", counted(result.failed, "log") if result.failed else ""),
        ("Unit turned, left out", named(result.turned)),
    ]
    texts = [
        Text(_METHOD),
        Text(_DISCOVERIES),
        *([Text(_DRIFTS)] if result.repeated else []),
        *([Text(_TOGETHER)] if result.pairs else []),
        *([Text(_LIMITS)] if limited else []),
    ]
    return [
        *texts,
        pairs([*rows, *wide], brief=False),
        References(_REFERENCES if limited else _REFERENCES[:5]),
    ]


# -- tables -----------------------------------------------------------------------------------------------


def _ends(name: str, quantity: Quantity | None) -> dict[str, object]:
    ends = ("", "") if quantity is None else (quantity.lower, quantity.upper)
    value = "" if quantity is None else quantity.value
    return {name: value, f"{name}_lower": ends[0], f"{name}_upper": ends[1]}


def _cells(part: object, *names: str) -> dict[str, object]:
    """Fields of a result, a quantity with its ends."""
    row: dict[str, object] = {}
    for name in names:
        value = getattr(part, name)
        row |= _ends(name, value) if isinstance(value, Quantity) else {name: value}
    return row


def coefficient_rows(result: FleetPopulation) -> Iterator[dict[str, object]]:
    """One row of a table for each coefficient, in SI; spreads are of the natural logarithm."""
    for c in result.coefficients:
        yield {
            **_cells(c, "channel", "kind", "symbol", "logs", "units", "lots", "resolved"),
            "unit": c.middle.unit,
            **_cells(c, "middle", "spread"),
            **_ends("between_lots", c.between_lots),
            **_ends("between_repeats", c.between_repeats),
            **_ends("wide_share", c.wide_share),
            "next_unit_lower": c.next_unit[0],
            "next_unit_upper": c.next_unit[1],
            "content": c.content,
            "tolerance_lower": c.tolerance[0],
            "tolerance_upper": c.tolerance[1],
            "limit": c.capability.limit if c.capability else "",
            **_ends("share_above_limit", c.capability.share if c.capability else None),
            **_ends("capability_index", c.capability.index if c.capability else None),
            "capability": c.capability.verdict.value if c.capability else "",
        }


def standing_out_rows(result: FleetPopulation) -> Iterator[dict[str, object]]:
    """One row of a table for each coefficient of each unit that stands out."""
    for s in result.standing_out:
        yield _cells(s, "unit", "lot", "channel", "symbol", "ratio", "deviations", "p")


def lot_rows(result: FleetPopulation) -> Iterator[dict[str, object]]:
    """One row of a table for each lot of each coefficient."""
    for c in result.coefficients:
        for lot in c.of_lots:
            yield {**_cells(c, "channel", "symbol"), **_cells(lot, "lot", "units", "ratio")}


def correlation_rows(result: FleetPopulation) -> Iterator[dict[str, object]]:
    """One row of a table for each pair of coefficients that correlate."""
    for c in result.correlations:
        yield _cells(c, "first", "second", "correlation", "units", "left_out")


def drift_rows(result: FleetPopulation) -> Iterator[dict[str, object]]:
    """One row of a table for each coefficient of each unit that drifts; slopes are of the natural logarithm."""
    for d in result.drifts:
        yield _cells(d, "unit", "lot", "channel", "symbol", "logs", "slope", "p")
