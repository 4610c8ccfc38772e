# SPDX-License-Identifier: BSD-3-Clause
"""A filtered record: measured and corrected samples, the drift that was removed, and whether the model holds."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from allanite.filtering.kalman import Consistency, FilterEstimate, FilterVerdict
from allanite.filtering.kalman.series import SeriesEnvelope
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import number
from allanite.views.figures.panel import (
    MARKERS,
    SERIES,
    Array,
    Axis,
    Curve,
    Envelope,
    Label,
    Panel,
    around,
)
from allanite.views.figures.records import clock

__all__ = ["VIEWS", "drift_panel", "series_panels", "terms_panel", "whiteness_panel"]

VIEWS = ("whole", "series", "drift", "terms", "whiteness")
_BAND = 2.0  # standard deviations
_NAMES = {
    "gauss_markov": "Gauss-Markov",
    "random_walk": "random walk",
    "flicker": "flicker",
    "ramp": "ramp",
    "level": "level",
}


def series_panels(result: FilterEstimate) -> Iterator[Panel]:
    """Measured and corrected samples, one above the other and equally scaled."""
    unit, factor = display_unit(result.kind, "sd", result.unit)
    how = "smoothed" if result.smoothed else "filtered"
    x, second = _axis(result)
    for samples, title, colour in (
        (result.measured, "Measured", "guide"),
        (result.corrected, f"Corrected: the drift removed ({how})", "z"),
    ):
        if samples is not None:
            shown = Envelope(
                x=samples.t / second,
                low=samples.low / factor,
                high=samples.high / factor,
                label="lowest and highest sample of each block",
                colour=colour,
            )
            yield Panel(title=title, x=x, y=Axis(label=f"Samples [{unit}]"), envelopes=(shown,))


def drift_panel(result: FilterEstimate) -> Panel:
    """The drift with its band."""
    unit, factor = display_unit(result.kind, "mean", result.unit)
    x, second = _axis(result)
    t, drift = _centre(result.drift)
    _, sd = _centre(result.drift_sd)
    half = _BAND * sd / factor
    y = drift / factor
    curve = Curve(
        x=t / second,
        y=y,
        lower=y - half,
        upper=y + half,
        label="drift",
        colour="z",
        band_label=f"± {_BAND:g} sd",
    )
    return Panel(
        title="Drift: the sum of all slow noise",
        x=x,
        y=Axis(label=f"Drift [{unit}]", limits=_limits([(t, y, half)])),
        curves=(curve,),
        labels=(Label(x=0.0, y=0.0, text="", colour="guide", place="level"),),
        height=0.3,
        key="above",
    )


def terms_panel(result: FilterEstimate) -> Panel:
    """Each slow term by itself, with its band; the level has none of its own here."""
    unit, factor = display_unit(result.kind, "mean", result.unit)
    x, second = _axis(result)
    curves, parts = [], []
    slow = {name: series for name, series in result.terms.items() if name != "level"}
    for i, (name, series) in enumerate(slow.items()):
        t, y, half = series.t, series.value / factor, _BAND * series.sd / factor
        parts.append((t, y, half))
        curves.append(
            Curve(
                x=t / second,
                y=y,
                lower=y - half,
                upper=y + half,
                label=_NAMES.get(name, name),
                colour=SERIES[(2 + i) % len(SERIES)],
                marker=MARKERS[i % len(MARKERS)],
                band_label="" if i else f"± {_BAND:g} sd",
            )
        )
    return Panel(
        title="What the drift consists of",
        x=x,
        y=Axis(label=f"At the end of a sample [{unit}]", limits=_limits(parts)),
        curves=tuple(curves),
        height=0.3,
        key="above",
    )


def whiteness_panel(result: FilterEstimate) -> Panel:
    """Correlation of the innovations at each lag, with the band in which it lies if they are white."""
    tests = result.consistency
    r = np.array(tests.correlations)
    lags = np.arange(1.0, r.size + 1)
    bound = 1.96 / math.sqrt(tests.count) if tests.count else math.nan
    reach = max(1.6 * bound if bound == bound else 0.0, 1.15 * float(np.nanmax(np.abs(r), initial=0.0)), 1e-6)
    ticks = tuple((float(lag), f"{lag}") for lag in range(1, r.size + 1) if lag == 1 or lag % 5 == 0)
    edge = np.array([0.4, r.size + 0.6])
    band = Curve(
        x=edge,
        y=np.zeros(2),
        lower=np.full(2, -bound),
        upper=np.full(2, bound),
        label="",
        colour="guide",
        style="thin",
        band_label="19 of 20 lie here if the model holds",
    )
    stems = Curve(
        x=lags,
        y=r,
        lower=np.minimum(r, 0.0),
        upper=np.maximum(r, 0.0),
        bars=True,
        label="correlation of the innovations",
        colour="z",
        style="none",
        marker="circle",
    )
    return Panel(
        title=_nis(tests),
        x=Axis(label="Lag [samples]", limits=(0.4, r.size + 0.6), names=ticks),
        y=Axis(label="Correlation [1]", limits=(-reach, reach)),
        curves=(band, stems),
        height=0.26,
        key="above",
    )


def _nis(tests: Consistency) -> str:
    if tests.verdict is FilterVerdict.UNTESTED:
        return "Innovations: not tested"
    verdict = "consistent" if tests.consistent else "not consistent"
    ends = f"{number(tests.nis_lower, 4)} to {number(tests.nis_upper, 4)}"
    return f"Innovations {verdict}: NIS {number(tests.nis, 4)}, {ends} if the model holds"


def _axis(result: FilterEstimate) -> tuple[Axis, float]:
    duration = result.samples / result.rate
    unit, second = clock(duration)
    axis = Axis(label=f"Time since the first sample [{unit}]", limits=(0.0, duration / second))
    return axis, second


def _centre(envelope: SeriesEnvelope) -> tuple[Array, Array]:
    """Middle of an envelope so narrow that it is a line."""
    return envelope.t, (envelope.low + envelope.high) / 2


def _limits(parts: list[tuple[Array, Array, Array]]) -> tuple[float, float] | None:
    """Limits that hold every line, and the bands once the first tenth of the record is over."""
    ends = [np.zeros(1)]
    for t, y, half in parts:
        late = t > t[0] + 0.1 * (t[-1] - t[0]) if t.size else np.zeros(0, dtype=np.bool_)
        ends += [y, (y - half)[late], (y + half)[late]]
    return around(*ends)
