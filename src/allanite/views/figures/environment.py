# SPDX-License-Identifier: BSD-3-Clause
"""Effects of the environment: the signal against the temperature, by branch; Allan deviation before and after; time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import cast

import numpy as np

from allanite.quantities.display_units import display_unit
from allanite.stability.environment.results import Environment, EnvironmentFacts
from allanite.views.figures.panel import Array, Axis, Curve, Label, Panel, positive_range
from allanite.views.figures.records import clock

__all__ = ["VIEWS", "branch_panels", "deviation_panels", "estimates_of", "time_panels"]

VIEWS = ("whole", "temperature", "deviation", "time")


def estimates_of(result: object) -> Sequence[EnvironmentFacts]:
    """Those of an `Environment`, or one alone."""
    return result.channels if isinstance(result, Environment) else [cast(EnvironmentFacts, result)]


def _unit(estimate: EnvironmentFacts) -> tuple[str, float]:
    return display_unit(estimate.kind, "adev", estimate.unit)


def _centred(estimate: EnvironmentFacts) -> tuple[Array, Array]:
    """Signal and residual in people's unit, less the mean of the signal."""
    _, factor = _unit(estimate)
    signal, residual = (part / factor for part in (estimate.series.signal, estimate.series.residual))
    middle = float(np.nanmean(signal))
    return signal - middle, residual - middle


def branch_panels(estimate: EnvironmentFacts) -> list[Panel]:
    """The signal over the temperature, warming and cooling apart, and what the coefficients make of it."""
    if estimate.thermometer is None:
        return []
    unit, factor = _unit(estimate)
    signal, residual = _centred(estimate)
    settling = estimate.series.settling / factor
    temperature, branch = estimate.series.temperature, estimate.series.branch
    curves = [
        Curve(
            x=temperature[which],
            y=(signal - settling)[which],
            label=label,
            colour=colour,
            style="none",
            marker=marker,
        )
        for which, label, colour, marker in (
            (branch > 0.5, "warming", "x", "triangle"),
            (branch < -0.5, "cooling", "z", "down"),
            (np.abs(branch) <= 0.5, "between", "guide", "circle"),
        )
        if which.any()
    ]
    if (np.abs(signal - residual - settling) > 0).any():
        order, off = np.argsort(temperature), signal - residual - settling
        curves.append(Curve(x=temperature[order], y=off[order], label="removed", colour="ink"))
    name = estimate.thermometer.channel
    without = ", without the warm-up" if settling.any() else ""
    return [
        Panel(
            title=f"{estimate.channel}: signal against {name}{without}",
            x=Axis(label=f"Temperature [{estimate.thermometer.unit or 'unit'}]"),
            y=Axis(label=f"Signal, mean removed [{unit}]"),
            curves=tuple(curves),
            height=0.5,
            key="above",
        )
    ]


def deviation_panels(estimate: EnvironmentFacts) -> list[Panel]:
    """Allan deviation before and after, and of what was removed with its error; nothing where nothing was."""
    correction = estimate.correction
    if correction is None:
        return []
    unit, factor = _unit(estimate)
    tau = correction.tau
    before, after, off, error = (
        part / factor
        for part in (correction.before, correction.after, correction.deviation, correction.error)
    )
    model = estimate.model.adev(tau) / factor
    curves = (
        Curve(x=tau, y=before, label="before", colour="x", marker="circle"),
        Curve(x=tau, y=after, label="after", colour="z", marker="square"),
        Curve(x=tau, y=model, label="noise of the regression", colour="ink", style="dashed"),
        Curve(
            x=tau,
            y=off,
            lower=np.maximum(off - error, 1e-3 * off),
            upper=off + error,
            label="removed, ± 1 sd",
            colour="orange",
            style="thin",
        ),
    )
    low, high = positive_range(before, after)
    labels: tuple[Label, ...] = ()
    if correction.longest <= tau[-1]:
        labels = (
            Label(
                x=correction.longest, y=low / 3, text="not fitted from here on", colour="guide",
                side="above left", place="line",
            ),
        )  # fmt: skip
    return [
        Panel(
            title=f"{estimate.channel}: Allan deviation of block means, before and after",
            x=Axis(label="Averaging time [s]", log=True),
            y=Axis(label=f"Allan deviation [{unit}]", log=True, limits=(low / 3, 2 * high)),
            curves=curves,
            labels=labels,
            height=0.5,
            key="above",
        )
    ]


def time_panels(estimate: EnvironmentFacts) -> list[Panel]:
    """The signal and the residual over time."""
    unit, _ = _unit(estimate)
    signal, residual = _centred(estimate)
    time = estimate.series.time
    words, second = clock(float(time[-1]))
    curves = [Curve(x=time / second, y=signal, label="signal", colour="guide", style="thin")]
    if estimate.taken_off:
        curves.append(Curve(x=time / second, y=residual, label="residual", colour="z"))
        curves.append(Curve(x=time / second, y=signal - residual, label="removed", colour="x"))
    return [
        Panel(
            title=f"{estimate.channel}: over time",
            x=Axis(label=f"Time since the first sample [{words}]"),
            y=Axis(label=f"Signal, mean removed [{unit}]"),
            curves=tuple(curves),
            height=0.36,
            key="above",
        )
    ]
