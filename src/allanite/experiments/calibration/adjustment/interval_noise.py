# SPDX-License-Identifier: BSD-3-Clause
"""The noise of means over intervals of a record, constant part included, and the noise that a record itself shows.

`allanite.noise.span_means` gives the covariance of means up to a constant, which the bias of a sensor takes up. Here
the constant is settled by the convention of the regression: a random walk starts at zero at the first sample,
stationary terms are stationary, and the band of flicker ends at five records. So the bias is that of the sensor as it
is, and its variance holds what the slow noise did to the record as a whole.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import Flicker, GaussMarkov, NoiseModel, Ramp, RandomWalk, TermType, White
from allanite.noise.span_means import span_covariance
from allanite.recording.records import Sampling

__all__ = ["Intervals", "about_mean", "interval_covariance", "model_beside_motion", "model_of_spans"]

Array = NDArray[np.float64]

#: Variance of the mean of flicker over a whole record, over B^2: the part of the band from there to five records,
#: (1/pi) integral of 2 u^2 (1/u - 1 + e^(-1/u)) du/u to u = 5, and slower states as a walk, 2/(15 pi).
FLICKER_LEVEL = 0.8692
#: Rows into which a span is divided to see its noise.
ROWS = 64
#: Order of the differences that tell noise from the motion of a hand: of shorter spans, half their samples.
DIFFERENCES = 20
#: B^2 of the candidates over N^2/(length of a row).
RATIOS = np.concatenate([[0.0], np.logspace(-4, 2.5, 27)])


@dataclass(frozen=True, slots=True, kw_only=True)
class Intervals:
    """Parts of a record over which means were taken.

    Attributes
    ----------
    start, stop : ndarray, shape (n,) [samples]
    whole : ndarray, shape (n,) [samples]
        Samples that were measured.
    length : float [samples]
        Of the record.
    dt : float [s]
    sampling : "mean" or "point"
    """

    start: Array
    stop: Array
    whole: Array
    length: float
    dt: float
    sampling: Sampling

    def with_record(self) -> Intervals:
        """The same, and the whole record as the last one."""
        return Intervals(
            start=np.append(self.start, 0.0),
            stop=np.append(self.stop, self.length),
            whole=np.append(self.whole, self.length),
            length=self.length,
            dt=self.dt,
            sampling=self.sampling,
        )


def interval_covariance(model: NoiseModel, intervals: Intervals) -> Array:
    """Covariance of the means of the noise over intervals, shape (n, n), in the square of the unit of the model."""
    n = len(intervals.start)
    total = np.zeros((n, n))
    for term in model.terms:
        total += _of_term(term, intervals)
    return total


def about_mean(model: NoiseModel, intervals: Intervals) -> Array:
    """The same of a noise whose mean over the record is taken for the bias, and no less uncertain for that.

    The deviations from the mean have their own covariance; to it comes the variance of the mean.
    """
    joint = interval_covariance(model, intervals.with_record())
    n = len(intervals.start)
    apart = np.column_stack([np.eye(n), -np.ones(n)])
    return np.asarray(apart @ joint @ apart.T + joint[-1, -1])


def _of_term(term: TermType, intervals: Intervals) -> Array:
    more = intervals.with_record()
    middle = (intervals.start + intervals.stop) / 2 * intervals.dt
    if isinstance(term, Ramp):
        return term.R**2 * np.outer(middle, middle)
    open_ = span_covariance(
        NoiseModel.of(term), more.start, more.stop, more.whole, dt=more.dt, sampling=more.sampling
    )
    span = more.length * more.dt
    if isinstance(term, RandomWalk):
        walked = term.K**2 / 2 * np.append(middle, span / 2)
        open_ = open_ + walked[:, None] + walked[None]
        level = term.K**2 * span / 3
    elif isinstance(term, Flicker):
        level = FLICKER_LEVEL * term.B**2
    elif isinstance(term, GaussMarkov):
        level = _mean_of_markov(term, span)
    else:
        level = float(open_[-1, -1])
    return np.asarray(open_[:-1, :-1] + (level - open_[-1, -1]))


def _mean_of_markov(term: GaussMarkov, span: float) -> float:
    """Variance of its mean over a span [s]: 2 sigma^2 (u - 1 + e^-u)/u^2, u = span/T."""
    u = span / term.T
    shape = 1 - u / 3 + u**2 / 12 if u < 1e-3 else 2 * (u + math.expm1(-u)) / u**2
    return term.sigma**2 * shape


# -- the noise of the spans themselves ----------------------------------------------------------------------


def model_of_spans(spans: Sequence[Array], dt: float) -> NoiseModel | None:
    """White noise and flicker of a channel from its samples within static spans, whose means are free.

    Parameters
    ----------
    spans : sequence of ndarray, shape (n_i,)
        Samples of each span; NaN where missing.
    dt : float [s]

    Returns
    -------
    NoiseModel or None
        None where the samples do not vary. B is the root mean square over what the spans do not contradict, every B
        being as likely as every other before: flicker that they cannot exclude is in it. Slow noise that shows only
        from span to span is not; it is seen in the scatter of the spans.

    Notes
    -----
    Each span is cut into 64 rows at most. Flicker has no time of its own, so the covariance of its row means is the
    same matrix F for every span of so many rows. With the eigenvectors of F among the contrasts every row becomes a
    number with the variance N^2/(length of a row) + B^2 f, independent of all others of the span.
    """
    squares, widths, shapes = [], [], []
    for samples in spans:
        rows = _rows(samples)
        if rows is None:
            continue
        mean, size = rows
        turn, spread = _flicker_contrasts(len(mean))
        squares.append((turn @ mean) ** 2)
        widths.append(np.full(len(spread), size * dt))
        shapes.append(spread)
    if not squares or not np.concatenate(squares).any():
        return None
    z2, width, shape = np.concatenate(squares), np.concatenate(widths), np.concatenate(shapes)
    unit = float(np.median(width))
    variance = unit / width[None] + RATIOS[:, None] * shape[None]  # over N^2/unit
    size2 = (z2 / variance).mean(axis=1)
    likelihood = -0.5 * (np.log(variance).sum(axis=1) + len(z2) * np.log(size2))
    steps = np.sqrt(RATIOS)
    weight = np.exp(likelihood - likelihood.max()) * np.gradient(steps)
    weight /= weight.sum()
    N = math.sqrt(unit * float(weight @ size2))
    B = math.sqrt(float(weight @ (size2 * RATIOS)))
    return NoiseModel.of(White(N=N), Flicker(B=B))


def model_beside_motion(spans: Sequence[Array], dt: float) -> NoiseModel | None:
    """White noise of a channel from spans in which a hand moves it: by high differences of neighbouring samples.

    White noise of variance s^2 passes q-th differences as (2 q over q) s^2. Of a tremor at a fifth or a quarter of the
    sample rate passes 5e-9 or 8e-6 of what would pass if it were white (q = 20); tenth differences pass 1e-4 or 6e-3,
    which is more than the noise of a consumer unit. A sensor that filters shows less than it has, which the scatter of
    the spans makes up for. The usual span tells: the median, of chi-square laws brought to their mean.

    Returns
    -------
    NoiseModel or None
        None where the samples do not vary.
    """
    q = max(min(DIFFERENCES, int(np.median([len(samples) for samples in spans])) // 2), 1)
    passes = math.comb(2 * q, q)
    squares = []
    for samples in spans:
        high = np.diff(samples, n=q)
        high = high[np.isfinite(high)]
        if len(high):
            dof = max(len(high) * passes**2 / math.comb(4 * q, 2 * q), 1.0)  # neighbours go together
            squares.append(float(np.mean(high**2)) / (1 - 2 / (9 * dof)) ** 3)
    if not squares or not np.median(squares) > 0:
        return None
    return NoiseModel.of(White(N=math.sqrt(float(np.median(squares)) / passes * dt)))


def _rows(samples: Array) -> tuple[Array, int] | None:
    """Means of up to 64 equal rows of a span without missing samples, and how many samples are in each."""
    good = samples[np.isfinite(samples)]
    size = max(len(good) // ROWS, 1)
    count = min(len(good) // size, ROWS)
    if count < 3:
        return None
    return (good[: count * size] - good[0]).reshape(count, size).mean(axis=1), size


@cache
def _flicker_contrasts(n: int) -> tuple[Array, Array]:
    """Contrasts of n rows in which flicker is uncorrelated, shape (n - 1, n), and its variance in each for B = 1."""
    edges = np.arange(n, dtype=np.float64)
    ones = np.ones(n)
    f = span_covariance(NoiseModel.of(Flicker(B=1.0)), edges, edges + 1, ones, dt=1.0, sampling="mean")
    contrast = np.linalg.qr(np.column_stack([ones, np.eye(n)[:, 1:]]))[0][:, 1:].T
    values, vectors = np.linalg.eigh(contrast @ f @ contrast.T)
    return np.asarray(vectors.T @ contrast), np.asarray(values)
