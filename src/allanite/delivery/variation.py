# SPDX-License-Identifier: BSD-3-Clause
"""The deviation over time of a log, with everything that a report of it needs."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping
from typing import TYPE_CHECKING, Any

from allanite.delivery.measurement import Measured, beside
from allanite.delivery.recordings import file_sha256, has_gaps, read_part

if TYPE_CHECKING:
    from allanite.noise import NoiseModel

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
) -> Measured:
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
    from allanite.health import check, prepare
    from allanite.variation import examine_variation

    advance = progress or (lambda fraction, what: None)
    advance(0.0, "reading")
    recording = read_part(log, source=source, **options)
    found = check(recording, progress=lambda fraction: advance(0.3 * fraction, "looking for faults"))
    ready, findings = prepare(recording, [f for f in found if f.code not in _JUDGED_HERE], accept=accept)
    result = examine_variation(
        ready,
        models=None if model is None else _models(model),
        progress=lambda fraction, what: advance(0.3 + 0.7 * fraction, what),
        **(estimate or {}),
    )
    document = {
        **result.to_json(),
        **beside(ready, None, findings, file_sha256(log), command),
        "model_name": "" if model is None else str(model),
    }
    return Measured(
        result=result,
        document=document,
        name="variation",
        tables={"variation.csv": _rows(document)},
        lossy=has_gaps(ready),
    )


def _models(source: str | os.PathLike[str]) -> NoiseModel | dict[str, NoiseModel]:
    """Models by channel; one alone stands for all channels."""
    from allanite.model_file import load_models

    models, _ = load_models(source)
    return next(iter(models.values())) if len(models) == 1 else models


def _rows(document: Json) -> list[dict[str, Any]]:
    """One row for each window and lag, in SI."""
    names = ("start", "stop", "deviation", "lower", "upper", "edf", "ratio", "significant")
    return [
        {"channel": channel["name"], "tau": lag["tau"], **dict(zip(names, values, strict=True))}
        for channel in document["channels"]
        for lag in channel["lags"]
        for values in zip(*(lag[name] for name in names), strict=True)
    ]
