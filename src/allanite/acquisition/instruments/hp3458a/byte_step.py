# SPDX-License-Identifier: BSD-3-Clause
"""Are the bytes of a stream of big-endian 32-bit integers still in step?

A byte that a serial line loses shifts all that follow: every value is wrong, and most look possible. But read from one
to three bytes further on, they continue the signal of before; those of a true jump do not. So readings are looked at
by nines, and given away only when the nine behind them are in step too.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass

__all__ = ["NINE", "ByteStep"]

#: Readings that are judged together; an odd number, whose median is always one of them.
NINE = 9
BYTES = 4 * NINE
#: A nine whose distance from the one before is larger than usual by this factor is looked at closely.
JUMP = 8.0
#: Shifted bytes are the signal when they are nearer to it than the plain ones by this factor; a shift by one byte
#: multiplies by 256, the others move noise to the top.
NEARER = 16.0


@dataclass(slots=True)
class ByteStep:
    """Follows one stream from a start that was in step. Changes with each check."""

    _level: float | None = None
    _usual: float | None = None

    def certain(self, data: bytes) -> tuple[int, bool]:
        """How many readings at the start of `data` are certain, and whether the rest is in step so far.

        Readings that were not certain are to be given again, with more behind them.
        """
        nines = max((len(data) - 3) // BYTES, 0)
        if not nines:
            return 0, True
        raw = np.frombuffer(data, dtype=">i4", count=NINE * nines).reshape(nines, NINE).astype(np.float64)
        level = _middle(raw)
        before = np.concatenate([level[:1] if self._level is None else [self._level], level[:-1]])
        away = _middle(np.abs(raw - before[:, None]))
        usual = float(away[0]) if self._usual is None else self._usual
        for i in np.flatnonzero(away > JUMP * (usual + 1)):
            if _shifted(data[BYTES * i :], float(before[i]), float(away[i])):
                # The shift may have begun in the second half of the nine before.
                return max(NINE * (int(i) - 1), 0), False
        self._learn(level[:-1], away[:-1], usual)
        return NINE * (nines - 1), True

    def _learn(self, level: NDArray[np.float64], away: NDArray[np.float64], usual: float) -> None:
        if len(level):
            self._level = float(level[-1])
            self._usual = 0.9 * usual + 0.1 * float(np.median(away))


def _middle(rows: NDArray[np.float64]) -> NDArray[np.float64]:
    """Median of each row; several times faster than that of NumPy on short rows."""
    return np.sort(rows, axis=1)[:, NINE // 2]


def _shifted(data: bytes, level: float, away: float) -> bool:
    for shift in (1, 2, 3):
        raw = np.frombuffer(data, dtype=">i4", count=NINE, offset=shift).astype(np.float64)
        if float(np.median(np.abs(raw - level))) * NEARER < away:
            return True
    return False
