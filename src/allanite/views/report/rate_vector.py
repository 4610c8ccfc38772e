# SPDX-License-Identifier: BSD-3-Clause
"""What the report of a rate vector says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.views.blocks import (
    Hero,
    Page,
    PageBlock,
    Text,
    drawn,
    equation,
    findings,
    pairs,
    table,
)
from allanite.views.rates import checks_table, estimates_table, rate_budget
from allanite.views.report.measurement import judgement, measurement_page
from allanite.views.wording import (
    EMPTY_BUDGET,
    angle,
    axis_lines,
    check_lines,
    duration,
    latitude_words,
    left_out_lines,
    length_lines,
    pose_words,
    sentence,
    tone,
    used_words,
    vector_budget,
)

__all__ = ["page"]

Json = Mapping[str, Any]


def page(document: Json) -> Page:
    """The page of a rate vector."""
    return measurement_page(
        document,
        title=document.get("source") or "Rate vector",
        kicker="Rate vector of three axes at rest",
        facts=[
            ("Axes", ", ".join(document["channels"])),
            ("Length", duration(document["duration"])),
            (
                "At rest",
                f"{duration(document['quiet'])} ({100 * document['quiet'] / document['duration']:.3g} %)",
            ),
            ("Latitude", "" if document["latitude"] is None else angle(document["latitude"])),
            ("Noise", document.get("model_name") or document["model_source"]),
        ],
        parts={
            "verdict": _verdict,
            "pictures": _pictures,
            "record": _record,
            "checks": _checks,
            "findings": findings,
            "method": _method,
        },
        titles={"record": "What was used"},
    )


def _verdict(document: Json) -> list[PageBlock]:
    verdict = document["verdict"]
    blocks = judgement(document, [words for words in document["advice"] if words not in document["reason"]])
    if document["length"] is None:
        return blocks
    percent = f"{100 * document['confidence']:g} %"
    lines = length_lines(document)
    main, known = lines
    blocks.append(
        Hero(
            main.value,
            "deg/h",
            f"{percent} interval {main.range} deg/h",
            f"{main.seconds} deg/s {main.seconds_range}; the Earth turns at {known.value} deg/h",
            tone(verdict),
        )
    )
    blocks.append(Text(sentence(document["statement"]), note=True))
    blocks += estimates_table(lines, f"Length of the vector, with its {percent} interval.")
    blocks += table(
        ("Axis", "deg/h", "Standard deviation, deg/h", "Angle to the vector"),
        axis_lines(document),
        caption="The vector in the axes of the sensor; standard deviations by the noise.",
    )
    return [*blocks, *_budget(document)]


def _budget(document: Json) -> list[PageBlock]:
    rows = vector_budget(document)
    if not rows:
        return [Text(EMPTY_BUDGET, note=True)]
    return rate_budget(rows)


def _pictures(document: Json) -> list[PageBlock]:
    return [
        *drawn(
            "length",
            document,
            "The length of what the three gyros see, bias and Earth together, and the known rate of the Earth. No "
            "latitude, heading or leveling is in it.",
            "Length of the rate vector with its interval beside the known rate.",
            view="length",
        ),
        *drawn(
            "means",
            document,
            "The means of the quiet parts, axis by axis: a drift, a warm-up or a turn that was missed would show here.",
            "Means of the quiet cells of each axis against time.",
            view="means",
        ),
    ]


def _record(document: Json) -> list[PageBlock]:
    return [
        *drawn(
            "record-figure",
            document,
            "The record: lowest and highest value of each block. What is at rest was found by the tool.",
            f"Record of {', '.join(document['channels'])}; {used_words(document)}.",
            view="record",
        ),
        pairs(
            [
                ("Used", used_words(document)),
                ("Poses", pose_words(document)),
                ("Looked at in", f"cells of {duration(document['cell'])}"),
            ]
        ),
        *table(
            ("Left out because", "Stretches", "Together", "The longest"),
            left_out_lines(document),
            caption="What was left out; every stretch is in stretches.csv.",
        ),
    ]


def _checks(document: Json) -> list[PageBlock]:
    caption = "Questions put to the vector. Chance: of so large a value if the answer is yes."
    return [
        *checks_table(check_lines(document["checks"]), caption),
        pairs([("Latitude", latitude_words(document))]),
    ]


def _method(document: Json) -> list[PageBlock]:
    return [
        Text(
            "Three gyros at right angles see the whole rotation of the Earth, whatever their attitude C, and their "
            "biases. The length of the Earth's part needs no latitude, heading or level:"
        ),
        *equation("rate_vector"),
        Text(
            "The record is cut into cells. A cell in which an axis moves more than in the quiet ones, at any time "
            "scale, or whose mean is off theirs, is left out with its neighbors. The level of what is left is fitted "
            "in the noise of each axis, by a model that is given or, without one, by the noise of the quiet parts "
            "themselves averaged over all that they allow. The part that noise adds to the length of a mean is "
            "removed. The interval is Student's, and no narrower than the scatter of batches of cells."
        ),
        Text(
            "A length that agrees with the Earth is no proof that the biases are small: they may happen to make it up. "
            "The angle to gravity, and the same length in several poses, are what speaks against that."
        ),
    ]
