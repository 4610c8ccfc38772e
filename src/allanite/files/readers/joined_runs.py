# SPDX-License-Identifier: BSD-3-Clause
"""Runs of one instrument one after another, as after a power cut: one log with a gap between them.

Each run keeps the grid of its counter. How far the next one lies behind is known from the wall clock of the host alone:
the gap is as exact as that, and what is averaged over it is not.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from allanite.errors import InputError
from allanite.files.readers.table import Table
from allanite.recording.records import Column, Spliced

__all__ = ["join_runs"]

_IDENTITY = ("maker", "model", "serial")


def join_runs(tables: Sequence[Table], names: Sequence[str], chained: Any) -> Table:
    """One table of several runs, in the order of their starts.

    Parameters
    ----------
    tables : sequence of Table
        Of the reader `run`, at least 2.
    names : sequence of str
        Their folders, for messages.
    chained : callable
        Columns one after another as one, see `allanite.files.readers.joining`.

    Raises
    ------
    InputError
        Another instrument, other channels, settings or rate; or runs that overlap.
    """
    placed = sorted(zip(tables, names, strict=True), key=lambda p: p[0].start or 0)
    first, first_name = placed[0]
    rate = float(first.rate or 0.0)
    for table, name in placed[1:]:
        if other := _differences(first, table):
            raise InputError(
                f"{name} does not belong to the same log as {first_name}: {'; '.join(other)}. Such "
                "samples are never merged: characterize them separately, and compare the studies"
            )
    lengths = [len(t.columns[0]) for t, _ in placed]
    begins = [round(((t.start or 0) - (first.start or 0)) * 1e-9 * rate) for t, _ in placed]
    for (_, name), begin, (_, next_), following, n in zip(
        placed, begins, placed[1:], begins[1:], lengths, strict=False
    ):
        if begin + n > following:
            raise InputError(f"{name} and {next_} overlap in time by {(begin + n - following) / rate:g} s")
    edges = tuple(int(e) for e in np.cumsum([0, *lengths]))
    source, grid = np.array(edges), np.array(begins)

    def column(i: int) -> Column:
        whole = chained([t.columns[i] for t, _ in placed], edges)
        return Spliced(whole, source, grid, begins[-1] + lengths[-1])

    labels = [name for _, name in placed]
    return replace(
        first,
        columns=tuple(column(i) for i in range(len(first.columns))),
        source={
            **first.source,
            **_counted([t for t, _ in placed]),
            "files": labels,
            "missing": _missing(placed, begins, lengths),
        },
        guesses=(
            *dict.fromkeys(g for t, _ in placed for g in t.guesses),
            "the gap between runs is known only from the wall clock of the host",
        ),
        history=(*(step for t, _ in placed for step in t.history), {"step": "join", "files": labels}),
    )


def _differences(one: Table, other: Table) -> list[str]:
    """Why two runs are not one log."""
    here, there = _record_step(one), _record_step(other)
    differences = [
        f"{key} {here['instrument'].get(key)!r} and {there['instrument'].get(key)!r}"
        for key in _IDENTITY
        if here["instrument"].get(key) != there["instrument"].get(key)
    ]
    if one.rate != other.rate:
        differences.append(f"{one.rate:g} Hz and {other.rate:g} Hz")
    if one.channels != other.channels:
        differences.append(f"channels {_channels(one)} and {_channels(other)}")
    keys = sorted({*here["settings"], *there["settings"]})
    return differences + [
        f"setting {key} {here['settings'].get(key)!r} and {there['settings'].get(key)!r}"
        for key in keys
        if here["settings"].get(key) != there["settings"].get(key)
    ]


def _record_step(table: Table) -> Mapping[str, Any]:
    return next(step for step in table.history if step.get("step") == "record")


def _channels(table: Table) -> str:
    return ", ".join(
        f"{c.name} ({c.unit}, 1 = {c.scale:.9g} SI, aperture {c.aperture})" for c in table.channels or ()
    )


def _counted(tables: Sequence[Table]) -> dict[str, Any]:
    """What is counted in each run, of all of them."""
    sources = [t.source for t in tables]
    return {
        "samples": sum(s["samples"] for s in sources),
        "remarks": sum(s["remarks"] for s in sources),
        "flagged": {name: sum(s["flagged"][name] for s in sources) for name in sources[0]["flagged"]},
    }


def _missing(
    placed: Sequence[tuple[Table, str]], begins: Sequence[int], lengths: Sequence[int]
) -> list[dict[str, Any]]:
    """The gaps of all runs, and those between them."""
    gaps: list[dict[str, Any]] = []
    end = 0
    for (table, name), begin, n in zip(placed, begins, lengths, strict=True):
        if begin > end:
            gaps.append({"position": end, "samples": begin - end, "reason": f"before {name} was begun"})
        gaps += [{**gap, "position": gap["position"] + begin} for gap in table.source.get("missing", ())]
        end = begin + n
    return gaps
