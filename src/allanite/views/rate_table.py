# SPDX-License-Identifier: BSD-3-Clause
"""What a run on a rate table says: its verdict, the response in numbers, the steps, and what speaks against them."""

from __future__ import annotations

import math
from collections.abc import Iterator

from allanite.experiments.rate_table import RateTableEstimate, ResponseParameter
from allanite.plain_files.counted import plural
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval, number
from allanite.quantities.quantity import QuantityStatus
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import (
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
from allanite.views.rates import ROSENBERG, TOGETHER, checks_table
from allanite.views.result_page import advice, findings_of, pictures, result_page, verdict_banner
from allanite.views.wording.rate_table import PPM, output_unit, scale_unit
from allanite.views.wording.rates import DEG, capitalised, check_wordings, model_words, sentence

__all__ = ["rows", "view"]

_UNSTATED = (
    "The interval of the scale factor includes only the noise: no uncertainty of the table rate is stated."
)
#: An entry of a budget below this part of the largest is none.
_NEGLIGIBLE = 1e-2
_NEVER_RESOLVED = ("clock offset", "clock drift", "delay", "bias", "bias without the Earth")
_LABELS = {
    "quadratic": "quadratic term",
    "cubic": "cubic term",
    "quartic": "quartic term",
    "quintic": "quintic term",
    "nonlinearity": "nonlinearity, largest",
    "asymmetry": "asymmetry, + less −",
}
_PICTURES = {
    "response": (
        "The response less its best straight line. Where the band includes zero, the line is as good as the curve.",
        "Deviation of the response from a straight line against the rate of the table.",
    ),
    "steps": (
        "Residuals of each step: diverging repeats show here.",
        "Residuals of the steps in chronological order.",
    ),
    "drift": ("The slow noise of the sensor through the record.", "Slow noise against time."),
    "noise": ("Whether the noise grows with the rate.", "Noise relative to the model, against the rate."),
}


def view(document: ResultDocument[RateTableEstimate]) -> Page:
    """The page of a run on a rate table."""
    result = document.result
    return result_page(
        document,
        title=result.source or "Rate table",
        kicker="Response to a rate table",
        facts=[
            ("Channel", result.channel),
            ("Table", _turned(result)),
            ("Length", duration(result.duration)),
            ("Fitted", _fitted(result)),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "pictures": ("Pictures", pictures(result, _PICTURES)),
            "steps": ("Steps", _steps(result)),
            "frequencies": ("Bandwidth", [*_frequencies(result)]),
            "checks": ("Checks", [*_checks(result)]),
            "findings": ("Findings", findings_of(document)),
            "record": ("Record", [_record(document)]),
            "method": ("Method", _method()),
        },
    )


# -- verdict ----------------------------------------------------------------------------------------------


def _verdict(result: RateTableEstimate) -> Iterator[PageBlock]:
    yield verdict_banner(result.verdict, result.reason)
    yield from advice(words for words in (*result.notes, *result.advice) if words not in result.reason)
    percent = f"{100 * result.confidence:g} % interval"
    lines = {p.name: _line(p, result) for p in result.parameters}
    _, value, ends, unit, _ = lines["scale factor"]
    if ends:
        _, error, of_error, its_unit, _ = lines.get("scale-factor error", ("", "", "", "", ""))
        beside = f"{error} {its_unit} from nominal {of_error}" if error else ""
        head = f"scale factor{', ' if unit else ''}{unit}"
        yield Hero(value, head, f"{percent} {ends}", beside, result.verdict.tone)
    yield from table(
        ("Response", "Value", percent, "Unit", "Answer"),
        list(lines.values()),
        caption="Curvature ratios are relative to the scale factor times the largest rate.",
        kept=[name == "scale factor" for name in lines],
    )
    yield from _budget(result)


def _line(p: ResponseParameter, result: RateTableEstimate) -> tuple[str, str, str, str, str]:
    """Name, value, interval, unit, and whether it was seen, in people's units."""
    unit, factor = _unit(p, result)
    label = capitalised(_LABELS.get(p.name, p.name))
    if not math.isfinite(p.value + p.lower + p.upper):
        unknown = result.asymmetry_unknown if p.name == "asymmetry" else "not determined"
        return label, "–", "", unit, unknown
    middle, lower, upper = interval(*(v / factor for v in (p.value, p.lower, p.upper)))
    return label, middle, f"[{lower}, {upper}]", unit, _answer(p, result, abs(factor))


def _answer(p: ResponseParameter, result: RateTableEstimate, factor: float) -> str:
    if p.name in _NEVER_RESOLVED:
        return ""
    if p.status is QuantityStatus.UPPER_LIMIT and p.limit is not None:
        return f"not resolved: below {number(p.limit / factor, 2)}"
    if p.name == "nonlinearity" and result.span:
        return f"{number(100 * p.value * result.full_scale / result.span, 2)} % of the span"
    return "resolved"


def _unit(p: ResponseParameter, result: RateTableEstimate) -> tuple[str, float]:
    """Unit of a parameter and its SI value."""
    if p.name == "scale factor":
        return scale_unit(result)
    if p.name.startswith("bias"):
        text, factor = display_unit(result.kind, "mean", result.unit)
        return (f"{text}/K", factor) if p.unit.endswith("/K") else (text, factor)
    if p.unit == "1":
        of_scale = p.name in _LABELS and p.name != "asymmetry"
        return ("ppm of full scale" if of_scale else "ppm"), PPM
    if p.unit == "s":
        return ("s", 1.0) if abs(p.value) >= 0.9995 else ("ms", 1e-3)
    return {"1/K": ("ppm/K", PPM), "rad": ("mrad", 1e-3)}.get(p.unit, (p.unit, 1.0))


def _budget(result: RateTableEstimate) -> Iterator[PageBlock]:
    largest = max((v for v in result.budget.values() if math.isfinite(v)), default=0.0)
    budget = [(name, v) for name, v in result.budget.items() if v > _NEGLIGIBLE * largest]
    if len(budget) < 2:
        yield Text(_UNSTATED, note=True, brief=True)
        return
    whole = math.sqrt(sum(v**2 for _, v in budget))
    yield from table(
        ("Source", "Standard uncertainty of the scale factor, ppm"),
        [(name, number(v / PPM, 3)) for name, v in (*budget, (TOGETHER, whole))],
        caption="Uncertainty budget.",
        kept=[False] * len(budget) + [True],
    )


# -- steps, bandwidth, checks, record ---------------------------------------------------------------------


def _steps(result: RateTableEstimate) -> list[PageBlock]:
    if not result.steps:
        return []
    unit, _ = output_unit(result)
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
    cells = []
    for row in rows(result):
        step, start, _, *values, _, why = map(str, row.values())
        cells.append((step, start, *values, why or "used"))
    shown = table(heads, cells, caption="Residuals in ppm of full scale.")
    return [Details(plural(len(cells), "step"), shown)]


def _frequencies(result: RateTableEstimate) -> Iterator[PageBlock]:
    if not result.frequencies:
        return
    lowest = min(result.frequencies, key=lambda point: point.frequency)
    lines = [
        (
            f"{point.frequency:g}",
            number(point.amplitude / DEG, 4),
            f"{point.gain / lowest.gain:.6f}",
            number(point.gain_sd / lowest.gain, 2),
            f"{point.phase / DEG:.3f}",
            number(point.phase_sd / DEG, 2),
        )
        for point in result.frequencies
    ]
    heads = (
        "Frequency, Hz",
        "Amplitude, deg/s",
        f"Gain over {lowest.frequency:g} Hz",
        "sd",
        "Phase, deg",
        "sd",
    )
    yield from drawn(
        "frequency", result, "Gain and phase.", "Gain and phase against frequency.", view="frequency"
    )
    yield from table(heads, lines, caption="A clock offset looks like a phase that grows with frequency.")


def _checks(result: RateTableEstimate) -> Iterator[PageBlock]:
    yield from checks_table(check_wordings(result.checks))
    aided, size = result.aided, result.full_output * PPM
    if aided is None:
        return
    words = f"Reference-aided: {sentence(aided.statement)}"
    if math.isfinite(aided.raw) and size:
        apart = abs(aided.scale / result["scale factor"].value - 1) / PPM
        words += (
            f" It takes the residuals of the steps from {number(aided.raw / size, 3)} to "
            f"{number(aided.corrected / size, 3)} ppm of full scale (root mean square); the scale factor of its "
            f"samples is {number(apart, 2)} ppm from that of the regression."
        )
    yield Text(words, note=True)


def _record(document: ResultDocument[RateTableEstimate]) -> PageBlock:
    result = document.result
    return pairs(
        [
            ("Table", _turned(result)),
            ("Fitted", _fitted(result)),
            ("Length", f"{duration(result.duration)}, in means over {duration(result.block)}"),
            ("Noise", f"{document.model_name or result.model_source}: {model_words(result.model)}"),
        ]
    )


def _turned(result: RateTableEstimate) -> str:
    """How the table turned."""
    motion, most = result.table, f"up to {number(result.full_scale / DEG, 3)} deg/s"
    if motion.frequency is not None:
        low, high = float(motion.frequency.min()), float(motion.frequency.max())
        of = f"{number(low, 3)} Hz" if low == high else f"{number(low, 3)} to {number(high, 3)} Hz"
        return f"{plural(motion.frequency.size, 'sinusoid')} of {of}, {most}"
    if not result.steps:
        return f"{motion.samples} {motion.quantity}s at intervals of {duration(motion.interval)}, {most}"
    left = "the changes lie between the steps"
    if result.dead_time:
        left = f"{duration(result.dead_time)} left out after each change"
    used, every = sum(step.used for step in result.steps), len(result.steps)
    count = plural(every, "step") if used == every else f"{used} of {every} steps used"
    return f"{count} {most}, {left}"


def _fitted(result: RateTableEstimate) -> str:
    if result.nonlinearity == "sign":
        return "two straight lines that meet at zero"
    return (
        "a straight line" if result.nonlinearity == "1" else f"a polynomial of degree {result.nonlinearity}"
    )


def _method() -> list[PageBlock]:
    return [
        Text(
            "The output of the sensor against the table rate x, with u = x over the largest rate and "
            "noise from the model:"
        ),
        *equation("rate_table"),
        Text(
            "Level, slope and curvature are fitted by generalized least squares. The best straight line "
            "is removed from the curvature, so the scale factor is the slope of the best straight line "
            "through the response; the bias is the response at rest. If the rate changes continuously, "
            "the delay between the clocks is a further coefficient, and its uncertainty enters all the others."
        ),
        *equation("least_squares"),
        References([ROSENBERG]),
    ]


def rows(result: RateTableEstimate) -> Iterator[dict[str, object]]:
    """One row of a table for each step, residuals in ppm of full scale."""
    text, factor = output_unit(result)
    key = "".join(c if c.isalnum() else "_" for c in text)
    size = result.full_output

    def ppm(value: float) -> str:
        return f"{value / size / PPM:.4g}" if size and math.isfinite(value) else ""

    for i, step in enumerate(result.steps, 1):
        yield {
            "number": i,
            "start_s": f"{step.start:.4f}",
            "stop_s": f"{step.stop:.4f}",
            "rate_deg_s": f"{step.rate / DEG:.9g}",
            f"mean_{key}": f"{step.mean / factor:.9g}" if math.isfinite(step.mean) else "",
            "residual_ppm": ppm(step.residual),
            "sd_ppm": ppm(step.sd),
            "corrected_ppm": ppm(step.corrected),
            "used": "yes" if step.used else "no",
            "why": step.why,
        }
