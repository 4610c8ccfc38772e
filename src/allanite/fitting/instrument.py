# SPDX-License-Identifier: BSD-3-Clause
"""A sensor seen through an instrument whose own noise was recorded too: the design of both curves together.

The measured curve is that of sensor and instrument, the floor that of the instrument alone (a shorted input). Both
records are independent and the instrument's noise is the same process in both, so with coefficients c of the sensor
and f of the instrument

    mean(measured) = A (c + f),      covariance(measured) = V(c + f),
    mean(floor)    = A' f,           covariance(floor)    = V'(f),

and nothing between the two. Stacked, this is one linear problem more for `allanite.fitting.objective`: no curve is
subtracted from another, no variance can become negative, and the sets of c hold what is not known of f. A ramp is no
process: that of the floor's record is its own, and takes nothing off the sensor's.

The noise of an instrument is given no Gauss-Markov term: with two correlation times neither would be known.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.fitting.design import CurveDesign, Times
from allanite.lazy_dataclasses import dataclass

__all__ = ["FLOOR", "TwoRecords", "of_floor", "two_records"]

Array = NDArray[np.float64]

#: The instrument's terms: the letter of each after an f.
FLOOR = ("fQ", "fN", "fB", "fK", "fR")


def of_floor(symbol: str) -> bool:
    """True for a term of the instrument."""
    return symbol in FLOOR


@dataclass(slots=True, kw_only=True)
class TwoRecords(CurveDesign):
    """Columns and covariance of a measured curve, and of the floor below it.

    Lags and length are those of the measured record: correlation times are looked for among these.

    Attributes
    ----------
    measured, floor : CurveDesign
        In samples of the same length.
    """

    measured: CurveDesign
    floor: CurveDesign

    def column(self, symbol: str, times: Times = ()) -> Array:
        """What a unit of this term gives at the lags of both curves, the measured one first."""
        letter = symbol.removeprefix("f")
        above = np.zeros(len(self.measured.lags))
        below = np.zeros(len(self.floor.lags))
        if symbol != "fR":
            above = self.measured.column(letter, times)
        if of_floor(symbol):
            below = self.floor.column(letter)
        return np.concatenate([above, below])

    def markov(self, T: float) -> tuple[Array, Array]:
        """Gauss-Markov noise of the sensor."""
        column, slope = self.measured.markov(T)
        below = np.zeros(len(self.floor.lags))
        return np.concatenate([column, below]), np.concatenate([slope, below])

    def covariance(self, symbols: Sequence[str], c: Array, times: Times = ()) -> Array:
        """Covariance matrix of both curves for these coefficients: two blocks."""
        total: dict[str, float] = {}
        sensor: dict[str, float] = {}
        for symbol, value in zip(symbols, c, strict=True):
            letter = symbol.removeprefix("f")
            if symbol != "fR":
                total[letter] = total.get(letter, 0.0) + float(value)
            if of_floor(symbol):
                sensor[letter] = float(value)
        n = len(self.measured.lags)
        out = np.zeros((n + len(self.floor.lags),) * 2)
        out[:n, :n] = self.measured.covariance(list(total), np.array(list(total.values())), times)
        out[n:, n:] = self.floor.covariance(list(sensor), np.array(list(sensor.values())))
        return out


def two_records(measured: CurveDesign, floor: CurveDesign) -> TwoRecords:
    """The design of both."""
    return TwoRecords(
        lags=measured.lags,
        n_samples=measured.n_samples,
        sampling=measured.sampling,
        pairs=measured.pairs,
        measured=measured,
        floor=floor,
    )
