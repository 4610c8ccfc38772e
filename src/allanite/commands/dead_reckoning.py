# SPDX-License-Identifier: BSD-3-Clause
"""A budget of dead reckoning, from models out of files or words to everything that a report needs."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable
from dataclasses import replace
from typing import Any

from allanite.commands.measurement import MeasurementResult, provenance
from allanite.commands.recordings import models_of_several
from allanite.plain_files.json_values import parse_plain
from allanite.plain_files.regular_file import read_regular_text

__all__ = ["dead_reckoning_of"]

Advance = Callable[[float, str], None]


def dead_reckoning_of(
    models: Iterable[str | os.PathLike[str]],
    *,
    command: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
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
    from allanite.experiments.dead_reckoning import dead_reckon
    from allanite.views.wording import duration

    sources = list(models)
    given, rate = models_of_several(sources)
    if rate is not None:
        options.setdefault("rate", rate)
    made = dead_reckon(given, **options)
    records = [length for source in sources if (length := _length(source)) is not None]
    if records and min(records) < made.duration:
        note = (
            f"the record is {duration(min(records))} long: beyond that the noise models are an extrapolation"
        )
        made = replace(made, notes=(*made.notes, note))
    document = {**made.to_json(), "provenance": provenance("", command=command)}
    return MeasurementResult(
        result=made,
        document=document,
        name="dead-reckoning",
        tables={"errors.csv": _rows(made.table())},
        lossy=False,
    )


def _length(source: str | os.PathLike[str]) -> float | None:
    """Of the record that was studied [s]; None for models that do not tell it."""
    try:
        document = parse_plain(read_regular_text(source))
    except (OSError, ValueError):  # words, a data sheet
        return None
    if not isinstance(document, dict) or document.get("format") != "allanite-study":
        return None
    return float(document["recording"]["duration"])


def _rows(table: list[dict[str, Any]]) -> list[dict[str, Any]]:
    ends = ("sd", "lower", "upper")
    return [
        {**row, "time_s": f"{row['time_s']:g}", **{end: f"{row[end]:.6g}" for end in ends}} for row in table
    ]
