# SPDX-License-Identifier: BSD-3-Clause
"""Combined sensors, from a log with their models and axes to everything that a report needs."""

from __future__ import annotations

import csv
import os
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from allanite.commands.measurement import MeasurementResult, beside
from allanite.commands.recordings import has_gaps, models_from, read_part
from allanite.errors import FormatError, InputError
from allanite.plain_files.regular_file import file_sha256, read_regular_text

__all__ = ["combination_of", "directions_from", "save_combined"]

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
    command: str | None = None,
    source: str | None = None,
    estimate: Mapping[str, Any] | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """Sensors of one kind of a log as one; see `combine`, whose further options `estimate` holds.

    Parameters
    ----------
    model : path
        Of every sensor by its name, or one for all.
    directions : path, optional
        CSV of the sensitive axes: see `directions_from`. Without it all sensors lie along one axis.
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
    from allanite.recording.health import check

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
        progress=lambda fraction, what: advance(0.1 + 0.7 * fraction, what),
        **(estimate or {}),
    )
    advance(0.8, "looking for faults of the record")
    findings = [f for f in check(recording.select(*combination.channels)) if f.code not in _JUDGED_HERE]
    document = {
        **combination.to_json(),
        **beside(recording, None, findings, file_sha256(log), command),
        "model_name": str(model),
    }
    rows = [
        {
            "sensor": name,
            **{axis: f"{w[i]:.9f}" for axis, w in zip(combination.axes, combination.weights, strict=True)},
        }
        for i, name in enumerate(combination.channels)
    ]
    return MeasurementResult(
        result=combination,
        document=document,
        name="combination",
        tables={"weights.csv": rows},
        lossy=has_gaps(recording),
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
        raise FormatError(f"{path}: a file of sensitive axes begins with channel,x,y,z")
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
            raise FormatError(f"{path}, line {number}: channel {row[0]!r} is there twice")
        axes[row[0]] = axis
    return axes


def save_combined(measured: MeasurementResult, path: str | os.PathLike[str], *, force: bool = False) -> Path:
    """Write the combined recording."""
    from allanite.files.recording_file import write_recording

    return write_recording(measured.result.recording(), path, force=force)
