# SPDX-License-Identifier: BSD-3-Clause
"""What the report of a study says, section by section, as plain data for its template."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from typing import Any

from allanite.quantities.display_units import display_unit, si_unit
from allanite.recording.health import Finding
from allanite.views.figures import sheet_of
from allanite.views.figures.curves import STATISTICS
from allanite.views.figures.panel import DARK, LIGHT
from allanite.views.pieces import Figure, finding_row, finding_rows, provenance_rows
from allanite.views.report.environment import pictures_of
from allanite.views.wording import (
    COLUMNS,
    GUARANTEE,
    ONE_RECORD,
    ChannelGroup,
    coefficient_lines,
    duration,
    effect_lines,
    environment_facts,
    environment_sentences,
    floor_lines,
    groups,
    headings,
    line_lines,
    missing_lines,
    number,
    probability,
    provisos,
    reading,
    readings,
    record_facts,
    shown_symbol,
    slope_reading,
    verdict,
    worst,
)

__all__ = ["page"]

Json = Mapping[str, Any]
_FLOOR = (
    " The model is that of the sensor without its instrument, whose own curve is grey; diamonds: the difference of the "
    "two variances, a bar alone its upper limit."
)
_FAMILY = {"flicker": "Flicker", "gauss-markov": "Gauss-Markov"}


def page(study: Json) -> dict[str, Any]:
    """Everything the template needs."""
    sections = [_section(i, group, study) for i, group in enumerate(groups(study["channels"]))]
    record, rate = _record_figure(study), study["recording"]["rate"]
    findings = [Finding.from_json(f) for f in study["findings"]]
    open_ = worst(f for f in findings if not f.accepted)
    environment = [_environment(c["environment"]) for c in study["channels"] if c.get("environment")]
    figures = [
        f
        for s in sections
        for f in (s["together"], *(c["figure"] for c in s["channels"]), s["spectrum"])
        if f
    ]
    return {
        "title": study["provenance"].get("source") or "recording",
        "facts": _facts(study["recording"]),
        "sections": sections,
        "worst": finding_row(open_, rate) if open_ else None,
        "accepted": [finding_row(f, rate) for f in findings if f.accepted],
        "findings": finding_rows(findings, rate),
        "advice": _advice(study["channels"]),
        "reached": _reached(study["channels"]),
        "record": record,
        "gaps": _gaps(study["recording"]),
        "missing": missing_lines(study["recording"].get("missing_because") or (), rate),
        "recorded": record_facts(study["recording"]["history"]),
        "provenance": provenance_rows(study),
        "guarantee": f"{GUARANTEE} {ONE_RECORD}",
        "statistics": sorted(
            {_in_a_sentence(STATISTICS[c["curve"]["statistic"]]) for c in study["channels"]}
        ),
        "of_samples": any(map(_of_samples, study["channels"])),
        "residual": environment_sentences(study["channels"]),
        "environment": environment,
        "figures": {
            f.id: f.spec
            for f in [
                *figures,
                *([record] if record else []),
                *(f for e in environment for f in e["figures"]),
            ]
        },
        "palettes": {"light": LIGHT, "dark": DARK},
    }


def _in_a_sentence(name: str) -> str:
    return (
        name
        if name.startswith(("Allan", "Hadamard", "Haar", "Theo1", "ThêoH"))
        else name[0].lower() + name[1:]
    )


def _environment(found: Json) -> dict[str, Any]:
    """What temperature and warm-up did to one channel."""
    return {
        "channel": found["channel"],
        "coefficients": coefficient_lines(found),
        "facts": environment_facts(found),
        "effects": effect_lines(found),
        "figures": pictures_of(found),
    }


# -- one group of channels --------------------------------------------------------------------------------


def _section(index: int, group: ChannelGroup, study: Json) -> dict[str, Any]:
    names = ", ".join(c["name"] for c in group.channels)
    document = {**study, "channels": list(group.channels)}
    curve = group.channels[0]["curve"]
    statistic = STATISTICS[curve["statistic"]]
    together = spectrum = None
    if len(group.channels) > 1:
        together = Figure.of(
            f"group-{index}",
            sheet_of(document, view="groups"),
            f"{group.title}: {statistic} of all channels with {100 * curve['confidence']:g} % bands and models; thin "
            "lines show the slopes of the terms.",
            f"{statistic} against averaging time of {names}.",
        )
    if any(c.get("spectrum") for c in group.channels):
        spectrum = Figure.of(
            f"spectrum-{index}",
            sheet_of(
                {**study, "channels": [c for c in group.channels if c.get("spectrum")]}, view="spectrum"
            ),
            f"{group.title}: root of the two-sided power spectral density; dashed, the model fitted to the "
            f"{_fitted(group.channels)}, as these segments would show it. Where they part, the record holds something "
            "that is not noise.",
            f"Spectrum of {names} with the model.",
        )
    return {
        "title": group.title,
        "lines": [(c["name"], row) for c in group.channels if c.get("spectrum") for row in line_lines(c)],
        "verdict": verdict(group),
        "provisos": provisos(group.channels),
        "has_si": group.has_si,
        "table": _table(group),
        "together": together,
        "spectrum": spectrum,
        "channels": [
            _channel(f"channel-{index}-{i}", channel, group, document)
            for i, channel in enumerate(group.channels)
        ],
    }


def _table(group: ChannelGroup) -> dict[str, Any]:
    heads = headings(group)
    return {
        "heads": [
            {"symbol": head, "name": group.name_of(s), "unit": unit, "si": si_unit(group.kind, s, group.unit)}
            for s, (head, unit) in heads.items()
        ],
        "rows": [(c["name"], [readings(c).get(s) for s in heads]) for c in group.channels],
    }


def _channel(id_: str, channel: Json, group: ChannelGroup, document: Json) -> dict[str, Any]:
    unit, factor = display_unit(channel["kind"], "mean", channel.get("unit") or "")
    spread, spread_factor = display_unit(channel["kind"], "sd", channel.get("unit") or "")
    curve = channel["curve"]
    there = [d is not None for d in curve["deviation"]]
    left_out = sum(d and not u for d, u in zip(there, curve.get("used") or [], strict=False))
    left_out = 0 if _of_samples(channel) else left_out
    one = sheet_of({**document, "channels": [channel]}, view="channels")
    return {
        "name": channel["name"],
        "figure": Figure.of(
            id_,
            one,
            f"{channel['name']}: measured curve with band, fitted model (dashed), its terms (thin) with their reading "
            "points, and upper limits (dotted, with arrows)."
            + (" Hollow points are not in the fit." if left_out else "")
            + (_FLOOR if channel.get("floor") else ""),
            f"{STATISTICS[curve['statistic']]} of {channel['name']}: {_summary(channel)}",
        ),
        "mean": f"{number((channel['mean'] or 0.0) / factor, 5)} {unit}",
        "sd": f"{number((channel['sd'] or 0.0) / spread_factor, 4)} {spread}",
        "models": [_model(m, channel, group) for m in channel["models"]],
        "slopes": [(shown_symbol(s), slope_reading(channel, s)) for s in COLUMNS if s in channel["slopes"]],
        "no_slopes": channel["slopes"].get("note") or "",
        "basis": curve.get("interval_basis") or "",
        "floor": _over_floor(channel),
        "left_out": left_out,
        "lags": sum(there),
    }


def _of_samples(channel: Json) -> bool:
    """The model is that of the samples, not of the curve."""
    return any((m.get("goodness") or {}).get("method") == "likelihood" for m in channel["models"])


def _fitted(channels: Iterable[Json]) -> str:
    return "samples" if any(map(_of_samples, channels)) else "curve"


def _over_floor(channel: Json) -> dict[str, Any] | None:
    """Measured, instrument and sensor, lag by lag, where a floor was taken off."""
    found = channel.get("floor")
    if not found:
        return None
    heads, rows = floor_lines(
        channel["kind"], channel.get("unit") or "", channel["curve"], found["curve"], found["sensor"]
    )
    return {"heads": heads, "rows": rows}


def _summary(channel: Json) -> str:
    return "; ".join(f"{shown_symbol(s)} {r.text}" for s, r in readings(channel).items()) or "no model"


def _model(model: Json, channel: Json, group: ChannelGroup) -> dict[str, Any]:
    goodness = model.get("goodness") or {}
    rows = [
        (
            e["symbol"],
            _symbol_name(e["symbol"], group),
            reading(channel["kind"], channel.get("unit") or "", e),
        )
        for e in sorted(model["estimates"], key=lambda e: _order(e["symbol"]))
    ]
    return {
        "family": _FAMILY.get(model.get("family", ""), model.get("family") or "Model"),
        "verdict": model.get("verdict") or "",
        "rows": rows,
        "goodness": _goodness(goodness),
        "poor": goodness.get("p") is not None and goodness["p"] < 0.01,
        "correlations": _correlations(model.get("covariance") or {}),
    }


def _order(symbol: str) -> int:
    order = ("N", "B", "B_equiv", "T", "sigma", "q", "K", "R", "Q")
    base = symbol.removesuffix("_2")
    return 2 * (order.index(base) if base in order else len(order)) + (base != symbol)


def _symbol_name(symbol: str, group: ChannelGroup) -> str:
    extra = {
        "B_equiv": "B with the same peak",
        "sigma": "Gauss-Markov deviation",
        "q": "Gauss-Markov driving noise",
    }
    base = symbol.removesuffix("_2")
    second = ", number 2" if base != symbol else ""
    return extra[base] + second if base in extra else group.name_of(symbol)


def _goodness(goodness: Json) -> str:
    if goodness.get("chi2") is None:
        return ""
    p = probability(goodness.get("p"))
    return f"χ² = {number(goodness['chi2'])} with {goodness['dof']:g} degrees of freedom, {p}"


def _correlations(covariance: Json) -> dict[str, Any] | None:
    """Correlation of the estimates; a single parameter has none."""
    symbols, matrix = covariance.get("symbols") or [], covariance.get("matrix") or []
    if len(symbols) < 2:
        return None
    sds = [math.sqrt(max(row[i] or 0.0, 0.0)) for i, row in enumerate(matrix)]
    rows = [
        [
            f"{v / (sds[i] * sds[j]):+.2f}" if sds[i] and sds[j] and v is not None else "–"
            for j, v in enumerate(row)
        ]
        for i, row in enumerate(matrix)
    ]
    return {"symbols": symbols, "rows": list(zip(symbols, rows, strict=True))}


# -- the rest ---------------------------------------------------------------------------------------------


def _facts(recording: Json) -> list[tuple[str, str]]:
    missing, samples = recording["missing"], recording["samples"]
    facts = [
        ("Channels", str(len(recording["channels"]))),
        ("Length", duration(recording["duration"])),
        ("Rate", f"{recording['rate']:.7g} Hz"),
        ("Samples", f"{samples:,}".replace(",", "\u202f")),
        ("Missing", f"{100 * missing / samples:.2g} %" if missing else "none"),
    ]
    if recording.get("start"):
        facts.append(("Start", str(recording["start"]).replace("T", " ").replace("Z", " UTC")))
    return facts


def _gaps(recording: Json) -> str:
    gaps = recording["gaps"]
    if not gaps:
        return "No sample is missing."
    lengths = sorted(((b - a) / recording["rate"] for a, b in gaps), reverse=True)
    plural = "gap" if len(gaps) == 1 else f"{'at least ' if len(gaps) >= 100 else ''}{len(gaps)} gaps"
    head = "one gap" if len(gaps) == 1 else plural
    return f"{recording['missing']} samples are missing in {head}, the longest of {duration(lengths[0])} (shaded)."


def _advice(channels: Iterable[Json]) -> list[dict[str, str]]:
    """What a longer record would buy."""
    return [
        {
            "channel": channel["name"],
            "symbol": shown_symbol(advice["symbol"]),
            "duration": "–" if advice.get("duration") is None else duration(advice["duration"]),
            "text": advice["text"],
        }
        for channel in channels
        for advice in channel.get("advice") or ()
        if not advice.get("reached")
    ]


def _reached(channels: Iterable[Json]) -> list[tuple[str, str]]:
    """What the record is long enough for: text, and the channels of which it is true."""
    found: dict[str, list[str]] = {}
    for channel in channels:
        for advice in channel.get("advice") or ():
            if advice.get("reached"):
                found.setdefault(advice["text"], []).append(channel["name"])
    return [(text, ", ".join(names)) for text, names in found.items()]


def _record_figure(study: Json) -> Figure | None:
    channels = [c for c in study["channels"] if (c.get("overview") or {}).get("t")]
    if not channels:
        return None
    return Figure.of(
        "overview",
        sheet_of({**study, "channels": channels}, view="record"),
        "The record: lowest and highest value of each block. Grey: no samples. Amber, at the foot: a place named in "
        "the findings.",
        "Overview of all channels against time. " + _gaps(study["recording"]),
    )
