# SPDX-License-Identifier: BSD-3-Clause
"""Counterparts of the thirteen figures of the seed paper [1], each from one function, and the four takes side by side.

Every function takes results and computes nothing; it returns a `PaperFigure`, which `allanite.plot` draws. Rates are
in deg/s, the unit of the paper.

References
----------
.. [1] Silva, Jeronymo, Pavan, Tosin, "Caracterização de Sensores MEMS Através da Variância de Allan para a Filtragem
   de Ruídos Estocásticos".
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.errors import InputError
from allanite.noise import FLICKER_FLOOR, Flicker, NoiseModel, Quantisation, Ramp, RandomWalk, White
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.number_words import number
from allanite.study.results import ChannelStudy
from allanite.study.study import Study
from allanite.views.figures.aided import (
    DEG,
    MILLI,
    MILLI_NAME,
    corrected_panel,
    means_panel,
    raw_panel,
)
from allanite.views.figures.bench import bench
from allanite.views.figures.curves import measured_curve, model_curve, tau_axis
from allanite.views.figures.earth import DEG_H, level, quantile
from allanite.views.figures.panel import (
    Axis,
    Curve,
    Guide,
    Label,
    Panel,
    Sheet,
    around,
    array,
    positive_range,
)
from allanite.views.figures.turned import turned_panel, window_panels
from allanite_seed_paper import twin

if TYPE_CHECKING:
    from allanite.experiments.earth_rate import EarthRateEstimate
    from allanite.recording.records import Recording

__all__ = [
    "TITLES",
    "PaperFigure",
    "all_figures",
    "figure_1",
    "figure_2",
    "figure_3",
    "figure_4",
    "figure_5",
    "figure_6",
    "figure_7",
    "figure_8",
    "figure_9",
    "figure_10",
    "figure_11",
    "figure_12",
    "figure_13",
    "four_takes",
]

Json = Mapping[str, Any]

_EARTH = f"known rate {EARTH_RATE / DEG:.6f} deg/s = {EARTH_RATE / DEG_H:.3f} deg/h"
_LENGTHS = {1: "2 h", 2: "12 min", 3: "25 min", 4: "60 min"}
_CLOSE = 240.0  # s of a take that are shown enlarged

TITLES: Mapping[int, str] = {
    1: "The standard Allan curve",
    2: "Allan deviation of the sensor",
    3: "N, B, K and T_b read off the curve, beside the fit",
    4: "The set-up",
    **{4 + take: f"Take {take}, {length}: as recorded" for take, length in _LENGTHS.items()},
    9: "A take and its cumulative mean",
    **{
        9 + take: f"Take {take}, {length}: reference-aided, not a measurement"
        for take, length in _LENGTHS.items()
    },
    14: "The four takes side by side",
}
"""What each figure shows. The paper has thirteen; the fourteenth compares its results with what the data can tell."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PaperFigure:
    """A counterpart of one figure of the paper.

    Attributes
    ----------
    number : int
        The paper's; 14 is ours.
    title, caption : str
    sheet : Sheet
    """

    number: int
    title: str
    caption: str
    sheet: Sheet

    @classmethod
    def of(cls, number_: int, caption: str, *rows: Panel) -> PaperFigure:
        """With the title of its number, panels under one another."""
        sheet = Sheet(rows=tuple((panel,) for panel in rows))
        return cls(number=number_, title=TITLES[number_], caption=caption, sheet=sheet)


def all_figures(
    *,
    study: Any,
    takes: Mapping[int, Recording],
    reversals: Mapping[int, Any],
    unsigned: Mapping[int, Sequence[Any]],
    demodulated: Mapping[int, Sequence[Any]],
) -> tuple[PaperFigure, ...]:
    """The thirteen figures from the results of the whole experiment.

    Parameters
    ----------
    study : Study or its document
        Of the week at rest.
    takes, reversals, unsigned, demodulated : mapping of the number of a take (1 to 4)
        Its recording, its turns (`Reversals` or `EarthRateEstimate`), and the reference-aided filter in both readings:
        the known rate as its reference first, then other rates typed in.
    """
    raw: tuple[Callable[..., PaperFigure], ...] = (figure_5, figure_6, figure_7, figure_8)
    aided: tuple[Callable[..., PaperFigure], ...] = (figure_10, figure_11, figure_12, figure_13)
    return (
        figure_1(),
        figure_2(study),
        figure_3(study),
        figure_4(),
        *(make(takes[take], reversals[take]) for take, make in enumerate(raw, 1)),
        figure_9(takes[1], reversals[1], unsigned[1][0]),
        *(make(unsigned[take], demodulated[take]) for take, make in enumerate(aided, 1)),
    )


# -- 1 to 4: the sensor and the bench ---------------------------------------------------------------------


def figure_1() -> PaperFigure:
    """The standard curve: five noises, their slopes and letters."""
    taus = np.geomspace(2e-3, 2e7, 301)
    terms = _textbook()
    total = np.sqrt(sum(array(term.avar(taus)) for term, *_ in terms)) / DEG_H
    frame = positive_range(taus), (float(total.min()) / 6, float(total.max()) * 2)
    labels, guides = [], []
    for term, text, at, side, slope, ends in terms:
        heights = np.sqrt(array(term.avar(array([at, *ends])))) / DEG_H
        labels.append(Label(x=at, y=float(heights[0]), text=text, colour="ink", side=side))
        name = {-1.0: "−1", -0.5: "−1/2", 0.0: "0", 0.5: "+1/2", 1.0: "+1"}[slope]
        where = ends[1] if slope <= 0 else ends[0]
        guides.append(
            Guide(x=ends, y=(float(heights[1]), float(heights[2])), name=name, name_x=where, slope=slope)
        )
    curve = Curve(x=taus, y=total, label="sum of the five noises", colour="z")
    panel = Panel(
        title=TITLES[1],
        x=tau_axis(frame[0]),
        y=Axis(label="Allan deviation σ(τ) [deg/h]", log=True, limits=frame[1]),
        curves=(curve,),
        guides=tuple(guides),
        labels=tuple(labels),
        square=True,
    )
    caption = (
        "The Allan deviation of five noises together: each rules a range of averaging times, and its slope there "
        "tells which it is; the numbers are those of a textbook sensor."
    )
    return PaperFigure.of(1, caption, panel)


def _textbook() -> list[tuple[Any, str, float, str, float, tuple[float, float]]]:
    """Term, words, where they stand and on which side, slope, and the ends of its guide."""
    return [
        (Quantisation(Q=1.7 * DEG_H, dt=1e-4), "Q  quantisation", 1.2e-2, "above right", -1.0, (3e-3, 1.2)),
        (White(N=10 * DEG_H), "N  white noise, angle random walk", 9.0, "above right", -0.5, (9e-3, 1.1e4)),
        (
            Flicker(B=0.3 / 0.6643 * DEG_H),
            "B  flicker, bias instability",
            4.6e3,
            "below",
            0.0,
            (1.5e2, 1.5e5),
        ),
        (
            RandomWalk(K=2.1e-3 * math.sqrt(3) * DEG_H),
            "K  rate random walk",
            8e4,
            "above left",
            0.5,
            (1.4e3, 3e6),
        ),
        (Ramp(R=3.3e-6 * math.sqrt(2) * DEG_H), "R  rate ramp", 2.2e6, "above left", 1.0, (5e4, 1.5e7)),
    ]


def figure_2(study: Any) -> PaperFigure:
    """The curve of the week at rest, with its band."""
    channel = _rate_channel(study)
    data, frame = _curve_of(channel)
    panel = Panel(title=channel.name, x=tau_axis(frame[0]), y=_sigma(frame[1]), curves=(data,), square=True)
    length = channel.curve.n_samples * channel.curve.dt / 86400
    caption = (
        f"Overlapping Allan deviation of the sensor at rest over {number(length)} d, with its 95 % interval, which is "
        "wide where few averages fit into the record."
    )
    return PaperFigure.of(2, caption, panel)


def figure_3(study: Any) -> PaperFigure:
    """The seed's reading of the curve, and the fit: on the curve, and number by number."""
    channel = _rate_channel(study)
    data, frame = _curve_of(channel)
    lines = [model_curve(channel.curve, m, DEG, i) for i, m in enumerate(channel.models)]
    labels, guides = _reading_points(channel, frame)
    panel = Panel(
        title="Read where the slope is −1/2, 0 and +1/2",
        x=tau_axis(frame[0]),
        y=_sigma(frame[1]),
        curves=(data, *lines),
        guides=guides,
        labels=labels,
        square=True,
    )
    caption = (
        "Above, the points at which the paper's rules read N, B and K off the curve, and the fitted model; below, what "
        "either way gives as a part of the published value, which is the truth of the simulated sensor: a reading "
        "off the curve has no interval, and takes T_b from a minimum that the other terms shift."
    )
    return PaperFigure.of(3, caption, panel, _coefficients_panel(channel))


def figure_4() -> PaperFigure:
    """The bench."""
    caption = (
        "The sensor stands on a turntable with its sensitive axis horizontal and is turned by hand between north and "
        "south; a multimeter reads its output, a computer keeps the readings."
    )
    return PaperFigure.of(4, caption, Panel(title=TITLES[4], drawing=bench()))


def _rate_channel(study: Study | Json) -> ChannelStudy:
    shown = Study.from_json(study) if isinstance(study, Mapping) else study
    rates = [c for c in shown.channels if c.kind in ("rate", "angle")]
    if not rates:
        raise InputError("the study has no channel of rates: the paper's sensor is a gyroscope")
    return rates[0]


def _curve_of(channel: ChannelStudy) -> tuple[Curve, tuple[tuple[float, float], tuple[float, float]]]:
    """The measured curve in deg/s, and a frame around it."""
    data = measured_curve(channel.curve, channel.name, DEG, ("z", "circle"))
    y = positive_range(data.y)
    return data, ((data.x[0] / 1.5, data.x[-1] * 1.5), (y[0] / 6, y[1] * 2.2))


def _sigma(limits: tuple[float, float]) -> Axis:
    return Axis(label="Allan deviation σ(τ) [deg/s]", log=True, limits=limits)


_UNITS = {"N": "deg/√s", "B": "deg/s", "K": "deg/s/√s", "T": "s"}
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_SLOPES = {"N": (-0.5, "−1/2"), "B": (0.0, "0"), "K": (0.5, "+1/2")}


def _reading_points(channel: ChannelStudy, frame: Any) -> tuple[tuple[Label, ...], tuple[Guide, ...]]:
    """Where N, B and K were read: the point on the curve, and its slope through it."""
    tau, sigma, slopes = channel.curve.tau, channel.curve.deviation, _slopes(channel)
    scales = {"N": np.sqrt(tau), "B": np.full(tau.size, 1 / FLICKER_FLOOR), "K": np.sqrt(3 / tau)}
    sides = {"N": "above right", "B": "below", "K": "above left"}
    labels, guides = [], []
    for symbol, (slope, name) in _SLOPES.items():
        if symbol not in slopes:
            continue
        value = slopes[symbol]
        read = int(np.nanargmin(np.abs(scales[symbol] * sigma - value)))  # the lag that gives this very value
        at, y = float(tau[read]), float(sigma[read]) / DEG
        text = f"{symbol} = {_power(value / DEG, 3)} {_UNITS[symbol]}"
        if symbol == "B" and "T" in slopes:
            text += f", T_b = {number(slopes['T'])} s"
        labels.append(Label(x=at, y=y, text=text, colour="orange", side=sides[symbol]))
        ends = _reach(at, y, slope, frame)
        heights = (y * (ends[0] / at) ** slope, y * (ends[1] / at) ** slope)
        guides.append(Guide(x=ends, y=heights, name=name, name_x=ends[0 if slope > 0 else 1], slope=slope))
    return tuple(labels), tuple(guides)


def _slopes(channel: ChannelStudy) -> dict[str, float]:
    """What was read off the curve, by symbol."""
    return {read.symbol: read.value for read in channel.slopes if not math.isnan(read.value)}


def _reach(at: float, y: float, slope: float, frame: Any) -> tuple[float, float]:
    """Ends of a line through a point: inside the frame, and down to near its foot, where the curve is far."""
    if not slope:
        return max(at / 30, frame[0][0]), min(at * 30, frame[0][1])
    foot = at * (1.5 * frame[1][0] / y) ** (1 / slope)
    return (max(foot, frame[0][0]), frame[0][1]) if slope > 0 else (frame[0][0], min(foot, frame[0][1]))


def _power(value: float, digits: int) -> str:
    """A number with its power of ten as it is written by hand."""
    text, _, power = f"{value:.{digits}g}".partition("e")
    return f"{text}·10{str(int(power)).translate(_RAISED)}" if power else text


def _coefficients_panel(channel: ChannelStudy) -> Panel:
    """Reading and fit as parts of the published values."""
    published = {"N": twin.N, "B": twin.B, "T": twin.T_B, "K": twin.K}
    names = tuple((i, _shown(s, v)) for i, (s, v) in enumerate(published.items()))
    slopes = _slopes(channel)
    read = [
        (i - 0.1, slopes[symbol] / true, math.nan, math.nan)
        for i, (symbol, true) in enumerate(published.items())
        if symbol in slopes
    ]
    curves = [_ratios(read, "read off the curve", "orange", "square")]
    for rank, model in enumerate(channel.models):
        rows = list(_fitted(model, published))
        colour, marker = (("z", "circle"), ("other", "diamond"))[min(rank, 1)]
        family = {"gauss-markov": "Gauss-Markov"}.get(model.family, model.family)
        shifted = [(x + 0.1 + 0.12 * rank, *rest) for x, *rest in rows]
        curves.append(_ratios(shifted, f"fit with its 95 % interval ({family})", colour, marker))
    top = max([1.0, *(float(np.nanmax(c.upper)) for c in curves[1:] if c.upper is not None and c.x.size)])
    top = max(top, *(float(np.nanmax(c.y, initial=0.0)) for c in curves))
    return Panel(
        title="As a part of the published value, the truth of the simulated sensor",
        x=Axis(label="", limits=(-0.5, len(names) - 0.5), names=names),
        y=Axis(label="Found / published [1]", limits=(0.0, min(1.1 * top, 3.0))),
        curves=tuple(c for c in curves if c.x.size),
        labels=(Label(x=0.0, y=1.0, text="", colour="ink", place="level"),),
        height=0.3,
        key="above",
    )


def _shown(symbol: str, value: float) -> str:
    text = _power(value / (1.0 if symbol == "T" else DEG), 5)
    return f"{ {'T': 'T_b'}.get(symbol, symbol) }\n{text} {_UNITS[symbol]}"


def _fitted(model: NoiseModel, published: Mapping[str, float]) -> Any:
    """Number, value and interval of each estimate that has a published counterpart, as a part of that."""
    for i, (symbol, value) in enumerate(published.items()):
        names = (symbol, "B_equiv") if symbol == "B" else (symbol,)
        for estimate in model.estimates:
            if estimate.symbol in names and estimate.value is not None:
                ends = (estimate.value, estimate.lower, estimate.upper)
                yield i, *(end / value if math.isfinite(end) else math.nan for end in ends)


def _ratios(rows: Sequence[tuple[float, ...]], label: str, colour: str, marker: str) -> Curve:
    x, y, low, high = array(rows).reshape(-1, 4).T
    return Curve(
        x=x, y=y, lower=low, upper=high, bars=True, label=label, colour=colour, style="none", marker=marker
    )


# -- 5 to 9: the takes as recorded ------------------------------------------------------------------------


def figure_5(take: Recording, reversals: Any) -> PaperFigure:
    """Take 1 as recorded, with its turns."""
    return _raw(1, take, reversals)


def figure_6(take: Recording, reversals: Any) -> PaperFigure:
    """Take 2 as recorded, with its turns."""
    return _raw(2, take, reversals)


def figure_7(take: Recording, reversals: Any) -> PaperFigure:
    """Take 3 as recorded, with its turns."""
    return _raw(3, take, reversals)


def figure_8(take: Recording, reversals: Any) -> PaperFigure:
    """Take 4 as recorded, with its turns."""
    return _raw(4, take, reversals)


def _raw(number_: int, take: Recording, reversals: Any) -> PaperFigure:
    whole = turned_panel(take, reversals)
    window = (0.0, min(_CLOSE, take.duration))
    close = window_panels(take, reversals, window)[1]
    caption = (
        f"Take {number_} as recorded: above the whole of it, where the turns stand out; below its first "
        f"{number(window[1] / 60)} min enlarged to the noise, with the stretches that are left out: the Earth's "
        "rotation is far below the noise of a sample."
    )
    return PaperFigure.of(
        4 + number_, caption, whole, replace(close, title="The beginning, enlarged to the noise")
    )


def figure_9(take: Recording, reversals: Any, aided: Any) -> PaperFigure:
    """A take and the mean of its samples so far, turns left out; `aided` is its unsigned reading."""
    whole = turned_panel(take, reversals)
    frame = whole.x.limits or (0.0, 1.0)
    below = raw_panel(aided.result.readings[0], [level(EARTH_RATE / MILLI, frame, _EARTH)])
    caption = (
        "A take and the mean of all its samples so far: it tends to the bias of the sensor, not to the rate of the "
        "Earth, for north and south cancel in it."
    )
    return PaperFigure.of(9, caption, replace(whole, x=replace(whole.x, landmarks=())), below)


# -- 10 to 13: reference-aided ----------------------------------------------------------------------------


def figure_10(unsigned: Sequence[Any], demodulated: Sequence[Any]) -> PaperFigure:
    """Take 1 through the filter that is told the rate, in both readings."""
    return _aided(1, unsigned, demodulated)


def figure_11(unsigned: Sequence[Any], demodulated: Sequence[Any]) -> PaperFigure:
    """Take 2 through the filter that is told the rate, in both readings."""
    return _aided(2, unsigned, demodulated)


def figure_12(unsigned: Sequence[Any], demodulated: Sequence[Any]) -> PaperFigure:
    """Take 3 through the filter that is told the rate, in both readings."""
    return _aided(3, unsigned, demodulated)


def figure_13(unsigned: Sequence[Any], demodulated: Sequence[Any]) -> PaperFigure:
    """Take 4 through the filter that is told the rate, in both readings."""
    return _aided(4, unsigned, demodulated)


def _aided(take: int, unsigned: Sequence[Any], demodulated: Sequence[Any]) -> PaperFigure:
    """Corrected samples, and the cumulative means of both readings for each rate that was typed in."""
    both = [[one.result.readings[0] for one in results] for results in (unsigned, demodulated)]
    for readings, reading in zip(both, ("unsigned", "demodulated"), strict=True):
        if not readings or any(one.reading != reading for one in readings):
            raise InputError(
                f"figure {9 + take} needs the {reading} reading of the take, and got another or none"
            )
    caption = (
        f"Take {take} through the paper's filter, which is told the rate (thin dashed lines): the unsigned mean moves "
        "with whatever rate is typed in, the mean demodulated by the heading hardly; neither is a measurement."
    )
    panels = corrected_panel(both[0][0]), means_panel(both[0]), means_panel(both[1])
    return PaperFigure.of(9 + take, caption, *panels)


# -- the four takes ---------------------------------------------------------------------------------------


def four_takes(
    estimates: Mapping[int, EarthRateEstimate | Mapping[str, Any]],
    *,
    bounds: Mapping[int, float] | None = None,
    published: bool = True,
) -> PaperFigure:
    """The paper's results, the pairs, north-south-north and the regression of each take, beside bound and truth.

    Parameters
    ----------
    estimates : mapping of the number of a take (1 to 4) to EarthRateEstimate or its document
    bounds : mapping of the number of a take to float, optional [rad/s]
        Standard deviation that the noise of the sensor alone allows: `allanite.experiments.planning.plan`.
    published : bool
        Show what the paper found; its takes were other records than these.
    """
    from allanite.experiments.earth_rate import EarthRateEstimate

    takes = {
        n: EarthRateEstimate.from_json(e) if isinstance(e, Mapping) else e
        for n, e in sorted(estimates.items())
    }
    wide = quantile(next(iter(takes.values())).confidence)
    curves = [_bound([(bounds or {}).get(n, math.nan) for n in takes], wide)]
    if published:
        rows = [(i, twin.TAKES[n].published / MILLI, 0.0) for i, n in enumerate(takes)]
        curves.append(_estimates(rows, -0.3, "published by the paper, without interval", "x", "cross"))
    simple = ((-0.1, "pairs", "orange", "square"), (0.1, "north-south-north", "y", "triangle"))
    for offset, name, colour, marker in simple:
        rows = [
            (i, r.rate / MILLI, wide * r.sd / MILLI)
            for i, e in enumerate(takes.values())
            for r in e.readings
            if r.name == name
        ]
        curves.append(_estimates(rows, offset, name, colour, marker))
    rows = [
        (i, e.rate / MILLI, (e.interval[1] - e.interval[0]) / 2 / MILLI)
        for i, e in enumerate(takes.values())
        if math.isfinite(e.rate)
    ]
    curves.append(_estimates(rows, 0.3, "regression", "z", "circle"))
    ends = [end for c in curves for end in (c.lower, c.upper) if end is not None]
    frame = -0.6, len(takes) - 0.4
    names = tuple(
        (i, f"take {n}, {_LENGTHS.get(n, '')}\n{e.verdict.words}") for i, (n, e) in enumerate(takes.items())
    )
    panel = Panel(
        title=TITLES[14],
        x=Axis(label="", limits=frame, names=names),
        y=Axis(label=f"Earth rate [{MILLI_NAME}]", limits=around(*ends)),
        curves=(*(c for c in curves if np.isfinite(c.y).any()), level(EARTH_RATE / MILLI, frame, _EARTH)),
        height=0.5,
        key="above",
    )
    caption = (
        "The four takes of the simulated bench by three estimators, with 95 % intervals, and what the paper found in "
        "its own"
    )
    caption += (
        ": the gray boxes are what the noise of the sensor alone allows in a record of that length, no time lost in "
        "turning."
        if bounds
        else "."
    )
    return PaperFigure.of(14, caption, panel)


def _bound(bounds: Sequence[float], wide: float) -> Curve:
    """A box around the known rate for each take: as wide as the noise alone makes the best estimate."""
    x: list[float] = []
    half: list[float] = []
    for i, sd in enumerate(bounds):
        x += [i - 0.42, i + 0.42, i + 0.42]
        half += [wide * sd / MILLI, wide * sd / MILLI, math.nan]
    rate, reach = np.full(len(x), EARTH_RATE / MILLI), array(half)
    words = "95 % bound: noise alone, at its best"
    look: dict[str, Any] = {"label": "", "colour": "guide", "style": "thin", "band_label": words}
    y = np.where(np.isfinite(reach), rate, np.nan)
    return Curve(x=array(x), y=y, lower=rate - reach, upper=rate + reach, **look)


def _estimates(
    rows: Sequence[tuple[float, float, float]], offset: float, label: str, colour: str, marker: str
) -> Curve:
    x, y, half = array(rows).reshape(-1, 3).T
    look: dict[str, Any] = {"colour": colour, "marker": marker, "style": "none", "bars": True}
    return Curve(x=x + offset, y=y, lower=y - half, upper=y + half, label=label, **look)
