# SPDX-License-Identifier: BSD-3-Clause
"""What sensors taken apart say: the noise that each has alone, and what they share."""

from __future__ import annotations

import math
from collections.abc import Iterator

from allanite.noise import Estimate
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, probability
from allanite.quantities.quantity import interval_words
from allanite.stability.shared_noise import Separation
from allanite.stability.shared_noise.results import COMMON, NoisePart
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Page, PageBlock, References, Text, equation, pairs, table
from allanite.views.result_page import advice, findings_of, pictures, result_page, verdict_banner

__all__ = ["rows", "view"]

#: Lags that a table lists, and terms.
_MOST, _TERMS = 7, ("N", "B", "K")
_REFERENCES = (
    (
        "J. Gray, D. Allan, “A method for estimating the frequency stability of an individual oscillator”, Proc. 28th "
        "Annual Symposium on Frequency Control (1974) 243."
    ),
    (
        "E. Lantz, C. Calosso, E. Rubiola et al., “KLTS: A rigorous method to compute the confidence intervals for the "
        "three-cornered hat and for Groslambert covariance”, IEEE Trans. UFFC 66 (2019) 1942."
    ),
    "S. Weerahandi, “Generalized confidence intervals”, J. Am. Stat. Assoc. 88 (1993) 899.",
)
_METHOD = (
    "Two sensors: their covariance is the variance of the common part. Three sensors: the individual "
    "noise follows from the variances of the differences (three-cornered hat), whatever all three share. "
    "An estimate may come out "
    "negative; its interval then reaches zero and its upper end is an upper limit. Degrees of freedom come "
    "from the exact variance of every estimate under the noise terms of all parts; the interval is that "
    "of a covariance with these degrees of freedom, and is valid near zero, too."
)
_PICTURES = {
    "parts": "Allan deviation of the individual noise of each sensor, and of the common part.",
    "correlation": "Correlation of the sensors against averaging time.",
}


def view(document: ResultDocument[Separation]) -> Page:
    """The page of a separation."""
    result = document.result
    return result_page(
        document,
        title=result.source or "Sensors taken apart",
        kicker="Noise of each sensor without the common part",
        facts=[("Sensors", ", ".join(result.channels)), ("Length", duration(result.duration))],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "pictures": ("Pictures", pictures(result, _PICTURES)),
            "noise": ("Every part", [*_noise(result)]),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", _method()),
        },
    )


def _verdict(result: Separation) -> Iterator[PageBlock]:
    yield verdict_banner(result.verdict, result.reason, result.channels)
    yield from advice(result.remarks, result.channels)
    same, missing = result.agreement, result.missing
    alike = "" if same is None else f"χ² {same.chi2:.1f} ({same.dof:.0f} expected), {probability(same.p)}"
    yield pairs(
        [
            ("Sensors", ", ".join(result.channels)),
            ("Other way round", ", ".join(result.opposite)),
            ("All pairs share the same", alike),
            ("Left out", f"{missing} samples missing in at least one sensor" if missing else ""),
            ("Length", duration(result.duration)),
        ]
    )


def _noise(result: Separation) -> Iterator[PageBlock]:
    percent, titles = f"{100 * result.confidence:g} %", [_title(part) for part in result.parts]
    unit, factor = display_unit(result.kind, "adev", result.unit)
    step = max(1, -(-len(result.tau) // _MOST))
    yield from table(
        ["Averaging", *(f"{title} [{unit}]" for title in titles)],
        [
            [
                duration(result.tau[i]),
                *(interval_words(p.deviation[i], p.lower[i], p.upper[i], factor) for p in result.parts),
            ]
            for i in range(0, len(result.tau), step)
        ],
        caption=f"Allan deviation with its {percent} interval; “<” is an upper limit, its upper end.",
    )
    units = {s: display_unit(result.kind, s, result.unit) for s in _TERMS}
    yield from table(
        ["Part", *(f"{s} [{units[s][0]}]" for s in _TERMS)],
        [
            [title, *(_term(part.model.estimate(s), units[s][1]) for s in _TERMS)]
            for title, part in zip(titles, result.parts, strict=True)
        ],
        caption=f"Terms with their {percent} intervals, with all other terms free; “<” is an upper limit.",
    )


def _title(part: NoisePart) -> str:
    return part.name if part.name == COMMON else f"{part.name} alone"


def _term(estimate: Estimate | None, factor: float) -> str:
    if estimate is None or math.isinf(estimate.upper):
        return "not determined"
    return interval_words(estimate.value, estimate.lower, estimate.upper, factor)


def _method() -> list[PageBlock]:
    return [
        Text("Differences of adjacent means of all sensors, at the positions where all are complete:"),
        *equation("separation"),
        Text(_METHOD),
        References(_REFERENCES),
    ]


def rows(result: Separation) -> Iterator[dict[str, object]]:
    """One row of a table for each part and lag, in SI."""
    names = ("variance", "variance_lower", "variance_upper", "deviation", "lower", "upper", "edf")
    for part in result.parts:
        for i, tau in enumerate(result.tau):
            yield {
                "part": part.name,
                "tau": float(tau),
                **{name: float(getattr(part, name)[i]) for name in names},
            }
