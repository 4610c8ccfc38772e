# SPDX-License-Identifier: BSD-3-Clause
"""The deviation over time of a log, with everything that a report of it needs."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping
from typing import Any

from allanite.commands.measurement import MeasurementResult, beside
from allanite.commands.recordings import has_gaps, models_from, noise_channels, ready_log
from allanite.plain_files.regular_file import file_sha256

__all__ = ["variation_of"]

Advance = Callable[[float, str], None]
Json = Mapping[str, Any]

#: What this measurement asks itself, at every lag and with its own level.
_JUDGED_HERE = frozenset({"noise_changes", "amplitude_drop"})


def variation_of(
    log: str | os.PathLike[str],
    *,
    model: str | os.PathLike[str] | None = None,
    accept: Collection[str] = (),
    command: str | None = None,
    source: str | None = None,
    estimate: Mapping[str, Any] | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """Does the noise of a log change? See `examine_variation`, whose further options `estimate` holds.

    Parameters
    ----------
    model : path, optional
        Of every channel by its name, or one for all; by default the fit to the log itself.
    accept : collection of str
        Codes of fatal findings to go on in spite of.
    **options
        Those of `read`.

    Raises
    ------
    DataQualityError
        A fatal finding that was not accepted.
    """
    from allanite.stability.variation import examine_variation

    advance = progress or (lambda fraction, what: None)
    ready, findings = ready_log(
        log,
        accept=accept,
        judged_elsewhere=_JUDGED_HERE,
        source=source,
        progress=lambda fraction, what: advance(0.3 * fraction, what),
        **options,
    )
    result = examine_variation(
        ready,
        models=None if model is None else models_from(model, noise_channels(ready)),
        progress=lambda fraction, what: advance(0.3 + 0.7 * fraction, what),
        **(estimate or {}),
    )
    document = {
        **result.to_json(),
        **beside(ready, None, findings, file_sha256(log), command),
        "model_name": "" if model is None else str(model),
    }
    return MeasurementResult(
        result=result,
        document=document,
        name="variation",
        tables={"variation.csv": _rows(document)},
        lossy=has_gaps(ready),
    )


def _rows(document: Json) -> list[dict[str, Any]]:
    """One row for each window and lag, in SI."""
    names = ("start", "stop", "deviation", "lower", "upper", "edf", "ratio", "significant")
    return [
        {"channel": channel["name"], "tau": lag["tau"], **dict(zip(names, values, strict=True))}
        for channel in document["channels"]
        for lag in channel["lags"]
        for values in zip(*(lag[name] for name in names), strict=True)
    ]
