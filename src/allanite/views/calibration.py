# SPDX-License-Identifier: BSD-3-Clause
"""What a self-calibration says: its verdict, every parameter with its interval, and what speaks against them."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.calibration import CalibrationEstimate, ObservationScatter
from allanite.experiments.calibration.results import CalibrationPosition, CalibrationTurn
from allanite.experiments.calibration.verdict import CalibrationNoise, ParameterStatus
from allanite.plain_files.counted import plural
from allanite.quantities.number_words import duration, interval, number
from allanite.quantities.units import STANDARD_GRAVITY
from allanite.recording.calibration import ACCELEROMETER, AXES, GYRO
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import (
    Cell,
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
from allanite.views.rates import checks_table
from allanite.views.result_page import advice, findings_of, result_page, verdict_banner
from allanite.views.wording.calibration import calibration_name, parameter_groups, rest_unit, sensor_words
from allanite.views.wording.rates import DEG_H, angle, capitalised, check_wordings, model_words, sentence

__all__ = ["rows", "view"]

Array = NDArray[np.float64]

_MOST_ROWS = 12  # of a table that is not folded away
_MG = 1e-3 * STANDARD_GRAVITY
_SCATTERED = {"m/s²": ("mg", _MG), "rad/s": ("deg/h", DEG_H), "rad": ("mrad", 1e-3)}
_GRAVITY = {
    "given": "as given",
    "latitude": "by latitude and height",
    "standard": "standard gravity, none given",
}
_RESTS = {"found": "found in the signal", "given": "as given", "rows of means": "rows of means"}

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


def view(document: ResultDocument[CalibrationEstimate]) -> Page:
    """The page of a self-calibration."""
    result = document.result
    return result_page(
        document,
        title=result.source or "Calibration",
        kicker="Self-calibration of three axes",
        facts=[
            ("Triads", " and ".join(sensor_words(s).lower() for s in result.sensors)),
            ("Length", duration(result.duration) if math.isfinite(result.duration) else ""),
            ("Positions", str(len(result.used))),
            ("Gravity", f"{result.gravity:.5f} m/s²"),
            ("Latitude", "" if result.latitude is None else angle(result.latitude)),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "parameters": ("Parameters", [*_parameters(result)]),
            "positions": ("Positions", _positions(result)),
            "residuals": ("Residuals", _residuals(result)),
            "log": ("The log", _log(document)),
            "checks": ("Checks", [*_checks(document)]),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", _method(result)),
        },
    )


# -- verdict ----------------------------------------------------------------------------------------------


def _verdict(result: CalibrationEstimate) -> Iterator[PageBlock]:
    known = sum(p.status is ParameterStatus.ESTIMATED for p in result.parameters)
    yield verdict_banner(result.verdict, result.reason)
    yield from advice(result.advice)
    yield Hero(
        f"{known} of {len(result.parameters)}",
        "parameters known",
        _used(result),
        f"each with its {_percent(result)} below",
        result.verdict.tone,
    )
    yield from table(
        ("Not observable", "What to do"),
        [
            (Cell(text=capitalised(names)), Cell(text=capitalised(words or "–"), look="words"))
            for names, words in _open(result)
        ],
        caption="Not determined by these positions: value and interval are those assumed, or little better.",
    )
    yield from table(
        _position_heads(result),
        [_position(p, result) for p in result.positions if p.outlier or not p.used],
        caption="Positions that contradict the others or were not used.",
    )
    yield from (Text(sentence(words), note=True, brief=True) for words in result.notes)


def _percent(result: CalibrationEstimate) -> str:
    return f"{100 * result.confidence:g} % interval"


def _open(result: CalibrationEstimate) -> Iterator[tuple[str, str]]:
    """What the positions leave open, with what to do: parameters that need the same stand together."""
    by_need: dict[tuple[str, ...], list[str]] = {}
    for p in result.parameters:
        if p.status is not ParameterStatus.ESTIMATED:
            by_need.setdefault(p.advice, []).append(calibration_name(p.name))
    for needed, names in by_need.items():
        words = "; ".join(needed)
        yield _listed(names), f"add: {words}" if words and {*needed} <= {*result.add} else words


def _listed(names: Sequence[str]) -> str:
    """Names of one sensor and kind are written once: "gyro scale factor x, y, z"."""
    stems: dict[str, list[str]] = {}
    for name in names:
        stem, _, axis = name.rpartition(" ")
        stems.setdefault(stem, []).append(axis)
    return "; ".join(f"{stem} {', '.join(axes)}" for stem, axes in stems.items())


def _used(result: CalibrationEstimate) -> str:
    """How much was used."""
    used, every = len(result.used), len(result.positions)
    count = f"{used} of {every} positions" if used < every else plural(used, "position")
    words = f"{count} ({_RESTS[result.spans_source]})"
    seconds = sum(p.duration for p in result.used)
    if math.isfinite(seconds):
        words += f", {duration(seconds)} at rest"
    turns = plural(sum(t.used for t in result.turns), "turn")
    return f"{words}; {turns} between them" if result.turns else words


# -- parameters -------------------------------------------------------------------------------------------


def _parameters(result: CalibrationEstimate) -> Iterator[PageBlock]:
    groups = parameter_groups(result.parameters)
    for sensor in dict.fromkeys(group.sensor for group in groups):
        lines: list[Sequence[str | Cell]] = []
        for group, line in ((g, line) for g in groups if g.sensor == sensor for line in g.lines):
            look = "value" if line.estimated else "limit"
            cells = (Cell(text=words, look=look) for words in (line.value, line.range))
            lines.append((f"{group.name} {line.name}", group.unit, *cells, line.status))
        channels = result.calibration.channels.get(sensor, ())
        caption = f"Channels {', '.join(channels)} along x, y, z." if channels else ""
        yield from table(
            (sensor_words(sensor), "Unit", "Estimate", _percent(result), ""), lines, caption=caption
        )
    yield from drawn(
        "parameters-figure",
        result,
        "Parameters with their intervals. The bar of an assumed value may extend beyond the frame.",
        "Parameters of each triad with their intervals.",
        view="parameters",
    )
    yield from drawn(
        "correlation",
        result,
        "Correlations. A large square marks two parameters that the positions hardly separate. A program that uses the "
        "calibration needs the correlations as well as the intervals.",
        "Matrix of the correlations of the estimated parameters.",
        view="correlation",
    )


# -- positions and turns ----------------------------------------------------------------------------------


def _position_heads(result: CalibrationEstimate) -> tuple[str, ...]:
    unit, _ = rest_unit(result)
    return ("Position", "Up", "Time", f"|f| − g, {unit}", "Rate, deg/h (worst axis)", "Misfit", "")


def _position(p: CalibrationPosition, result: CalibrationEstimate) -> tuple[str | Cell, ...]:
    """Number, which way was up, from and to, excess of |f| over g, rate left, misfit, and what of it."""
    return (
        str(p.number),
        p.words or "–",
        f"{p.start:.1f} to {p.stop:.1f} s" if math.isfinite(p.duration) else "–",
        _with_sd(p.excess, p.excess_sd, rest_unit(result)[1]),
        _largest(p.rate, p.rate_sd),
        number(p.misfit, 2),
        _state(p, p.why),
    )


def _turn(t: CalibrationTurn) -> tuple[str | Cell, ...]:
    """From, to, angle, what the integrated rates leave of it, misfit, and what of it."""
    left = float(np.linalg.norm(t.residual))
    return (
        f"{t.before} to {t.after}",
        angle(t.angle, 4),
        f"{number(left * 1e3, 3)} mrad" if math.isfinite(left) else "–",
        number(t.misfit, 2),
        _state(t, f"not used: {t.why}" if t.why else "not used"),
    )


def _state(part: CalibrationPosition | CalibrationTurn, why: str) -> Cell:
    return Cell(text="outlier", look="fatal") if part.outlier else Cell(text="" if part.used else why)


def _with_sd(value: float | None, sd: float | None, factor: float) -> str:
    if value is None or sd is None:
        return "–"
    middle, _, _ = interval(value / factor, (value - sd) / factor, (value + sd) / factor)
    return f"{middle} ± {number(sd / factor, 2)}"


def _largest(rate: Array | None, sd: Array | None) -> str:
    """Of three axes the one that lies farthest from zero, in deg/h."""
    if rate is None or sd is None:
        return "–"
    known = [(r, s, a) for r, s, a in zip(rate.tolist(), sd.tolist(), AXES, strict=True) if s and r == r]
    if not known:
        return "–"
    r, s, axis = max(known, key=lambda part: abs(part[0] / part[1]))
    return f"{_with_sd(r, s, DEG_H)} ({axis})"


def _positions(result: CalibrationEstimate) -> list[PageBlock]:
    caption = (
        "Each static span; ± one standard deviation of noise and scatter. Misfit: distance from the prediction of all "
        "others, in standard deviations."
    )
    lines = [_position(p, result) for p in result.positions]
    return [
        *drawn(
            "sphere",
            result,
            "Direction of up at each position, in sensor axes. Biases and scale factors need positions on opposite "
            "sides; misalignments need some between the axes.",
            f"Positions on a sphere: {_used(result)}.",
            view="sphere",
        ),
        *_folded("All positions", _position_heads(result), lines, caption),
    ]


def _residuals(result: CalibrationEstimate) -> list[PageBlock]:
    heads = ("Turn", "Angle", "Residual", "Misfit", "")
    return [
        *drawn(
            "residuals-figure",
            result,
            "Residuals of the calibrated sensors at each position, with the band that noise and scatter allow.",
            "Residuals of the positions and turns, by the number of the position.",
            view="residuals",
        ),
        *table(
            ("Observed", "Scatter over noise", "Added to the noise"),
            [(s.what, number(s.ratio, 3), _added(s, result.duration)) for s in result.scatter],
            caption="Scatter beyond the noise (a hand, a soft table, motion at rest) is added to it and widens every "
            "interval.",
        ),
        *_folded("All turns", heads, [_turn(t) for t in result.turns], "Turns between positions."),
    ]


def _folded(
    summary: str, heads: Sequence[str], lines: Sequence[Sequence[str | Cell]], caption: str
) -> list[PageBlock]:
    """A table that is folded away where it is long; none for a terminal."""
    made = table(heads, lines, caption=caption, brief=False)
    return [Details(f"{summary} ({len(lines)})", made)] if len(lines) > _MOST_ROWS else made


def _added(scatter: ObservationScatter, seconds: float) -> str:
    """Scatter of each span or turn, and a drift that the spans by themselves do not show."""
    unit, size = _SCATTERED.get(scatter.unit, (scatter.unit, 1.0))
    known = max(seconds, 0.0) if math.isfinite(seconds) else 0.0
    drift = scatter.walk * math.sqrt(known)  # of a random walk, over the record
    parts = [f"{number(scatter.sd / size, 2)} {unit}"] if scatter.sd else []
    parts += [f"drift of {number(drift / size, 2)} {unit} over the record"] if drift else []
    return " and ".join(parts) or "none"


# -- the rest ---------------------------------------------------------------------------------------------


def _log(document: ResultDocument[CalibrationEstimate]) -> list[PageBlock]:
    """The log with its rests; nothing in a document that was made without the record."""
    return drawn(
        "log-figure",
        document.result,
        "The log, with its static spans shaded and numbered. Above 1, the motion exceeds the noise.",
        f"Log with its static spans: {_used(document.result)}.",
        view="log",
        recording=document.overviews,
    )


def _checks(document: ResultDocument[CalibrationEstimate]) -> Iterator[PageBlock]:
    caption = (
        "Checks of the residuals. Chance: the probability of so large a value if the calibration is right."
    )
    yield from checks_table(check_wordings(document.result.checks), caption)
    yield pairs([*_facts(document)])


def _facts(document: ResultDocument[CalibrationEstimate]) -> Iterator[tuple[str, str]]:
    """Gravity, latitude, temperature, noise: what the result rests on."""
    result = document.result
    known = result.stated.get("gravity")
    stated = f", ± {known:g} stated)" if known else ")"
    yield "Used", _used(result)
    yield "Gravity", f"{result.gravity:.5f} m/s² ({_GRAVITY[result.gravity_source]}{stated}"
    yield "Latitude", "" if result.latitude is None else angle(result.latitude)
    yield "Earth", _earth(result)
    yield "Temperature", _temperature(document)
    triad = "accelerometers" if ACCELEROMETER in result.sensors else "gyros"
    yield "Body", f"{result.calibration.frame} axis of the {triad}"
    own_words = {
        CalibrationNoise.RECORD: "from this record",
        CalibrationNoise.GIVEN: document.model_name or "given",
    }
    yield "Noise", own_words.get(result.model_source, str(result.model_source))


def _earth(result: CalibrationEstimate) -> str:
    """The rotation of the Earth as the gyros saw it; nothing without gyros."""
    earth = result.earth
    if earth is None:
        return ""
    known = f"{number(earth.expected / DEG_H, 4)} deg/h"
    if not math.isfinite(earth.length + earth.length_sd):
        return f"not measured; expected {known}"
    use = "used for the scale factors" if earth.resolved else "too uncertain to be used"
    return f"{_with_sd(earth.length, earth.length_sd, DEG_H)} deg/h (1 sd), expected {known}: {use}"


def _temperature(document: ResultDocument[CalibrationEstimate]) -> str:
    span, reference = document.result.temperature_span, document.result.calibration.temperature
    channels = () if document.recording is None else document.recording.channels
    unit = next((f" {c.unit}" for c in channels if c.kind.value == "temperature"), "")
    words = "" if span is None else f"{number(span[0], 3)} to {number(span[1], 3)}{unit}"
    return words + ("" if reference is None else f"; the biases apply at {reference:g}{unit}")


def _method(result: CalibrationEstimate) -> list[PageBlock]:
    blocks: list[PageBlock] = [
        Text(
            "Output of three axes for a true vector x: scale factors S, misalignments E, biases b, noise n; the term "
            "of the specific force f is for gyros whose biases follow it."
        ),
        *equation("triad"),
    ]
    if ACCELEROMETER in result.sensors:
        blocks += [
            Text(
                "At rest the accelerometers measure gravity, with known magnitude and unknown direction. Each position "
                "gives one equation for the parameters, and two for its attitude:"
            ),
            *equation("rest"),
        ]
    if GYRO in result.sensors:
        blocks += [
            Text(
                "At rest the gyros turn with the Earth. Between two rests the integrated rates must turn one direction "
                "of gravity into the other, which gives the gyro scale factors and misalignments in the axes of the "
                "accelerometers:"
            ),
            *equation("earth_at_rest", "turned_triad"),
        ]
    return [
        *blocks,
        Text(
            "One generalized least-squares fit gives all parameters and attitudes, with the noise of the model: its "
            "drift continues from one position to the next. The singular values of the fit decide which parameters are "
            "observable, not the number of positions. The others keep their nominal values, with the assumed interval, "
            "and are part of the correlations."
        ),
        *equation("least_squares"),
        Text(_frame(result)),
        pairs(
            [(f"Noise of {name}", model_words(model)) for name, model in result.models.items()], brief=False
        ),
        References([TEDALDI, FROSIO, BIRGE, WGS84]),
    ]


def _frame(result: CalibrationEstimate) -> str:
    which = "accelerometers" if ACCELEROMETER in result.sensors else "gyros"
    axis, other = ("z", "y and z") if result.calibration.frame == "z" else ("x", "x and y")
    return f"Body axes: {axis} is the {axis} axis of the {which}, whose y axis lies in the body's plane of {other}."


def rows(result: CalibrationEstimate) -> Iterator[dict[str, object]]:
    """One row of a table for each position, in people's units."""

    def shown(value: float | None, factor: float = 1.0) -> str:
        return "" if value is None or math.isnan(value) else f"{value / factor:.6g}"

    def time(value: float) -> str:
        return "" if math.isnan(value) else f"{value:.6f}"

    for p in result.positions:
        rate = (None,) * 3 if p.rate is None else p.rate.tolist()
        yield {
            "number": p.number,
            "start_s": time(p.start),
            "stop_s": time(p.stop),
            "used": "yes" if p.used else "no",
            "outlier": "yes" if p.outlier else "no",
            **{f"up_{axis}": shown(value) for axis, value in zip(AXES, p.up.tolist(), strict=True)},
            "excess_mg": shown(p.excess, _MG),
            "excess_sd_mg": shown(p.excess_sd, _MG),
            **{f"rate_{axis}_deg_h": shown(value, DEG_H) for axis, value in zip(AXES, rate, strict=True)},
            "misfit": shown(p.misfit),
            "temperature": shown(p.temperature),
        }
