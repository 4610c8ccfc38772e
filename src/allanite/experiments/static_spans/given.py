# SPDX-License-Identifier: BSD-3-Clause
"""Static spans from the user: a list, or a table with the columns start and stop."""

from __future__ import annotations

import os
from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from allanite.errors import InputError
from allanite.experiments.reversals.listing import read_listing
from allanite.experiments.static_spans.axes import UnitAxes, unit_axes
from allanite.experiments.static_spans.results import MovingSpan, StaticSpan, StaticSpans
from allanite.recording.records import Recording

__all__ = ["given_spans", "read_spans"]


def given_spans(
    spans: ArrayLike,
    recording: Recording,
    *,
    labels: Sequence[str] = (),
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
) -> StaticSpans:
    """Static spans that the user knows. Whether the unit is at rest in them is not asked.

    Parameters
    ----------
    spans : array_like, shape (n, 2) [s]
        Start and stop since the first sample, in the order of time.
    recording : Recording
    labels : sequence of str, optional
        One for each.
    gyro, accelerometer : sequence of str, optional
        See `unit_axes`.

    Raises
    ------
    InputError
        Spans that are empty, overlap, are out of order, or lie outside of the record; no triad.

    Examples
    --------
    >>> given_spans([(0, 50), (55, 63)], recording)  # doctest: +SKIP
    """
    try:
        times = np.asarray(spans, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"static spans are pairs of start and stop in seconds, not {spans!r}") from None
    if times.ndim != 2 or times.shape[1] != 2 or len(times) == 0 or not np.isfinite(times).all():
        raise InputError(
            f"static spans are pairs of start and stop in seconds, shape (n, 2), not of shape {times.shape}"
        )
    if labels and len(labels) != len(times):
        raise InputError(f"{len(labels)} labels for {len(times)} static spans")
    edges = np.rint(times * recording.rate).astype(np.int64)
    where = [f"static span {i + 1}" for i in range(len(edges))]
    return _assembled(
        recording,
        [(w, int(a), int(b)) for w, (a, b) in zip(where, edges, strict=True)],
        labels or [""] * len(edges),
        "given",
        unit_axes(recording, gyro, accelerometer),
    )


def read_spans(
    path: str | os.PathLike[str],
    recording: Recording,
    *,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
) -> StaticSpans:
    """Static spans from a file.

    Parameters
    ----------
    path : path
        Text with a heading: ``start,stop`` in seconds since the first sample (``start [min]`` and such are
        understood), and ``label`` if wanted.
    recording : Recording
    gyro, accelerometer : sequence of str, optional
        See `unit_axes`.

    Raises
    ------
    FormatError
        A column is missing, a cell is no number; the message names the line.
    InputError
        Spans that are empty, overlap, are out of order, or lie outside of the record; no triad; no such file.

    Examples
    --------
    >>> read_spans("spans.csv", recording)  # doctest: +SKIP
    """
    listing = read_listing(path, {"start": ("begin",), "stop": ("end",)}, {}, texts=("label",))
    rows = [(f"{listing.file}, line {line}", a, b) for line, a, b in listing.spans(recording)]
    axes = unit_axes(recording, gyro, accelerometer)
    return _assembled(recording, rows, listing.texts("label"), "file", axes)


def _assembled(
    recording: Recording,
    rows: Sequence[tuple[str, int, int]],
    labels: Sequence[str],
    source: str,
    axes: UnitAxes,
) -> StaticSpans:
    before, spans, moving = 0, [], []
    for (where, a, b), label in zip(rows, labels, strict=True):
        text = f"{where}: {a / recording.rate:g} s to {b / recording.rate:g} s"
        if a >= b:
            raise InputError(f"{text} holds no sample")
        if a < before:
            raise InputError(
                f"{text} overlaps with the one before or comes before it; put them in the order of time"
            )
        if a < 0 or b > recording.n_samples:
            raise InputError(f"{text} does not lie in the record of {recording.duration:g} s")
        if a > before:
            moving.append(MovingSpan(start=before, stop=a, why="unlisted"))
        spans.append(StaticSpan(start=a, stop=b, label=label))
        before = b
    if before < recording.n_samples:
        moving.append(MovingSpan(start=before, stop=recording.n_samples, why="unlisted"))
    return StaticSpans(
        rate=recording.rate,
        n_samples=recording.n_samples,
        spans=tuple(spans),
        moving=tuple(moving),
        gyro=axes.gyro,
        accelerometer=axes.accelerometer,
        source=source,
    )
