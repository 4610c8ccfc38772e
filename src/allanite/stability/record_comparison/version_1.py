# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for codes, and bare ends of intervals: what they say in the present version."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from allanite.quantities.display_units import si_unit

__all__ = ["upgraded"]

Entry = Mapping[str, object]

_ODD, _END = ": no sum of terms explains the curve of ", "; the parameters' intervals"
_APERTURE = ": the averaging time within a sample (aperture) differs"


def upgraded(data: Entry) -> dict[str, object]:
    """The document of a comparison, version 1, as one of version 2; what is damaged stays so."""
    sentences = data.get("remarks")
    remarks = [str(r) for r in sentences] if isinstance(sentences, Sequence) else []
    return {**data, "version": 2, "channels": [_channel(c, remarks) for c in _entries(data.get("channels"))]}


def _entries(value: object) -> list[Entry]:
    return [v for v in value if isinstance(v, Mapping)] if isinstance(value, Sequence) else []


def _channel(data: Entry, remarks: Sequence[str]) -> dict[str, object]:
    name = str(data.get("name"))
    odd = [r.removeprefix(name + _ODD).partition(_END)[0] for r in remarks if r.startswith(name + _ODD)]
    parameters = [_parameter(p, data) for p in _entries(data.get("parameters"))]
    bias = data.get("bias")
    return {
        **data,
        "unexplained": [record for listed in odd for record in listed.split(", ")],
        "apertures_differ": any(r.startswith(name + _APERTURE) for r in remarks),
        "parameters": parameters,
        "bias": _parameter(bias, data) if isinstance(bias, Mapping) else None,
    }


def _parameter(data: Entry, channel: Entry) -> dict[str, object]:
    symbol = str(data.get("symbol"))
    unit = si_unit(str(channel.get("kind")), symbol, str(channel.get("unit") or ""))
    population, common = data.get("population"), data.get("common")
    return {
        **data,
        "records": [_quantity(r, unit) for r in _entries(data.get("records"))],
        "common": _quantity(common, unit) if isinstance(common, Mapping) else common,
        "population": (
            _population(population, unit, symbol) if isinstance(population, Mapping) else population
        ),
    }


def _quantity(data: Entry, unit: str) -> dict[str, object]:
    status = (
        "resolved"
        if data.get("supported")
        else "not resolved"
        if data.get("upper") is None
        else "upper limit"
    )
    ends = {
        name: None if status == "not resolved" else data.get(name) for name in ("value", "lower", "upper")
    }
    return {**ends, "unit": unit, "status": status}


def _population(data: Entry, unit: str, symbol: str) -> dict[str, object]:
    ahead = [data.get("next_lower"), data.get("next_upper")]
    middle = {"value": data.get("mean"), "lower": data.get("lower"), "upper": data.get("upper")}
    spread = {
        name: data.get(f"spread{end}")
        for name, end in (("value", ""), ("lower", "_lower"), ("upper", "_upper"))
    }
    bounded = data.get("spread_upper") is not None
    limit = "upper limit" if data.get("spread_lower") == 0 else "resolved"
    return {
        "resolved": data.get("resolved"),
        "middle": {**middle, "unit": unit, "status": "not resolved" if data.get("upper") is None else "resolved"},
        "spread": {
            **spread, "unit": unit if symbol == "mean" else "1", "status": limit if bounded else "not resolved"
        },
        "next_sensor": None if None in ahead else ahead,
    }  # fmt: skip
