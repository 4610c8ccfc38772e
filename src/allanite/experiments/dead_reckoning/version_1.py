# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences; two of their values stand nowhere else."""

from __future__ import annotations

import re
from collections.abc import Mapping

from allanite.quantities.earlier_documents import first_match, texts

__all__ = ["upgraded"]

_OTHER = re.compile(r"with the other family the horizontal position is wrong by (\S+) (km|m) at the end")
_RECORD = re.compile(r"the record is (\S+) (d|h|min|s) long")
_SIZES = {"km": 1000.0, "m": 1.0, "d": 86400.0, "h": 3600.0, "min": 60.0, "s": 1.0}


def upgraded(data: Mapping[str, object]) -> dict[str, object]:
    """A budget, version 1, as one of version 2; what is damaged stays so."""
    notes = texts(data.get("notes"))
    # The first documents do not state `vertical`: its mean was always removed.
    return {
        "vertical": True,
        **data,
        "version": 2,
        "other_family": _value(_OTHER, notes),
        "record": _value(_RECORD, notes),
    }


def _value(pattern: re.Pattern[str], notes: list[str]) -> float | None:
    match = first_match(pattern, notes)
    return None if match is None else float(match[1]) * _SIZES[match[2]]
