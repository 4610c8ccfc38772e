# SPDX-License-Identifier: BSD-3-Clause
"""Studies of version 1 held advice in sentences and bare ends of intervals, and left out what a channel had not."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

from allanite.quantities.display_units import si_unit

__all__ = ["upgraded", "upgraded_channel"]

Entry = Mapping[str, object]

_PROVENANCE: Entry = {"sha256": None, "command": None, "python": "", "numpy": ""}
_THERMOMETER: Entry = {"si": "K", "scale": 1.0, "missing": 0.0, "constant": False}
#: Relative deviation below which an advice aims at a coefficient that is resolved; it was 0.1, and 1/6 for the others.
_RESOLVED = 0.15


def upgraded(data: Entry) -> dict[str, object]:
    """A study of version 1 as one of version 2; what is damaged stays so, for the reader to name."""
    return {
        **data,
        "version": 2,
        "provenance": _of(data.get("provenance"), lambda made: {**_PROVENANCE, **made}),
        "channels": _each(data.get("channels"), _channel),
    }


def upgraded_channel(data: Entry) -> Entry:
    """An entry of "channels" of a study of either version as one of version 2."""
    return _channel(data) if isinstance(data.get("slopes"), Mapping) else data


def _of(value: object, make: Callable[[Entry], object]) -> object:
    return make(value) if isinstance(value, Mapping) else value


def _each(value: object, make: Callable[[Entry], object]) -> object:
    if not isinstance(value, Sequence) or isinstance(value, str):
        return value
    return [_of(entry, make) for entry in value]


def _channel(data: Entry) -> dict[str, object]:
    slopes = data.get("slopes")
    by_symbol = (
        {s: v for s, v in slopes.items() if isinstance(v, Mapping)} if isinstance(slopes, Mapping) else {}
    )
    return {
        **data,
        "curve": _of(data.get("curve"), lambda curve: {"engine": "exact", **curve}),
        "spectrum": _of(data.get("spectrum"), lambda spectrum: _spectrum(spectrum, data)),
        "slopes": [{"note": "", **reading, "symbol": symbol} for symbol, reading in by_symbol.items()],
        "no_slopes": "" if by_symbol or not isinstance(slopes, Mapping) else slopes.get("note", ""),
        "advice": _each(data.get("advice"), _advice),
        "environment": _of(data.get("environment"), _environment),
        "contamination": _of(data.get("contamination"), lambda entry: _contamination(entry, data)),
    }


def _advice(data: Entry) -> dict[str, object]:
    target = data.get("target")
    return {**data, "resolved": isinstance(target, float) and target < _RESOLVED}


def _environment(data: Entry) -> dict[str, object]:
    thermometer = _of(data.get("thermometer"), lambda known: {**_THERMOMETER, **known})
    return {**data, "thermometer": thermometer}


def _contamination(data: Entry, channel: Entry) -> dict[str, object]:
    unit = si_unit(str(channel.get("kind")), "N", str(channel.get("unit") or ""))
    quantities = {name: _of(data.get(name), lambda n: {**n, "unit": unit}) for name in ("N", "N_without")}
    return {**data, **quantities}


def _spectrum(data: Entry, channel: Entry) -> dict[str, object]:
    """The first studies of this version told neither how a spectrum was made nor how wide its lines may be."""
    curve = channel.get("curve")
    made: Entry = curve if isinstance(curve, Mapping) else {}
    density, corner = data.get("density", []), data.get("corner")
    unknown = [None] * len(density) if isinstance(density, Sequence) else []
    known: Entry = {
        **{name: [] for name in ("frequency", "density", "lower", "upper", "lines")},
        "channel": channel.get("name"),
        "edf": unknown,
        "background": density,
        "dt": made.get("dt"),
        "n_samples": made.get("n_samples"),
        "sampling": made.get("sampling"),
        "band_limit": None if corner is None else {"plateau": math.nan, "begins": math.nan, "corner": corner},
    }
    return {**known, **data, "lines": _each(data.get("lines", []), lambda line: {"width": None, **line})}
