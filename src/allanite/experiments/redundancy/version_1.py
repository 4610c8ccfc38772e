# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for facts: what they say in the present version."""

from __future__ import annotations

from collections.abc import Mapping

from allanite.quantities.earlier_documents import entries, quantity_entry, texts

__all__ = ["upgraded"]

_NOT_APART = "a fault is seen and its sensor named, but not apart: "
#: How a remark began -> the fact it stated.
_FACTS = {
    "the sensors disagree": "unusual",
    "the record was not at rest": "moved",
    "every window lies": "faults_everywhere",
}


def upgraded(data: Mapping[str, object]) -> dict[str, object]:
    """A document of a combination, version 1, as one of version 2."""
    remarks, parity, isolation = texts(data.get("remarks")), data.get("parity"), str(data.get("isolation"))
    parities = parity.get("dof") if isinstance(parity, Mapping) else None
    facts = {fact: any(r.startswith(head) for r in remarks) for head, fact in _FACTS.items()}
    groups = isolation.removeprefix(_NOT_APART).split("; ") if isolation.startswith(_NOT_APART) else []
    alike = [texts(data.get("channels"))] if parities == 1 else [group.split(" and ") for group in groups]
    return {
        **data,
        "version": 2,
        "faults": [{**fault, "parities": parities} for fault in entries(data.get("faults"))],
        "shared": [_pair(pair) for pair in entries(data.get("shared"))],
        "alike": alike,
        "at_rest": not facts.pop("moved"),
        **facts,
    }


def _pair(pair: Mapping[str, object]) -> dict[str, object]:
    ends = [pair.get("lower"), pair.get("upper")]
    return {**pair, "correlation": quantity_entry(pair.get("correlation"), ends, "1", resolved=True)}
