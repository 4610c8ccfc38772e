# SPDX-License-Identifier: BSD-3-Clause
"""The means of the positions: a second method beside the regression, for their scatter and for errors of heading.

Their covariance under the noise model is that of `allanite.noise.span_means`. It holds for combinations in which a
constant cancels, and only such are used.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.north.tracks import Track
from allanite.lazy_dataclasses import dataclass
from allanite.noise.span_means import contrast_whitener, span_covariance

__all__ = ["Means", "PositionScatter", "scatter_of"]

Array = NDArray[np.float64]

#: Most dwells of an axis; of more, those in the middle are taken.
MOST = 1500


@dataclass(frozen=True, slots=True, kw_only=True)
class Means:
    """Dwells of one axis that have samples and a heading.

    Attributes
    ----------
    heading : ndarray, shape (n,) [rad]
        Of this axis, relative to the mark.
    position : ndarray of int, shape (n,)
    mean : ndarray, shape (n,) [rad/s]
    whitener : ndarray, shape (n - 1, n)
        Turns the means into independent numbers of variance one, a constant into zero.
    share : float
        Part of all dwells that were taken.
    """

    heading: Array
    position: NDArray[np.int64]
    mean: Array = field(repr=False)
    whitener: Array = field(repr=False)
    share: float

    @classmethod
    def of(cls, track: Track) -> Means | None:
        """None with fewer than two dwells, or none at all in a rotation."""
        if track.reversals is None:
            return None
        dwells, rate = track.reversals.dwells, track.reversals.rate
        mean, whole = track.blocks.of_spans(len(dwells))
        good = [i for i, d in enumerate(dwells) if math.isfinite(d.heading) and whole[i] > 0]
        least = max(len(good) - MOST, 0) // 2
        kept = good[least : least + MOST]
        if len(kept) < 2:
            return None
        start, stop = (
            np.array([getattr(dwells[i], end) for i in kept], dtype=np.float64) for end in ("start", "stop")
        )
        measured = whole[kept] * track.blocks.dt * rate
        covariance = span_covariance(track.model, start, stop, measured, dt=1 / rate, sampling=track.sampling)
        n = len(kept)
        return cls(
            heading=np.array([dwells[i].heading for i in kept]) + track.offset,
            position=np.array([dwells[i].position for i in kept]),
            mean=mean[kept],
            whitener=contrast_whitener(covariance),
            share=n / len(good),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionScatter:
    """What the means of the positions say.

    Attributes
    ----------
    chi2, dof : float, int
        Of their residuals.
    vector : ndarray, shape (2,) [rad/s]
        From the means alone; in a direction they do not see, zero.
    weights : tuple of ndarray, shape (2, n)
        `vector` as a sum over the means of each axis.
    means : tuple of Means
    """

    chi2: float
    dof: int
    vector: Array
    weights: tuple[Array, ...] = field(repr=False)
    means: tuple[Means, ...] = field(repr=False)

    def heading_term(self, psi: float) -> float:
        """Standard deviation of the azimuth [rad] when the heading of each position is off by 1 rad at random.

        An error h of a position changes what an axis at psi + theta sees by -H sin(psi + theta) h.
        """
        across = np.array([-math.sin(psi), math.cos(psi)])
        moved: dict[int, float] = {}
        for axis_means, weight in zip(self.means, self.weights, strict=True):
            shifts = (across @ weight) * -np.sin(psi + axis_means.heading)
            for position, shift in zip(axis_means.position.tolist(), shifts.tolist(), strict=True):
                moved[position] = moved.get(position, 0.0) + shift
        share = float(np.mean([axis_means.share for axis_means in self.means]))
        return math.sqrt(sum(v**2 for v in moved.values()) * share)


def scatter_of(tracks: Sequence[Track]) -> PositionScatter | None:
    """Least squares of the means of all axes; None in a rotation."""
    means = [axis_means for axis_means in (Means.of(track) for track in tracks) if axis_means is not None]
    if len(means) < len(tracks):
        return None
    columns = np.concatenate(
        [m.whitener @ np.column_stack([np.cos(m.heading), -np.sin(m.heading)]) for m in means]
    )
    y = np.concatenate([m.whitener @ (m.mean - m.mean.mean()) for m in means])
    left, values, right = np.linalg.svd(columns, full_matrices=False)
    size = max(float(np.linalg.norm(m.whitener, 2)) for m in means)
    keep = values > 1e-9 * size
    left, values, right = left[:, keep], values[keep], right[keep]
    solver = right.T @ (left / values).T
    residual = y - left @ (left.T @ y)
    parts = np.split(solver, np.cumsum([len(m.whitener) for m in means])[:-1], axis=1)
    return PositionScatter(
        chi2=float(residual @ residual),
        dof=len(y) - len(values),
        vector=solver @ y,
        weights=tuple(part @ m.whitener for part, m in zip(parts, means, strict=True)),
        means=tuple(means),
    )
