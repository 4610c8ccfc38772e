# SPDX-License-Identifier: BSD-3-Clause
"""A log at rest and logs in motion, read and compared."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from allanite.commands.measurement import MeasurementResult, measured_result, origin_of
from allanite.commands.recordings import is_lossy, models_from, noise_channels, ready_log
from allanite.errors import InputError

if TYPE_CHECKING:
    from allanite.recording.health.finding import Finding

__all__ = ["in_motion_of"]

Advance = Callable[[float, str], None]

#: Findings that motion makes: they are what is measured.
_OF_MOTION = (
    "not_at_rest",
    "motion",
    "disturbance",
    "spikes",
    "heavy_tails",
    "contaminated",
    "noise_changes",
    "amplitude_drop",
    "gravity",
    "aliasing",
    "bias_removed",
)


def in_motion_of(
    places: Sequence[str | os.PathLike[str]],
    *,
    above: float | None = None,
    fixed: bool = False,
    match: Sequence[str] = (),
    model: str | os.PathLike[str] | None = None,
    accept: Sequence[str] = (),
    confidence: float = 0.95,
    command: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """The noise of logs in motion over that of a log at rest; see `allanite.measure_in_motion`.

    Parameters
    ----------
    places : sequence of path
        The log at rest, then those in motion.
    model : path, optional
        Models at rest by channel, or one for all.
    accept : sequence of str
        Codes of fatal findings to go on in spite of.
    **options
        Those of `read_part`.

    Raises
    ------
    InputError
        Fewer than two logs, or what `measure_in_motion` refuses.
    DataQualityError
        A fatal finding that was not accepted.
    """
    from allanite.stability.in_motion import measure_in_motion

    if len(places) < 2:
        raise InputError(
            "one log: state the log at rest, then those in motion: allanite in-motion REST MOTION"
        )
    advance = progress or (lambda fraction, what: None)
    advance(0.0, "reading")
    rest, findings = ready_log(places[0], accept=accept, **options)
    moved = [ready_log(place, accept=accept, judged_elsewhere=_OF_MOTION, **options) for place in places[1:]]
    result = measure_in_motion(
        rest,
        [recording for recording, _ in moved],
        above=above,
        fixed=fixed,
        match=match,
        models=None if model is None else models_from(model, noise_channels(rest)),
        confidence=confidence,
        progress=lambda fraction, what: advance(0.3 + 0.7 * fraction, what),
    )
    logs = (replace(log, faults=_faults(of_log)) for log, (_, of_log) in zip(result.logs, moved, strict=True))
    result = replace(result, logs=tuple(logs))
    lossy = any(is_lossy(f.to_json() for f in each) for each in (findings, *(of_log for _, of_log in moved)))
    measured = measured_result(
        "in-motion",
        result,
        lossy=lossy,
        model_name="" if model is None else str(model),
        **origin_of(rest, findings, places[0], command),
    )
    return replace(measured, models=result.models)


def _faults(findings: Iterable[Finding]) -> tuple[str, ...]:
    from allanite.recording.health.finding import Severity

    grave = (f for f in findings if f.severity is not Severity.INFO)
    return tuple(f"{f.channel + ': ' if f.channel else ''}{f.message}" for f in grave)
