# SPDX-License-Identifier: BSD-3-Clause
"""Allan curves: with 95 % band, model and terms, slope guides, reading points, and upper limits as arrows.

Reading points are those of IEEE Std 952-1997, annex C: tau = sqrt(3) for Q, 1 for N, the minimum for B (value over
0.664), 3 for K, sqrt(2) for R. At these places the line of the term has the height of its coefficient.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from allanite.fitting.sensor_curves import OverFloor
from allanite.noise import (
    BY_LETTER,
    GM_PEAK_TAU,
    GaussMarkov,
    NoiseModel,
    TermType,
)
from allanite.noise.allan import AllanCurve
from allanite.noise.allan.channel_curve import ChannelCurve
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import number
from allanite.study.results import ChannelFloor, ChannelStudy
from allanite.views.figures.panel import (
    MARKERS,
    SERIES,
    Axis,
    Curve,
    Guide,
    Label,
    Limit,
    Panel,
    decades,
    legend_entry,
    positive_range,
)
from allanite.views.wording.powers import raised_powers
from allanite.views.wording.study import ChannelGroup, reading

__all__ = [
    "STATISTICS",
    "channel_panels",
    "curve_panels",
    "deviations_panel",
    "floor_curves",
    "group_panel",
    "measured_curve",
    "model_curve",
    "model_panel",
    "over_floor_panels",
    "series_colours",
    "tau_axis",
]

Limits = tuple[float, float]
Frame = tuple[Limits, Limits]
_Part = TypeVar("_Part")

STATISTICS = {
    "adev": "Allan deviation",
    "oadev": "Allan deviation",
    "mdev": "Modified Allan deviation",
    "tdev": "Time deviation",
    "hdev": "Hadamard deviation",
    "ohdev": "Hadamard deviation",
    "totdev": "Total deviation",
    "haar": "Haar wavelet deviation",
    "robust": "Robust Allan deviation",
    "theo1": "Theo1 deviation",
    "theobr": "Theo1 deviation, bias removed",
    "theoh": "ThêoH deviation",
}
_OF_MODEL = ("adev", "oadev", "totdev", "robust", "theobr", "theoh")  # what a term's Allan variance describes
_SLOPE = {"Q": -1.0, "N": -0.5, "B": 0.0, "K": 0.5, "R": 1.0}
_SLOPE_NAME = {-1.0: "−1", -0.5: "−1/2", 0.0: "0", 0.5: "+1/2", 1.0: "+1"}
#: Terms of a model in its name.
_NAMED = {"q": "Gauss-Markov", "amplitude": "line"}
_READ_AT = {"Q": math.sqrt(3), "N": 1.0, "K": 3.0, "R": math.sqrt(2)}
_SIDE = {"Q": "below left", "N": "above right", "B": "below", "K": "below right", "R": "below right"}
_LANDMARKS = ((60.0, "1 min"), (3600.0, "1 h"), (86400.0, "1 d"))
_ROOM_BELOW = 1.6  # decades that a reading point may lie below the lowest value of the curve
_ROOM_LIMITS = 1.0  # decades below the curve where there are limits to show
_ROOM_ARROW = 0.4  # decades between the arrow of a limit and the lower edge
_ROOM_BESIDE = 1.0  # decades that it may lie outside the lags
_LETTERS = {"x": "x", "y": "y", "z": "z", "0": "x", "1": "y", "2": "z"}


def series_colours(names: Sequence[str]) -> list[tuple[str, str]]:
    """Colour and marker of each channel: by its axis letter if all have different ones, else in their order."""
    axes = [_LETTERS.get(name.lower().rstrip("])_ ")[-1:], "") for name in names]
    if all(axes) and len(set(axes)) == len(axes):
        return [(axis, MARKERS[SERIES.index(axis)]) for axis in axes]
    return [(SERIES[i % len(SERIES)], MARKERS[i % len(MARKERS)]) for i in range(len(names))]


# -- panels -----------------------------------------------------------------------------------------------


def channel_panels(group: ChannelGroup[ChannelStudy]) -> list[Panel]:
    """One panel per channel: its curve, its model with all terms, and what it bounds; all in one common frame."""
    looks = series_colours([c.name for c in group.channels])
    parts = [_ChannelParts(c, look) for c, look in zip(group.channels, looks, strict=True)]
    frames = [p.frame for p in parts]
    common = _union([f[0] for f in frames]), _union([f[1] for f in frames])
    return [p.panel(common) for p in parts]


class _ChannelParts:
    """What the panel of one channel consists of, before the frame is known."""

    def __init__(self, channel: ChannelStudy, look: tuple[str, str]) -> None:
        self.channel, curve = channel, channel.curve
        self.unit, factor = _unit(curve.statistic, channel.kind, channel.unit)
        models = channel.models if curve.statistic in _OF_MODEL else ()
        self.data = measured_curve(curve, channel.name, factor, look)
        self.apart = () if channel.floor is None else floor_curves(channel.floor, factor)
        self.lines = [model_curve(curve, m, factor, i) for i, m in enumerate(models)]
        minimum = _minimum(self.lines[0] if models else self.data)
        self.marks = [
            _Mark.of(t, factor, minimum, _estimate_text(models[0], t, channel)) for t in _terms(models)
        ]
        self.bounds = _bounds(models[0], channel, factor, minimum) if models else []

    @property
    def frame(self) -> Frame:
        x, y = _frame([self.data, *self.apart], [m.point for m in self.marks if m.point])
        lowest = _minimum(self.data)[1]
        return (x, (min(y[0], lowest / 10**_ROOM_LIMITS), y[1])) if self.bounds else (x, y)

    def panel(self, frame: Frame) -> Panel:
        return Panel(
            title=self.channel.name,
            x=tau_axis(frame[0]),
            y=_deviation_axis(self.channel.curve.statistic, self.unit, frame[1]),
            curves=(
                self.data,
                *self.apart,
                *self.lines,
                *(m.curve(frame) for m in self.marks if m.slope is None),
            ),
            guides=_made(m.guide(frame) for m in self.marks),
            labels=_made(m.label(frame) for m in self.marks),
            limits=_apart(self.bounds, frame),
            square=True,
        )


def group_panel(group: ChannelGroup[ChannelStudy]) -> Panel:
    """All channels of one kind together, each with its model; guides at the mean coefficient of the axes."""
    statistic = group.channels[0].curve.statistic
    unit, factor = _unit(statistic, group.kind, group.unit)
    looks = series_colours([c.name for c in group.channels])
    data: list[Curve] = []
    lines: list[Curve] = []
    terms: list[TermType] = []
    for channel, look in zip(group.channels, looks, strict=True):
        band = "" if data else "95 % interval"
        measured = measured_curve(channel.curve, channel.name, factor, look, band)
        data.append(replace(measured, axis=channel.name))
        if channel.models and statistic in _OF_MODEL:
            line = model_curve(channel.curve, channel.models[0], factor, 0)
            lines.append(replace(line, label="", axis=channel.name))
            terms += _terms(channel.models)
    marks = [_Mark.of(t, factor, _minimum(data[0]), "") for t in _mean_terms(terms)]
    frame = _frame(data, [])
    return Panel(
        title=group.title,
        x=tau_axis(frame[0]),
        y=_deviation_axis(statistic, unit, frame[1]),
        curves=(*data, *lines, *([legend_entry("model")] if lines else [])),
        guides=_made(m.guide(frame) for m in marks),
        square=True,
    )


def curve_panels(curve: AllanCurve, model: NoiseModel | None = None) -> list[Panel]:
    """An `AllanCurve` alone: a panel for the channels of each unit, with a key of the five slopes.

    A model is drawn over the channels of the first panel.
    """
    members: dict[tuple[str, float], list[int]] = {}
    for i, channel in enumerate(curve.channels):
        members.setdefault(_unit(curve.statistic, channel.kind, channel.unit), []).append(i)
    panels = [_curve_panel(curve, which, unit, factor) for (unit, factor), which in members.items()]
    if model is not None:
        factor = next(iter(members))[1]
        line = model_curve(ChannelCurve.of(curve[curve.names[0]]), model, factor, 0)
        panels[0] = replace(panels[0], curves=(*panels[0].curves, line))
    return panels


def _curve_panel(curve: AllanCurve, which: Sequence[int], unit: str, factor: float) -> Panel:
    names = [curve.channels[i].name for i in which]
    data: list[Curve] = []
    for name, look in zip(names, series_colours(names), strict=True):
        band = "" if data else f"{100 * curve.confidence:g} % interval"
        data.append(measured_curve(ChannelCurve.of(curve[name]), name, factor, look, band))
    frame = _frame(data, [])
    return Panel(
        title=", ".join(names),
        x=tau_axis(frame[0]),
        y=_deviation_axis(curve.statistic, unit, frame[1]),
        curves=tuple(data),
        guides=_slope_key(frame),
        square=True,
    )


def over_floor_panels(curve: OverFloor) -> list[Panel]:
    """An `OverFloor`: measured, instrument and sensor, a panel for each channel."""
    panels = []
    for channel in curve.measured.channels:
        unit, factor = _unit("oadev", channel.kind, channel.unit)
        measured, looks = ChannelCurve.of(curve.measured[channel.name]), series_colours([channel.name])[0]
        floor = ChannelFloor.of(curve, channel.name)
        data = [measured_curve(measured, "measured", factor, looks), *floor_curves(floor, factor)]
        frame = _frame(data, [])
        panels.append(
            Panel(
                title=channel.name,
                x=tau_axis(frame[0]),
                y=_deviation_axis("oadev", unit, frame[1]),
                curves=tuple(data),
                guides=_slope_key(frame),
                square=True,
            )
        )
    return panels


def model_panel(model: NoiseModel, tau: tuple[float, float] = (1e-2, 1e5)) -> Panel:
    """A noise model without data: total and terms between two averaging times [s]."""
    unit, factor = display_unit(model.kind, "adev", model.unit)
    taus = np.geomspace(*tau, 241)
    total = Curve(x=taus, y=np.sqrt(model.avar(taus)) / factor, label="model", colour="model", style="dashed")
    texts = {t.symbols[0]: _coefficient_text(t, model.kind, model.unit) for t in model.terms}
    marks = [_Mark.of(t, factor, _minimum(total), texts[t.symbols[0]]) for t in model.terms]
    frame = _frame([total], [m.point for m in marks if m.point])
    return Panel(
        title="Noise model",
        x=tau_axis(frame[0]),
        y=_deviation_axis("adev", unit, frame[1]),
        curves=(total, *(m.curve(frame) for m in marks if m.slope is None)),
        guides=_made(m.guide(frame) for m in marks),
        labels=_made(m.label(frame) for m in marks),
        square=True,
    )


# -- parts ------------------------------------------------------------------------------------------------


def _unit(statistic: str, kind: str, shown_in: str) -> tuple[str, float]:
    """Unit of a deviation; the time deviation has that of the integrated quantity."""
    return display_unit(kind, "Q" if statistic == "tdev" else "adev", shown_in)


def measured_curve(
    curve: ChannelCurve, label: str, factor: float, look: tuple[str, str], band: str = "95 % interval"
) -> Curve:
    """Measured deviations with their band; those outside the fit are hollow."""
    return Curve(
        x=curve.tau,
        y=curve.deviation / factor,
        lower=curve.lower / factor,
        upper=curve.upper / factor,
        hollow=~curve.used if curve.used.size else None,
        label=label,
        colour=look[0],
        marker=look[1],
        band_label=band,
    )


def floor_curves(floor: ChannelFloor, factor: float) -> tuple[Curve, Curve]:
    """The instrument's own curve, and what is left for the sensor; bars without a point are upper limits."""
    sensor, below = floor.sensor, floor.curve
    instrument = Curve(
        x=below.tau,
        y=below.deviation / factor,
        lower=below.lower / factor,
        upper=below.upper / factor,
        label="instrument",
        colour="guide",
        marker="square",
    )
    left = Curve(
        x=sensor.tau,
        y=sensor.deviation / factor,
        lower=np.where(np.isfinite(sensor.deviation), sensor.lower, np.nan) / factor,
        upper=sensor.upper / factor,
        bars=True,
        style="none",
        label="sensor",
        colour="other",
        marker="diamond",
    )
    return instrument, left


def model_curve(
    curve: ChannelCurve, model: NoiseModel, factor: float, rank: int, colour: str = "", label: str = ""
) -> Curve:
    """The model as these samples show it; the alternative family is dash-dotted."""
    averaged = curve.tau / curve.dt
    m = np.geomspace(averaged.min(), averaged.max(), 160)
    letters = [_NAMED.get(t.symbols[0], t.symbols[0]) for t in model.terms]
    named = f"model ({', '.join(letters)})" if letters else "model"
    return Curve(
        x=m * curve.dt,
        y=np.sqrt(model.avar_sampled(m, curve.dt, curve.sampling)) / factor,
        label=label or (named if rank == 0 else f"or: {named}"),
        colour=colour or ("model" if rank == 0 else "other"),
        style="dashed" if rank == 0 else "dashdot",
    )


def _terms(models: Sequence[NoiseModel]) -> list[TermType]:
    """Terms of the first model, those that a deviation shows as a line of their own."""
    return [t for m in models[:1] for t in m.terms if t.symbols[0] in {*BY_LETTER, "q"}]


def _mean_terms(terms: Iterable[TermType]) -> list[TermType]:
    """Power-law terms with the geometric mean of their coefficients over the channels."""
    means = []
    for symbol, make in BY_LETTER.items():
        values = [v for t in terms if t.symbols == (symbol,) and (v := getattr(t, symbol)) > 0]
        if values:
            means.append(make(**{symbol: float(np.exp(np.mean(np.log(values))))}))
    return means


def _estimate_text(model: NoiseModel, term: TermType, channel: ChannelStudy) -> str:
    """The coefficient of a term as it was estimated; "" where the record only bounds it."""
    symbol = "B_equiv" if isinstance(term, GaussMarkov) else term.symbols[0]
    known = {e.symbol: reading(channel.kind, channel.unit, e) for e in model.estimates}
    if symbol not in known:
        return _coefficient_text(term, channel.kind, channel.unit)
    text = f"{symbol} = {known[symbol].value} {known[symbol].unit}" if known[symbol].supported else ""
    if isinstance(term, GaussMarkov) and text and "T" in known and known["T"].supported:
        text += f", T_b = {known['T'].value} s"
    return text


def _coefficient_text(term: TermType, kind: str, shown_in: str) -> str:
    if isinstance(term, GaussMarkov):
        symbol, value = "B_equiv", term.B_equiv
    else:
        symbol, value = term.symbols[0], float(getattr(term, term.symbols[0]))
    unit, factor = display_unit(kind, symbol, shown_in)
    return f"{symbol} = {number(value / factor)} {unit}"


def _minimum(curve: Curve) -> tuple[float, float]:
    """Place and height of the lowest point of a curve."""
    good = np.isfinite(curve.y) & (curve.y > 0)
    if not good.any():
        return 1.0, 1.0
    lowest = int(np.argmin(np.where(good, curve.y, np.inf)))
    return float(curve.x[lowest]), float(curve.y[lowest])


def _bounds(
    model: NoiseModel, channel: ChannelStudy, factor: float, minimum: tuple[float, float]
) -> list[_Mark]:
    limits = []
    for estimate in model.estimates:
        make = BY_LETTER.get(estimate.symbol)
        if make and not estimate.supported and 0 < estimate.upper < math.inf:
            term = make(**{estimate.symbol: estimate.upper})
            shown = reading(channel.kind, channel.unit, estimate)
            limits.append(_Mark.of(term, factor, minimum, f"{shown.symbol} {shown.value} {shown.unit}"))
    return limits


class _Mark:
    """A term on the plane: a straight line with its reading point (a curve for Gauss-Markov)."""

    def __init__(self, term: TermType, factor: float, read_at: float, text: str) -> None:
        self.term, self.factor, self.read_at, self.text = term, factor, read_at, raised_powers(text)
        self.symbol = term.symbols[0]
        self.slope = _SLOPE.get(self.symbol)

    @classmethod
    def of(cls, term: TermType, factor: float, minimum: tuple[float, float], text: str) -> _Mark:
        at = (
            GM_PEAK_TAU * term.T
            if isinstance(term, GaussMarkov)
            else _READ_AT.get(term.symbols[0], minimum[0])
        )
        return cls(term, factor, at, text)

    def height(self, tau: float) -> float:
        return float(np.sqrt(self.term.avar(tau))) / self.factor

    @property
    def point(self) -> tuple[float, float] | None:
        y = self.height(self.read_at)
        return (self.read_at, y) if y > 0 else None

    def curve(self, frame: Frame) -> Curve:
        taus = np.geomspace(*frame[0], 161)
        heights = np.sqrt(self.term.avar(taus)) / self.factor
        return Curve(x=taus, y=heights, label="Gauss-Markov term", colour="guide", style="thin")

    def guide(self, frame: Frame) -> Guide | None:
        """The line inside the frame, named near the end that lies away from the data."""
        part = self._inside(frame)
        if part is None or self.slope is None:
            return None
        ends = (self.height(part[0]), self.height(part[1]))
        name_x = part[0] * (part[1] / part[0]) ** (0.86 if self.slope < 0 else 0.12)
        if self.text and abs(math.log10(name_x / self.read_at)) < 0.45:  # keep clear of the reading point
            name_x = self.read_at * 10 ** (0.6 if self.slope > 0 else -0.6)
        return Guide(x=part, y=ends, name=_SLOPE_NAME[self.slope], name_x=name_x, slope=self.slope)

    def label(self, frame: Frame) -> Label | None:
        if not self.text or self.point is None or not all(map(_within, self.point, frame)):
            return None
        side = _turned(_SIDE.get(self.symbol, "below"), _share(self.point[0], frame[0]))
        return Label(x=self.point[0], y=self.point[1], text=self.text, colour="ink", side=side)

    def limit(self, frame: Frame, lift: float = 0.0) -> Limit | None:
        """The line as an upper limit; its arrow stands at the reading point, or as near to it as the frame lets it.

        `lift` keeps the arrow so many decades further from the lower edge.
        """
        part = self._inside(frame)
        floor = frame[1][0] * 10 ** (_ROOM_ARROW + lift)
        roomy = self._inside(((frame[0][0] * 1.6, frame[0][1] / 1.6), (floor, frame[1][1] / 2)))
        if part is None or roomy is None:
            return None
        at = min(max(self.read_at, roomy[0]), roomy[1])
        heights = np.array([self.height(t) for t in part])
        side = _turned(_SIDE[self.symbol], _share(at, frame[0]))
        return Limit(x=np.array(part), y=heights, at=(at, self.height(at)), text=self.text, side=side)

    def _inside(self, frame: Frame) -> tuple[float, float] | None:
        """Averaging times between which the line runs inside the frame."""
        (start, stop), at_one = frame[0], self.height(1.0)
        if at_one <= 0:
            return None
        if self.slope:
            crossings = sorted((edge / at_one) ** (1 / self.slope) for edge in frame[1])
            start, stop = max(start, crossings[0]), min(stop, crossings[1])
        elif not _within(at_one, frame[1]):
            return None
        return (start, stop) if start * 1.5 < stop else None


def _apart(bounds: Iterable[_Mark], frame: Frame) -> tuple[Limit, ...]:
    """Limits whose arrows and words do not cover one another: a later one moves up its line."""
    placed: list[Limit] = []
    for bound in sorted(bounds, key=lambda b: b.read_at):
        for step in range(4):
            limit = bound.limit(frame, lift=0.36 * step)
            if limit is None or not any(_close(limit.at, other.at, frame) for other in placed):
                break
        if limit is not None:
            placed.append(limit)
    return tuple(placed)


def _close(a: tuple[float, float], b: tuple[float, float], frame: Frame) -> bool:
    across = abs(math.log10(a[0] / b[0])) / decades(frame[0])
    return across < 0.3 and abs(math.log10(a[1] / b[1])) < 0.3


def _within(value: float, limits: Limits) -> bool:
    return limits[0] <= value <= limits[1]


def _share(value: float, limits: Limits) -> float:
    """Where a value stands between two limits, on a logarithmic scale: 0 to 1."""
    return math.log(value / limits[0]) / math.log(limits[1] / limits[0])


def _turned(side: str, share: float) -> str:
    """The side on which words stay inside the frame."""
    if share > 0.72:
        return "below left"
    if share < 0.2:
        return "above right"
    return side


def _made(parts: Iterable[_Part | None]) -> tuple[_Part, ...]:
    return tuple(part for part in parts if part is not None)


def _union(limits: Sequence[Limits]) -> Limits:
    return min(low for low, _ in limits), max(high for _, high in limits)


def _frame(data: Sequence[Curve], points: Iterable[tuple[float, float]]) -> Frame:
    """Limits around the curves, and around those reading points that lie near them."""
    x = positive_range(*(c.x for c in data))
    y = positive_range(*(c.y for c in data))
    band = positive_range(*(part for c in data for part in (c.lower, c.upper) if part is not None), y)
    y = max(band[0], y[0] / 4), min(band[1], y[1] * 4)
    for tau, height in points:
        if (
            x[0] / 10**_ROOM_BESIDE <= tau <= x[1] * 10**_ROOM_BESIDE
            and y[0] / 10**_ROOM_BELOW <= height <= y[1]
        ):
            x = min(x[0], tau), max(x[1], tau)
            y = min(y[0], height), max(y[1], height)
    x, y = (x[0] / 1.5, x[1] * 1.5), (y[0] / 2.5, y[1] * 1.6)
    missing = 0.42 * decades(x) - decades(y)  # a flat strip is hard to read
    if missing > 0:
        y = y[0] / 10 ** (0.6 * missing), y[1] * 10 ** (0.4 * missing)
    return x, y


def _slope_key(frame: Frame) -> tuple[Guide, ...]:
    """Five short lines from one point at the lower left: what each slope looks like."""
    (x, y), size = frame, min(0.9, decades(frame[0]) / 6, decades(frame[1]) / 3.2)
    centre = x[0] * 10 ** (0.3 * size), y[0] * 10 ** (1.05 * size)
    guides = []
    for slope, name in _SLOPE_NAME.items():
        reach = 10 ** (size / math.hypot(1, slope))
        ends = centre[1], centre[1] * reach**slope
        guides.append(
            Guide(x=(centre[0], centre[0] * reach), y=ends, name=name, name_x=centre[0] * reach, slope=slope)
        )
    return tuple(guides)


def deviations_panel(title: str, unit: str, curves: tuple[Curve, ...]) -> Panel:
    """Curves of deviations, with limits that hold them and their bands."""
    x = positive_range(*(c.x for c in curves))
    bands = [c.upper for c in curves if c.upper is not None]
    low, high = positive_range(*(c.y for c in curves), *bands)
    x = (x[0] / 1.5, x[1] * 1.5)
    return Panel(
        title=title,
        x=tau_axis(x),
        y=Axis(label=f"Allan deviation σ(τ) [{unit}]", log=True, limits=(low / 2, high * 2)),
        curves=curves,
        height=0.56,
        key="above",
    )


def tau_axis(limits: Limits) -> Axis:
    """Averaging times, with minute, hour and day named."""
    marks = tuple((at, name) for at, name in _LANDMARKS if _within(at, limits))
    return Axis(label="Averaging time τ [s]", log=True, limits=limits, landmarks=marks)


def _deviation_axis(statistic: str, unit: str, limits: Limits) -> Axis:
    return Axis(label=f"{STATISTICS.get(statistic, statistic)} σ(τ) [{unit}]", log=True, limits=limits)
