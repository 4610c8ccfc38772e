# SPDX-License-Identifier: BSD-3-Clause
"""What a file must say of a sensor that renews its values less often than the log has rows: which rate is whose."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from allanite.exporters.triads import plain_line

__all__ = ["renewed_lines"]

Json = Mapping[str, Any]


def renewed_lines(channels: Sequence[Json]) -> list[str]:
    """Comment lines on held channels, one for each rate of theirs; none where every row is a value of its own."""
    names: dict[tuple[float, float], list[str]] = {}
    for channel in channels:
        if held := channel.get("held"):
            names.setdefault((float(held["rate"]), float(held["log_rate"])), []).append(channel["name"])
    lines = []
    for (rate, log), of_rate in names.items():
        lines.append(
            f"{plain_line(', '.join(of_rate))}: the sensor renews its values at {rate:.6g} Hz, the rows of the log "
            f"repeat them at {log:.6g} Hz"
        )
        lines.append(
            f"a rate in this file must be that of your stream: {log:.6g} Hz with the repeats, {rate:.6g} Hz if each "
            "value comes once"
        )
    return lines
