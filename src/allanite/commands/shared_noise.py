# SPDX-License-Identifier: BSD-3-Clause
"""Two or three sensors of a log taken apart, with everything that a report of it needs."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping
from typing import Any

from allanite.commands.measurement import MeasurementResult, beside
from allanite.commands.recordings import has_gaps, ready_log
from allanite.plain_files.regular_file import file_sha256

__all__ = ["separation_of"]

Advance = Callable[[float, str], None]
Json = Mapping[str, Any]


def separation_of(
    log: str | os.PathLike[str],
    *,
    accept: Collection[str] = (),
    command: str | None = None,
    source: str | None = None,
    estimate: Mapping[str, Any] | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """What two or three sensors of a log share, and what each has alone; see `separate_noise`, whose options `estimate`
    holds.

    Parameters
    ----------
    accept : collection of str
        Codes of fatal findings to go on in spite of.
    **options
        Those of `read`.

    Raises
    ------
    InputError
        What `separate_noise` refuses.
    DataQualityError
        A fatal finding that was not accepted.
    """
    from allanite.stability.shared_noise import separate_noise

    advance = progress or (lambda fraction, what: None)
    ready, findings = ready_log(
        log,
        accept=accept,
        source=source,
        progress=lambda fraction, what: advance(0.4 * fraction, what),
        **options,
    )
    result = separate_noise(
        ready, progress=lambda fraction, what: advance(0.4 + 0.6 * fraction, what), **(estimate or {})
    )
    document = {
        **result.to_json(),
        **beside(ready, None, findings, file_sha256(log), command),
        "model_name": "",
    }
    return MeasurementResult(
        result=result,
        document=document,
        name="separation",
        tables={"separation.csv": _rows(document)},
        lossy=has_gaps(ready),
    )


def _rows(document: Json) -> list[dict[str, Any]]:
    """One row for each part and lag, in SI."""
    names = ("variance", "variance_lower", "variance_upper", "deviation", "lower", "upper", "edf")
    return [
        {"part": part["name"], "tau": tau, **{name: part[name][i] for name in names}}
        for part in (*document["own"], document["common"])
        for i, tau in enumerate(document["tau"])
    ]
