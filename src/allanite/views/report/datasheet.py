# SPDX-License-Identifier: BSD-3-Clause
"""What the reports of a data sheet and of bounds say, from their plain documents."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.blocks import (
    Cards,
    Cell,
    Page,
    PageBlock,
    References,
    Subheading,
    Text,
    findings,
    pairs,
    table,
)
from allanite.views.report.measurement import judgement, measurement_page, views
from allanite.views.wording import (
    bound_lines,
    bound_words,
    duration,
    inflation_words,
    model_words,
    sentence,
    statement_lines,
)

__all__ = ["page"]

Json = Mapping[str, Any]

_LOOKS = {"meets": "good", "does not meet": "fatal"}

IEEE_952 = (
    "IEEE Std 952-1997, “Specification format guide and test procedure for single-axis interferometric fiber optic "
    "gyros”, annex C."
)
BESAG = (
    "J. Besag, P. Green, D. Higdon, K. Mengersen, “Bayesian computation and stochastic systems”, Statist. Sci. 10 "
    "(1995) 3."
)
GOODMAN = "J. Goodman, J. Weare, “Ensemble samplers with affine invariance”, Comm. App. Math. Comp. Sci. 5 (2010) 65."


def page(document: Json) -> Page:
    """The page of a data sheet, or of bounds."""
    return _sheet(document) if document["format"] == "allanite-datasheet" else _bounds(document)


# -- data sheet ---------------------------------------------------------------------------------------------


def _sheet(document: Json) -> Page:
    recording = document.get("recording")
    return measurement_page(
        document,
        title=document["sensor"] or document.get("sheet_name") or "Data sheet",
        kicker="Data sheet and measurement",
        facts=[
            ("Channels", ", ".join(c["name"] for c in document["channels"])),
            ("Length", "" if recording is None else duration(recording["duration"])),
            ("Source", document["source"]),
        ],
        parts={
            "verdict": _sheet_verdict,
            "pictures": _sheet_pictures,
            "findings": findings,
            "method": _sheet_method,
        },
    )


def _sheet_verdict(document: Json) -> list[PageBlock]:
    blocks = judgement(document, ())
    for channel in document["channels"]:
        heads = ("Statement", "Data sheet", "Measured, 95 % interval", "Ratio", "Verdict")
        rows = [
            (
                s.name,
                Cell(text=s.stated, below=s.text),
                s.measured,
                s.ratio,
                Cell(text=s.verdict, below=s.note, look=_LOOKS.get(s.verdict, "")),
            )
            for s in statement_lines(channel)
        ]
        blocks += [Subheading(channel["name"]), *table(heads, rows)]
    models = [(name, model_words(s["model"])) for name, s in document["sections"].items()]
    return [*blocks, pairs([(f"The sheet as a model, {name}", words) for name, words in models])]


def _sheet_pictures(document: Json) -> list[PageBlock]:
    pictures = [("curves", "Allan deviation, measured and as the data sheet states it.")]
    if document["channels"]:
        pictures.append(("ratio", "Measured over stated, with the 95 % interval of the measurement."))
    return views(document, pictures)


def _sheet_method(document: Json) -> list[PageBlock]:
    return [
        Text(
            "Each statement is held against the interval of the same quantity: it is met where the whole interval lies "
            "at or below the stated value, not met where it lies above, and not resolved where the stated value is "
            "inside. A minimum of the Allan deviation is measured at the lag where the fitted model has its own."
        ),
        pairs([(f"As read, {name}", s["model"]["verdict"]) for name, s in document["sections"].items()]),
        References([IEEE_952]),
    ]


# -- bounds -------------------------------------------------------------------------------------------------


def _bounds(document: Json) -> Page:
    return measurement_page(
        document,
        title=(document.get("provenance") or {}).get("source") or "Bounds",
        kicker="Noise models above the sensor",
        facts=[
            ("Channels", ", ".join(c["name"] for c in document["channels"])),
            ("Probability", f"{100 * document['probability']:g} %"),
        ],
        parts={"bounds": _bound_tables, "pictures": _bound_pictures, "method": _bound_method},
    )


def _bound_tables(document: Json) -> list[PageBlock]:
    items = []
    for channel in document["channels"]:
        facts = channel["bound"]["overbound"]
        items.append(
            (
                channel["name"],
                [
                    Text(f"{sentence(bound_words(facts))} {sentence(inflation_words(facts))}"),
                    *table(("Term", "Fitted", "Bound", "Inflation"), bound_lines(channel)),
                ],
            )
        )
    return [Cards(items)]


def _bound_pictures(document: Json) -> list[PageBlock]:
    pictures = (
        ("curves", "Measured Allan deviation, the fitted model, and the bound above the sensor."),
        ("inflation", "How many times the fitted deviation the bound is."),
    )
    return views(document, pictures)


def _bound_method(_: Json) -> list[PageBlock]:
    return [
        Text(
            "Curves of noise that the record does not contradict are drawn from the likelihood of the whole measured "
            "curve, with all terms of the family, also those that the record does not show. A band that the stated "
            "share of them stays below everywhere at once is covered by the sum of terms with the least mean excess; "
            "no term is smaller than in the fit. Beyond the record a bound is an extrapolation of what the record "
            "cannot exclude. The probability is that of each channel by itself."
        ),
        References([BESAG, GOODMAN]),
    ]
