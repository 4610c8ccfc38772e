# SPDX-License-Identifier: BSD-3-Clause
"""What a model's spectrum looks like: its density as samples fold it, seen through the window of the segments.

The expected periodogram of a bin is the folded density averaged with the power kernel of the window around the bin:

    E[P_k] = integral of S(|k + x| df) K(x) dx.

Near zero S may grow without bound (1/f, 1/f^2); at whole bins beyond its order the kernel vanishes there as the square
of the distance, so that the integral exists for every term. It is taken by Gauss-Legendre points between whole bins.
Beyond `LEAKY` bins the density is straight across the kernel, to 1/bin^2 in the worst case (a random walk).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise.spectrum.windows import Window

__all__ = ["Sight", "sight_of"]

Array = NDArray[np.float64]

#: Bins of a segment in which the shape of the window counts: beyond, it moves the density by less than 0.02 %.
LEAKY = 64
#: Bins beside the main lobe from which power is gathered.
SIDE_LOBES = 8
_POINTS = 6  # of the Gauss-Legendre rule between two whole bins
_FEW = 16  # bins of a wide mean that are looked at


@dataclass(frozen=True, slots=True, kw_only=True)
class Sight:
    """A linear map from a density to what the bins of a spectrum hold on average.

    Attributes
    ----------
    frequency, weight : ndarray, shape (n_points,) [Hz], [1]
    owner : ndarray of int64, shape (n_points,)
        Bin of the spectrum that a point belongs to.
    size : int
        Bins of the spectrum.
    """

    frequency: Array
    weight: Array
    owner: NDArray[np.int64]
    size: int

    def __call__(self, density: Callable[[Array], Array]) -> Array:
        """Expected value of each bin, shape (size,), for a two-sided folded density."""
        power = self.weight * density(self.frequency)
        return np.asarray(np.bincount(self.owner, power, self.size), dtype=np.float64)


def sight_of(bins: ArrayLike, resolution: ArrayLike, nyquist: float, window: Window) -> Sight:
    """The map of a spectrum whose point i is the mean of periodogram bins [bins[i, 0], bins[i, 1]).

    Parameters
    ----------
    bins : array_like of int, shape (n, 2)
    resolution : array_like, shape (n,) [Hz]
        Distance of two periodogram bins; a segment holds 2 nyquist/resolution samples of the full rate.
    nyquist : float [Hz]
        Half the rate of the record.
    window : Window
    """
    f, weight, owner = [np.zeros(0)], [np.zeros(0)], [np.zeros(0, dtype=np.int64)]
    offsets, share = _kernel_points(window)
    for i, ((first, last), step) in enumerate(zip(np.asarray(bins), np.asarray(resolution), strict=True)):
        near = np.arange(first, min(last, LEAKY))
        far = np.arange(max(first, LEAKY), last)
        if len(near):
            f.append((np.add.outer(near, offsets) * step).ravel())
            weight.append(np.tile(share / (last - first), len(near)))
        if len(far):
            points = far if len(far) <= _FEW else far[0] + (np.arange(_FEW) + 0.5) / _FEW * len(far) - 0.5
            f.append(points * step)
            weight.append(np.full(len(points), len(far) / len(points) / (last - first)))
        owner.append(np.full(sum(map(len, f)) - sum(map(len, owner)), i, dtype=np.int64))
    around = np.mod(np.concatenate(f), 2 * nyquist)
    frequency = np.minimum(around, 2 * nyquist - around)
    size = len(np.asarray(resolution))
    return Sight(
        frequency=np.maximum(frequency, 1e-300),
        weight=np.concatenate(weight),
        owner=np.concatenate(owner),
        size=size,
    )


#: A segment is long against the side lobes that are gathered: its length no longer matters to the kernel.
_LENGTH = 1 << 14


def _kernel_points(window: Window) -> tuple[Array, Array]:
    """Offsets from a bin, and their shares of what it sees; they add up to 1."""
    nodes, weights = np.polynomial.legendre.leggauss(_POINTS)
    reach = window.order + 1 + SIDE_LOBES
    starts = np.arange(-reach, reach)
    x = np.add.outer(starts, (nodes + 1) / 2).ravel()
    share = np.tile(weights / 2, len(starts)) * window.kernel(x, _LENGTH)
    return x, share / share.sum()
