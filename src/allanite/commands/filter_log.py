# SPDX-License-Identifier: BSD-3-Clause
"""The log of a filter: its innovations and the variances that it stated."""

from __future__ import annotations

import os
import re
from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from allanite.commands.measurement import MeasurementResult, measured_result, origin_of
from allanite.commands.recordings import has_gaps, read_part
from allanite.errors import InputError

if TYPE_CHECKING:
    from allanite.recording.records import Recording

__all__ = ["innovations_of"]

Advance = Callable[[float, str], None]

_VARIANCE = re.compile(r"^S(?![a-z])|(?<![a-z])(var|cov)", re.IGNORECASE)
_DEVIATION = re.compile(r"(?<![a-z])(sd|std|sigma|stddev)(?![a-z])", re.IGNORECASE)


def innovations_of(
    log: str | os.PathLike[str],
    *,
    innovations: Sequence[str] | None = None,
    variances: Sequence[str] | None = None,
    deviations: Sequence[str] | None = None,
    confidence: float = 0.95,
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """The innovations of a filter's log; see `allanite.examine_innovations`.

    Parameters
    ----------
    innovations, variances, deviations : sequence of str, optional
        Names of columns, in one order; by default as their names tell.
    **options
        Those of `read_part`.

    Raises
    ------
    InputError
        Columns that are not there or cannot be told apart, or what `examine_innovations` refuses.
    """
    from allanite.filtering.innovations import examine_innovations

    advance = progress or (lambda fraction, what: None)
    advance(0.0, "reading")
    recording = read_part(log, source=source, **options)
    of_axes, stated, power = _columns(recording, innovations, variances, deviations)
    advance(0.3, "testing the innovations")
    e, s = (np.stack([recording.values(name) for name in names], axis=1) for names in (of_axes, stated))
    result = examine_innovations(
        e, s**power, rate=recording.rate, names=of_axes, confidence=confidence, source=recording.source
    )
    return measured_result(
        "innovations", result, lossy=has_gaps(recording), **origin_of(recording, (), log, command)
    )


def _columns(
    recording: Recording,
    innovations: Sequence[str] | None,
    variances: Sequence[str] | None,
    deviations: Sequence[str] | None,
) -> tuple[list[str], list[str], int]:
    """Innovations, what was stated for them, and the power that makes variances of that."""
    names = list(recording.names)
    if variances is not None:
        stated, power = list(variances), 1
    elif deviations is not None:
        stated, power = list(deviations), 2
    elif by_name := [name for name in names if _VARIANCE.search(name)]:
        stated, power = by_name, 1
    else:
        stated, power = [name for name in names if _DEVIATION.search(name)], 2
    of_axes = [name for name in names if name not in stated] if innovations is None else list(innovations)
    for name in (*of_axes, *stated):
        recording.index(name)
    if not of_axes or len(of_axes) != len(stated):
        raise InputError(
            f"innovations ({', '.join(of_axes) or 'none'}) and their variances ({', '.join(stated) or 'none'}) do not "
            f"pair; the log has {', '.join(names)}: name both, --innovations and --variances (or --deviations), in one "
            "order"
        )
    return of_axes, stated, power
