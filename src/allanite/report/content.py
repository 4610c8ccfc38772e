# SPDX-License-Identifier: BSD-3-Clause
"""What the report says, section by section, as plain data for the template."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from urllib.parse import quote

from markupsafe import Markup, escape

from allanite.figures import matplotlib, plotly, sheet_of
from allanite.figures.curves import STATISTICS
from allanite.figures.panel import DARK, LIGHT, Sheet
from allanite.wording import (
    COLUMNS,
    GUARANTEE,
    Group,
    duration,
    finding_kinds,
    groups,
    headings,
    number,
    people_unit,
    probability,
    reading,
    readings,
    si_unit,
    slope_reading,
    verdict,
    worst,
)

__all__ = ["page", "with_powers"]

Json = Mapping[str, Any]
_SAFE_IN_URI = " !$&'()*+,-./:;=?@[]^_`{|}~\n"  # leaves an SVG readable, and half as long as base64 would
_SHOWN = {"T": "T_b"}
_FAMILY = {"flicker": "Flicker", "gauss-markov": "Gauss-Markov"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """A figure of the page: `spec` is drawn by the script, `still` (an SVG as data URI) stands in for it.

    Attributes
    ----------
    id, caption, words : str
        `words` say what is to be seen to those who cannot see it.
    """

    id: str
    caption: str
    words: str
    spec: Json
    still: str

    @classmethod
    def of(cls, id_: str, sheet: Sheet, caption: str, words: str) -> Figure:
        """Both drawings of a sheet."""
        still = "data:image/svg+xml," + quote(matplotlib.svg(sheet), safe=_SAFE_IN_URI)
        return cls(id=id_, caption=caption, words=words, spec=plotly.spec(sheet), still=still)


def page(study: Json) -> dict[str, Any]:
    """Everything the template needs."""
    sections = [_section(i, group, study) for i, group in enumerate(groups(study["channels"]))]
    record = _record_figure(study)
    open_ = worst([f for f in study["findings"] if not f.get("accepted")])
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
        "worst": _finding(open_, study) if open_ else None,
        "accepted": [_finding(f, study) for f in study["findings"] if f.get("accepted")],
        "findings": [[_finding(f, study) for f in kind] for kind in finding_kinds(study["findings"])],
        "advice": _advice(study["channels"]),
        "reached": _reached(study["channels"]),
        "record": record,
        "gaps": _gaps(study["recording"]),
        "provenance": _provenance(study),
        "guarantee": GUARANTEE,
        "statistics": sorted(
            {_in_a_sentence(STATISTICS[c["curve"]["statistic"]]) for c in study["channels"]}
        ),
        "figures": {f.id: f.spec for f in [*figures, *([record] if record else [])]},
        "palettes": {"light": LIGHT, "dark": DARK},
    }


def with_powers(text: str) -> Markup:
    """Text with exponents as people write them: 1.2e-05 becomes 1.2 × 10 to the minus five.

    An interval whose ends share an exponent gets it once: [1.1, 1.3] × 10 to the minus five.
    """
    safe = _MINUS.sub("−", _SHARED.sub(r"[\1, \3]e\2", str(escape(text))))
    safe = safe.replace("T_b", "<i>T</i><sub>b</sub>").replace("B_equiv", "<i>B</i><sub>equiv</sub>")
    return Markup(_POWER.sub(lambda m: f"{m[1]}\u202f×\u202f10<sup>{_exponent(m[2])}</sup>", safe))  # noqa: S704 - escaped above


_SHARED = re.compile(r"\[([\d.]+)e([+-]\d+), ([\d.]+)e\2\]")
_MINUS = re.compile(r"(?<![\w.])-(?=\d)")
_POWER = re.compile(r"([\d\]])e([+-]\d+)")


def _exponent(digits: str) -> str:
    return str(int(digits)).replace("-", "−")


def _in_a_sentence(name: str) -> str:
    return name if name.startswith(("Allan", "Hadamard")) else name[0].lower() + name[1:]


# -- one group of channels --------------------------------------------------------------------------------


def _section(index: int, group: Group, study: Json) -> dict[str, Any]:
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
            f"{group.title}: root of the two-sided power spectral density; dashed, the model fitted to the curve. "
            "Where they part, the curve holds something that is not noise.",
            f"Spectrum of {names} with the model.",
        )
    return {
        "title": group.title,
        "verdict": verdict(group),
        "has_si": group.has_si,
        "table": _table(group),
        "together": together,
        "spectrum": spectrum,
        "channels": [
            _channel(f"channel-{index}-{i}", channel, group, document)
            for i, channel in enumerate(group.channels)
        ],
    }


def _table(group: Group) -> dict[str, Any]:
    heads = headings(group)
    return {
        "heads": [
            {"symbol": head, "name": group.name_of(s), "unit": unit, "si": si_unit(group.kind, s, group.unit)}
            for s, (head, unit) in heads.items()
        ],
        "rows": [(c["name"], [readings(c).get(s) for s in heads]) for c in group.channels],
    }


def _channel(id_: str, channel: Json, group: Group, document: Json) -> dict[str, Any]:
    unit, factor = people_unit(channel["kind"], "mean", channel.get("unit") or "")
    spread, spread_factor = people_unit(channel["kind"], "sd", channel.get("unit") or "")
    curve = channel["curve"]
    left_out = sum(not u for u in curve.get("used") or [])
    one = sheet_of({**document, "channels": [channel]}, view="channels")
    return {
        "name": channel["name"],
        "figure": Figure.of(
            id_,
            one,
            f"{channel['name']}: measured curve with band, fitted model (dashed), its terms (thin) with their reading "
            "points, and upper limits (dotted, with arrows)."
            + (" Hollow points are not in the fit." if left_out else ""),
            f"{STATISTICS[curve['statistic']]} of {channel['name']}: {_summary(channel)}",
        ),
        "mean": f"{number((channel['mean'] or 0.0) / factor, 5)} {unit}",
        "sd": f"{number((channel['sd'] or 0.0) / spread_factor, 4)} {spread}",
        "models": [_model(m, channel, group) for m in channel["models"]],
        "slopes": [(_SHOWN.get(s, s), slope_reading(channel, s)) for s in COLUMNS if s in channel["slopes"]],
        "no_slopes": channel["slopes"].get("note") or "",
        "basis": curve.get("interval_basis") or "",
        "left_out": left_out,
        "lags": len(curve["lags"]),
    }


def _summary(channel: Json) -> str:
    return "; ".join(f"{_SHOWN.get(s, s)} {r.text}" for s, r in readings(channel).items()) or "no model"


def _model(model: Json, channel: Json, group: Group) -> dict[str, Any]:
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
    return order.index(symbol) if symbol in order else len(order)


def _symbol_name(symbol: str, group: Group) -> str:
    extra = {
        "B_equiv": "B with the same peak",
        "sigma": "Gauss-Markov deviation",
        "q": "Gauss-Markov driving noise",
    }
    return extra.get(symbol) or group.name_of(symbol)


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


def _finding(finding: Json, study: Json) -> dict[str, Any]:
    rate = study["recording"]["rate"]
    return {
        **{k: finding[k] for k in ("code", "severity", "advice", "risk", "count", "accepted")},
        "message": finding["message"].removeprefix(f"{finding['channel']}: "),
        "channel": finding["channel"] or "all channels",
        "places": _places(finding["places"], rate, finding["count"]),
    }


def _places(places: Iterable[Sequence[int]], rate: float, count: int) -> str:
    found = [f"{_clock(a / rate)} to {_clock(b / rate)}" for a, b in places]
    covered = sum(b - a for a, b in places)
    return "; ".join(found) + (" and more" if found and count > covered else "")


def _clock(seconds: float) -> str:
    """Hours, minutes and seconds since the first sample: a place that can be found again."""
    whole = math.floor(seconds)
    part = f"{seconds - whole:.3f}"[1:] if seconds != whole else ""
    return f"{whole // 3600}:{whole % 3600 // 60:02}:{whole % 60:02}{part}"


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
            "symbol": _SHOWN.get(advice["symbol"], advice["symbol"]),
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


def _provenance(study: Json) -> list[tuple[str, str]]:
    found = study["provenance"]
    rows = [
        ("File", found.get("source")),
        ("SHA-256", found.get("sha256")),
        ("Command", found.get("command")),
        ("Made", str(found.get("created") or "").replace("T", " ").replace("Z", " UTC")),
        ("allanite", found.get("allanite")),
        ("Python, NumPy", ", ".join(str(v) for v in (found.get("python"), found.get("numpy")) if v)),
        ("Study", f"{study['format']} version {study['version']}"),
    ]
    steps = [(f"Step {i}", _step(step)) for i, step in enumerate(study["recording"]["history"], 1)]
    return [(name, str(value)) for name, value in [*rows, *steps] if value]


def _step(step: Json) -> str:
    return (
        f"{step.get('step', 'step')}: {_said({k: v for k, v in step.items() if k != 'step'})}".removesuffix(
            ": "
        )
    )


def _said(value: Any) -> str:
    """Nested plain data in words."""
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_said(part)}" for key, part in value.items())
    if isinstance(value, list | tuple):
        return ", ".join(map(_said, value))
    return f"{value:.6g}" if isinstance(value, float) else str(value)
