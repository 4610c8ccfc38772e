# SPDX-License-Identifier: BSD-3-Clause
"""Which terms the channels of a log support, with everything that a report of it needs."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Sequence
from typing import Any, Literal

from allanite.commands.measurement import MeasurementResult, origin_of
from allanite.commands.recordings import has_gaps, noise_channels, ready_log

__all__ = ["selection_of"]

Advance = Callable[[float, str], None]


def selection_of(
    log: str | os.PathLike[str],
    *,
    lines: Sequence[float] | Literal["auto"] = "auto",
    confidence: float = 0.95,
    accept: Collection[str] = (),
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """Which terms do the channels of a log support? See `select`.

    Parameters
    ----------
    accept : collection of str
        Codes of fatal findings to go on in spite of.
    **options
        Those of `read`.

    Raises
    ------
    InputError
        No channel that carries noise.
    DataQualityError
        A fatal finding that was not accepted.
    """
    from allanite.fitting.selection import TermSelection, select
    from allanite.study.result_document import ResultDocument

    advance = progress or (lambda fraction, what: None)
    ready, findings = ready_log(
        log,
        accept=accept,
        by_averages=False,
        source=source,
        progress=lambda fraction, what: advance(0.2 * fraction, what),
        **options,
    )
    names = noise_channels(ready)
    selections = [
        select(ready, channel=name, lines=lines, confidence=confidence, progress=_part(advance, i, names))
        for i, name in enumerate(names)
    ]
    result = TermSelection(confidence=confidence, channels=tuple(one.entry for one in selections))
    return MeasurementResult(
        result=result,
        document=ResultDocument(result=result, **origin_of(ready, findings, log, command)),
        name="selection",
        tables={},
        lossy=has_gaps(ready),
    )


def _part(advance: Advance, i: int, names: Sequence[str]) -> Advance:
    """The share of one channel in the whole."""
    return lambda fraction, what: advance(0.2 + 0.8 * (i + fraction) / len(names), f"{names[i]}: {what}")
