# SPDX-License-Identifier: BSD-3-Clause
"""What the report of a self-calibration says, from its plain document."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.views.blocks import (
    Cell,
    Details,
    Hero,
    Page,
    PageBlock,
    References,
    Section,
    Subheading,
    Text,
    bullets,
    drawn,
    equation,
    findings,
    page_of,
    pairs,
    provenance,
    table,
)
from allanite.views.rates import checks_table
from allanite.views.report.measurement import judgement
from allanite.views.wording import (
    angle,
    calibrated_words,
    calibration_facts,
    capitalised,
    check_lines,
    duration,
    model_words,
    parameter_groups,
    position_lines,
    rest_unit,
    scatter_lines,
    sensor_words,
    sentence,
    still_open,
    tone,
    turn_lines,
)

__all__ = ["page"]

Json = Mapping[str, Any]
_MOST_ROWS = 12  # of a table that is not folded away

TEDALDI = (
    "D. Tedaldi, A. Pretto, E. Menegatti, A robust and easy to implement method for IMU calibration without external "
    "equipments, ICRA 2014: accelerometers from the length of gravity, gyros from the turns between rests."
)
FROSIO = (
    "I. Frosio, F. Pedersini, N. A. Borghese, Autocalibration of MEMS accelerometers, IEEE Transactions on "
    "Instrumentation and Measurement 58 (2009) 2034: the ellipsoid of three axes at rest."
)
BIRGE = (
    "R. T. Birge, The calculation of errors by the method of least squares, Physical Review 40 (1932) 207: scatter "
    "beyond the noise."
)
WGS84 = "NGA.STND.0036_1.0.0_WGS84 (2014), equations 4-1 and 4-3: normal gravity by latitude and height."


def page(document: Json) -> Page:
    """The page of a self-calibration."""
    return page_of(
        title=document.get("source") or "Calibration",
        kicker="Self-calibration of three axes",
        facts=[
            ("Triads", " and ".join(sensor_words(s).lower() for s in _sensors(document))),
            ("Length", "" if document["duration"] is None else duration(document["duration"])),
            ("Positions", str(sum(p["used"] for p in document["positions"]))),
            ("Gravity", f"{document['gravity']:.5f} m/s²"),
            ("Latitude", "" if document["latitude"] is None else angle(document["latitude"])),
        ],
        sections=[
            Section(id="verdict", title="Verdict", blocks=_verdict(document)),
            Section(id="parameters", title="Parameters", blocks=_parameters(document)),
            Section(id="positions", title="Positions", blocks=_positions(document)),
            Section(
                id="residuals", title="What the calibration leaves", short="Residuals", blocks=_residuals(document)
            ),
            Section(id="log", title="The log", blocks=_log(document)),
            Section(id="checks", title="Checks", blocks=_checks(document)),
            Section(id="findings", title="Findings", blocks=findings(document)),
            Section(id="method", title="Method", blocks=_method(document)),
            provenance(document),
        ],
    )  # fmt: skip


def _sensors(document: Json) -> list[str]:
    return list(dict.fromkeys(row["name"].partition(".")[0] for row in document["parameters"]))


def _verdict(document: Json) -> list[PageBlock]:
    verdict, rows = document["verdict"], document["parameters"]
    known = sum(row["status"] not in ("assumed", "not resolved") for row in rows)
    return [
        *judgement(document),
        Hero(
            f"{known} of {len(rows)}",
            "parameters known",
            calibrated_words(document),
            f"each with its {100 * document['confidence']:g} % interval below",
            tone(verdict),
        ),
        *_open(document),
        *(Text(sentence(words), note=True) for words in document["remarks"]),
    ]


def _open(document: Json) -> list[PageBlock]:
    """What the positions leave open, and which to add."""
    rows = [
        (Cell(text=capitalised(names)), Cell(text=capitalised(advice or "–"), look="words"))
        for names, advice in still_open(document)
    ]
    return table(
        ("Not observable", "What to do"),
        rows,
        caption="What these positions leave open: its value and interval are what was assumed, or little better.",
    )


def _parameters(document: Json) -> list[PageBlock]:
    groups, blocks = parameter_groups(document), list[PageBlock]()
    percent = f"{100 * document['confidence']:g} % interval"
    for sensor in dict.fromkeys(group.sensor for group in groups):
        rows: list[Sequence[str | Cell]] = []
        for group in (g for g in groups if g.sensor == sensor):
            for line in group.lines:
                look = "value" if line.estimated else "limit"
                rows.append(
                    (
                        f"{group.name} {line.name}",
                        group.unit,
                        Cell(text=line.value, look=look),
                        Cell(text=line.range, look=look),
                        line.status,
                    )
                )
        blocks.append(Subheading(sensor_words(sensor)))
        blocks += table(
            ("Parameter", "Unit", "Estimate", percent, ""), rows, caption=_caption(document, sensor)
        )
    return [
        *blocks,
        *drawn(
            "parameters-figure",
            document,
            "Every parameter with its interval. The bar of what is only assumed may run out of the frame.",
            "Parameters of each triad with their intervals.",
            view="parameters",
        ),
        *drawn(
            "correlation",
            document,
            "Correlations: two parameters that the positions hardly tell apart are large squares. A program that "
            "takes the calibration needs them as well as the intervals.",
            "Matrix of the correlations of the estimated parameters.",
            view="correlation",
        ),
    ]


def _caption(document: Json, sensor: str) -> str:
    channels = document["calibration"]["channels"].get(sensor, ())
    return f"Channels {', '.join(channels)} along x, y, z." if channels else ""


def _positions(document: Json) -> list[PageBlock]:
    unit, _ = rest_unit(document)
    heads = ("Position", "Up", "Time", f"|f| − g, {unit}", "Rate, deg/h (worst axis)", "Misfit", "")
    caption = (
        "Each static span; ± one standard deviation by noise and scatter. Misfit: distance from what all others "
        "predict, in standard deviations."
    )
    return [
        *drawn(
            "sphere",
            document,
            "Which way was up at each position, in the axes of the sensor. Biases and scale factors need positions on "
            "opposite sides, misalignments need some between the axes.",
            f"Positions on a sphere: {calibrated_words(document)}.",
            view="sphere",
        ),
        *_folded("All positions", heads, position_lines(document), caption),
    ]


def _residuals(document: Json) -> list[PageBlock]:
    turned = ("Turn", "Angle", "Left of it", "Misfit", "")
    return [
        *drawn(
            "residuals-figure",
            document,
            "What the calibrated sensors read too much at each position, with the band that noise and scatter allow.",
            "Residuals of the positions and turns, by the number of the position.",
            view="residuals",
        ),
        *table(
            ("Observed", "Scatter over noise", "Added to the noise"),
            scatter_lines(document),
            caption="Scatter beyond the noise (a hand, a table that gives way, a rest that was not one) is added to "
            "it, and widens every interval.",
        ),
        *_folded("All turns", turned, turn_lines(document), "Turns between positions."),
    ]


def _folded(
    summary: str, heads: Sequence[str], rows: Sequence[Sequence[str]], caption: str
) -> list[PageBlock]:
    """A table that is folded away where it is long."""
    marked: list[Sequence[str | Cell]] = [(*row[:-1], _state(row[-1])) for row in rows]
    made = table(heads, marked, caption=caption)
    return [Details(f"{summary} ({len(rows)})", made)] if len(rows) > _MOST_ROWS else made


def _state(words: str) -> Cell:
    return Cell(text=words, look="fatal" if words == "outlier" else "")


def _log(document: Json) -> list[PageBlock]:
    """The log with its rests; nothing in a document that was made without the record."""
    rests = document.get("static_spans")
    if rests is None:
        return []
    return [
        *drawn(
            "log-figure",
            rests,
            "The log: what is at rest is shaded and numbered. Above one, the motion is more than noise.",
            f"Log with its static spans: {calibrated_words(document)}.",
        ),
        *bullets([sentence(words) for words in rests["findings"] if words not in document["remarks"]]),
    ]


def _checks(document: Json) -> list[PageBlock]:
    caption = (
        "Questions put to what the calibration leaves. Chance: of so large a value if the answer is yes."
    )
    facts = [(capitalised(name), words) for name, words in calibration_facts(document)]
    return [*checks_table(check_lines(document["checks"]), caption), pairs(facts)]


def _method(document: Json) -> list[PageBlock]:
    sensors = _sensors(document)
    blocks: list[PageBlock] = [
        Text(
            "What three axes show of a true vector x: scale factors S, misalignments E, biases b, noise n; of gyros "
            "also what the specific force f adds to the biases, where they are seen to follow it."
        ),
        *equation("triad"),
    ]
    if "accelerometer" in sensors:
        blocks += [
            Text(
                "At rest the accelerometers feel gravity, of known length and unknown direction. Each position is one "
                "equation for the parameters, and two for its own attitude:"
            ),
            *equation("rest"),
        ]
    if "gyro" in sensors:
        blocks += [
            Text(
                "The gyros turn with the Earth at rest, and between two rests they must turn the one direction of "
                "gravity into the other; the latter gives their scale factors and misalignments, in the axes of the "
                "accelerometers:"
            ),
            *equation("earth_at_rest", "turned_triad"),
        ]
    return [
        *blocks,
        Text(
            "All parameters and attitudes are fitted together, by generalized least squares in the noise of the model: "
            "its drift goes on from one position to the next. A parameter is called observable by the singular values "
            "of that fit, not by the number of positions. What is not keeps its nominal value, with what was assumed "
            "of it as its interval, and takes part in the correlations."
        ),
        *equation("least_squares"),
        Text(_frame_words(document)),
        pairs([(f"Noise of {name}", model_words(model)) for name, model in document["models"].items()]),
        References([TEDALDI, FROSIO, BIRGE, WGS84]),
    ]


def _frame_words(document: Json) -> str:
    which = "accelerometers" if "accelerometer" in _sensors(document) else "gyros"
    if document["calibration"]["frame"] == "z":
        return f"The body: its z axis is that of the {which}, and their y axis lies in its plane of y and z."
    return f"The body: its x axis is that of the {which}, and their y axis lies in its plane of x and y."
