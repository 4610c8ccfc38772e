# SPDX-License-Identifier: BSD-3-Clause
"""Isolated missing samples in a periodogram.

Left out at weight zero, a missing sample of red noise is a step down to the mean and back: it leaks the power of the
lowest frequencies over all others. Here its best estimate from its neighbours stands in for it, with weights that sum
to 1, so that slow noise of any size passes: x'_i = sum of a_ik x_(i+k), and e_i = x_i - x'_i (0 where nothing is
missing). What that changes is put back into the density:

    E|F(f)|^2 = E|F'(f)|^2 + sum over i, j of w_i w_j t_ij cos(2 pi f (i - j) dt),                         (1)

    t_ij = u_i(j - i) + u_j(i - j) - cov(e_i, e_j),     u_i(h) = cov(e_i, x_(i+h)) = R(h) - sum of a_ik R(h - k),

whatever the spectrum and the weights. As the weights sum to 1, u depends on the differences of the samples alone, not
on the variance of the slow noise, and is taken as 0 beyond the neighbours. White noise needs less put back than
was missing, or a negative density: a mean over neighbours has what is slow in them twice. A random walk needs next
to nothing. Runs of more than a few samples stay missing: segments that hold them are left out. The recording itself
keeps its gaps.

What is put back carries no information. Look at the density as the transform of the autocovariance: the pairs of
samples that are h apart enter with the weight of their number. With p_h the part of them that is there (p_0 = p, the
part of the samples), white noise of variance R has an autocovariance known to R^2 (2 if h = 0 else 1)/(n p_h), and a
density whose missing samples were set to the mean holds the part p_h of it. Bridged, and with (1) put back, it holds
the part w_h (w_0 = 1),

    w_h = p_h + pairs of which one sample or both are bridged, up to h = `_REACH`,                         (2)

because the estimate of a missing sample, and what is put back, are made of that autocovariance. With 2/nu the
relative variance of an ordinate of a whole record, l_0 = 1 and l_h = sqrt(2) cos(2 pi f h dt), the relative errors of
the ordinates are so

    own:  2 p/nu at most,        in common:  sum over h, k of l_h l_k C_hk,                                 (3)

    C_hk = (2/n) (w_h^2 - p_h^2)/p_h [h = k] + (w_h - p_h) (w_k - p_k) (sum over i of c_ih c_ik/(n_h n_k) - 4/n_0),

n_h = n p_h the pairs, c_ih how many of them sample i is in. (The second part of C, for h, k > 0: the autocovariance
is taken from differences, R(0) - D(h)/2, as slow noise needs it, and the samples in pairs are not all samples.) The
own part is right for any pattern of holes: with the mean in their place, the covariance of the ordinates has no
eigenvalue larger than p, that of the mean over all of them. With the common part that mean is known to p + 1/p - p =
1/p: no better than the p n samples allow. One narrow bin is known to p^2, better than without holes, by a part that
tells nothing. At low frequencies, where a negative density is put back, a bin was measured with q times the noise of
a whole record, q up to 1/p, and its own part is 2 q^2/nu. In other noise the white part alone, of density
`Bridged.white`, is taken to do all this: slow noise is bridged with next to no error.

References
----------
.. [1] N. Wiener, "Extrapolation, interpolation and smoothing of stationary time series", 1949: the estimate from both
   sides; here from the autocovariance of the block itself, over `_REACH` samples on each side.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = ["Bridge", "Bridged"]

Array = NDArray[np.float64]

#: Longest run of missing samples that is bridged.
LONGEST_RUN = 4
_REACH = 8
_ENOUGH = 64  # samples of a block that its autocovariance is taken from
_RIDGE = 1e-9
_BATCH = 4096
#: An independent error of eq. (3) whose variance is smaller, times 2/n, does not count; nor does less of a density.
_LEAST = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Bridged:
    """What was put back for bridged samples into a density, and what that does to its errors.

    Attributes
    ----------
    lacking : tuple of float
        Sums of t_ij of eq. (1) by distance, from 0, a sample of the record on average, times dt: unit of the density.
    share : float
        Bridged samples over all samples.
    dt : float [s]
        Sample interval.
    errors : tuple of tuple of float
        Root of C in eq. (3), a row for each lag from 0, a column for each independent error: what densities have in
        common. Empty where that does not count.
    coupling : float
        Variance of a mean over all frequencies that holes at random places add to that of its bins, likewise.
    white : float
        Density of the part of the record that the neighbours of a missing sample do not tell, as if it were white.
    """

    lacking: tuple[float, ...] = ()
    share: float = 0.0
    dt: float = 1.0
    errors: tuple[tuple[float, ...], ...] = ()
    coupling: float = 0.0
    white: float = 0.0

    def put_back(self, frequency: ArrayLike) -> Array:
        """Density that was added, negative or not, in the unit of the density; shape of `frequency` [Hz]."""
        return _transform(self.lacking, 2 * np.pi * self.dt * np.asarray(frequency, dtype=np.float64))

    def own_part(self, density: ArrayLike, frequency: ArrayLike) -> Array:
        """Variance of densities but for the common errors, at most, over that without holes: q^2, or p, of eq. (3)."""
        measured = 1 - _over(self.put_back(frequency), density)
        return np.asarray(np.maximum(measured, 1 - self.share) * np.maximum(measured, 1.0))

    def common(self, density: ArrayLike, below: ArrayLike, above: ArrayLike) -> Array:
        """Loadings of independent errors of unit variance that all densities have in common, relative to them.

        Parameters
        ----------
        density : array_like, shape (n,)
        below, above : array_like, shape (n,) [Hz]
            Ends of the band that each of them is a mean of.

        Returns
        -------
        ndarray, shape (n, n_errors)
        """
        low, high = (2 * np.pi * self.dt * np.asarray(f, dtype=np.float64) for f in (below, above))
        part = np.minimum(_over(self.white, density), 1.0)
        if not self.errors:
            return np.zeros((len(part), 0))
        turns = [
            (np.sin(h * high) - np.sin(h * low)) / (h * (high - low)) for h in range(1, len(self.errors))
        ]
        loadings = np.stack([np.ones_like(part), *(math.sqrt(2) * t for t in turns)], axis=1)
        return np.asarray(part[:, None] * (loadings @ np.array(self.errors)))

    def scaled(self, factor: float) -> Bridged:
        """The same for a density times a factor."""
        lacking = tuple(part * factor for part in self.lacking)
        return replace(self, lacking=lacking, white=self.white * factor)


def _transform(by_distance: Iterable[float], turn: Array) -> Array:
    """Sum over both signs of the distance, of angles [rad a sample]."""
    total = np.zeros_like(turn)
    for h, part in enumerate(by_distance):
        total += (2 if h else 1) * part * np.cos(h * turn)
    return total


def _over(part: ArrayLike, density: ArrayLike) -> Array:
    level = np.asarray(density, dtype=np.float64)
    return np.asarray(np.divide(part, level, out=np.zeros_like(level), where=level > 0))


class Bridge:
    """Bridges short runs of missing samples in a stream of blocks, and counts what that takes off the variance."""

    def __init__(self) -> None:
        self._lacking = np.zeros(2 * _REACH + 1)  # sums of t_ij
        self._erring = np.zeros(2 * _REACH + 1)  # of cov(e_i, e_j)
        self._samples = self._filled = 0
        self._pairs = np.zeros((2, _REACH + 1))  # by distance: both there, and one or both bridged
        self._shared = np.zeros((_REACH, _REACH))  # sums of c_ih c_ik

    @property
    def lacking(self) -> Array:
        """What is put back, by distance from 0, averaged over all samples: a density at dt = 1."""
        return np.asarray(self._lacking / max(self._samples, 1))

    def account(self, dt: float, count: int) -> Bridged:
        """What to put back into the density of `count` samples of interval dt."""
        if not self._erring[0] > 0 or not count:
            return Bridged(dt=dt)
        return Bridged(
            lacking=tuple((self.lacking * dt).tolist()),
            share=self._filled / self._samples,
            dt=dt,
            errors=self._errors(min(count, self._samples)),
            coupling=self._filled
            / self._samples
            * (1 - self._filled / self._samples)
            * 2
            / min(count, self._samples),
            white=self._white() * dt,
        )

    def _white(self) -> float:
        """Density of the errors at dt = 1 over their share of the samples: a mean of logarithms, as of predictions."""
        density = _transform(self._erring, np.linspace(0.0, np.pi, 65))
        return float(np.exp(np.log(np.maximum(density, _LEAST * self._erring[0])).mean())) / self._filled

    def _errors(self, n: int) -> tuple[tuple[float, ...], ...]:
        """Root of C in eq. (3), for a density of n samples."""
        both, one = np.maximum(self._pairs, [[1.0], [0.0]]) / self._samples
        whole = both + one
        C = np.diag((whole**2 - both**2) / both)  # times 2/n
        gain = ((whole - both) / both)[1:]
        apart = self._shared / self._samples / 2 - 2 * np.outer(both[1:], both[1:]) / both[0]
        C[1:, 1:] += np.outer(gain, gain) * apart
        size, axes = np.linalg.eigh(C)
        counts = size > _LEAST
        root = axes[:, counts] * np.sqrt(size[counts] * 2 / n)
        return tuple(map(tuple, root.tolist())) if counts.any() else ()

    def __call__(self, block: Array) -> Array:
        """The block with its short runs bridged."""
        if not math.isnan(float(block.sum())):
            self._count_complete(len(block))
            return block
        missing = np.isnan(block)
        short = _short(missing) if len(block) - missing.sum() >= _ENOUGH else np.zeros(0, dtype=np.int64)
        self._count(~missing, short)
        if not len(short):
            return block
        level = float(np.nanmean(block))
        covariance = _autocovariance(np.where(missing, 0.0, block - level), ~missing)
        out = block.copy()
        for count, places in _batches(short):
            value, shares = _expected(block - level, ~missing, places, covariance)
            out[places[:count]] = value[:count] + level
            tracking, erring = _unknown(places, shares, count, covariance)
            self._erring += erring
            self._lacking += tracking - erring
        return out

    def _count_complete(self, n_samples: int) -> None:
        self._samples += n_samples
        self._pairs[0] += np.maximum(n_samples - np.arange(_REACH + 1), 0)
        self._shared += 4.0 * n_samples

    def _count(self, there: NDArray[np.bool_], bridged: NDArray[np.int64]) -> None:
        """Samples, and pairs of them by their distance."""
        self._samples += int(there.sum()) + len(bridged)
        self._filled += len(bridged)
        filled = np.zeros(len(there), dtype=bool)
        filled[bridged] = True
        known, within = there | filled, np.zeros((_REACH, len(there)))
        for h in range(min(_REACH + 1, len(there))):
            a, b = slice(h, None), slice(None, len(there) - h)
            pair = there[a] & there[b]
            self._pairs[0, h] += int(pair.sum())
            self._pairs[1, h] += int(np.sum(known[a] & known[b] & ~pair))
            if h:
                within[h - 1, a] += pair
                within[h - 1, b] += pair
        self._shared += within @ within.T


def _batches(places: NDArray[np.int64]) -> Iterator[tuple[int, NDArray[np.int64]]]:
    """How many places are those of the batch, and these with the ones that follow within reach."""
    for first in range(0, len(places), _BATCH):
        size = min(_BATCH, len(places) - first)
        yield size, places[first : first + size + 2 * _REACH]


def _short(missing: NDArray[np.bool_]) -> NDArray[np.int64]:
    """Missing samples in runs that are short enough, and not at the ends of the block."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], missing, [False]]).astype(np.int8)))
    runs = edges.reshape(-1, 2)
    runs = runs[(np.diff(runs, axis=1)[:, 0] <= LONGEST_RUN) & (runs[:, 0] > 0) & (runs[:, 1] < len(missing))]
    places = [np.arange(a, b) for a, b in runs]
    return np.concatenate(places) if places else np.zeros(0, dtype=np.int64)


def _autocovariance(values: Array, present: NDArray[np.bool_]) -> Array:
    """R(h) = R(0) - D(h)/2 by mean squared differences D: no cancellation. R(0) is that of the largest of them.

    More variance would be that of noise which is slower than the neighbours are far: it drops out.
    """
    apart = [0.0]
    for h in range(1, 2 * _REACH + 1):
        both = present[h:] & present[:-h]
        apart.append(
            float(np.sum(np.where(both, values[h:] - values[:-h], 0.0) ** 2)) / max(int(both.sum()), 1)
        )
    return _definite((max(apart) - np.array(apart)) / 2)


def _definite(covariance: Array) -> Array:
    """As much white noise mixed in as makes it a covariance, as far above zero as it was below.

    Where holes leave few pairs of some distances, their errors make estimates that are larger than any sample.
    """
    from scipy.linalg import toeplitz

    least = float(np.linalg.eigvalsh(toeplitz(covariance))[0])
    if least >= 0:
        return covariance
    share = min(2 * -least / (covariance[0] - least), 1.0)
    return np.asarray(np.concatenate([covariance[:1], (1 - share) * covariance[1:]]))


_OFFSETS = np.concatenate([np.arange(-_REACH, 0), np.arange(1, _REACH + 1)])


def _expected(
    values: Array, present: NDArray[np.bool_], places: NDArray[np.int64], covariance: Array
) -> tuple[Array, Array]:
    """Best estimate of the samples at `places` from those around, by weights that sum to 1; these, by `_OFFSETS`."""
    near = places[:, None] + _OFFSETS
    inside = (near >= 0) & (near < len(values))
    near = np.clip(near, 0, len(values) - 1)
    there = inside & present[near]
    matrix = np.where(there[:, :, None] & there[:, None, :], covariance[_BETWEEN], 0.0)
    diagonal = np.arange(len(_OFFSETS))
    matrix[:, diagonal, diagonal] = covariance[0] * (1 + _RIDGE) or 1.0
    target = np.where(there, covariance[np.abs(_OFFSETS)], 0.0)
    solved = np.linalg.solve(matrix, np.stack([target, there.astype(np.float64)], axis=2))
    known, level = solved.sum(axis=1, where=there[:, :, None]).T
    shares = solved[:, :, 0] + ((1 - known) / level)[:, None] * solved[:, :, 1]  # they sum to 1
    return np.sum(shares * np.where(there, values[near], 0.0), axis=1), shares


_BETWEEN = np.abs(np.subtract.outer(_OFFSETS, _OFFSETS))
_WITHIN = np.arange(-_REACH, _REACH + 1)  # distances at which an error may be correlated with a sample


def _unknown(places: NDArray[np.int64], shares: Array, count: int, covariance: Array) -> tuple[Array, Array]:
    """Sums over the first `count` places of u_i(h) + u_i(-h) and of cov(e_i, e_i+h), h = 0 ... 2 `_REACH`.

    cov(e_i, e_j) = u_i(j - i) - sum of a_jk u_i(j - i + k), as in eq. (1).
    """
    u = covariance[np.abs(_WITHIN)] - shares @ covariance[np.abs(_OFFSETS[:, None] - _WITHIN)]
    u = np.pad(u, ((0, 0), (2 * _REACH, 2 * _REACH)))
    tracking, erring = np.zeros((2, 2 * _REACH + 1))
    middle = u.shape[1] // 2
    for h in range(len(erring)):
        i = np.arange(count)
        j = np.searchsorted(places, places[:count] + h)
        both = j < len(places)
        both[both] = places[j[both]] == places[i[both]] + h
        first, second = i[both], j[both]
        known = np.sum(shares[second] * u[first][:, middle + h + _OFFSETS], axis=1)
        erring[h] = float(np.sum(u[first, middle + h] - known))
        tracking[h] = float(np.sum(u[:count, [middle - h, middle + h]]))
    return tracking, np.concatenate([np.maximum(erring[:1], 0.0), erring[1:]])
