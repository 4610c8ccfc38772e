# SPDX-License-Identifier: BSD-3-Clause
"""What stands beside the samples of a filter: outputs, drive and noise of each row, given or made when wanted."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.filtering.kalman.checks import checked_matrix, checked_row, checked_shape

__all__ = ["Rowwise", "Sides"]

Array = NDArray[np.float64]
#: One row for each sample: an array, or a function (start, stop) that gives those rows. It may be called from several
#: threads and for any rows, more than once.
Rowwise = ArrayLike | Callable[[int, int], ArrayLike]


class Sides:
    """Rows beside the samples, cut like the samples and looked at when their turn comes.

    Parameters
    ----------
    outputs, drive : array_like, shape (rows, n), or callable, optional
    noise : array_like, shape (rows,), or callable, optional
    n : int
        States.

    Raises
    ------
    InputError
        Arrays with different numbers of rows.
    """

    def __init__(self, outputs: Rowwise | None, drive: Rowwise | None, noise: Rowwise | None, n: int) -> None:
        given = {"outputs": outputs, "drive": drive, "noise": noise}
        self._made = {name: x for name, x in given.items() if callable(x)}
        self._given = {
            name: np.asarray(x) for name, x in given.items() if x is not None and name not in self._made
        }
        self._width = {"outputs": (n,), "drive": (n,), "noise": ()}
        lengths = {x.shape[0] if x.ndim else -1 for x in self._given.values()}
        if len(lengths) > 1:
            raise InputError(f"outputs, drive and noise have different numbers of rows: {sorted(lengths)}")
        self._rows = lengths.pop() if lengths else None

    def __contains__(self, name: str) -> bool:
        return name in self._given or name in self._made

    def of(self, start: int, rows: int) -> dict[str, Array | None]:
        """The rows beside some samples.

        Raises
        ------
        InputError
            There are fewer rows than samples, or they have the wrong shape, or numbers that make no sense.
        """
        parts: dict[str, Array | None] = {}
        for name, part in self.unlooked(start, rows).items():
            parts[name] = (
                _variances(part, start) if name == "noise" else checked_matrix(part, part.shape, name)
            )
        return parts

    def unlooked(self, start: int, rows: int) -> dict[str, Array]:
        """As `of`, without a look at the numbers: that takes a part of the time of the fastest filter."""
        if self._rows is not None and start + rows > self._rows:
            raise InputError(f"outputs, drive and noise have {self._rows} rows, the samples have more")
        for name, whole in self._given.items():
            if whole.shape[1:] != self._width[name]:
                raise InputError(
                    f"{name} must have shape {(self._rows, *self._width[name])}, not {whole.shape}"
                )
        parts = {name: whole[start : start + rows] for name, whole in self._given.items()}
        parts |= {name: np.asarray(make(start, start + rows)) for name, make in self._made.items()}
        return {name: checked_shape(part, (rows, *self._width[name]), name) for name, part in parts.items()}

    def finish(self, rows: int) -> None:
        """Refuse rows beyond the last of so many samples."""
        if self._rows is not None and self._rows != rows:
            raise InputError(f"outputs, drive and noise have {self._rows} rows, the samples have {rows}")


def _variances(noise: ArrayLike, start: int) -> Array:
    row = checked_row(noise, "noise")
    if np.fmin.reduce(row, initial=0.0) < 0:
        first = int(np.argmax(row < 0))
        raise InputError(f"noise holds a negative variance, {row[first]:g} in row {start + first}")
    return row
