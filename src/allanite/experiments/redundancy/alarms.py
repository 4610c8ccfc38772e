# SPDX-License-Identifier: BSD-3-Clause
"""The tests of a record of parities: which window contradicts the noise models, at a stated rate of false alarms."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.redundancy.means import WindowMeans
from allanite.experiments.redundancy.parity import ParityFilter
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.distributions import chi_square_quantile

__all__ = ["RUN", "Bench"]

Array = NDArray[np.float64]

#: Windows in a longer window, and windows in a run that is tested for its noise.
SCALES, RUN = (1, 8, 64), 16
#: The variance of noise over that of the differences of neighbors: what is slower is a fault, not noise.
SLOW = 4.0
#: A longer window is used from so many of them on.
FEWEST = 8


@dataclass(slots=True, kw_only=True)
class Bench:
    """The filters of all scales, the data, and the columns of what has been explained so far."""

    means: WindowMeans
    parity: Array
    models: Sequence[NoiseModel]
    correlation: Array
    extra: Array
    scales: tuple[int, ...]
    tests: int
    false_alarm: float
    masked: NDArray[np.bool_]
    median: float = 1.0
    unusual: bool = False
    filters: dict[int, ParityFilter] = field(default_factory=dict)
    explained: list[Array] = field(default_factory=list)  # shapes (windows, n): a fault of size one

    @classmethod
    def of(
        cls,
        means: WindowMeans,
        parity: Array,
        models: Sequence[NoiseModel],
        correlation: Array,
        extra: Array,
        open_: NDArray[np.bool_],
        false_alarm: float,
    ) -> Bench:
        usable = replace(means, part=np.where(open_[:, None], means.part, 0.0))
        scales = tuple(s for s in SCALES if s == 1 or len(means) // s >= FEWEST)
        bench = cls(
            means=usable,
            parity=parity,
            models=models,
            correlation=correlation,
            extra=extra,
            scales=scales,
            tests=sum(len(means) // s for s in scales) + len(means) // RUN,
            false_alarm=false_alarm,
            masked=~open_,
        )
        bench.mask(0, 0)
        bench.measure()
        return bench

    def mask(self, start: int, stop: int) -> None:
        """Leave windows out of everything from now on."""
        self.masked = self.masked.copy()
        self.masked[start:stop] = True
        self.means = replace(self.means, part=np.where(self.masked[:, None], 0.0, self.means.part))
        for scale in self.scales:
            coarse = self.means if scale == 1 else self.means.merged(scale)
            part = coarse.part.min(axis=1)
            wide = self.extra[: len(part) * scale].reshape(len(part), scale).mean(axis=1)
            self.filters[scale] = ParityFilter.of(
                self.parity,
                self.models,
                self.correlation,
                np.where(part < 0.5, 0.0, part),
                dt=coarse.dt,
                extra=wide,
            )

    @property
    def allowed(self) -> float:
        """Factor on the variance of the models that the tests allow for: never below one."""
        return max(self.median, 1.0) if self.unusual else 1.0

    def level(self, dof: int) -> float:
        """Threshold of a chi-square."""
        return chi_square_quantile(1 - self.false_alarm / self.tests, dof)

    def cleaned(self, horizon: int) -> Array:
        """Means without what has been explained; all sizes fitted together to the windows before the horizon."""
        y = np.nan_to_num(self.means.mean)
        if not self.explained:
            return y
        return np.asarray(y - np.stack(self.explained, axis=-1) @ self.sizes(horizon)[0])

    def whitened(self, means: Array) -> Array:
        """At the scale of single windows, over the noise that is allowed for; missing windows are zero."""
        white = self.filters[1].whiten(means) / math.sqrt(self.allowed)
        return np.nan_to_num(white)

    def sizes(self, horizon: int | None = None) -> tuple[Array, Array]:
        """Sizes of what has been explained, and their covariance, from the windows before the horizon."""
        if not self.explained:
            return np.zeros(0), np.zeros((0, 0))
        columns = self.whitened(np.stack(self.explained, axis=-1)[:horizon])
        x = columns.reshape(-1, columns.shape[-1])
        y = self.whitened(np.nan_to_num(self.means.mean)[:horizon]).ravel()
        inverse = np.asarray(np.linalg.pinv(x.T @ x, rcond=1e-10, hermitian=True))
        return inverse @ (x.T @ y), inverse

    def misfit(self, horizon: int) -> float:
        """Sum of the chi-square of the windows before the horizon, without what has been explained."""
        return float((self.whitened(self.cleaned(horizon)[:horizon]) ** 2).sum())

    def state(self) -> tuple[Any, ...]:
        """Everything that an explanation changes."""
        return list(self.explained), self.masked, self.means, dict(self.filters)

    def restore(self, state: tuple[Any, ...]) -> None:
        """Back to what `state` gave."""
        self.explained, self.masked, self.means, self.filters = state

    def measure(self) -> None:
        """The noise of what is left, by the median of the windows.

        A fault of half of the record moves that median, but not the difference of neighboring windows.
        """
        white = self.filters[1].whiten(self.cleaned(len(self.means)))
        median, sd = _median_ratio((white**2).sum(axis=1), len(self.parity))
        apart, _ = _median_ratio((np.diff(white, axis=0) ** 2).sum(axis=1) / 2, len(self.parity))
        self.median = min(median, SLOW * apart)
        self.unusual = abs(self.median - 1) > 3 * sd

    def series(self) -> dict[int, Array]:
        """Chi-square of every window at every scale, nothing explained."""
        rows = {s: self.means if s == 1 else self.means.merged(s) for s in self.scales}
        return {s: (f.whiten(np.nan_to_num(rows[s].mean)) ** 2).sum(axis=1) for s, f in self.filters.items()}

    def first_alarm(self, cleaned: Array) -> tuple[int, int] | None:
        """Span in windows of the first test that fails, the shorter window before the longer; None without one."""
        q = len(self.parity)
        alarms = []
        for scale, filter_ in self.filters.items():
            part = replace(self.means, mean=cleaned)
            rows = part.mean if scale == 1 else part.merged(scale).mean
            white = filter_.whiten(np.nan_to_num(rows)) / math.sqrt(self.allowed)
            chi2 = (white**2).sum(axis=1)
            high = np.flatnonzero(np.nan_to_num(chi2) > self.level(q))
            if len(high):
                alarms.append((int(high[0]) * scale, (int(high[0]) + 1) * scale))
            if scale == 1:
                alarms += self._runs(chi2, q)
        return min(alarms, key=lambda span: (span[1], span[1] - span[0])) if alarms else None

    def _runs(self, chi2: Array, q: int) -> list[tuple[int, int]]:
        runs = chi2[: len(chi2) // RUN * RUN].reshape(-1, RUN)
        count = (~np.isnan(runs)).sum(axis=1)
        total = np.nansum(runs, axis=1)
        high = [i for i in range(len(runs)) if count[i] > 1 and total[i] > self.level(q * int(count[i]))]
        return [(high[0] * RUN, (high[0] + 1) * RUN)] if high else []


def _median_ratio(chi2: Array, q: int) -> tuple[float, float]:
    """Median of the statistic over that of the law, which no fault of some windows moves; and its deviation."""
    there = chi2[~np.isnan(chi2)]
    middle = chi_square_quantile(0.5, q)
    density = math.exp((q / 2 - 1) * math.log(middle) - middle / 2 - q / 2 * math.log(2) - math.lgamma(q / 2))
    if len(there) < 2:
        return 1.0, math.inf
    return float(np.median(there)) / middle, 0.5 / (density * middle * math.sqrt(len(there)))
