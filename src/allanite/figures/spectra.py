# SPDX-License-Identifier: BSD-3-Clause
"""Power spectral densities with the model over them: the second look at a fit, which the curve alone cannot give.

Drawn is the root of the two-sided density, in the unit of N, so that the flat part of the spectrum is N itself.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from allanite.figures.curves import series_colours
from allanite.figures.panel import Axis, Curve, Label, Panel, array, positive_range
from allanite.noise import NoiseModel
from allanite.wording import Group, people_unit

__all__ = ["group_spectrum_panel", "spectrum_panel"]

Json = Mapping[str, Any]
_MOST_LINES = 5


def group_spectrum_panel(group: Group) -> Panel:
    """The spectra of all channels of one kind."""
    unit, factor = people_unit(group.kind, "N", group.unit)
    looks = series_colours([c["name"] for c in group.channels])
    curves: list[Curve] = []
    lines: list[Curve] = []
    labels: list[Label] = []
    for channel, (colour, _) in zip(group.channels, looks, strict=True):
        curve = _density(channel["spectrum"], channel["name"], factor, colour, band=not curves)
        curves.append(curve)
        if channel["models"]:
            model = NoiseModel.from_json(channel["models"][0])
            named = "" if lines else "model"
            lines.append(_model_line(model, curve, factor, named))
        labels += _labels(channel["spectrum"], curve, colour)
    return _panel(group.title, unit, (*curves, *lines), tuple(_merged(labels)))


def spectrum_panel(spectrum: Any, kind: str, own: str) -> Panel:
    """A `Spectrum` alone. It does not know the kind of its channel, so that is said beside it."""
    unit, factor = people_unit(kind, "N", own)
    name = spectrum.channel
    facts: Json = {
        **{k: getattr(spectrum, k) for k in ("frequency", "density", "lower", "upper")},
        "lines": [{"frequency": line.frequency, "amplitude": line.amplitude} for line in spectrum.lines],
        "corner": spectrum.corner,
    }
    curve = _density(facts, name, factor, series_colours([name])[0][0], band=True)
    return _panel(name, unit, (curve,), tuple(_labels(facts, curve, curve.colour)))


def _density(spectrum: Json, label: str, factor: float, colour: str, band: bool) -> Curve:
    f = array(spectrum["frequency"])
    keep = f > 0
    root = {k: np.sqrt(array(spectrum[k])[keep]) / factor for k in ("density", "lower", "upper")}
    return Curve(
        x=f[keep],
        y=root["density"],
        lower=root["lower"],
        upper=root["upper"],
        label=label,
        colour=colour,
        band_label="95 % interval" if band else "",
    )


def _model_line(model: NoiseModel, curve: Curve, factor: float, label: str) -> Curve:
    f = np.geomspace(*positive_range(curve.x), 160)
    return Curve(x=f, y=np.sqrt(model.psd(f)) / factor, label=label, colour="model", style="dashed")


def _labels(spectrum: Json, curve: Curve, colour: str) -> list[Label]:
    labels = []
    for line in sorted(spectrum["lines"], key=lambda line: -line["amplitude"])[:_MOST_LINES]:
        nearest = int(np.argmin(np.abs(np.log(curve.x / line["frequency"]))))
        text = f"line {line['frequency']:.3g} Hz"
        labels.append(
            Label(x=line["frequency"], y=float(curve.y[nearest]), text=text, colour=colour, side="above")
        )
    if spectrum.get("corner"):
        text = f"filter corner {spectrum['corner']:.3g} Hz"
        labels.append(Label(x=spectrum["corner"], y=0.0, text=text, colour="guide", place="line"))
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


def _panel(title: str, unit: str, curves: tuple[Curve, ...], labels: tuple[Label, ...]) -> Panel:
    x = positive_range(*(c.x for c in curves))
    y = positive_range(
        *(c.y for c in curves if c.lower is not None)
    )  # what was measured, not where models go
    return Panel(
        title=title,
        x=Axis(label="Frequency f [Hz]", log=True, limits=(x[0] / 1.2, x[1] * 1.2)),
        y=Axis(label=f"Root density √S(f), two-sided [{unit}]", log=True, limits=(y[0] / 1.6, y[1] * 1.8)),
        curves=curves,
        labels=labels,
    )
