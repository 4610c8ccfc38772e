# SPDX-License-Identifier: BSD-3-Clause
"""The page that says for every program which number goes where, made of what the exporters write by."""

from __future__ import annotations

import re
from collections.abc import Sequence

from allanite.exporters import EXPORTERS, exporter
from allanite.exporters.imu import Slot
from allanite.quantities.units import parse_unit
from consumers import PACKAGES

__all__ = ["which_number_page"]


def which_number_page() -> str:
    """docs/reference/which-number-goes-where.md: each program, by the `USAGE` that its file is written with."""
    rows, sources = [], []
    for name in EXPORTERS:
        usage, file = getattr(exporter(name), "USAGE", None), exporter(name).FILE_NAME
        if usage is None:
            continue
        convention = next(s.formula.convention for s in usage.slots if s.formula.of == "noise")
        files = ", ".join(f"`{f}`" for f in file.split(", "))
        caution = with_roots(usage.trap) + (f". Lost: {usage.lost}" if usage.lost else "")
        tested = f"`{name}`" + (f", {PACKAGES[name]}" if name in PACKAGES else "")
        for program in usage.programs:
            rows.append((program.name, files, keys_of(usage.slots), convention, caution, tested))
            sources.append((program.name, program.source))
    head = ("program", "file", "key = formula", "white noise is", "caution", "tested by")
    return "\n".join([
        *WHICH_NUMBER.splitlines(), "", *table_of(head, sorted(rows, key=lambda row: row[0].lower())), "",
        "## Where the formulas were read", "",
        *table_of(("program", "source"), sorted(sources, key=lambda row: row[0].lower())), "",
    ])  # fmt: skip


WHICH_NUMBER = """\
# Which number goes where

The keys of each program and what it needs there, made by `make docs` from the tables with which `allanite export`
writes the files. [How to export](../howto/export.md).

N is the white noise (angle or velocity random walk) and K the random walk of the bias, both root densities in SI; K
includes the bias instability as `--walk` says. σ and T are the standard deviation and the correlation time of a
Gauss-Markov bias, B is the bias instability of IEEE Std 952, and f is the rate of the samples, `--filter-rate`. Units
are SI unless stated. A program whose white noise is *continuous* makes it discrete itself; one that wants the *standard
deviation of a sample* does not.

*Tested by*: the update step of the program, a function of this name in `tests/consumers.py`, recovers N and the bias of
the model from the file as written. With the plain coefficient in place of the formula it does not. Packages named there
run on the same numbers where they are installed."""


def table_of(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> list[str]:
    """A table in Markdown."""
    return [f"| {' | '.join(row)} |" for row in (head, ("---",) * len(head), *rows)]


def keys_of(slots: Sequence[Slot]) -> str:
    """Keys with their formulas, those of one formula together."""
    groups: dict[str, list[str]] = {}
    for slot in slots:
        plain = slot.formula.power == 2 or parse_unit(slot.unit).factor == 1
        unit = "" if plain else f" in {with_roots(slot.unit)}"
        axes = f"{slot.axes[0]}…{slot.axes[-1]}" if slot.axes else ""
        groups.setdefault(f"{slot.formula}{unit}", []).append(f"`{slot.key}{axes}`")
    return "; ".join(f"{', '.join(dict.fromkeys(keys))} = {formula}" for formula, keys in groups.items())


def with_roots(text: str) -> str:
    """Roots as the documents write them."""
    return re.sub(r"sqrt\((\w+)\)", r"√\1", text).replace("sqrt(", "√(")
