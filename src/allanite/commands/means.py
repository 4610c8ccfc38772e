# SPDX-License-Identifier: BSD-3-Clause
"""A table with one row for each position, the means of its readings, read by whatever reader its file has."""

from __future__ import annotations

import os
from collections.abc import Collection
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from allanite.commands.recordings import read_part
from allanite.errors import InputError

if TYPE_CHECKING:
    from allanite.experiments.reversals import PositionsApart
    from allanite.experiments.static_spans import PositionMeans, SdOf
    from allanite.recording.health.finding import Finding
    from allanite.recording.records import Recording

__all__ = ["read_means", "record_of_means", "refuse_rows_of_means"]

#: Averaging times of rows that differ by less than this part are equal.
_EQUAL = 0.01


def read_means(
    table: str | os.PathLike[str],
    *,
    averaging: float | None = None,
    sd_of: SdOf | None = None,
    source: str | None = None,
    **options: Any,
) -> tuple[PositionMeans, tuple[Finding, ...]]:
    """The rows, and what is found of their text; see `means_of`.

    Parameters
    ----------
    **options
        Those of `read_part`, but for what a table of means does not have.

    Raises
    ------
    InputError
        An option of logs.
    """
    from allanite.experiments.static_spans import means_of
    from allanite.recording.health.catalogue import CATALOGUE
    from allanite.recording.health.examination import LOG_DETECTORS

    of_logs = [name for name in ("rate", "time", "start", "stop", "repair") if options.pop(name, None)]
    if of_logs:
        names = {"start": "from", "stop": "to"}
        raise InputError(
            f"--{names.get(of_logs[0], of_logs[0])} is for logs: rows of means are positions, not samples"
        )
    recording = read_part(table, rate=1.0, time="none", source=source, **options)
    findings = [f for look in LOG_DETECTORS for f in look(recording)]
    means = means_of(recording, sd_of=sd_of, averaging=averaging)
    return means, tuple(f for f in findings if CATALOGUE[f.code].group == "Text")


def refuse_rows_of_means(recording: Recording, accept: Collection[str]) -> None:
    """Before anything is looked for in it: a table of positions is no log.

    Raises
    ------
    DataQualityError
        The finding was not accepted.
    """
    from allanite.recording.health.examination import prepare
    from allanite.recording.health.rows import rows_of_means

    prepare(recording, tuple(rows_of_means(recording)), accept=set(accept) & {"rows_of_means"})


def record_of_means(
    means: PositionMeans, between: float
) -> tuple[Recording, list[tuple[int, int]], PositionsApart]:
    """A record whose samples are the means, each over its averaging time, missing between the positions.

    Parameters
    ----------
    between : float [s]
        From one position to the next, where no column says it.

    Returns
    -------
    recording : Recording
    spans : list of (int, int) [samples]
        One sample for each position.
    apart : PositionsApart
        Where the time between them comes from, and what was not needed.

    Raises
    ------
    InputError
        Averaging times that nobody gave, or that differ; positions that overlap in time.
    """
    import numpy as np

    from allanite.experiments.reversals import PositionsApart
    from allanite.recording.records import ArrayColumn

    if means.duration is None:
        raise InputError(
            "the noise of a mean depends on its averaging time: state --averaging 60s, or a column duration"
        )
    length = float(np.median(means.duration))
    if np.ptp(means.duration) > _EQUAL * length:
        raise InputError(
            f"the rows were averaged over {means.duration.min():g} to {means.duration.max():g} s: here "
            "all rows need the same time; pass the positions as logs (--positions)"
        )
    begins = means.start
    start = np.arange(means.n) * (length + between) if begins is None else begins
    if means.n > 1 and np.diff(start).min() < (1 - _EQUAL) * length:
        raise InputError("the positions overlap: one begins before the mean of the previous one ended")
    steps = np.maximum(np.rint(np.diff(start) / length), 2)  # what is between two rows is missing
    places = np.concatenate([[0], np.cumsum(steps)]).astype(np.int64)
    closer = (steps * length - np.diff(start) > 0.5 * length).any()
    columns = []
    for name in means.rows.names:
        column = np.full(int(places[-1]) + 1, np.nan)
        column[places] = means.rows.values(name)
        columns.append(ArrayColumn(column))
    record = replace(means.rows, columns=tuple(columns), rate=1 / length)
    apart = PositionsApart(
        rows=True,
        count=means.n,
        headed=means.heading is not None,
        assumed=between if begins is None else None,
        least=length if closer else None,
        sd_ignored=bool(means.sd),
    )
    return record, [(k, k + 1) for k in places.tolist()], apart
