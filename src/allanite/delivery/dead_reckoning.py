# SPDX-License-Identifier: BSD-3-Clause
"""A budget of dead reckoning, from models out of files or words to everything that a report needs."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from allanite.delivery.measurement import Measured, provenance
from allanite.errors import InputError

__all__ = ["dead_reckoning_of"]

Advance = Callable[[float, str], None]


def dead_reckoning_of(
    models: Iterable[str | os.PathLike[str]],
    *,
    command: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> Measured:
    """Errors over time, by source; options are those of `dead_reckon`.

    Parameters
    ----------
    models : iterable of path
        Studies, models, data sheets, or words; several where gyros and accelerometers were studied apart.

    Raises
    ------
    InputError
        Two sources that name the same channel.
    """
    from allanite.dead_reckoning import dead_reckon
    from allanite.model_file import load_models
    from allanite.wording import duration

    found: dict[str, Any] = {}
    rate, records = None, []
    for source in models:
        held, own = load_models(source)
        twice = sorted(set(held) & set(found))
        if twice:
            raise InputError(f"{source} has another model of {twice[0]!r}: give each channel once")
        found |= held
        rate = rate or own
        records += [] if own is None else [_length(source)]
    if rate is not None:
        options.setdefault("rate", rate)
    made = dead_reckon(found, **options)
    if records and min(records) < made.duration:
        note = (
            f"the record is {duration(min(records))} long: beyond that the noise models are an extrapolation"
        )
        made = replace(made, notes=(*made.notes, note))
    document = {**made.to_json(), "provenance": provenance("", command=command)}
    return Measured(
        result=made,
        document=document,
        name="dead-reckoning",
        tables={"errors.csv": _rows(made.table())},
        lossy=False,
    )


def _length(study: str | os.PathLike[str]) -> float:
    """Of the record that was studied [s]."""
    return float(json.loads(Path(study).read_text(encoding="utf-8"))["recording"]["duration"])


def _rows(table: list[dict[str, Any]]) -> list[dict[str, Any]]:
    ends = ("sd", "lower", "upper")
    return [
        {**row, "time_s": f"{row['time_s']:g}", **{end: f"{row[end]:.6g}" for end in ends}} for row in table
    ]
