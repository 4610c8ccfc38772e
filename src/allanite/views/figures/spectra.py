# SPDX-License-Identifier: BSD-3-Clause
"""Power spectral densities with the model over them: the second look at a fit, which the curve alone cannot give.

Drawn is the root of the two-sided density, in the unit of N, so that the flat part of the spectrum is N itself. A
model is drawn as the segments behind the points would show it: folded by sampling, seen through their window.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.spectral.spectra import ChannelSpectrum
from allanite.noise import BY_LETTER, NoiseModel, TermType
from allanite.noise.spectrum.results import Spectrum
from allanite.quantities.display_units import display_unit
from allanite.study.results import ChannelStudy
from allanite.views.figures.curves import series_colours
from allanite.views.figures.panel import Axis, Curve, Label, Panel, legend_entry, positive_range
from allanite.views.wording.study import ChannelGroup

__all__ = [
    "VIEWS",
    "density_curve",
    "density_panel",
    "frequency_axis",
    "group_spectrum_panel",
    "ratio_panel",
    "spectrum_panel",
]

Array = NDArray[np.float64]

VIEWS = ("whole", "density", "ratio")
_MOST_LINES = 5
_NAMES = {
    "gauss_markov": "Gauss-Markov",
    "random_walk": "K",
    "quantisation": "Q",
    "white": "N",
    "flicker": "B",
}


def group_spectrum_panel(group: ChannelGroup[ChannelStudy]) -> Panel:
    """The spectra of all channels of one kind."""
    unit, factor = display_unit(group.kind, "N", group.unit)
    looks = series_colours([c.name for c in group.channels])
    curves: list[Curve] = []
    lines: list[Curve] = []
    labels: list[Label] = []
    for channel, (colour, _) in zip(group.channels, looks, strict=True):
        curve = density_curve(channel.spectrum, channel.name, factor, colour, band=not curves)
        curves.append(replace(curve, axis=channel.name))
        if channel.models:
            line = _model_line(channel.spectrum, channel.models[0], factor, "")
            lines.append(replace(line, axis=channel.name))
        labels += _labels(channel.spectrum, curve, colour)
    models = [*lines, legend_entry("model")] if lines else []
    return density_panel(group.title, unit, (*curves, *models), tuple(_merged(labels)))


def spectrum_panel(channel: ChannelSpectrum) -> Panel:
    """One channel, the model with its terms over it."""
    unit, factor = display_unit(channel.kind, "N", channel.unit)
    facts, model = channel.spectrum, channel.model
    curve = density_curve(facts, channel.name, factor, series_colours([channel.name])[0][0], band=True)
    lines: list[Curve] = []
    if model is not None:
        lines = [_model_line(facts, model, factor, "model")]
        lines += [_term_line(facts, term, factor) for term in _dense(model.terms)]
    return density_panel(channel.name, unit, (curve, *lines), tuple(_labels(facts, curve, curve.colour)))


def ratio_panel(channel: ChannelSpectrum, expected: Array) -> Panel:
    """Density over that of the model, with its interval: 1 within the band where they agree."""
    facts = channel.spectrum
    good = expected > 0
    f = facts.frequency[good]
    density, lower, upper = (
        part[good] / expected[good] for part in (facts.density, facts.lower, facts.upper)
    )
    colour = series_colours([channel.name])[0][0]
    measured = Curve(
        x=f,
        y=density,
        lower=lower,
        upper=upper,
        label=channel.name,
        colour=colour,
        band_label=_level(facts),
    )
    one = Curve(x=f, y=np.ones(len(f)), label="model", colour="model", style="dashed")
    low, high = positive_range(lower, upper)
    return Panel(
        title=f"{channel.name}: density relative to the model",
        x=frequency_axis(f),
        y=Axis(label="Density / model", log=True, limits=(max(low, 0.05) / 1.1, min(high, 20.0) * 1.1)),
        curves=(measured, one),
        height=0.3,
    )


def _dense(terms: Sequence[TermType]) -> list[TermType]:
    """Terms that have a density."""
    return [t for t in terms if t.symbols[0] in {*BY_LETTER, "q"} - {"R"}]


def density_curve(spectrum: Spectrum, label: str, factor: float, colour: str, band: bool) -> Curve:
    """The root density of a spectrum with its interval, which the legend names for a `band`."""
    keep = spectrum.frequency > 0
    density, lower, upper = (
        np.sqrt(part[keep]) / factor for part in (spectrum.density, spectrum.lower, spectrum.upper)
    )
    return Curve(
        x=spectrum.frequency[keep],
        y=density,
        lower=lower,
        upper=upper,
        label=label,
        colour=colour,
        band_label=_level(spectrum) if band else "",
    )


def _level(spectrum: Spectrum) -> str:
    return f"{100 * spectrum.confidence:g} % interval"


def _model_line(spectrum: Spectrum, model: NoiseModel, factor: float, label: str) -> Curve:
    root = np.sqrt(spectrum.expected(model)) / factor
    return Curve(x=spectrum.frequency, y=root, label=label, colour="model", style="dashed")


def _term_line(spectrum: Spectrum, term: TermType, factor: float) -> Curve:
    root = np.sqrt(spectrum.expected(NoiseModel.of(term))) / factor
    name, style = _NAMES.get(term.type, term.type), _STYLES[term.type]
    return Curve(x=spectrum.frequency, y=root, label=name, colour="guide", style=style)


_STYLES: Mapping[str, Any] = {
    "white": "thin",
    "quantisation": "dotted",
    "flicker": "dashdot",
    "gauss_markov": "dashdot",
    "random_walk": "dotted",
}


def _labels(spectrum: Spectrum, curve: Curve, colour: str) -> list[Label]:
    labels = []
    for line in sorted(spectrum.lines, key=lambda line: -line.amplitude)[:_MOST_LINES]:
        nearest = int(np.argmin(np.abs(np.log(curve.x / line.frequency))))
        text = f"line {line.frequency:.3g} Hz" + (", steady" if line.stable else "")
        labels.append(
            Label(x=line.frequency, y=float(curve.y[nearest]), text=text, colour=colour, side="above")
        )
    if spectrum.corner:
        text = f"filter corner {spectrum.corner:.3g} Hz"
        labels.append(Label(x=spectrum.corner, y=0.0, text=text, colour="guide", place="line"))
    return labels


def _merged(labels: list[Label]) -> list[Label]:
    """Axes of one sensor share their lines and their filter: what lies within a few percent is said once."""
    kept: list[Label] = []
    for label in sorted(labels, key=lambda label: -label.y):
        apart = 1.3 if label.place == "line" else 1.12
        if all(o.place != label.place or not 1 / apart < label.x / o.x < apart for o in kept):
            kept.append(label)
    points = [label for label in kept if label.place == "point"]
    return points[:_MOST_LINES] + [label for label in kept if label.place == "line"]


def frequency_axis(*parts: Any) -> Axis:
    """The axis over these frequencies [Hz]."""
    x = positive_range(*parts)
    return Axis(label="Frequency f [Hz]", log=True, limits=(x[0] / 1.2, x[1] * 1.2))


def density_panel(title: str, unit: str, curves: tuple[Curve, ...], labels: tuple[Label, ...]) -> Panel:
    """Root densities over frequency."""
    y = positive_range(
        *(c.y for c in curves if c.lower is not None)
    )  # what was measured, not where models go
    return Panel(
        title=title,
        x=frequency_axis(*(c.x for c in curves)),
        y=Axis(label=f"Root density √S(f), two-sided [{unit}]", log=True, limits=(y[0] / 1.6, y[1] * 1.8)),
        curves=curves,
        labels=labels,
    )
