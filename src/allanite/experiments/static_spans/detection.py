# SPDX-License-Identifier: BSD-3-Clause
"""From a recording to its static spans."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.static_spans.axes import UnitAxes, unit_axes
from allanite.experiments.static_spans.cells import ChannelCells, cut, runs
from allanite.experiments.static_spans.remarks import remarks
from allanite.experiments.static_spans.results import Level, MovingSpan, StaticSpan, StaticSpans
from allanite.experiments.static_spans.scan import ALARM, RestScan, scan
from allanite.experiments.static_spans.scrutiny import frozen, held, smooth, turning
from allanite.noise import NoiseModel
from allanite.noise.given_models import models_of
from allanite.recording.records import Kind, Recording

__all__ = ["find_static_spans", "level_of"]

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
States = NDArray[np.int64]
Progress = Callable[[float, str], None]

#: Spans are no shorter than this [s], where nothing else is said.
SHORTEST = 1.0
#: Left out on both sides of a motion [s]: what begins slowly is seen late.
GUARD = 0.15
#: Blocks of the level.
BLOCKS = 1500

#: What a cell is, by number.
KINDS = ("quiet", "moving", "beside", "missing", "frozen", "turning", "held", "short", "smooth")
_QUIET, _MOVING, _BESIDE, _MISSING, _FROZEN, _TURNING, _HELD, _SHORT, _SMOOTH = range(9)


def find_static_spans(
    recording: Recording,
    *,
    gyro: Sequence[str] | None = None,
    accelerometer: Sequence[str] | None = None,
    model: NoiseModel | Mapping[str, NoiseModel] | None = None,
    shortest: float | None = None,
    progress: Progress | None = None,
) -> StaticSpans:
    """Find the stretches of a hand-moved log in which the unit is at rest.

    Parameters
    ----------
    recording : Recording
        Of three gyros, three accelerometers, or both.
    gyro, accelerometer : sequence of str, optional
        The channels x, y, z: see `unit_axes`.
    model : NoiseModel or mapping of str to NoiseModel, optional
        Of the channels at rest: the thresholds follow from it. By name of the channel, or by role: "gyro",
        "accelerometer"; a single one is that of all channels of its kind. A channel without one must show its own
        floor, which it does where an eighth of the record is at rest.
    shortest : float, optional [s]
        Shorter spans are dropped; 1 s by default.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Returns
    -------
    StaticSpans
        Of clean static records no more than one in a hundred is cut anywhere.

    Raises
    ------
    InputError
        No triad, a model of a channel that is not there, a length that is not positive, a record shorter than a span.

    Notes
    -----
    What can be seen is what exceeds the noise: over t seconds, rotations of about 8 N sqrt(t) of the gyro's white noise
    N, and tilts of 8 N / (9.8 sqrt(t)) of the accelerometer's. An even rotation about the vertical moves no
    accelerometer and leaves the rate of the gyro constant; it is told by a mean that is off that of the other spans.
    """
    axes = unit_axes(recording, gyro, accelerometer)
    length = _checked_shortest(shortest, recording)
    models = _models(model, recording, axes)
    advance = progress or (lambda fraction, what: None)
    cells = cut(recording, axes.names, lambda part: advance(0.8 * part, "reading the samples"))
    advance(0.8, "looking for rest")
    sampling = [recording[name].sampling for name in axes.names]
    rest_scan = scan(cells, models, sampling)
    given = [m is not None for m in models]
    state = _states(cells, rest_scan, axes, length, given=any(given))
    spans, moving = _spans(cells, state, recording.n_samples)
    advance(1.0, "looking for rest")
    return StaticSpans(
        rate=recording.rate,
        n_samples=recording.n_samples,
        spans=spans,
        moving=moving,
        gyro=axes.gyro,
        accelerometer=axes.accelerometer,
        source="detected",
        noise="model" if all(given) else "both" if any(given) else "record",
        alarm=ALARM,
        shortest=length,
        floor={n: float(v) for n, v in zip(axes.names, rest_scan.white, strict=True)},
        level=level_of(cells, rest_scan.ratio),
        findings=remarks(cells, rest_scan, axes, moving, bool(spans)),
    )


def _checked_shortest(shortest: float | None, recording: Recording) -> float:
    length = SHORTEST if shortest is None else shortest
    if not (isinstance(length, (int, float)) and math.isfinite(length) and length > 0):
        raise InputError(f"the shortest span must be positive seconds, not {shortest!r}")
    if recording.duration < length:
        raise InputError(
            f"a record of {recording.duration:g} s holds no span of {length:g} s; give shortest= if that is meant"
        )
    return float(length)


def _models(
    model: NoiseModel | Mapping[str, NoiseModel] | None, recording: Recording, axes: UnitAxes
) -> list[NoiseModel | None]:
    known = {*recording.names, *axes.triads}
    strange = [name for name in model if name not in known] if isinstance(model, Mapping) else []
    if strange:
        raise InputError(
            f"noise models of {', '.join(strange)}, but the channels are {', '.join(recording.names)}"
        )
    one = isinstance(model, NoiseModel)  # of a mapping a name or role says enough
    kinds = {name: recording[name].kind if one else Kind.UNKNOWN for name in axes.names}
    models_by_channel = models_of(model, kinds, roles=axes.triads, needed=False)
    return [models_by_channel.get(name) for name in axes.names]


# -- what each cell is ----------------------------------------------------------------------------------------


def _states(
    cells: ChannelCells, rest_scan: RestScan, axes: UnitAxes, shortest: float, *, given: bool
) -> States:
    """Number of the kind of each cell, shape (n,)."""
    state: States = np.where(rest_scan.quiet, _QUIET, np.where(cells.whole, _MOVING, _MISSING))
    state[(state == _QUIET) & _widened(state == _MOVING, max(round(GUARD / cells.length), 1))] = _BESIDE
    _without(state, frozen(cells, runs(state == _QUIET)), _FROZEN)
    least = shortest / cells.length - 1e-9
    _without(state, [(a, b) for a, b in runs(state == _QUIET) if b - a < least], _SHORT)
    quiet = runs(state == _QUIET)
    _without(state, turning(cells, rest_scan, axes, quiet), _TURNING)
    if not given and held(cells, rest_scan, axes, runs(state == _QUIET)):
        state[state == _QUIET] = _HELD
    if not given and smooth(rest_scan):
        state[state == _QUIET] = _SMOOTH
    return state


def _without(state: States, spans: Sequence[tuple[int, int]], kind: int) -> None:
    for a, b in spans:
        state[a:b] = kind


def _widened(mask: Mask, by: int) -> Mask:
    wide = mask.copy()
    for k in range(1, by + 1):
        wide[k:] |= mask[:-k]
        wide[:-k] |= mask[k:]
    return wide


def _spans(
    cells: ChannelCells, state: States, n_samples: int
) -> tuple[tuple[StaticSpan, ...], tuple[MovingSpan, ...]]:
    """Neighbours of one kind joined; the samples that fill no cell belong to the last one."""
    if len(state) == 0:
        return (), ()
    edges = np.concatenate(([0], np.flatnonzero(np.diff(state)) + 1, [len(state)]))
    spans, moving = [], []
    for a, b in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
        start, stop = a * cells.size, n_samples if b == len(state) else b * cells.size
        if state[a] == _QUIET:
            spans.append(StaticSpan(start=start, stop=stop))
        else:
            moving.append(MovingSpan(start=start, stop=stop, why=KINDS[state[a]]))
    return tuple(spans), tuple(moving)


def level_of(cells: ChannelCells, ratios: Array) -> Level:
    """The largest ratio of each block."""
    join = max(-(-cells.n // BLOCKS), 1)
    n = -(-cells.n // join)
    padded = np.full(n * join, np.nan)
    padded[: cells.n] = ratios
    rows = padded.reshape(n, join)
    there = ~np.isnan(rows)
    ratio = np.where(there.any(axis=1), np.where(there, rows, 0.0).max(axis=1, initial=0.0), np.nan)
    return Level(time=np.asarray((np.arange(n) + 0.5) * join * cells.length, dtype=np.float64), ratio=ratio)
