# SPDX-License-Identifier: BSD-3-Clause
"""A sum of sinusoids in the samples of a record.

A wave that begins a row of samples with some phase is its cosine and its sine within the row, in proportions that turn
from row to row: many sinusoids in many rows are one product of matrices, and no sine is computed for a sample.
"""

from __future__ import annotations

from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = ["SinusoidSum"]

Array = NDArray[np.float64]

_ROW, _BLOCK = 1024, 65_536  # samples


@dataclass(frozen=True, slots=True, kw_only=True)
class SinusoidSum:
    """Sum of cosines cos(2 pi f k) + sines sin(2 pi f k) in sample k, over all frequencies f [cycles per sample].

    Attributes
    ----------
    frequencies, cosines, sines : ndarray, shape (n,)
    """

    frequencies: Array
    cosines: Array
    sines: Array
    _row: Array = field(init=False, repr=False)

    def __post_init__(self) -> None:
        angle = 2 * np.pi * (np.outer(self.frequencies, np.arange(_ROW)) % 1.0)
        object.__setattr__(self, "_row", np.concatenate([np.cos(angle), np.sin(angle)]))

    def samples(self, first: int, count: int) -> Array:
        """Samples [first, first + count); a sample is the same to the last bit in whatever part it is asked for."""
        begin, end = first // _BLOCK, -(-(first + count) // _BLOCK)
        blocks = [self._block(_BLOCK * i) for i in range(begin, end)]
        return np.concatenate([np.zeros(0), *blocks])[first - _BLOCK * begin :][:count]

    def _block(self, first: int) -> Array:
        starts = first + _ROW * np.arange(_BLOCK // _ROW, dtype=np.float64)
        angle = 2 * np.pi * (np.outer(starts, self.frequencies) % 1.0)
        c, s = np.cos(angle), np.sin(angle)
        turned = [self.cosines * c + self.sines * s, self.sines * c - self.cosines * s]
        return np.asarray((np.concatenate(turned, axis=1) @ self._row).ravel())
