# SPDX-License-Identifier: BSD-3-Clause
"""A unit that rested in several attitudes: when it did, and what is wrong with its log between the moves.

Every attitude has a level of its own, which a look at the whole record takes for motion, a step or the end of a range.
None of that is a fault: whether the unit was at rest is judged stretch by stretch.
"""

from __future__ import annotations

import math
import os
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from allanite.commands.turned import TurnedRecord, judged
from allanite.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from allanite.experiments.static_spans import StaticSpans, UnitAxes
    from allanite.noise import NoiseModel
    from allanite.recording.health.finding import Finding
    from allanite.recording.records import Recording

__all__ = ["judged_at_rest", "rests_of", "thermometers"]

_MOVED = "while the unit was moved"
#: What only says that attitudes differ.
_OF_ATTITUDES = frozenset(
    {
        "not_at_rest",
        "disturbance",
        "amplitude_drop",
        "noise_changes",
        "heavy_tails",
        "spikes",
        "motion",
        "gravity",
        "bias_removed",
    }
)
#: The level of the uppermost attitude looks like the end of a range. Spans without spread are not used as rests.
_DOUBTFUL = frozenset({"clipping"})
#: Levels without noise that shows.
_SILENT = frozenset({"stuck", "quantisation_limited"})
#: So many values make this part of a rest, or more, if their noise is smaller than their step.
_FEW, _SHARE = 3, 0.9


def thermometers(recording: Recording, named: str | None = None) -> list[str]:
    """Channels of temperature, and the one that is named."""
    from allanite.recording.records import Kind

    return [c.name for c in recording.channels if c.kind is Kind.TEMPERATURE or c.name == named]


def rests_of(
    whole: Recording,
    part: Recording,
    axes: UnitAxes,
    *,
    listing: str | os.PathLike[str] | None,
    start: float | None,
    models: Mapping[str, NoiseModel] | None,
) -> StaticSpans:
    """When the unit was at rest in a part of its log: found, or listed in a file.

    Parameters
    ----------
    listing : path, optional
        Its times count from the first sample of the whole.
    start : float, optional [s]
        Where the part begins in the whole.
    models : mapping of str to NoiseModel, optional
        Taken where they are of all channels.

    Raises
    ------
    InputError
        None of the listed spans lies in the part.
    """
    from allanite.experiments.static_spans import find_static_spans, read_spans

    channels: dict[str, Any] = {"gyro": axes.gyro, "accelerometer": axes.accelerometer}
    if listing is None:
        complete = models if models and set(axes.names) <= set(models) else None
        return find_static_spans(part, model=complete, **channels)
    listed = read_spans(listing, whole, **channels)
    return _within(listed, round((start or 0.0) * whole.rate), part.n_samples)


def _within(rests: StaticSpans, first: int, count: int) -> StaticSpans:
    """The same for a part of the record: spans that reach beyond it end at its ends."""

    def inside(spans: Sequence[Any]) -> tuple[Any, ...]:
        ends = [(max(s.start - first, 0), min(s.stop - first, count), s) for s in spans]
        return tuple(replace(s, start=a, stop=b) for a, b, s in ends if a < b)

    spans = inside(rests.spans)
    if not spans:
        raise InputError("none of the listed spans is in this part of the log")
    return replace(rests, n_samples=count, spans=spans, moving=inside(rests.moving))


def judged_at_rest(
    part: Recording,
    rests: StaticSpans | None,
    axes: UnitAxes,
    *,
    accept: Collection[str],
    milder: Collection[str] = (),
) -> TurnedRecord:
    """The log with its findings; None for the rests: all of it is used, moved or not.

    Parameters
    ----------
    milder : collection of str
        Further findings that warn and do not refuse.

    Raises
    ------
    DataQualityError
        A fatal finding at rest that was not accepted.
    """
    import numpy as np

    spans = [(m.start, m.stop) for m in rests.moving] if rests is not None else []
    ready = judged(
        part,
        np.array(spans, dtype=np.int64).reshape(-1, 2),
        axes.names,
        where=_MOVED,
        longest=math.inf,
        milder={*_DOUBTFUL, *milder},
        accept=accept,
        reviewed=None if rests is None else lambda finding: _without_noise(finding, part, rests),
    )
    silent = {f.channel for f in ready.findings if f.code in _SILENT and not f.excludes}
    return replace(ready, findings=tuple(_of_attitudes(f, silent) for f in ready.findings))


def _of_attitudes(finding: Finding, silent: Collection[str | None]) -> Finding:
    from allanite.recording.health.finding import Severity

    advice = "none needed: every attitude has its own level, and each is checked separately"
    if finding.code == "clipping" and finding.channel in silent:
        advice = "none needed: without noise every level is repeated, the largest as any other"
    elif finding.code not in _OF_ATTITUDES:
        return finding
    if finding.severity is Severity.INFO:
        return finding
    return replace(finding, severity=Severity.INFO, advice=advice, risk="")


def _without_noise(finding: Finding, part: Recording, rests: StaticSpans) -> Finding:
    """Readings of few values at rest that vary on the move are not frozen: their steps hide the noise.

    How long a value repeats is then a matter of where the level of an attitude lies between two steps.
    """
    import numpy as np

    from allanite.recording.health.finding import Severity

    unlike = finding.code != "stuck" or finding.severity is Severity.INFO
    if unlike or finding.channel is None or len(rests.spans) < 2:
        return finding
    few = [_few_values(part.raw(finding.channel, s.start, s.stop)) for s in rests.spans]
    moves = [(a.stop, b.start) for a, b in pairwise(rests.spans)]
    alive = [len(np.unique(part.raw(finding.channel, a, b))) > 1 for a, b in moves]
    if np.mean(few) < 0.5 or np.mean(alive) < 0.5:
        return finding
    return replace(
        finding,
        severity=Severity.WARNING,
        message=f"{finding.message}; but it varies while the unit is moved, and takes {_FEW} values at the most in "
        "most rests: its steps hide the noise",
        advice="none needed for a simulated log; for a sensor, log more digits",
        risk="",
        excludes=False,
    )


def _few_values(samples: NDArray[Any]) -> bool:
    import numpy as np

    counts = np.sort(np.unique(samples, return_counts=True)[1])
    return bool(counts[-_FEW:].sum() >= _SHARE * len(samples))
