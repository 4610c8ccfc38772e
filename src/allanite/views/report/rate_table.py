# SPDX-License-Identifier: BSD-3-Clause
"""What the report of a run on a rate table says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.plain_files.counted import plural
from allanite.views.blocks import (
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
from allanite.views.rates import ROSENBERG, checks_table
from allanite.views.report.measurement import judgement, measurement_page, views
from allanite.views.wording import (
    DEG,
    NOISE_ALONE,
    check_lines,
    duration,
    model_words,
    number,
    output_unit,
    response_budget,
    response_lines,
    shape_words,
    step_rows,
    table_words,
    tone,
)

__all__ = ["page"]

Json = Mapping[str, Any]


def page(document: Json) -> Page:
    """The page of a run on a rate table."""
    return measurement_page(
        document,
        title=document.get("source") or "Rate table",
        kicker="Response to a rate table",
        facts=[
            ("Channel", document["channel"]),
            ("Table", table_words(document)),
            ("Length", duration(document["duration"])),
            ("Fitted", shape_words(document)),
        ],
        parts={
            "verdict": _verdict,
            "pictures": _pictures,
            "steps": _steps,
            "frequencies": _frequencies,
            "checks": _checks,
            "findings": findings,
            "method": _method,
        },
        titles={"frequencies": "Bandwidth"},
    )


def _verdict(document: Json) -> list[PageBlock]:
    verdict = document["verdict"]
    blocks = judgement(document, [*document["notes"], *document["advice"]])
    lines = response_lines(document)
    main = lines[0]
    if main.value != "–":
        percent = f"{100 * document['confidence']:g} %"
        beside = next(
            (f"{n.value} {n.unit} from nominal {n.range}" for n in lines if n.name == "Scale-factor error"),
            "",
        )
        blocks.append(
            Hero(
                main.value,
                f"scale factor{', ' if main.unit else ''}{main.unit}",
                f"{percent} interval {main.range}",
                beside,
                tone(verdict),
            )
        )
    blocks += table(
        ("Number", "Value", f"{100 * document['confidence']:g} % interval", "Unit", "Answer"),
        [(n.name, n.value, n.range, n.unit, n.answer) for n in lines],
        caption="The response of the channel. Ratios of curvature are over the scale factor times the largest rate.",
        kept=[n.kept for n in lines],
    )
    rows = response_budget(document)
    if len(rows) < 2:
        return [*blocks, Text(NOISE_ALONE, note=True)]
    heads = ("Source", "Standard uncertainty of the scale factor, ppm")
    return [*blocks, *table(heads, rows, caption="Where the uncertainty comes from.")]


def _pictures(document: Json) -> list[PageBlock]:
    shown = (
        ("response",
         "The response less its best straight line. Where the band holds zero, the line is as good as the curve.",
         "Deviation of the response from a straight line against the rate of the table."),
        ("steps", "What the fit leaves of each step: repeats that drift apart show here.",
         "Residuals of the steps in the order of time."),
        ("drift", "The slow noise of the sensor through the record.", "Slow noise against time."),
        ("noise", "Whether the noise grows with the rate.", "Noise over that of the model against the rate."),
    )  # fmt: skip
    return views(document, shown)


def _steps(document: Json) -> list[PageBlock]:
    rows = step_rows(document)
    if not rows:
        return []
    unit, _ = output_unit(document)
    cells = [
        (str(r["number"]), r["start_s"], r["rate_deg_s"], *(list(r.values())[4:8]), r["why"] or "used")
        for r in rows
    ]
    heads = (
        "Step",
        "From, s",
        "Rate, deg/s",
        f"Mean, {unit}",
        "Residual, ppm",
        "sd, ppm",
        "Corrected, ppm",
        "",
    )
    return [
        Details(plural(len(rows), "step"), table(heads, cells, caption="Residuals in ppm of full scale."))
    ]


def _frequencies(document: Json) -> list[PageBlock]:
    rows = document["frequencies"]
    if not rows:
        return []
    lowest = min(rows, key=lambda r: float(r["frequency"]))
    cells = [
        (
            f"{r['frequency']:g}",
            number(r["amplitude"] / DEG, 4),
            f"{r['gain'] / lowest['gain']:.6f}",
            number(r["gain_sd"] / lowest["gain"], 2),
            f"{r['phase'] / DEG:.3f}",
            number(r["phase_sd"] / DEG, 2),
        )
        for r in rows
    ]
    heads = ("Frequency, Hz", "Amplitude, deg/s", "Gain over the lowest", "sd", "Phase, deg", "sd")
    return [
        *drawn(
            "frequency", document, "Gain and phase.", "Gain and phase against frequency.", view="frequency"
        ),
        *table(
            heads, cells, caption="A clock that is late looks like a phase that grows with the frequency."
        ),
    ]


def _checks(document: Json) -> list[PageBlock]:
    blocks = checks_table(check_lines(document["checks"]), "Questions put to what the fit leaves.")
    aided = document["aided"]
    if aided is None:
        return blocks
    return [*blocks, Text(_aided_words(aided, document), note=True)]


def _aided_words(aided: Json, document: Json) -> str:
    """What the reference-aided filter leaves, and that it agrees."""
    words = f"Reference-aided: {aided['statement']}."
    if aided["raw"] is None:
        return words
    value = next(p for p in document["parameters"] if p["name"] == "scale factor")["value"]
    size = abs(value) * document["full_scale"] * 1e-6
    apart = abs(aided["scale"] / value - 1) * 1e6
    return (
        f"{words} It takes the residuals of the steps from {number(aided['raw'] / size, 3)} to "
        f"{number(aided['corrected'] / size, 3)} ppm of full scale (root mean square); the scale factor of its samples "
        f"is {number(apart, 2)} ppm from that of the regression."
    )


def _method(document: Json) -> list[PageBlock]:
    return [
        Text(
            "The output of the sensor against the rate x of the table, u being x over the largest rate, in the noise "
            "of the model:"
        ),
        *equation("rate_table"),
        Text(
            "Level, slope and curvature are fitted by generalized least squares. The curvature enters less its best "
            "straight line, so that the scale factor is the slope of the best straight line through the response; the "
            "bias is the response at rest. Where the rate changes all the time, the delay between the clocks is one "
            "more coefficient, and its uncertainty is in all the others."
        ),
        *equation("least_squares"),
        pairs(
            [
                (
                    "Noise",
                    f"{document.get('model_name', document['model_source'])}: {model_words(document['model'])}",
                ),
                ("Means over", duration(document["block"])),
            ]
        ),
        References([ROSENBERG]),
    ]
