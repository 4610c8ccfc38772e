# SPDX-License-Identifier: BSD-3-Clause
"""Sensors taken apart in people's words: what each has alone, and what they share."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.quantities.display_units import display_unit
from allanite.quantities.number_words import duration, interval, number, probability

__all__ = ["part_lines", "part_term_lines", "separation_facts"]

Json = Mapping[str, Any]

_TERMS = ("N", "B", "K")


def part_lines(document: Json, most: int = 7) -> tuple[list[str], list[list[str]]]:
    """Heads and rows: deviation of every part at some lags, with its interval or as an upper limit."""
    parts = [*document["own"], document["common"]]
    unit, factor = display_unit(document["kind"], "adev", document["unit"])
    tau = document["tau"]
    step = max(1, -(-len(tau) // most))
    heads = ["Averaging", *(_title(part["name"], document) + f" [{unit}]" for part in parts)]
    rows = []
    for i in range(0, len(tau), step):
        rows.append([duration(tau[i]), *(_deviation(part, i, factor) for part in parts)])
    return heads, rows


def _title(name: str, document: Json) -> str:
    return f"{name} alone" if name in document["channels"] else name


def _deviation(part: Json, i: int, factor: float) -> str:
    value, low, high = (part[k][i] for k in ("deviation", "lower", "upper"))
    if high is None:
        return "–"
    if value is None:
        return f"< {number(high / factor, 2)}"
    middle, least, most = interval(value / factor, low / factor, high / factor)
    return f"{middle} [{least}, {most}]"


def part_term_lines(document: Json) -> tuple[list[str], list[list[str]]]:
    """Heads and rows: N, B and K of every part with their intervals, or upper limits."""
    units = {s: display_unit(document["kind"], s, document["unit"]) for s in _TERMS}
    heads = ["Part", *(f"{s} [{units[s][0]}]" for s in _TERMS)]
    rows = []
    for part in (*document["own"], document["common"]):
        estimates = {e["symbol"]: e for e in part["model"]["estimates"]}
        cells = []
        for s in _TERMS:
            estimate, factor = estimates[s], units[s][1]
            if estimate["upper"] is None:
                cells.append("not determined")
            elif estimate["value"] is None:
                cells.append(f"< {number(estimate['upper'] / factor, 2)}")
            else:
                ends = (estimate[k] / factor for k in ("value", "lower", "upper"))
                middle, low, high = interval(*ends)
                cells.append(f"{middle} [{low}, {high}]")
        rows.append([_title(part["name"], document), *cells])
    return heads, rows


def separation_facts(document: Json) -> list[tuple[str, str]]:
    """What the numbers rest on."""
    agreement = document["agreement"]
    alike = "" if agreement is None else (
        f"χ² {agreement['chi2']:.1f} ({agreement['dof']:.0f} expected), {probability(agreement['p'])}"
    )  # fmt: skip
    missing = document["missing"]
    return [
        ("sensors", ", ".join(document["channels"])),
        ("other way round", ", ".join(document["opposite"])),
        ("all pairs share the same", alike),
        ("left out", f"{missing} samples that not all sensors have" if missing else ""),
        ("length", duration(document["duration"])),
    ]
