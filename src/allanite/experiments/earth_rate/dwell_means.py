# SPDX-License-Identifier: BSD-3-Clause
"""The means of the dwells: the simple estimators, and what their scatter says.

Their covariance under the noise model is that of `allanite.noise.span_means`, a second method beside the regression.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.earth_rate.checks import RateCheck
from allanite.experiments.earth_rate.results import RateReading
from allanite.experiments.earth_rate.take import Take, Transient
from allanite.experiments.earth_rate.verdict import RateCheckKind
from allanite.experiments.reversals.sides import triple_of
from allanite.filtering.block_means import BlockMeans
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.span_means import contrast_whitener, span_covariance
from allanite.quantities.residual_tests import alarm, scatter_check
from allanite.recording.records import Sampling

__all__ = ["DwellMeans"]

Array = NDArray[np.float64]

#: Most dwells that are checked; of more, those in the middle are taken.
MOST = 1500
#: Single values whose covariance is taken at once.
GROUP = 600


@dataclass(frozen=True, slots=True, kw_only=True)
class DwellMeans:
    """Dwells of known direction, in order.

    Attributes
    ----------
    start, stop, whole : ndarray, shape (n,) [samples]
        Ends, and samples that were measured.
    sign, mean : ndarray, shape (n,)
    nuisances : ndarray, shape (n, k)
        Other columns of the regression, as means of the dwells.
    projection : float
        Part of the Earth's rotation along the axis where the sign is +1.
    triple : str
        Name of the estimator of three dwells.
    model : NoiseModel
    dt : float [s]
    sampling : "mean" or "point"
    """

    start: Array
    stop: Array
    whole: Array
    sign: Array
    mean: Array
    nuisances: Array
    projection: float
    triple: str
    model: NoiseModel
    dt: float
    sampling: Sampling

    @classmethod
    def of(cls, take: Take, model: NoiseModel, decays: Sequence[Transient]) -> DwellMeans:
        """The dwells that have samples and a direction."""
        blocks, every = take.blocks, take.reversals.dwells
        mean, whole = blocks.of_spans(len(every))
        kept = [i for i, d in enumerate(every) if d.sign != 0 and whole[i] > 0]
        table = np.array([(every[i].start, every[i].stop, every[i].sign) for i in kept], dtype=np.float64)
        start, stop, sign = table.reshape(-1, 3).T
        others = take.design(decays)[0].T[2:]
        return cls(
            start=start,
            stop=stop,
            whole=whole[kept] * blocks.dt * take.reversals.rate,
            sign=sign,
            mean=mean[kept],
            nuisances=np.array([_of_dwells(blocks, c, kept) for c in others]).reshape(-1, len(kept)).T,
            projection=take.projection,
            triple=triple_of(take.reversals.first),
            model=model,
            dt=1 / take.reversals.rate,
            sampling=take.recording[take.channel].sampling,
        )

    @property
    def size(self) -> int:
        """Number of dwells."""
        return len(self.mean)

    @property
    def middle(self) -> Array:
        """Middle of each dwell [s]."""
        return np.asarray((self.start + self.stop) / 2 * self.dt)

    def covariance(self, part: slice[int, int] | NDArray[np.int64]) -> Array:
        """Of these dwells; it holds for combinations in which a constant cancels [rad²/s²]."""
        ends = self.start[part], self.stop[part], self.whole[part]
        return span_covariance(self.model, *ends, dt=self.dt, sampling=self.sampling)

    # -- simple estimators --------------------------------------------------------------------------------

    def pairs(self) -> tuple[NDArray[np.int64], Array]:
        """The seed's estimator: numbers of the two dwells of each pair, and their coefficients; (k, 2)."""
        firsts, i = [], 0
        while i + 1 < self.size:
            differ = self.sign[i] != self.sign[i + 1]
            firsts += [i] if differ else []
            i += 2 if differ else 1
        members = np.array(firsts, dtype=np.int64)[:, None] + np.arange(2)
        return members, self.sign[members] / (2 * self.projection)

    def triples(self) -> tuple[NDArray[np.int64], Array]:
        """Three dwells, (m1 - 2 m2 + m3)/4 where they are equal: free of a drift that is linear in time; (k, 3)."""
        turned = self.sign[1:] != self.sign[:-1]
        members = np.flatnonzero(turned[1:] & turned[:-1])[:, None] + np.arange(3)
        before, after = np.diff(self.middle[members], axis=1).T
        weight = np.column_stack([after, -(before + after), before]) / (before + after)[:, None]
        return members, weight * self.sign[members[:, :1]] / (2 * self.projection)

    def readings(self) -> tuple[RateReading, ...]:
        """Both simple estimators, where the record allows them."""
        estimators = (("pairs", *self.pairs()), (self.triple, *self.triples()))
        return tuple(self._reading(*each) for each in estimators if len(each[1]))

    def _reading(self, name: str, members: NDArray[np.int64], weights: Array) -> RateReading:
        """Mean of the single values. Their variance is summed over groups of values that follow each other."""
        values, n, variance = (weights * self.mean[members]).sum(axis=1), len(members), 0.0
        for group in range(0, n, GROUP):
            group_members = members[group : group + GROUP]
            part = slice(int(group_members.min()), int(group_members.max()) + 1)
            total = (
                np.bincount((group_members - part.start).ravel(), weights[group : group + GROUP].ravel()) / n
            )
            variance += float(total @ self.covariance(part) @ total)
        return RateReading(
            name=name,
            rate=float(values.mean()),
            sd=math.sqrt(variance),
            scatter=float(values.std(ddof=1) / math.sqrt(n)) if n > 1 and _apart(members) else None,
            count=n,
        )

    # -- checks -------------------------------------------------------------------------------------------

    def checks(self) -> tuple[RateCheck, ...]:
        """Scatter of the dwells, a rate that changes, a turn that was missed; none with fewer than four dwells."""
        n = min(self.size, MOST)
        if n < 4 + self.nuisances.shape[1]:
            return ()
        part = slice((self.size - n) // 2, (self.size + n) // 2)
        sign, middle = self.sign[part], self.middle[part]
        whitener = contrast_whitener(self.covariance(part))
        signal = np.column_stack([sign * self.projection, self.nuisances[part]])
        known = np.linalg.qr(whitener @ signal)[0]
        left = whitener @ (self.mean[part] - self.mean[part].mean())
        left = left - known @ (known.T @ left)

        def gains(columns: Array) -> Array:
            """Chi-square that each column takes off the residuals."""
            whitened = whitener @ columns
            whitened -= known @ (known.T @ whitened)
            lengths = (whitened**2).sum(axis=0)
            good = lengths > 1e-9 * lengths.max()
            return np.where(good, (left @ whitened) ** 2 / np.where(good, lengths, 1.0), 0.0)

        later = np.tril(np.ones((n, n - 1)), -1) * sign[:, None]
        trend = (sign * (middle - middle.mean()))[:, None]
        scatter = scatter_check("dwells", float(left @ left), n - 1 - known.shape[1])
        return (
            RateCheck.of(RateCheckKind.SCATTER, scatter),
            RateCheck.of(RateCheckKind.CONSTANCY, alarm("constancy", float(gains(trend)[0]), 1)),
            _missed(gains(later), middle),
        )


def _apart(members: NDArray[np.int64]) -> bool:
    """No dwell serves in two values."""
    return bool((members[1:, 0] > members[:-1, -1]).all())


def _of_dwells(blocks: BlockMeans, column: Array, kept: list[int]) -> Array:
    return replace(blocks, mean=column).of_spans(max(kept, default=-1) + 1)[0][kept]


def _missed(gains: Array, middle: Array) -> RateCheck:
    worst = int(np.argmax(gains))
    test = alarm("order", float(gains[worst]), 1, looks=len(gains))
    return RateCheck.of(RateCheckKind.ORDER, test, at=float(middle[worst + 1]))
