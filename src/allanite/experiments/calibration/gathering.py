# SPDX-License-Identifier: BSD-3-Clause
"""From a recording and its static spans to what is observed: means at rest, turns between them, noise of each axis."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, InputError
from allanite.experiments.calibration.adjustment.interval_noise import (
    Intervals,
    model_beside_motion,
    model_of_spans,
)
from allanite.experiments.calibration.adjustment.rounding import RoundingSteps, of_integrals, of_means
from allanite.experiments.calibration.adjustment.turning import TurningSamples
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, White
from allanite.recording.calibration import ACCELEROMETER, GYRO
from allanite.recording.records import Recording, Sampling

__all__ = ["Gathered", "gather", "unused_of"]

Array = NDArray[np.float64]
Index = NDArray[np.int64]

#: So many samples in a row at the extreme of a channel, and this part of all that come near it (by the other part of
#: the range): the converter was at its end. A smooth peak has more samples near it than at it.
CLIPPED, AT_END, NEAR = 3, 0.8, 5e-3
#: Samples of a span from which on its not varying says something.
LEAST = 8


@dataclass(frozen=True, slots=True, kw_only=True)
class Gathered:
    """What a recording holds for a calibration, in the units of its channels after their scale.

    Attributes
    ----------
    axes : dict of str to tuple of str
        Channels of each triad.
    edges : ndarray of int64, shape (n, 2) [samples]
        Of the spans that are used.
    numbers : tuple of int
        Of these spans among all, from 1.
    unused : dict of int to str
        The others, and why: "left out", "samples missing".
    means, whole : dict of str to ndarray, shape (n, 3)
        Of each triad; samples measured.
    coarse : dict of str to ndarray, shape (3, n, n)
        Covariance that steps of the converter which no noise smooths add to the means.
    held : ndarray, shape (3, m)
        Variance that they add to the integral of each gyro over each turn.
    in_hand : bool
        The unit was held: the attitude wanders within a span, whose mean is meant, and turns go from mean to mean.
    restless : ndarray, shape (n,)
        Rms of the motion within each span: of the rates about their bias, or of the steps from sample to sample of the
        accelerometers where there are no gyros; one of a unit that was put down.
    wander : ndarray, shape (n, 3, 3)
        Mean of the products of the integrated rates within each span, about their mean, in the square of the unit of
        the gyros times seconds; zero of a unit that was put down.
    temperature : ndarray, shape (n,) or None
    before, after : ndarray of int64, shape (m,)
        Used spans that a whole turn links.
    motion : TurningSamples or None
        The gyros and accelerometers in these turns; None without.
    dropped : dict of (int, int) to str
        Turns between used spans that are not used, and why: places of the spans among them.
    models : dict of str to NoiseModel
    given : bool
        The models were given.
    sampling : dict of str to Sampling
    rate : float [Hz]
    n_samples : int
    """

    axes: Mapping[str, tuple[str, ...]]
    edges: Index
    numbers: tuple[int, ...]
    unused: dict[int, str]
    means: dict[str, Array]
    whole: dict[str, Array]
    coarse: dict[str, Array]
    held: Array
    in_hand: bool
    restless: Array
    wander: Array
    temperature: Array | None
    before: Index
    after: Index
    motion: TurningSamples | None = field(repr=False)
    dropped: dict[tuple[int, int], str]
    models: dict[str, NoiseModel]
    given: bool
    sampling: dict[str, Sampling]
    rate: float
    n_samples: int

    @property
    def dt(self) -> float:
        """Sample interval [s]."""
        return 1 / self.rate

    def spans(self, sensor: str) -> Intervals:
        """The spans as intervals of a triad."""
        return self._intervals(self.edges[:, 0], self.edges[:, 1], sensor)

    def turns(self) -> Intervals:
        """The turns as intervals of the gyros."""
        return self._intervals(*self._ends, GYRO)

    @property
    def seconds(self) -> Array:
        """Length of each turn, shape (m,) [s]."""
        start, stop = self._ends
        return np.asarray((stop - start) * self.dt)

    @property
    def relative(self) -> dict[str, Array]:
        """Variances of the scatter of the spans over the usual one; none of a unit that was put down.

        What a hand does to the mean of a rate or an acceleration is a difference of an angle or of a velocity between
        the ends of the span, over its length; and it is as large as the hand is restless.
        """
        if not self.in_hand:
            return {}
        size = self.restless / np.diff(self.edges, axis=1)[:, 0]
        return dict.fromkeys(self.axes, (size / float(np.median(size))) ** 2)

    @property
    def _ends(self) -> tuple[Index, Index]:
        """Of the turns [samples]: from the middle of a span that wanders to that of the next."""
        if self.in_hand:
            middle = self.edges.sum(axis=1) // 2
            return middle[self.before], middle[self.after]
        return self.edges[self.before, 1], self.edges[self.after, 0]

    def _intervals(self, start: Index, stop: Index, sensor: str) -> Intervals:
        return Intervals(
            start=start.astype(np.float64),
            stop=stop.astype(np.float64),
            whole=(stop - start).astype(np.float64),
            length=float(self.n_samples),
            dt=self.dt,
            sampling=self.sampling[sensor],
        )


def gather(
    recording: Recording,
    axes: Mapping[str, tuple[str, ...]],
    edges: Index,
    *,
    model: Mapping[str, NoiseModel] | None,
    temperature: str | None,
    without: Collection[int | tuple[int, int]],
    in_hand: bool = False,
) -> Gathered:
    """Read a recording.

    Parameters
    ----------
    in_hand : bool
        See `Gathered`.

    Raises
    ------
    InputError
        Channels of angles or velocities, spans that do not exist.
    DataQualityError
        A channel that is stuck, or no span with samples of all axes.
    """
    for name in (n for three in axes.values() for n in three):
        if recording[name].kind.integrated:
            raise InputError(f"channel {name!r} holds {recording[name].kind.value}s; give the rates instead")
    spans, turns = {n for n in without if isinstance(n, int)}, {n for n in without if not isinstance(n, int)}
    unknown = sorted((spans | {n for turn in turns for n in turn}) - set(range(1, len(edges) + 1)))
    if unknown:
        raise InputError(f"there is no position {unknown[0]}; they are numbered from 1 to {len(edges)}")
    y = {sensor: _samples(recording, three) for sensor, three in axes.items()}
    means, whole = {}, {}
    for sensor, samples in y.items():
        means[sensor], whole[sensor] = _means(samples, edges)
    unused = unused_of(whole, spans)
    use = np.array([k + 1 not in unused for k in range(len(edges))], dtype=np.bool_)
    if not use.any():
        raise DataQualityError("no static span has samples of every axis")
    used = edges[use]
    steps = {s: [RoundingSteps.of(v[:, k]) for k in range(3)] for s, v in y.items()}
    coarse = {
        s: np.stack([of_means(steps[s][k], [v[a:b, k] for a, b in used]) for k in range(3)])
        for s, v in y.items()
    }
    models = _models(recording, axes, y, used, coarse, model, in_hand)
    warmth = _warmth(recording, temperature)
    before, after, motion, dropped = _turns(y, used, recording.dt, warmth, _places(turns, use), in_hand)
    held = np.zeros((3, len(before)))
    if motion is not None:
        held = np.stack(
            [of_integrals(steps[GYRO][k], motion.y[:, k], motion.edges, recording.dt) for k in range(3)]
        )
    return Gathered(
        axes=axes,
        edges=used,
        numbers=tuple((np.flatnonzero(use) + 1).tolist()),
        unused=unused,
        means={s: v[use] for s, v in means.items()},
        whole={s: v[use] for s, v in whole.items()},
        coarse=coarse,
        held=held,
        in_hand=in_hand,
        restless=_restless(y, used) if in_hand else np.ones(len(used)),
        wander=_wander(y.get(GYRO), used, recording.dt, in_hand),
        temperature=None if warmth is None else _means(warmth[:, None], used)[0][:, 0],
        before=before,
        after=after,
        motion=motion,
        dropped=dropped,
        models=models,
        given=model is not None,
        sampling={s: recording[three[0]].sampling for s, three in axes.items()},
        rate=recording.rate,
        n_samples=recording.n_samples,
    )


def _samples(recording: Recording, names: tuple[str, ...]) -> Array:
    return np.stack([recording.scaled(n) for n in names], axis=-1)


def _warmth(recording: Recording, name: str | None) -> Array | None:
    return None if name is None else _samples(recording, (name,))[:, 0]


def _means(samples: Array, edges: Index) -> tuple[Array, Array]:
    """Means over spans and samples in them, shape (n, channels) each; NaN without samples."""
    means, counts = [], []
    for a, b in edges:
        part = samples[a:b]
        good = np.isfinite(part)
        count = good.sum(axis=0)
        offset = part[good.all(axis=1)][:1]  # keeps the digits of values far from zero
        base = offset[0] if len(offset) else np.zeros(part.shape[1])
        with np.errstate(invalid="ignore"):
            means.append(base + np.where(good, part - base, 0.0).sum(axis=0) / count)
        counts.append(count)
    return np.array(means), np.array(counts, dtype=np.float64)


def _places(turns: Collection[tuple[int, int]], use: NDArray[np.bool_]) -> set[tuple[int, int]]:
    """Turns by the places of their positions among those that are used.

    Raises
    ------
    InputError
        A turn between positions that do not follow each other.
    """
    place = {int(k) + 1: i for i, k in enumerate(np.flatnonzero(use))}
    for a, b in turns:
        if a not in place or place.get(b) != place[a] + 1:
            raise InputError(f"there is no turn from position {a} to {b}: they do not follow each other")
    return {(place[a], place[b]) for a, b in turns}


def unused_of(whole: Mapping[str, Array], without: Collection[int]) -> dict[int, str]:
    """Numbers of the spans that cannot or shall not be used, and why."""
    empty = np.any([(counts == 0).any(axis=1) for counts in whole.values()], axis=0)
    unused = {int(k) + 1: "samples missing" for k in np.flatnonzero(empty)}
    return dict(sorted((unused | dict.fromkeys(without, "left out")).items()))


def _models(
    recording: Recording,
    axes: Mapping[str, tuple[str, ...]],
    y: Mapping[str, Array],
    edges: Index,
    coarse: Mapping[str, Array],
    model: Mapping[str, NoiseModel] | None,
    in_hand: bool,
) -> dict[str, NoiseModel]:
    if model is not None:
        return dict(model)
    out = {}
    for sensor, three in axes.items():
        for axis, name in enumerate(three):
            parts = [y[sensor][a:b, axis] for a, b in edges]
            fitted_model = (model_beside_motion if in_hand else model_of_spans)(parts, recording.dt)
            steps = float(np.diag(coarse[sensor][axis]).max())
            if fitted_model is None and steps > 0:  # the steps hide the noise, which is smaller than they are
                fitted_model = NoiseModel.of(White(N=math.sqrt(steps * recording.dt)))
            if fitted_model is None:
                fitted_model = _silent(y[sensor][:, axis], edges, recording.dt)
            if fitted_model is None:
                raise DataQualityError(
                    f"channel {name!r} does not vary, or the static spans are too short: its noise cannot be "
                    "estimated. Give a noise model (--model), or longer spans"
                )
            out[name] = fitted_model
    return out


def _silent(samples: Array, edges: Index, dt: float) -> NoiseModel | None:
    """Of a channel that varies between the spans and not within them: every mean may be off by what it resolves."""
    if any(np.isfinite(samples[a:b]).sum() < LEAST for a, b in edges):
        return None
    gaps = np.diff(np.unique(samples[np.isfinite(samples)]))
    if not len(gaps):
        return None
    length = float(np.diff(edges, axis=1).max()) * dt
    return NoiseModel.of(White(N=float(gaps.min()) * math.sqrt(length)))


# -- turns ----------------------------------------------------------------------------------------------------


def _turns(
    y: Mapping[str, Array],
    edges: Index,
    dt: float,
    warmth: Array | None,
    left_out: Collection[tuple[int, int]],
    in_hand: bool,
) -> tuple[Index, Index, TurningSamples | None, dict[tuple[int, int], str]]:
    """Turns between neighbouring spans whose every sample is there."""
    none: Index = np.zeros(0, dtype=np.int64)
    gyro, force = y.get(GYRO), y.get(ACCELEROMETER)
    if gyro is None or len(edges) < 2:
        return none, none, None, {}
    rails = [_rails(gyro[:, axis]) for axis in range(3)]
    used, parts, heat, dropped = [], [], [], {}
    reach = [slice(edges[k, 1 - in_hand], edges[k + 1, int(in_hand)]) for k in range(len(edges) - 1)]
    for k, place in enumerate(reach):
        part = gyro[place]
        warm = np.zeros(len(part)) if warmth is None else warmth[place]
        why = "left out" if (k, k + 1) in left_out else _unusable(part, warm, rails)
        if why:
            dropped[k, k + 1] = why
            continue
        used.append(k)
        parts.append(part)
        heat.append(warm)
    if not used:
        return none, none, None, dropped
    sizes = [len(p) for p in parts]
    first = np.array(used, dtype=np.int64)
    motion = TurningSamples(
        y=np.concatenate(parts),
        warmer=np.concatenate(heat),
        edges=np.concatenate([[0], np.cumsum(sizes)]),
        dt=np.full(len(used), dt),
        force=None if force is None else np.concatenate([force[reach[k]] for k in used]),
        weight=np.concatenate([_trapezoid(edges[k : k + 2]) for k in used]) if in_hand else None,
        shared=np.where(np.isin(first - 1, first), np.diff(edges, axis=1)[first, 0], 0) if in_hand else None,
    )
    return first, first + 1, motion, dropped


def _trapezoid(edges: Index) -> Array:
    """Weights of the samples from the start of one span to the end of the next: see `TurningSamples`."""
    (a, b), (c, d) = edges.tolist()
    up, down = (np.arange(b - a) + 0.5) / (b - a), (np.arange(d - c) + 0.5) / (d - c)
    return np.concatenate([up, np.ones(c - b), 1 - down])


def _usual_mean(samples: Array, edges: Index) -> Array:
    return np.asarray(np.median([np.nanmean(samples[a:b], axis=0) for a, b in edges.tolist()], axis=0))


def _restless(y: Mapping[str, Array], edges: Index) -> Array:
    """`Gathered.restless` of a unit that was held."""
    gyro = y.get(GYRO)
    moves = np.diff(y[ACCELEROMETER], axis=0) if gyro is None else gyro - _usual_mean(gyro, edges)
    return np.array([math.sqrt(float(np.nanmean(moves[a : b - 1] ** 2))) for a, b in edges.tolist()])


def _wander(gyro: Array | None, edges: Index, dt: float, in_hand: bool) -> Array:
    """`Gathered.wander`: the bias is the median of the means."""
    out = np.zeros((len(edges), 3, 3))
    if gyro is None or not in_hand:
        return out
    bias = _usual_mean(gyro, edges)
    for k, (a, b) in enumerate(edges.tolist()):
        turned = np.cumsum(np.nan_to_num(gyro[a:b] - bias), axis=0) * dt
        turned -= turned.mean(axis=0)
        out[k] = turned.T @ turned / len(turned)
    return out


def _rails(samples: Array) -> tuple[float, ...]:
    """Ends of its range at which a channel was cut off."""
    good = samples[np.isfinite(samples)]
    if not len(good):
        return ()
    reach = NEAR * float(np.ptp(good))
    ends = (float(good.min()), float(good.max()))
    return tuple(e for e in ends if np.mean(good[np.abs(good - e) <= reach] == e) >= AT_END)


def _unusable(part: Array, warm: Array, rails: Sequence[tuple[float, ...]]) -> str:
    if len(part) < 2 or not np.isfinite(part).any():
        return "no samples between"
    if not (np.isfinite(part).all() and np.isfinite(warm).all()):
        return "samples missing"
    for axis in range(3):
        if any(_longest_run(part[:, axis] == end) >= CLIPPED for end in rails[axis]):
            return "clipped"
    return ""


def _longest_run(hit: NDArray[np.bool_]) -> int:
    if not hit.any():
        return 0
    edges = np.flatnonzero(np.diff(np.concatenate([[0], hit.astype(np.int8), [0]])))
    return int((edges[1::2] - edges[::2]).max())
