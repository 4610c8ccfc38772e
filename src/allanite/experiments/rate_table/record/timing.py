# SPDX-License-Identifier: BSD-3-Clause
"""The clocks of record and table: by how much they are apart, and how long the sensor takes to settle after a step.

A step happens when the area under the transition says so: t = end of the window - integral of (y - before) over
(after - before). That holds for a ramp, an exponential or any other shape, and counts the mean delay of table and
sensor as part of the offset. For a rate that changes all the time the offset is a coefficient of the regression
itself, that of the derivative of the rate (see `allanite.experiments.rate_table.record.fit`).
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_table.motion import RateSteps, RateTable, Sampled, TableClock
from allanite.lazy_dataclasses import dataclass
from allanite.recording.records import OVERLOAD, Recording

__all__ = ["CoarseOffset", "Edges", "Settling", "coarse_offset", "find_edges", "settling"]

Array = NDArray[np.float64]

#: Offsets that leave so many times as much of the record unexplained as the best one does fit as well, and so much that
#: settling may leave; of those, the ones by which the two share nearly as much time. Where even the best one leaves so
#: much, nothing is said of others. Cells leave no more than the blur; and so many peaks are looked at.
AS_GOOD, LEFT, AS_LONG, UNCLEAR, BLUR, MOST_PEAKS = 3.0, 1e-3, 0.95, 0.5, 0.02, 40
#: Part of the largest variance below which the transforms' rounding is seen.
ROUND = 1e-9
#: Least overlap of record and table in the search, as a part of the shorter one.
OVERLAP = 0.5
#: Most points of the search.
POINTS = 1 << 19
#: An edge is used where its time is known to this part of its window.
SHARP = 0.05
#: Longest time on either side of an edge that is looked at [s].
LONGEST = 60.0
#: A bin of the mean transition so many standard deviations off has not settled; and what is left out beyond that.
SETTLED, MARGIN = 4.5, 1.5
BINS = 240
#: Part of a step that still moves in the second half of it: it has not settled.
CREEP = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class CoarseOffset:
    """Where the table's motion fits the record, to a part of its changes.

    Attributes
    ----------
    offset : float [s]
    others : tuple of float [s]
        Offsets at which it fits as well, the nearest first: the motion repeats itself.
    either_sign : bool
        At some of them the scale factor has the other sign.
    """

    offset: float = 0.0
    others: tuple[float, ...] = ()
    either_sign: bool = False


def coarse_offset(recording: Recording, channel: str, table: RateTable) -> CoarseOffset:
    """Offset of the clocks by the correlation of the record with the table's rates, over what both of them hold.

    Of offsets that fit equally well the response that grows with the rate is taken, then the smallest offset.
    """
    spans = table.spans
    step, size = _step(recording, table)
    y = _cells(recording, channel, size)
    first = math.floor(spans[0, 0] / step)
    at = (first + np.arange(max(math.ceil(spans[-1, 1] / step) - first, 1))) * step
    inside = np.searchsorted(spans.ravel(), at + step / 2, side="right") % 2 == 1
    if not (inside.any() and np.isfinite(y).any()):
        return CoarseOffset()
    fit, shared = _correlation(y, np.where(inside, table.means(at, step), np.nan))
    lag = np.arange(len(fit))
    lag = np.where(lag < len(y), lag, lag - len(fit)) - first
    size_of = np.abs(fit)
    peaks = np.flatnonzero(
        (size_of >= np.roll(size_of, 1)) & (size_of >= np.roll(size_of, -1)) & (size_of > 0)
    )
    if not len(peaks):
        return CoarseOffset()
    unexplained = 1 - size_of[peaks] ** 2
    peaks = peaks[unexplained <= AS_GOOD * unexplained.min() + BLUR]
    peaks = peaks[shared[peaks] >= AS_LONG * shared[peaks].max()]
    peaks = peaks[np.argsort(-size_of[peaks], kind="stable")[:MOST_PEAKS]]
    refined = [_refined(y, step, table, float(lag[i]) * step) for i in peaks]
    offsets, left = np.array(refined).T
    good = left <= AS_GOOD * left.min() + LEFT
    sign = np.sign(fit[peaks])
    chosen = min(np.flatnonzero(good), key=lambda i: (-sign[i], abs(offsets[i])))
    rest = [i for i in np.flatnonzero(good) if i != chosen and abs(offsets[i] - offsets[chosen]) > step]
    if left.min() > UNCLEAR:
        rest = []
    rest.sort(key=lambda i: abs(offsets[i] - offsets[chosen]))
    return CoarseOffset(
        offset=float(offsets[chosen]),
        others=tuple(float(offsets[i]) for i in rest),
        either_sign=any(sign[i] != sign[chosen] for i in rest),
    )


def _step(recording: Recording, table: RateTable) -> tuple[float, int]:
    """Step of the search [s], and samples in it."""
    spans = table.spans
    fine = float(np.quantile(spans[:, 1] - spans[:, 0], 0.2)) / 40
    if isinstance(table, Sampled):
        fine = max(table.interval, (spans[-1, 1] - spans[0, 0]) / 20_000)
    elif not isinstance(table, RateSteps):
        fine = 1 / (48 * float(table.frequency.min()))
    whole = max(recording.duration, spans[-1, 1] - spans[0, 0])
    size = max(round(max(fine, 2 * whole / POINTS) * recording.rate), 1)
    return size / recording.rate, size


def _correlation(y: Array, x: Array) -> tuple[Array, Array]:
    """Pearson's, of y with x moved by each number of cells, over the cells that both hold, and their number.

    The correlation is 0 where little of the table's motion is among them.
    """
    n = 1 << (len(y) + len(x)).bit_length()
    here, there = np.isfinite(y), np.isfinite(x)
    y = np.where(here, y - y[here].mean(), 0.0)
    x = np.where(there, x - x[there].mean(), 0.0)
    y_part, yy_part, here_part = (np.fft.rfft(v, n) for v in (y, y**2, here.astype(np.float64)))
    x_part, xx_part, there_part = (np.conj(np.fft.rfft(v, n)) for v in (x, x**2, there.astype(np.float64)))
    count = np.maximum(np.fft.irfft(here_part * there_part, n), 1.0)
    x_sum, y_sum = np.fft.irfft(here_part * x_part, n), np.fft.irfft(y_part * there_part, n)
    both = np.fft.irfft(y_part * x_part, n) - x_sum * y_sum / count
    xx = np.fft.irfft(here_part * xx_part, n) - x_sum**2 / count
    yy = np.fft.irfft(yy_part * there_part, n) - y_sum**2 / count
    enough = xx >= OVERLAP * float((x**2).sum()) * min(1.0, len(y) / len(x))
    coefficients = np.where(
        enough & (yy > ROUND * yy.max()), both / np.sqrt(np.maximum(xx * yy, 1e-300)), 0.0
    )
    return coefficients, count


def _refined(y: Array, step: float, table: RateTable, offset: float) -> tuple[float, float]:
    """An offset to a tenth of a cell, and the part of the record's variance that is left by it."""
    at: Array = np.arange(len(y), dtype=np.float64) * step
    width, best = step / 2, (offset, _left(y, at, step, table, offset))
    while width > step / 20:
        middle = best[0]
        for candidate in (middle - width, middle + width):
            left = _left(y, at, step, table, candidate)
            best = min(best, (candidate, left), key=lambda pair: pair[1])
        width /= 2
    return best


def _left(y: Array, at: Array, step: float, table: RateTable, offset: float) -> float:
    table_time = at - offset
    inside = (
        np.searchsorted(table.spans.ravel(), table_time + step / 2, side="right") % 2 == 1
    ) & np.isfinite(y)
    if np.count_nonzero(inside) < 3:
        return 1.0
    x, readings = table.means(table_time[inside], step), y[inside]
    x, readings = x - x.mean(), readings - readings.mean()
    size = float(x @ x) * float(readings @ readings)
    return 1.0 if size <= 0 else max(1 - float(x @ readings) ** 2 / size, 0.0)


def _cells(recording: Recording, channel: str, size: int) -> Array:
    """Means over cells of samples; NaN where there is none."""
    out = []
    for _, samples in recording.blocks(channel, size * max((1 << 18) // size, 1)):
        padded = np.pad(samples, (0, -len(samples) % size), constant_values=math.nan).reshape(-1, size)
        good = np.isfinite(padded)
        with np.errstate(invalid="ignore"):
            out.append(np.where(good, padded, 0.0).sum(axis=1) / good.sum(axis=1))
    return np.concatenate(out)


# -- steps ------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Edges:
    """Changes of the rate that the record shows.

    Attributes
    ----------
    number : ndarray of int64, shape (n,)
        Of the step that begins.
    commanded : ndarray, shape (n,) [s]
        By the table's clock.
    observed, sd : ndarray, shape (n,) [s]
        By the record's, and its standard deviation by white noise.
    before, after : ndarray, shape (n,) [SI of the channel]
        Means well before and well after.
    reach : ndarray, shape (n,) [s]
        Half of the window.
    """

    number: NDArray[np.int64]
    commanded: Array
    observed: Array
    sd: Array
    before: Array
    after: Array
    reach: Array

    def clock(self, quantile: float) -> tuple[TableClock, float, float]:
        """Clock with the standard deviations of offset and drift; the drift is 0 where none is seen.

        The scatter of the edges widens both: a table does not take the same time for each step.
        """
        weight, middle = 1 / self.sd, float(np.mean(self.commanded))
        table = np.column_stack([weight, weight * (self.commanded - middle)])
        late = self.observed - self.commanded
        offset = float((weight**2 * late).sum() / (weight**2).sum())
        spread = math.sqrt(max(float((((late - offset) * weight) ** 2).sum()) / max(len(late) - 1, 1), 1.0))
        sd = spread / float(np.sqrt((weight**2).sum()))
        if len(late) < 4:
            return TableClock(offset=offset), sd, math.inf
        fit = np.linalg.lstsq(table, weight * late, rcond=None)[0]
        left = float((((late - fit[0] - fit[1] * (self.commanded - middle)) * weight) ** 2).sum()) / (
            len(late) - 2
        )
        drift_sd = math.sqrt(max(left, 1.0)) / max(float(np.linalg.norm(table[:, 1])), 1e-300)
        if abs(fit[1]) <= quantile * drift_sd:
            return TableClock(offset=offset), sd, drift_sd
        drift = float(fit[1])
        start = float(fit[0]) - drift * middle
        return TableClock(offset=start, drift=drift), math.hypot(sd, drift_sd * middle), drift_sd


def find_edges(
    recording: Recording,
    channel: str,
    table: RateSteps,
    offset: float,
    chosen: NDArray[np.bool_] | None = None,
) -> Edges | None:
    """Changes of the rate between steps that take part, and when the record shows them; None where it shows none."""
    rows = [
        row
        for i in range(len(table.rate) - 1)
        if table.rate[i] != table.rate[i + 1]
        and (chosen is None or chosen[i : i + 2].all())
        and (row := _edge(recording, channel, table, i, offset)) is not None
    ]
    if not rows:
        return None
    number, commanded, observed, sd, before, after, reach = np.array(rows).T
    sharp = sd < SHARP * reach
    if not sharp.any():
        return None
    columns = [c[sharp] for c in (commanded, observed, sd, before, after, reach)]
    names = ("commanded", "observed", "sd", "before", "after", "reach")
    return Edges(number=number[sharp].astype(np.int64), **dict(zip(names, columns, strict=True)))


def _edge(
    recording: Recording, channel: str, table: RateSteps, i: int, offset: float
) -> tuple[float, ...] | None:
    """Number, commanded and observed time, its sd, means before and after, half window; None where it is not seen."""
    gap = float(table.start[i + 1] - table.stop[i])
    dwell = min(float(table.stop[i] - table.start[i]), float(table.stop[i + 1] - table.start[i + 1]))
    if gap > dwell:
        return None
    commanded = float(table.changes[i])
    reach = min(dwell, LONGEST) * 0.9 + min(commanded - table.stop[i], table.start[i + 1] - commanded)
    middle = commanded + offset
    first, last = round((middle - reach) * recording.rate), round((middle + reach) * recording.rate)
    if first < 0 or last > recording.n_samples or last - first < 16:
        return None
    y, lost = _filled(recording, channel, first, last)
    quarter = len(y) // 4
    early, late, inner = y[:quarter], y[-quarter:], y[quarter:-quarter]
    before, after = float(early.mean()), float(late.mean())
    noise = float(np.median(np.abs(np.diff(np.concatenate([early, late]))))) / 0.9539
    if not math.isfinite(lost) or before == after:
        return None
    area = float((inner - before).sum()) / recording.rate
    observed = (first + len(y) - quarter) / recording.rate - area / (after - before)
    sd = math.hypot(2 * math.sqrt(quarter) * noise, lost) / recording.rate / abs(after - before)
    return float(i + 1), commanded, observed, max(sd, 0.002 / recording.rate), before, after, reach


def _filled(recording: Recording, channel: str, first: int, last: int) -> tuple[Array, float]:
    """Samples in SI with straight lines across those that are missing, and the standard deviation of their sum by that.

    Where most of them are missing that is infinite. A change may hide in a gap: its area is then anything up to that of
    the triangle beside the line, either way.
    """
    y = recording.raw(channel, first, last)
    there = np.flatnonzero(np.abs(y) < OVERLOAD)
    y = y * recording[channel].scale
    if 2 * len(there) < len(y):
        return np.zeros(len(y)), math.inf
    wide = np.diff(there)
    hidden = np.where(wide > 1, wide * np.diff(y[there]), 0.0)
    return np.interp(np.arange(len(y)), there, y[there]), float(np.linalg.norm(hidden)) / math.sqrt(12)


@dataclass(frozen=True, slots=True, kw_only=True)
class Settling:
    """The mean transition of all edges.

    Attributes
    ----------
    dead_time, guard : float [s]
        To be left out after a step begins and before it ends, by the clock that was found.
    time : ndarray, shape (n,) [s]
        Since the edge.
    left : ndarray, shape (n,)
        What is left of the step at that time, as a part of it; 1 before the edge.
    settles : bool
        Whether the record settles within half of its steps.
    """

    dead_time: float
    guard: float
    time: Array
    left: Array
    settles: bool


def settling(
    recording: Recording, channel: str, table: RateSteps, edges: Edges, clock: TableClock
) -> Settling:
    """When a step has settled, from the mean of all transitions."""
    span = 2 * float(np.quantile(edges.reach, 0.2))
    width = max(span / BINS, 1 / recording.rate)
    bins = int(span / width)
    total, weight = np.zeros(bins), 0.0
    for k in range(len(edges.commanded)):
        middle = float(clock.record_time(edges.commanded[k : k + 1])[0])
        at = (np.arange(bins + 1) - bins / 2) * width + middle
        ends = np.clip(np.round(at * recording.rate), 0, recording.n_samples).astype(np.int64)
        y, _ = _filled(recording, channel, int(ends[0]), int(ends[-1]))
        sums = np.concatenate([[0.0], np.cumsum(edges.after[k] - y)])
        count = np.maximum(np.diff(ends), 1)
        size = edges.after[k] - edges.before[k]
        left = np.diff(sums[ends - ends[0]]) / count / size
        total += left * size**2
        weight += size**2
    left = total / weight
    time = (np.arange(bins) - bins / 2 + 0.5) * width
    sd = max(_scatter(left[-(bins // 4) :]), _scatter(left[: bins // 4]), 1e-9)
    begun, ended = table.start[1:] - table.changes, table.changes - table.stop[:-1]
    off = np.abs(left - (time < 0)) > SETTLED * sd
    together = off & (np.roll(off, 1) | np.roll(off, -1))  # one bin alone is chance, or a spike
    moving, stirring = np.flatnonzero(together & (time > 0)), np.flatnonzero(together & (time < 0))
    half, late = span / 2, time > 0.75 * span / 2
    creeps = abs(float(left[(time > 0.25 * half) & (time < 0.5 * half)].mean() - left[late].mean())) > CREEP
    after = float(time[moving[-1]] + width / 2) if len(moving) else width
    after = half / 2 / MARGIN if creeps else after
    early = float(-time[stirring[0]] + width / 2) if len(stirring) else 0.0
    return Settling(
        dead_time=max(MARGIN * after - float(np.median(begun)), 0.0),
        guard=max(MARGIN * early + width - float(np.median(ended)), 0.0),
        time=np.asarray(time, dtype=np.float64),
        left=left,
        settles=bool(after < 0.6 * half and not creeps),
    )


def _scatter(values: Array) -> float:
    """Of bins that have settled: about a straight line, or from one to the next, for noise is slow, too."""
    at = np.arange(len(values)) - (len(values) - 1) / 2
    level, slope = values.mean(), float(at @ values) / float(at @ at)
    about = float(np.sqrt(np.mean((values - level - slope * at) ** 2)))
    return max(about, float(np.median(np.abs(np.diff(values)))) / 0.9539)
