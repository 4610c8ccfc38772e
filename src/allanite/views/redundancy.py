# SPDX-License-Identifier: BSD-3-Clause
"""What a combination says: faults, weights, the gain over the best sensor, and the noise that sensors share."""

from __future__ import annotations

import math
from collections.abc import Iterator

from allanite.experiments.redundancy import Combination, SensorFault
from allanite.experiments.redundancy.verdict import FaultKind
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval, number
from allanite.quantities.quantity import interval_words
from allanite.study.result_document import ResultDocument
from allanite.views.blocks import Page, PageBlock, References, Text, equation, pairs, table
from allanite.views.result_page import advice, findings_of, pictures, result_page, verdict_banner
from allanite.views.wording.rates import model_words

__all__ = ["rows", "view"]

#: Averaging times at which the gain is stated: from the shortest on, so many of them, and pairs that are listed.
_STEPS, _MOST_PAIRS = 4, 10

_PICTURES = {
    "parity": "Parity of the sensors over time: faults exceed the threshold.",
    "deviation": "Allan deviation of the combined axes and of the best sensor.",
    "gain": "Improvement over the best sensor.",
}
_REFERENCES = (
    (
        "A. C. Aitken, “On least squares and linear combination of observations”, Proc. R. Soc. Edinburgh 55 (1935) "
        "42."
    ),
    (
        "J. E. Potter, M. C. Suman, “Thresholdless redundancy management with arrays of skewed instruments”, "
        "AGARDograph 224 (1977)."
    ),
    (
        "R. K. Mehra, J. Peschon, “An innovations approach to fault detection and diagnosis in dynamic systems”, "
        "Automatica 7 (1971) 637."
    ),
)


def view(document: ResultDocument[Combination]) -> Page:
    """The page of a combination."""
    result = document.result
    return result_page(
        document,
        title=result.source or "Combined sensors",
        kicker="Redundant sensors as one",
        facts=[
            ("Sensors", str(len(result.channels))),
            ("Axes", ", ".join(result.axes)),
            ("Length", duration(result.duration)),
        ],
        sections={
            "verdict": ("Verdict", [*_verdict(result)]),
            "pictures": ("Pictures", pictures(result, _PICTURES)),
            "noise": ("Weights and noise", [*_noise(result)]),
            "findings": ("Findings", findings_of(document)),
            "method": ("Method", _method()),
        },
    )


# -- verdict ----------------------------------------------------------------------------------------------


def _verdict(result: Combination) -> Iterator[PageBlock]:
    yield verdict_banner(result.verdict, result.reason, result.channels)
    yield from table(
        ("Fault", "Sensor", "From", "To", "Size"),
        [
            (f.kind, f.who, f"{f.start:.6g} s", f"{f.stop:.6g} s", _size(f, result.kind))
            for f in result.faults
        ],
    )
    yield from advice(result.advice)
    lengths = ", ".join(duration(w.length) for w in result.parity.windows)
    alarms = f"{100 * result.false_alarm:g} % of records without a fault give an alarm"
    yield pairs(
        [
            ("Sensors", ", ".join(result.channels)),
            ("Weights for", f"averages over {duration(result.averaging)}"),
            ("Isolation", result.isolation),
            ("Parity", f"{result.parity.dof} in windows of {lengths}; {alarms}"),
            ("Noise of the parity", f"{number(result.noise_ratio, 3)} times that of the models"),
            ("Length", duration(result.duration)),
        ]
    )


def _size(fault: SensorFault, kind: str) -> str:
    size, sd = fault.size, fault.size_sd
    if fault.kind is FaultKind.NOISE and not math.isnan(size):
        return f"{number(size, 2)} times the noise"
    if math.isnan(size + sd) or fault.kind in (FaultKind.STUCK, FaultKind.OTHER):
        return ""
    unit, factor = display_unit(kind, "mean")
    if fault.kind is FaultKind.DRIFT:
        unit, factor = f"{unit} per hour", factor / 3600
    middle, _, _ = interval(size / factor, (size - sd) / factor, (size + sd) / factor)
    return f"{middle} ± {number(sd / factor, 2)} {unit}"


# -- weights and noise ------------------------------------------------------------------------------------


def _noise(result: Combination) -> Iterator[PageBlock]:
    unit, factor = display_unit(result.kind, "mean")
    yield from table(
        ("Sensor", *(f"for {axis}" for axis in result.axes), f"differs by [{unit}]"),
        [
            (
                name,
                *(f"{row[i]:+.3f}" for row in result.weights),
                number(float(result.differences[i]) / factor, 3),
            )
            for i, name in enumerate(result.channels)
        ],
        caption="Weight of each sensor in each axis. Constant differences are removed first.",
    )
    percent = f"{100 * result.confidence:g} % interval"
    yield from table(
        ("Averaging", "Axis", "Allan deviation", f"Gain, {percent}", "Predicted", "Lost"),
        [*_gains(result)],
        caption="Gain over the best sensor; lost: the further gain with weights for that averaging time.",
    )
    yield from table(
        ("Sensors", "Correlation", "of means over"),
        [
            (f"{p.first} and {p.second}", f"{r.value:.3f} [{r.lower:.3f}, {r.upper:.3f}]", duration(p.tau))
            for p in result.sharing[:_MOST_PAIRS]
            for r in [p.correlation]
        ],
        caption="Noise that is shared.",
    )
    models = zip(result.axes, result.models, strict=True)
    yield pairs([(f"Noise of {axis}", model_words(model)) for axis, model in models])


def _gains(result: Combination) -> Iterator[tuple[str, ...]]:
    """Averaging time, axis, deviation of the combined axis, gain over the best sensor, predicted, loss."""
    unit, factor = display_unit(result.kind, "adev")
    for k in _times(result):
        for m, axis in enumerate(result.axes):
            measured = float(result.measured[k, m])
            shown = float(result.predicted[k, m]) if math.isnan(measured) else measured
            gain = (float(ends[k, m]) for ends in (result.gain, result.gain_lower, result.gain_upper))
            yield (
                duration(float(result.tau[k])),
                axis,
                f"{number(shown / factor, 3)} {unit}",
                interval_words(*gain),
                number(float(result.gain_predicted[k, m]), 3),
                f"{100 * max(float(result.loss[k, m]) - 1, 0.0):.1f} %",
            )


def _times(result: Combination) -> list[int]:
    count = len(result.tau)
    near = min(range(count), key=lambda k: abs(math.log(result.tau[k] / result.averaging)))
    step = max(1, math.ceil(count / _STEPS))
    return sorted({*range(0, count, step), near})


def _method() -> list[PageBlock]:
    return [
        Text("Each sensor gives the quantity along its axis, plus its own noise:"),
        *equation("redundant"),
        Text(
            "The weights W are the best linear unbiased ones for one averaging time, constant in time: "
            "the measurand passes unchanged at every frequency, and the noise of the combined axes is a "
            "sum of terms that every other command takes. The parity p does not depend on the measurand. "
            "A filter of the states of all sensors whitens it, so each window is an independent "
            "chi-square; the overall false-alarm rate stays below the stated rate. The fault that raises "
            "the likelihood most explains an alarm: step, drift, spike, increased noise. Sensors that "
            "explain it nearly as well remain candidates."
        ),
        References(_REFERENCES),
    ]


def rows(result: Combination) -> Iterator[dict[str, object]]:
    """One row of a table for each sensor: what it gives to each axis."""
    for i, name in enumerate(result.channels):
        weights = zip(result.axes, result.weights, strict=True)
        yield {"sensor": name, **{axis: f"{w[i]:.9f}" for axis, w in weights}}
