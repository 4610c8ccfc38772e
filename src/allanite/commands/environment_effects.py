# SPDX-License-Identifier: BSD-3-Clause
"""Effects of the environment, from a log to everything that a report needs."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Iterator, Mapping
from typing import TYPE_CHECKING, Any, Literal

from allanite.commands.measurement import MeasurementResult, file_names, origin_of
from allanite.commands.recordings import has_gaps, models_from, noise_channels, ready_log

if TYPE_CHECKING:
    from allanite.stability.environment.correction import Correction

__all__ = ["environment_of"]

Advance = Callable[[float, str], None]
_CURVE = ("tau", "before", "after", "deviation", "error", "share", "left")


def environment_of(
    log: str | os.PathLike[str],
    *,
    temperature: str | Mapping[str, str] | None = None,
    warm_up: Literal["model", "cut"] | None = None,
    model: str | os.PathLike[str] | None = None,
    accept: Collection[str] = (),
    confidence: float = 0.95,
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """Temperature and warm-up in every channel of a log that carries sensor noise; see `free_of_environment`.

    Parameters
    ----------
    model : path, optional
        Noise of the sensors, known from elsewhere: one for all, or one for each.
    **options
        Those of `read`.

    Raises
    ------
    InputError
        No temperature and no warm-up to look at, or what `free_of_environment` refuses.
    DataQualityError
        A fatal finding that was not accepted.
    """
    from allanite.stability.environment.estimation import free_of_environment
    from allanite.stability.environment.remarks import remarks
    from allanite.study.result_document import ResultDocument

    advance = progress or (lambda fraction, what: None)
    prepared, findings = ready_log(
        log,
        accept=accept,
        source=source,
        progress=lambda fraction, what: advance(0.1 * fraction, what),
        **options,
    )
    thermometers = {temperature} if isinstance(temperature, str) else set((temperature or {}).values())
    names = noise_channels(prepared.select(*(n for n in prepared.names if n not in thermometers)))
    freed = free_of_environment(
        prepared,
        channels=names,
        temperature=temperature,
        warm_up=warm_up,
        models=None if model is None else models_from(model, names),
        confidence=confidence,
        progress=lambda fraction, what: advance(0.1 + 0.8 * fraction, what),
    )
    shown = [*findings, *(r for e in freed.estimates for r in remarks(e))]
    result = freed.result
    curves = {e.channel: e.correction for e in freed.estimates if e.correction is not None}
    return MeasurementResult(
        result=result,
        document=ResultDocument(result=result, **origin_of(prepared, shown, log, command)),
        name="environment",
        tables={
            name: [*_rows(curve)]
            for name, curve in zip(file_names(curves, ".csv"), curves.values(), strict=True)
        },
        lossy=has_gaps(prepared),
        series=freed.residual,
    )


def _rows(curve: Correction) -> Iterator[dict[str, object]]:
    """One row of a table for each averaging time, in SI."""
    for values in zip(*(getattr(curve, name).tolist() for name in _CURVE), strict=True):
        yield dict(zip(_CURVE, values, strict=True))
