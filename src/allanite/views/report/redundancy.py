# SPDX-License-Identifier: BSD-3-Clause
"""What the report of combined sensors says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.blocks import (
    Banner,
    Page,
    PageBlock,
    References,
    Text,
    bullets,
    equation,
    findings,
    pairs,
    table,
)
from allanite.views.report.measurement import known_facts, measurement_page, views
from allanite.views.wording import (
    combination_facts,
    duration,
    fault_lines,
    gain_lines,
    model_words,
    sentence,
    shared_lines,
    tone,
    weight_lines,
)

__all__ = ["page"]

Json = Mapping[str, Any]

AITKEN = (
    "A. C. Aitken, “On least squares and linear combination of observations”, Proc. R. Soc. Edinburgh 55 (1935) "
    "42."
)
POTTER = (
    "J. E. Potter, M. C. Suman, “Thresholdless redundancy management with arrays of skewed instruments”, AGARDograph "
    "224 (1977)."
)
MEHRA = (
    "R. K. Mehra, J. Peschon, “An innovations approach to fault detection and diagnosis in dynamic systems”, "
    "Automatica 7 (1971) 637."
)


def page(document: Json) -> Page:
    """The page of a combination."""
    return measurement_page(
        document,
        title=document.get("source") or "Combined sensors",
        kicker="Redundant sensors as one",
        facts=[
            ("Sensors", str(len(document["channels"]))),
            ("Axes", ", ".join(document["axes"])),
            ("Length", duration(document["duration"])),
        ],
        parts={
            "verdict": _verdict,
            "pictures": _pictures,
            "noise": _noise,
            "findings": findings,
            "method": _method,
        },
        titles={"noise": "Weights and noise"},
    )


def _verdict(document: Json) -> list[PageBlock]:
    return [
        # the reason may begin with the name of a channel: as it is written
        Banner(tone(document["verdict"]), sentence(document["verdict"]), f"{document['reason']}."),
        *table(("Fault", "Sensor", "From", "To", "Size"), fault_lines(document)),
        *bullets([sentence(remark) for remark in document["remarks"]]),
        known_facts(combination_facts(document)),
    ]


def _pictures(document: Json) -> list[PageBlock]:
    pictures = (
        ("parity", "Parity of the sensors over time: what contradicts them stands above the threshold."),
        ("deviation", "Allan deviation of the combined axes beside the best sensor."),
        ("gain", "How many times better than the best sensor."),
    )
    return views(document, pictures)


def _noise(document: Json) -> list[PageBlock]:
    heads, rows = weight_lines(document)
    percent = f"{100 * document['confidence']:g} % interval"
    return [
        *table(
            heads,
            rows,
            caption="What each sensor gives to each axis. Constant differences are removed first.",
        ),
        *table(
            ("Averaging", "Axis", "Allan deviation", f"Gain, {percent}", "Predicted", "Lost"),
            gain_lines(document),
            caption="Gain over the best sensor; lost: what weights made for that time would be better by.",
        ),
        *table(
            ("Sensors", "Correlation", "of means over"),
            shared_lines(document),
            caption="Noise that is shared.",
        ),
        pairs(
            [
                (f"Noise of {axis}", model_words(model))
                for axis, model in zip(document["axes"], document["models"], strict=True)
            ]
        ),
    ]


def _method(document: Json) -> list[PageBlock]:
    return [
        Text("Each sensor shows what is measured along its axis, and its own noise:"),
        *equation("redundant"),
        Text(
            "The weights W are the best linear unbiased ones for one averaging time, constant in time: what is "
            "measured passes unchanged at every frequency, and the noise of the combined axes is a sum of terms that "
            "every other command takes. The parity p does not depend on what is measured. Under the noise models it is "
            "whitened by the filter of all sensors' states, so each window is an independent chi-square; the false "
            "alarms of all windows together stay below the stated rate. An alarm is explained by the fault that raises "
            "the likelihood most: step, drift, spike, more noise. Sensors that explain it nearly as well stay "
            "candidates."
        ),
        References([AITKEN, POTTER, MEHRA]),
    ]
