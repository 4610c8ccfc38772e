# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 had the sheet at their top, statements in one with what was measured, and notes in words."""

from __future__ import annotations

import re
from collections.abc import Mapping

from allanite.quantities.display_units import si_unit
from allanite.quantities.earlier_documents import Entry, entries

__all__ = ["upgraded"]

_SHEET = ("sensor", "source", "sections")
_ENTRY = ("name", "text", "symbol", "value", "reading")
#: Note -> its code, and the averaging time where it names one.
_NOTES = (
    (re.compile("the study holds no"), "no model"),
    (re.compile("the fitted model holds no Gauss"), "no Gauss-Markov term"),
    (re.compile("the fitted model holds no such"), "no such term"),
    (re.compile("upper limit"), "upper limit"),
    (re.compile("of the Gauss-Markov term"), "B with the same peak"),
    (re.compile("no lag of the curve"), "no lag was fitted"),
    (re.compile(r"the curve still falls at (\S+) s"), "still falls"),
    (re.compile(r"at (\S+) s"), "minimum"),
)


def upgraded(data: Mapping[str, object]) -> dict[str, object]:
    """A data sheet beside a study, version 1, as one of version 2; what is damaged stays so."""
    sheet = {name: data[name] for name in _SHEET if name in data}
    return {
        **data,
        "version": 2,
        "datasheet": {**sheet, "file": data.get("sheet_name", "")},
        "channels": [_channel(c) for c in entries(data.get("channels"))],
    }


def _channel(channel: Entry) -> dict[str, object]:
    statements = [_statement(s, channel) for s in entries(channel.get("statements"))]
    return {**channel, "sheet": channel.get("model"), "statements": statements}


def _statement(statement: Entry, channel: Entry) -> dict[str, object]:
    entry = {name: statement[name] for name in _ENTRY if name in statement}
    symbol = str(statement.get("symbol"))
    value, known = statement.get("measured"), statement.get("upper") is not None
    matches = ((pattern.match(str(statement.get("note"))), code) for pattern, code in _NOTES)
    match, code = next(((m, code) for m, code in matches if m), (None, None))
    return {
        "entry": entry,
        "measured": {
            "value": value,
            "lower": statement.get("lower") if known else None,
            "upper": statement.get("upper"),
            "unit": si_unit(
                str(channel.get("kind")), "B" if symbol == "minimum" else symbol, str(channel.get("unit"))
            ),
            "status": "resolved" if value is not None else "upper limit" if known else "not resolved",
        },
        "remark": code,
        "tau": float(match[1]) if match is not None and match.groups() else None,
    }
