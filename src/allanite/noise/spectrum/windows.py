# SPDX-License-Identifier: BSD-3-Clause
"""Windows of segments: sums of cosines that are zero at both ends, and what a spectrum looks like through them.

The transform of such a window vanishes at every whole bin beyond its order: the level of a segment, which wanders
without bound under a random walk, is not seen there at all. A segment without a window has no such bins in practice:
its side lobes fall so slowly that red noise leaks from zero into all of them, so that it is not offered.

References
----------
.. [1] F. J. Harris, "On the use of windows for harmonic analysis with the discrete Fourier transform", Proc. IEEE 66
   (1978) 51.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.quantities.sums import sum_of_products

__all__ = ["HANN", "WINDOWS", "Window", "window_of"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Window:
    """A window w_j = sum over m of (-1)^m a_m cos(2 pi m j/length).

    Attributes
    ----------
    name : str
    weights : tuple of float
        a_0, a_1, ...
    """

    name: str
    weights: tuple[float, ...]

    @property
    def order(self) -> int:
        """Whole bins beyond this one do not see a constant."""
        return len(self.weights) - 1

    @property
    def spread(self) -> float:
        """Mean square distance [bins] of the power that a bin sees: S = 1/f^2 is seen 1 + 3 spread/bin^2 too high."""
        return sum((m * a) ** 2 for m, a in enumerate(self.weights)) / 2 / _energy(self.weights)

    def samples(self, length: int) -> Array:
        """The window of a segment, shape (length,)."""
        angle = 2 * np.pi * np.arange(length) / length
        parts = ((-1) ** m * a * np.cos(m * angle) for m, a in enumerate(self.weights))
        total: Array = sum(parts, np.zeros(length))
        return np.maximum(total, 0.0)  # rounding at the ends

    def kernel(self, bins: ArrayLike, length: int) -> Array:
        """Power that a bin sees of what lies so many bins off; its integral over all bins is 1.

        Parameters
        ----------
        bins : array_like
            Need not be whole.
        length : int
            Samples of the segment.
        """
        x = np.asarray(bins, dtype=np.float64)
        amplitude = np.zeros(x.shape, dtype=np.complex128)
        for m, a in enumerate(self.weights):
            for side in (0,) if m == 0 else (m, -m):
                amplitude += (-1) ** m * a / (1 if m == 0 else 2) * _dirichlet(x - side, length)
        return np.asarray(np.abs(amplitude) ** 2 / _energy(self.weights))

    def overlap(self, length: int, hop: int) -> Array:
        """Correlation of the powers of one bin in segments 0, 1, 2, ... hops apart, for white noise."""
        w = self.samples(length)
        shared = [sum_of_products(w[: length - d], w[d:]) for d in range(0, length, hop)]
        return (np.array(shared) / shared[0]) ** 2

    def neighbours(self, length: int, hop: int, most: int) -> tuple[Array, Array]:
        """Correlation of the powers of bins 0, 1, ..., `most` apart: in one segment, and in two a hop apart."""
        w = self.samples(length)
        energy = sum_of_products(w, w)
        same = np.abs(np.fft.rfft(w * w)) / energy
        other = np.abs(np.fft.rfft(w[: length - hop] * w[hop:], length)) / energy
        return same[: most + 1] ** 2, other[: most + 1] ** 2


def _energy(weights: tuple[float, ...]) -> float:
    """Mean square of the window."""
    return weights[0] ** 2 + sum(a * a for a in weights[1:]) / 2


def _dirichlet(x: Array, length: int) -> NDArray[np.complex128]:
    """Mean of exp(-2 pi i x j/length) over a segment."""
    turns = np.pi * x / length
    near = np.abs(np.sin(turns)) < 1e-12
    size = np.where(near, 1.0, np.sin(np.pi * x) / (length * np.sin(np.where(near, 1.0, turns))))
    return np.asarray(size * np.exp(-1j * (np.pi * x - turns)))


#: By name. Hann sees two bins on each side, Blackman three, Blackman-Harris four with side lobes 92 dB down.
WINDOWS = {
    w.name: w
    for w in (
        Window("hann", (0.5, 0.5)),
        Window("blackman", (0.42, 0.5, 0.08)),
        Window("blackman-harris", (0.35875, 0.48829, 0.14128, 0.01168)),
    )
}
HANN = WINDOWS["hann"]


@lru_cache(maxsize=8)
def window_of(name: str) -> Window:
    """A window by its name.

    Raises
    ------
    InputError
        No such window.
    """
    if name not in WINDOWS:
        hint = " (a segment without a window lets red noise leak into every bin)" if name == "boxcar" else ""
        raise InputError(f"no window {name!r}{hint}; there are: {', '.join(WINDOWS)}")
    return WINDOWS[name]
