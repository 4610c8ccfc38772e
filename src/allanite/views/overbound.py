# SPDX-License-Identifier: BSD-3-Clause
"""What bounds above noise models say: what each promises, and its terms beside the fitted ones."""

from __future__ import annotations

from collections.abc import Iterator

from allanite.fitting.overbound import BoundedChannel, BoundedTerm, Bounds
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import number
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Page, PageBlock, References, Subheading, Text, table
from allanite.views.result_page import pictures, result_page
from allanite.views.wording.rates import sentence

__all__ = ["rows", "view"]

_METHOD = (
    "Noise curves that the record does not contradict are drawn from the likelihood of the whole measured curve, with "
    "all terms of the family, including those that the record does not resolve. The stated share of them stays below a "
    "simultaneous band. The bound is the sum of terms above that band with the least mean excess; no term is smaller "
    "than in the fit. Beyond the record a bound extrapolates what the record cannot exclude. The probability applies "
    "to each channel separately."
)
_REFERENCES = (
    (
        "J. Besag, P. Green, D. Higdon, K. Mengersen, “Bayesian computation and stochastic systems”, Statist. Sci. 10 "
        "(1995) 3."
    ),
    "J. Goodman, J. Weare, “Ensemble samplers with affine invariance”, Comm. App. Math. Comp. Sci. 5 (2010) 65.",
)
_PICTURES = {
    "curves": "Measured Allan deviation, fitted model, and bound.",
    "inflation": "Ratio of the bound to the fitted deviation.",
}


def view(document: ResultDocument[Bounds]) -> Page:
    """The page of bounds."""
    result, made = document.result, document.provenance
    return result_page(
        document,
        title=("" if made is None else made.source) or "Bounds",
        kicker="Noise models above the sensor",
        facts=[
            ("Channels", ", ".join(result.models)),
            ("Probability", f"{100 * result.probability:g} %"),
        ],
        sections={
            "bounds": ("Bounds", [block for channel in result.channels for block in _bound(channel)]),
            "pictures": ("Pictures", pictures(result, _PICTURES)),
            "method": ("Method", [Text(_METHOD), References(_REFERENCES)]),
        },
    )


def _bound(channel: BoundedChannel) -> Iterator[PageBlock]:
    yield Subheading(channel.name, brief=True)
    yield Text(f"{sentence(channel.inflation.promise)} It is {channel.inflation.extent}.", brief=True)
    yield from table(
        ("Term", "Fitted", "Bound", "Inflation"), [_line(channel, term) for term in channel.terms()]
    )


def _line(channel: BoundedChannel, term: BoundedTerm) -> tuple[str, str, str, str]:
    unit, factor = display_unit(channel.kind, term.symbol, channel.unit)
    like = ", or a term like it" if term.needed else ""
    fitted = "–" if term.fitted is None else f"{number(term.fitted / factor, 4)} {unit}{like}"
    grown = "added" if term.factor is None else f"× {number(term.factor, 4)}"
    return term.symbol, fitted, f"{number(term.bound / factor, 4)} {unit}", grown


def rows(result: Bounds) -> Iterator[dict[str, object]]:
    """One row of a table for each term of each bound."""
    for channel in result.channels:
        inflation = channel.inflation
        for symbol, factor in inflation.factors.items():
            yield {
                "channel": channel.name,
                "term": symbol,
                "factor": "added" if factor is None else f"{factor:.6g}",
                "shortest_s": f"{inflation.shortest:.6g}",
                "horizon_s": f"{inflation.horizon:.6g}",
            }
