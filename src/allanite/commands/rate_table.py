# SPDX-License-Identifier: BSD-3-Clause
"""A run on a rate table, from a log, a model and the table's own record to everything that a report needs."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection, Mapping
from typing import TYPE_CHECKING, Any

from allanite.commands.measurement import MeasurementResult, beside
from allanite.commands.recordings import read_whole
from allanite.commands.turned import judged, models_for, part_of
from allanite.plain_files.regular_file import file_sha256

if TYPE_CHECKING:
    from allanite.experiments.rate_table import RateTableEstimate
    from allanite.recording.records import Recording

__all__ = ["STEPS", "rate_table_of"]

Json = Mapping[str, Any]
Advance = Callable[[float, str], None]

STEPS = "steps.csv"
"""Name of the table of steps."""


def rate_table_of(
    log: str | os.PathLike[str],
    *,
    table: str | os.PathLike[str],
    model: str | os.PathLike[str] | None = None,
    channel: str | None = None,
    start: float | None = None,
    stop: float | None = None,
    accept: Collection[str] = (),
    estimate: Mapping[str, Any] | None = None,
    command: str | None = None,
    source: str | None = None,
    progress: Advance | None = None,
    **options: Any,
) -> MeasurementResult:
    """The response to a rate table out of a log; see `measure_rate_table`, whose further options `estimate` holds.

    Parameters
    ----------
    log, model : path
        Whatever `read` and `load_models` understand.
    table : path
        CSV of the table's motion (`read_rate_table`).
    channel : str, optional
        On the axis of the table; of several the one that responds most.
    start, stop : float, optional [s]
        Part of the log.
    accept : collection of str
        Fatal findings to go on in spite of.
    **options
        Those of `read`.
    """
    import numpy as np

    from allanite.experiments.rate_table import measure_rate_table, read_rate_table
    from allanite.views.wording import step_rows

    advance = progress or (lambda fraction, what: None)
    advance(0.0, "reading")
    whole, start, stop = read_whole(log, start, stop, listed=True, source=source, **options)
    turned = read_rate_table(table)
    part = part_of(whole, start, stop)
    models, where = models_for(model, _following(part, channel), mapped=False)
    chosen: dict[str, Any] = {
        "table": turned,
        "model": models or None,
        "channel": channel,
        **(estimate or {}),
    }
    measured = measure_rate_table(part, progress=lambda f, what: advance(0.5 * f, what), **chosen)
    advance(0.5, "looking for faults")
    used = part.select(measured.channel, *_beside(part, measured, chosen))
    ready = judged(
        used,
        np.array([[0, part.n_samples]]),  # nobody says that the table rests before and after
        used.names,
        where="while the table turned",
        longest=0.0,
        accept=accept,
    )
    if any(f.excludes for f in ready.findings):
        measured = measure_rate_table(ready.recording, **{**chosen, "channel": measured.channel})
    document = {
        **measured.to_json(),
        **beside(part, measured.channel, ready.findings, file_sha256(log), command),
        "model_name": where[measured.channel],
    }
    tables = {STEPS: step_rows(document)} if document["steps"] else {}
    return MeasurementResult(
        result=measured, document=document, name="rate-table", tables=tables, lossy=ready.lossy
    )


def _following(recording: Recording, channel: str | None) -> list[Any]:
    """Channels that need a model: those of the kind that is measured."""
    from allanite.recording.records import Kind

    for kinds in ((Kind.RATE,), (Kind.VOLTAGE, Kind.COUNTS), (Kind.UNKNOWN,)):
        of_kind = [c for c in recording.channels if c.kind in kinds]
        if channel is not None and channel not in [c.name for c in of_kind]:
            continue
        if of_kind:
            return of_kind
    return [] if channel is None else [recording[channel]]


def _beside(recording: Recording, measured: RateTableEstimate, chosen: Mapping[str, Any]) -> list[str]:
    """Other channels that took part."""
    across = [n.removeprefix("misalignment of ") for n in measured.names if n.startswith("misalignment of ")]
    warm = chosen.get("temperature")
    return [n for n in (*across, warm) if n]
