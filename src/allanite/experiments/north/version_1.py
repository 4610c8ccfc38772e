# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for codes, and bare ends of intervals: what they say in the present version."""

from __future__ import annotations

from collections.abc import Mapping

from allanite.experiments.reversals.apart import apart_of_sentences
from allanite.quantities.earlier_documents import checks_of_kind, quantity_entry, texts

__all__ = ["upgraded", "upgraded_null"]

_KINDS = {
    "size of the noise": "size",
    "constancy of the heading": "constancy",
    "scatter of the positions": "scatter",
}


def upgraded(data: Mapping[str, object]) -> dict[str, object]:
    """A document of a search for north, version 1, as one of version 2."""
    rate, ends = data.get("horizontal_rate"), data.get("horizontal_interval")
    return {
        **data,
        "version": 2,
        "horizontal": quantity_entry(rate, ends, "rad/s", resolved=rate is not None),
        "checks": checks_of_kind(data.get("checks"), _KINDS),
        "apart": apart_of_sentences(texts(data.get("advice"))),
    }


def upgraded_null(data: Mapping[str, object]) -> dict[str, object]:
    """A document of a null test, version 1, as one of version 2."""
    value = data.get("value")
    return {
        **data,
        "version": 2,
        "following": quantity_entry(value, data.get("interval"), "rad/s", resolved=value is not None),
        "checks": checks_of_kind(data.get("checks"), _KINDS),
    }
