# SPDX-License-Identifier: BSD-3-Clause
"""Combined sensors in people's words: weights, gain, shared noise and faults."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval, number

__all__ = ["combination_facts", "fault_lines", "gain_lines", "shared_lines", "weight_lines"]

Json = Mapping[str, Any]

#: Times at which the gain is told: from the shortest on, every so many octaves.
_STEPS = 4


def weight_lines(document: Json) -> tuple[list[str], list[list[str]]]:
    """Heads and rows: what each sensor gives to each axis, and its constant difference from the others."""
    unit, factor = display_unit(document["kind"], "mean")
    heads = ["Sensor", *(f"for {axis}" for axis in document["axes"]), f"differs by [{unit}]"]
    rows = []
    for i, name in enumerate(document["channels"]):
        weights = [f"{row[i]:+.3f}" for row in document["weights"]]
        rows.append([name, *weights, number(document["differences"][i] / factor, 3)])
    return heads, rows


def gain_lines(document: Json) -> list[tuple[str, str, str, str, str, str]]:
    """Averaging time, axis, deviation of the combined axis, gain over the best sensor, predicted, loss."""
    unit, factor = display_unit(document["kind"], "adev")
    rows = []
    for k in _times(document):
        for m, axis in enumerate(document["axes"]):
            value = document["measured"][k][m]
            gain = document["gain"][k][m]
            words = "–"
            if gain is not None:
                ends = document["gain_lower"][k][m], document["gain_upper"][k][m]
                middle, low, high = interval(gain, *ends)
                words = f"{middle} [{low}, {high}]"
            shown = document["predicted"][k][m] if value is None else value
            rows.append(
                (
                    duration(document["tau"][k]),
                    axis,
                    f"{number(shown / factor, 3)} {unit}",
                    words,
                    number(document["gain_predicted"][k][m], 3),
                    f"{100 * max(document['loss'][k][m] - 1, 0.0):.1f} %",
                )
            )
    return rows


def _times(document: Json) -> list[int]:
    count = len(document["tau"])
    near = min(range(count), key=lambda k: abs(math.log(document["tau"][k] / document["averaging"])))
    step = max(1, math.ceil(count / _STEPS))
    return sorted({*range(0, count, step), near})


def shared_lines(document: Json, most: int = 10) -> list[tuple[str, str, str]]:
    """Pairs of sensors that share noise, and their correlation with its interval; the largest first."""
    correlated = sorted((p for p in document["shared"] if p["seen"]), key=lambda p: -abs(p["correlation"]))
    return [
        (
            f"{p['first']} and {p['second']}",
            f"{p['correlation']:.3f} [{p['lower']:.3f}, {p['upper']:.3f}]",
            duration(p["tau"]),
        )
        for p in correlated[:most]
    ]


def fault_lines(document: Json) -> list[tuple[str, str, str, str, str]]:
    """Kind, sensor, from, to and size of every fault."""
    return [
        (
            fault["kind"],
            fault["sensor"] or f"one of {', '.join(fault['candidates'])}",
            f"{fault['start']:.6g} s",
            f"{fault['stop']:.6g} s",
            _size(fault, document["kind"]),
        )
        for fault in document["faults"]
    ]


def _size(fault: Json, kind: str) -> str:
    size, sd = fault["size"], fault["size_sd"]
    if fault["kind"] == "noise" and size is not None:
        return f"{number(size, 2)} times the noise"
    if size is None or sd is None or fault["kind"] in ("stuck", "other"):
        return ""
    unit, factor = display_unit(kind, "mean")
    if fault["kind"] == "drift":
        unit, factor = f"{unit} per hour", factor / 3600
    middle, _, _ = interval(size / factor, (size - sd) / factor, (size + sd) / factor)
    return f"{middle} ± {number(sd / factor, 2)} {unit}"


def combination_facts(document: Json) -> Sequence[tuple[str, str]]:
    """What the combination rests on."""
    parity, alarms = document["parity"], f"{100 * document['false_alarm']:g} %"
    windows = f"{parity['dof']} in windows of {', '.join(duration(w['length']) for w in parity['windows'])}"
    return [
        ("sensors", ", ".join(document["channels"])),
        ("weights for", f"averages over {duration(document['averaging'])}"),
        ("isolation", document["isolation"]),
        ("parity", f"{windows}; {alarms} of records without a fault give an alarm"),
        ("noise of the parity", f"{number(document['noise_ratio'], 3)} times that of the models"),
        ("length", duration(document["duration"])),
    ]
