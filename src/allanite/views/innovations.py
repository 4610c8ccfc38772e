# SPDX-License-Identifier: BSD-3-Clause
"""What innovations say: whether the filter states their size, and which of its numbers is wrong."""

from __future__ import annotations

from collections.abc import Iterator

from allanite.filtering.innovations import InnovationAxis, Innovations
from allanite.quantities.number_words import duration, number, probability
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Page, PageBlock, References, Text, equation, pairs, table
from allanite.views.filtered import OF_INNOVATIONS
from allanite.views.result_page import advice, pictures, result_page, verdict_banner

__all__ = ["band_rows", "nis_rows", "view"]

_METHOD = (
    "A filter whitens what it measures by its own model. So the density of the standardized innovations is that of the "
    "measurement over that which the filter assumes: at the highest frequencies the ratio of the measurement noises, "
    "at the lowest that of the drifts. The factors of N and K, and the corner of the filter, are fitted to all "
    "frequencies by Whittle's likelihood: a mean over low frequencies alone shows a part of the factor of K. Each test "
    "calls one right filter in a thousand wrong."
)
_REFERENCES = (
    (
        "R. K. Mehra, “On the identification of variances and adaptive Kalman filtering”, IEEE Trans. Autom. Control "
        "15 (1970) 175."
    ),
    *OF_INNOVATIONS,
)
_PICTURES = {
    "nis": "Size of the innovations over that stated, all axes together, in windows of time.",
    "bands": "Size of the innovations over that stated, by frequency: short times right, long times left.",
}
_ADVICE = "multiply N or K of the filter by its factor, and test it again"


def view(document: ResultDocument[Innovations]) -> Page:
    """The page of the innovations of a filter."""
    result = document.result
    return result_page(
        document,
        title=result.source or "Innovations",
        kicker="Innovations of a filter",
        facts=[
            ("Axes", ", ".join(axis.name for axis in result.axes)),
            ("Length", duration(result.duration)),
            ("Rate", f"{result.rate:.7g} Hz"),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "pictures": ("Pictures", pictures(result, _PICTURES)),
            "bands": ("Bands", [*_bands(result)]),
            "method": ("Method", [Text(_METHOD), *equation("nis"), References(_REFERENCES)]),
        },
    )


def _verdict(result: Innovations) -> Iterator[PageBlock]:
    names = [axis.name for axis in result.axes]
    yield verdict_banner(result.verdict, result.reason, names)
    yield from table(
        ("Axis", "NIS", "If the filter is right", "Short times", "Long times", "Whiteness"),
        [_row(axis) for axis in result.axes],
        caption=f"Short and long times: factor over the stated size, with {100 * result.confidence:g} % intervals.",
    )
    yield from advice([_ADVICE] if any(axis.misfits for axis in result.axes) else [])
    windows = len(result.series.nis)
    chance = (1 - result.confidence) * windows
    yield pairs([("Windows outside", f"{result.series.outside} of {windows}, {number(chance, 2)} expected")])


def _row(axis: InnovationAxis) -> tuple[str, ...]:
    tests = axis.consistency
    return (
        axis.name,
        number(tests.nis, 4),
        f"{number(tests.nis_lower, 4)} to {number(tests.nis_upper, 4)}",
        *(str(q) if q.resolved else "not resolved" for q in (axis.fast, axis.slow)),
        probability(tests.whiteness_p),
    )


def _bands(result: Innovations) -> Iterator[PageBlock]:
    yield from table(
        ("Axis", "Band", "Factor"),
        [
            (axis.name, f"{number(band.lower)} to {number(band.upper)} Hz", str(band.ratio))
            for axis in result.axes
            for band in axis.bands
        ],
        caption="Size of the innovations over that stated.",
        brief=False,
    )


def band_rows(result: Innovations) -> Iterator[dict[str, object]]:
    """One row of a table for each band."""
    for axis in result.axes:
        for band in axis.bands:
            yield {
                "axis": axis.name,
                "lower_hz": f"{band.lower:.6g}",
                "upper_hz": f"{band.upper:.6g}",
                "factor": f"{band.ratio.value:.6g}",
                "factor_lower": f"{band.ratio.lower:.6g}",
                "factor_upper": f"{band.ratio.upper:.6g}",
            }


def nis_rows(result: Innovations) -> Iterator[dict[str, object]]:
    """One row of a table for each window."""
    names = ("start", "stop", "nis", "lower", "upper")
    columns = (getattr(result.series, name).tolist() for name in names)
    for values in zip(*columns, strict=True):
        yield dict(zip(names, values, strict=True))
