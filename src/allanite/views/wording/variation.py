# SPDX-License-Identifier: BSD-3-Clause
"""Deviation over time in people's words: what changed, and how constant every lag is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from allanite.quantities.display_units import display_unit
from allanite.views.wording.numbers import duration, interval, number, probability

__all__ = ["change_lines", "constancy_lines", "part_name", "variation_facts"]

Json = Mapping[str, Any]

_NAMES = {"all": "the noise as a whole", "sigma": "Gauss-Markov term"}


def part_name(symbol: str) -> str:
    """What changes, in words.

    >>> part_name("N"), part_name("all")
    ('N', 'the noise as a whole')
    """
    return _NAMES.get(symbol, symbol)


def change_lines(document: Json) -> list[tuple[str, str, str, str, str]]:
    """Channel, what changed, when with its interval, amplitude after over before with its interval, chance."""
    rows = []
    for channel in document["channels"]:
        for change in channel["changes"]:
            when = "from the first to the last sample"
            if change["time"] is not None:
                low, high = (duration(change[f"time_{end}"]) for end in ("lower", "upper"))
                when = f"{duration(change['time'])} [{low}, {high}]"
            size = "the windows do not tell"
            if change["upper"] is not None:
                middle, least, most = interval(change["ratio"], change["lower"], change["upper"])
                size = f"{middle} times [{least}, {most}]"
            rows.append((channel["name"], part_name(change["symbol"]), when, size, probability(change["p"])))
    return rows


def constancy_lines(document: Json, most: int = 8) -> list[tuple[str, str, str, str, str, str, str]]:
    """Channel, lag, windows, smallest and largest deviation, whole record, chance; some lags of every channel."""
    rows = []
    for channel in document["channels"]:
        unit, factor = display_unit(channel["kind"], "adev", channel["unit"])
        lags = channel["lags"]
        step = max(1, -(-len(lags) // most))
        told = sorted(
            {*range(0, len(lags), step), *(i for i, lag in enumerate(lags) if any(lag["significant"]))}
        )
        for i in told[: 2 * most]:
            lag = lags[i]
            rows.append(
                (
                    channel["name"],
                    duration(lag["tau"]),
                    f"{len(lag['start'])} of {duration(lag['window'])}",
                    f"{number(min(lag['deviation']) / factor)} to {number(max(lag['deviation']) / factor)} {unit}",
                    f"{number(lag['whole'] / factor)} {unit}",
                    str(sum(lag["significant"])) if any(lag["significant"]) else "none",
                    probability(lag["p"]),
                )
            )
    return rows


def variation_facts(document: Json) -> list[tuple[str, str]]:
    """What the verdict rests on."""
    channels = document["channels"]
    alarm = f"{100 * document['false_alarm']:g} %"
    visible = [
        f"{channel['name']}: "
        + ", ".join(
            f"{part_name(s)} by {number(100 * (f - 1), 2)} %"
            for s, f in channel["visible"].items()
            if s != "all" and f < 3
        )
        for channel in channels
        if any(s != "all" and f < 3 for s, f in channel["visible"].items())
    ]
    return [
        ("channels", ", ".join(c["name"] for c in channels)),
        (
            "all windows together",
            "; ".join(
                f"{c['name']}: χ² {c['chi2']:.0f} ({c['dof']:.0f} expected), {probability(c['p'])}"
                for c in channels
            ),
        ),
        ("would show", "; ".join(visible)),
        ("false alarms", f"{alarm} of channels whose noise is constant"),
        ("length", duration(document["duration"])),
    ]
