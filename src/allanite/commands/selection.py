# SPDX-License-Identifier: BSD-3-Clause
"""Which terms the channels of a log support, with everything that a report of it needs."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping, Sequence
from typing import Any, Literal

from allanite.commands.measurement import MeasurementResult, beside
from allanite.commands.recordings import has_gaps, noise_channels, ready_log
from allanite.plain_files.regular_file import file_sha256

__all__ = ["selection_of"]

Advance = Callable[[float, str], None]
Json = Mapping[str, Any]


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
    from allanite.fitting.selection import select
    from allanite.fitting.selection.results import document_of

    advance = progress or (lambda fraction, what: None)
    ready, findings = ready_log(
        log,
        accept=accept,
        source=source,
        progress=lambda fraction, what: advance(0.2 * fraction, what),
        **options,
    )
    names = noise_channels(ready)
    selections = [
        select(ready, channel=name, lines=lines, confidence=confidence, progress=_part(advance, i, names))
        for i, name in enumerate(names)
    ]
    document = {
        **document_of(selections),
        **beside(ready, None, findings, file_sha256(log), command),
        "source": ready.source,
    }
    return MeasurementResult(
        result=document,
        document=document,
        name="selection",
        tables={"selection.csv": _rows(document)},
        lossy=has_gaps(ready),
    )


def _part(advance: Advance, i: int, names: Sequence[str]) -> Advance:
    """The share of one channel in the whole."""
    return lambda fraction, what: advance(0.2 + 0.8 * (i + fraction) / len(names), f"{names[i]}: {what}")


def _rows(document: Json) -> list[dict[str, Any]]:
    """One row for each candidate, parameters in SI."""
    symbols = list(
        dict.fromkeys(s for ch in document["channels"] for c in ch["candidates"] for s in c["parameters"])
    )
    return [
        {
            "channel": channel["name"],
            "terms": " ".join(c["letters"]),
            "weight": c["weight"],
            "score": c["score"],
            "log_likelihood": c["log_likelihood"],
            "p": c["p"],
            **{s: c["parameters"].get(s, "") for s in symbols},
        }
        for channel in document["channels"]
        for c in channel["candidates"]
    ]
