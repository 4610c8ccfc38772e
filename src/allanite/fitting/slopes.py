# SPDX-License-Identifier: BSD-3-Clause
"""The seed paper's reading of the curve: where the slope is -1, -1/2, 0, +1/2, +1.

Kept for comparison. It has no interval, B and T_b off the minimum are biased (T_b by -77 % for the seed's own
sensor), and a slope that the curve does not have is still the nearest one: the note says so.

References
----------
.. [1] Silva, Jeronymo, Pavan, Tosin, "Caracterizacao de sensores MEMS atraves da variancia de Allan".
.. [2] IEEE Std 952-1997, annex C.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import DataQualityError, InputError
from allanite.fitting.moments import one_per_lag
from allanite.noise import FLICKER_FLOOR, Estimate, NoiseModel, term_of
from allanite.noise.allan.curve import AllanCurve
from allanite.plain_files.counted import plural

__all__ = ["read_slopes"]

Array = NDArray[np.float64]

_SLOPES = {"Q": -1.0, "N": -0.5, "B": 0.0, "K": 0.5, "R": 1.0}
_NEAR = 0.15  # a slope farther than this from the wanted one is not that slope


def read_slopes(curve: AllanCurve, *, exclude: ArrayLike | None = None) -> NoiseModel:
    """Q, N, B, T_b, K, R where the deviation's slope is nearest to the term's.

    Raises
    ------
    InputError
        More than one channel, another statistic than oadev and adev, or an `exclude` without one value for each lag.
    DataQualityError
        Fewer than three lags with a deviation.
    """
    if len(curve.channels) != 1:
        raise InputError("read_slopes takes the curve of one channel: curve['x']")
    if curve.statistic not in ("oadev", "adev"):
        raise InputError(
            f"the slopes are those of the Allan deviation (oadev, adev), not of {curve.statistic}"
        )
    ok = np.isfinite(curve.deviation[:, 0]) & (curve.deviation[:, 0] > 0)
    ok &= ~curve.excluded[:, 0]
    if exclude is not None:
        ok &= ~one_per_lag(exclude, len(curve.lags))
    if ok.sum() < 3:
        raise DataQualityError(
            f"{plural(int(ok.sum()), 'lag')} with a deviation; reading slopes needs at least 3"
        )
    tau, sigma = curve.tau[ok], curve.deviation[ok, 0]
    slope = np.gradient(np.log(sigma), np.log(tau))
    estimates, terms = [], []
    for symbol, wanted in _SLOPES.items():
        at = int(np.argmin(np.abs(slope - wanted))) if symbol != "B" else int(np.argmin(sigma))
        matches = abs(slope[at] - wanted) <= _NEAR or (symbol == "B" and 0 < at < len(sigma) - 1)
        value = _coefficient(symbol, float(tau[at]), float(sigma[at]))
        note = f"read at tau = {tau[at]:.4g} s, slope {slope[at]:+.2f}"
        if not matches:
            note += f"; the curve has no slope {wanted:+.1f}, so this is no estimate"
        estimates.append(
            Estimate(
                symbol=symbol,
                value=value if matches else None,
                lower=0.0,
                upper=math.inf,
                supported=False,
                note=note,
            )
        )
        if matches:
            terms.append(term_of(symbol, value, dt=curve.dt))
        if symbol == "B":
            time = Estimate(
                symbol="T",
                value=float(tau[at]) / 1.89 if matches else None,
                lower=0.0,
                upper=math.inf,
                supported=False,
                note="tau of the minimum / 1.89 (the seed's rule; biased)",
            )
    estimates.append(time)
    return NoiseModel(
        terms=tuple(terms),
        family="slopes",
        estimates=tuple(estimates),
        kind=curve.channels[0].kind.value,
        unit="" if curve.channels[0].kind.has_si else curve.channels[0].unit,
        verdict="Slope readings, without intervals; for comparison only.",
    )


def _coefficient(symbol: str, tau: float, sigma: float) -> float:
    return {
        "Q": sigma * tau / math.sqrt(3),
        "N": sigma * math.sqrt(tau),
        "B": sigma / FLICKER_FLOOR,
        "K": sigma * math.sqrt(3 / tau),
        "R": sigma * math.sqrt(2) / tau,
    }[symbol]
