# SPDX-License-Identifier: BSD-3-Clause
"""Combined sensors, from a log with their models and axes to everything that a report needs."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Sequence
from typing import Any

from allanite.commands.measurement import MeasurementResult, origin_of
from allanite.commands.recordings import has_gaps, models_from, read_part
from allanite.errors import FormatError, InputError
from allanite.plain_files.regular_file import read_regular_text

__all__ = ["combination_of", "directions_from"]

Advance = Callable[[float, str], None]

#: The sensors are judged by their parity; these say the same of one alone, and a sensor at fault stays in the record.
_JUDGED_HERE = frozenset(
    {"not_at_rest", "disturbance", "spikes", "heavy_tails", "amplitude_drop", "noise_changes", "stuck"}
)


def combination_of(
    log: str | os.PathLike[str],
    *,
    model: str | os.PathLike[str],
    directions: str | os.PathLike[str] | None = None,
    averaging: float | None = None,
    moving: bool = False,
    motion_error: float = 0.0,
    window: float | None = None,
    false_alarm: float = 0.01,
    confidence: float = 0.95,
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """Sensors of one kind of a log as one; see `combine`.

    Parameters
    ----------
    model : path
        Of every sensor by its name, or one for all.
    directions : path, optional
        CSV of the sensitive axes: see `directions_from`. Without it all sensors lie along one axis.
    moving : bool
        The record is not at rest.
    **options
        Those of `read`.

    Raises
    ------
    InputError
        No model for a sensor, or what `combine` refuses.
    FormatError
        A file of axes that does not hold them.
    """
    from allanite.experiments.redundancy import combine
    from allanite.recording.health.examination import check
    from allanite.study.result_document import ResultDocument

    advance = progress or (lambda fraction, what: None)
    advance(0.0, "reading")
    recording = read_part(log, source=source, **options)
    axes = None if directions is None else directions_from(directions)
    names = list(axes) if axes else None
    if names is not None:
        recording = recording.select(*names)
    combination = combine(
        recording,
        models=models_from(model, recording.names),
        directions=None if axes is None else list(axes.values()),
        channels=names,
        averaging=averaging,
        rest=not moving,
        window=window,
        false_alarm=false_alarm,
        motion_error=motion_error,
        confidence=confidence,
        progress=lambda fraction, what: advance(0.1 + 0.7 * fraction, what),
    )
    advance(0.8, "checking the record for faults")
    findings = [f for f in check(recording.select(*combination.channels)) if f.code not in _JUDGED_HERE]
    result = combination.result
    return MeasurementResult(
        result=result,
        document=ResultDocument(
            result=result, model_name=str(model), **origin_of(recording, findings, log, command)
        ),
        name="combination",
        tables={},
        lossy=has_gaps(recording),
        series=combination.recording(),
    )


def directions_from(path: str | os.PathLike[str]) -> dict[str, Sequence[float]]:
    """Sensitive axes by channel out of a CSV with the head "channel,x,y,z".

    Raises
    ------
    InputError
        No such file.
    FormatError
        Another head, a line that is not a name and three numbers, or a channel twice.
    """
    try:
        rows = list(csv.reader(read_regular_text(path).splitlines()))
    except FileNotFoundError:
        raise InputError(f"no such file: {path}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(f"{path} cannot be read: {error}") from None
    rows = [[cell.strip() for cell in row] for row in rows if any(cell.strip() for cell in row)]
    if not rows or [cell.lower() for cell in rows[0]] != ["channel", "x", "y", "z"]:
        raise FormatError(f"{path}: a file of sensing axes must begin with channel,x,y,z")
    axes: dict[str, Sequence[float]] = {}
    for number, row in enumerate(rows[1:], 2):
        try:
            axis = [float(cell) for cell in row[1:]]
        except ValueError:
            axis = []
        if len(axis) != 3:
            raise FormatError(
                f"{path}, line {number}: expected a channel and three numbers, found {','.join(row)}"
            )
        if row[0] in axes:
            raise FormatError(f"{path}, line {number}: channel {row[0]!r} is listed twice")
        axes[row[0]] = axis
    return axes
