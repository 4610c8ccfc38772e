# SPDX-License-Identifier: BSD-3-Clause
"""What a reader of noise coefficients must know besides: a term that is needed but open, values that the log repeats,
contaminated noise, the aperture of the meter, the error of the scale factor.

And what a run lacks, and how it was recorded.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from allanite.noise import Estimate
from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval, number

__all__ = ["missing_lines", "provisos", "record_facts"]

Json = Mapping[str, Any]

_SHOWN_SETTINGS = 40
#: Symbols of slow noise.
_SLOW = {"B", "T", "sigma", "sigma_2", "K", "R"}


def provisos(channels: Iterable[Json]) -> list[str]:
    """One sentence for each kind of proviso, with the channels that it is true of.

    Parameters
    ----------
    channels : iterable of dict
        Entries like those of a study's "channels".
    """
    said: dict[str, list[str]] = {}
    for channel in channels:
        for say in (_needed, _held, _contamination, _aliasing, _scale, _clock):
            sentence = say(channel)
            if sentence:
                said.setdefault(sentence, []).append(channel["name"])
    return [f"{', '.join(names)}: {sentence}" for sentence, names in said.items()]


def _needed(channel: Json) -> str:
    """Limits that must not be read as "no slow noise": one of the terms is there, and which one is open."""
    model = channel["models"][0] if channel.get("models") else {}
    needed = [e["symbol"] for e in model.get("estimates") or () if Estimate.from_json(e).needed]
    if not needed:
        return ""
    what = "slow noise" if _SLOW.issuperset(needed) else "noise beyond the terms that the record shows"
    return (
        f"{what} is there, {' and '.join(needed)} or a term like it; the record cannot tell which, so that each "
        "has a limit alone. Record longer to know."
    )


def _held(channel: Json) -> str:
    found = channel.get("held")
    if not found:
        return ""
    rate, log = (f"{found[key]:.6g} Hz" for key in ("rate", "log_rate"))
    return f"each value was taken once, at the sensor's own rate of {rate}; the log runs at {log}."


def _contamination(channel: Json) -> str:
    """N with and without the contaminated samples, each with its interval."""
    found = channel.get("contamination")
    if not found:
        return ""
    model = channel["models"][0]
    unit, factor = display_unit(model["kind"], "N", model["unit"])

    def written(entry: Json) -> str:
        value, low, high = interval(*(entry[key] / factor for key in ("value", "lower", "upper")))
        return f"{value} [{low}, {high}] {unit}"

    return (
        f"N is {written(found['N'])} for all samples and {written(found['N_without'])} without the "
        f"{number(100 * found['share'], 2)} % that scatter {number(found['ratio'], 2)} times as much. The first "
        "interval holds their scatter."
    )


def _aliasing(channel: Json) -> str:
    found = channel.get("aliasing")
    if not found:
        return ""
    aperture, interval = (f"{found[key]:.6g} s" for key in ("aperture", "interval"))
    return (
        f"N is that of the samples. Each averages {aperture} of its {interval}: if the noise of the sensor is white "
        f"far beyond 1/{aperture}, its own N is {number(found['factor'], 4)} = √({interval}/{aperture}) times smaller "
        "(aliasing). Nothing was divided by that."
    )


def _scale(channel: Json) -> str:
    found = channel["models"][0].get("scale_uncertainty") if channel["models"] else None
    if found is None:
        return ""
    return (
        f"the intervals hold the scale factor's standard uncertainty of {number(100 * found, 2)} %, one error common "
        "to all amplitudes, in quadrature with the statistical one. The band of the curve does not."
    )


def _clock(channel: Json) -> str:
    """What the names of a clock's terms are, and which of them a fit does not have."""
    if channel.get("kind") not in ("phase", "frequency") or not channel.get("models"):
        return ""
    return (
        "WPM, WFM, FFM, RWFM: white phase, white, flicker and random-walk frequency noise, of fractional frequency. "
        "Flicker phase noise (FPM) is not a term of the fit: the Allan deviation shows it as WPM; "
        "`--statistic mdev` of `allanite allan` tells them apart (slope -3/2 for WPM, -1 for FPM)."
    )


def missing_lines(entries: Iterable[Json], rate: float) -> list[tuple[str, str, str, str, str]]:
    """What is missing and why: reason, gaps, samples, the longest, where the first begins."""
    return [
        (
            e["reason"],
            "–" if e["gaps"] is None else str(e["gaps"]),
            str(e["samples"]),
            "–" if e["longest"] is None else duration(e["longest"] / rate),
            "–" if e["first"] is None else duration(e["first"] / rate),
        )
        for e in entries
    ]


def record_facts(history: Iterable[Json]) -> list[tuple[str, str]]:
    """How a run was recorded, of each run that a recording is made of: names and values."""
    return [fact for step in history if step.get("step") == "record" for fact in _recorded(step)]


def _recorded(step: Json) -> Iterable[tuple[str, str]]:
    named = (step["instrument"].get(key) for key in ("maker", "model", "serial"))
    firmware = step["instrument"].get("firmware")
    text = " ".join(str(part) for part in named if part) or "not known"
    yield "instrument", text + (f", firmware {firmware}" if firmware else "")
    yield "run", f"{step['run']}: {step['status']}, by allanite {step['software']}"
    if step.get("aperture"):
        yield "aperture", duration(step["aperture"])
    if step.get("scale_date"):
        yield "scale factor of", str(step["scale_date"])
    settings = [f"{key} {_value(value)}" for key, value in sorted(step["settings"].items())]
    if settings:
        more = ", …" if len(settings) > _SHOWN_SETTINGS else ""
        yield "settings", ", ".join(settings[:_SHOWN_SETTINGS]) + more


def _value(value: Any) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    if isinstance(value, float):
        return f"{value:.9g}"
    if isinstance(value, list):
        return "/".join(_value(v) for v in value)
    return str(value)
