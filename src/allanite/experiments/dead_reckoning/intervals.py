# SPDX-License-Identifier: BSD-3-Clause
"""From the intervals of the parameters of noise models to those of a variance that is a sum over them.

Notes
-----
The part V_i of the variance that a parameter makes is known to the ends [l_i, u_i] that the ends of the parameter's own
interval give: exactly, for an amplitude enters by its square, and a correlation time is put in at its ends. The
variances of estimates are recovered from these distances [1], so that for V = sum V_i

    lower = V - sqrt(sum_ij r_ij (V_i - l_i)(V_j - l_j)),    upper = V + sqrt(sum_ij r_ij (u_i - V_i)(u_j - V_j)),

which keeps the asymmetry of the intervals; r is the correlation of the estimates where the fit states it. A parameter
with an upper limit only has V_i = l_i = 0 and adds to the upper end.

References
----------
.. [1] G. Y. Zou, A. Donner, "Construction of confidence limits about effect measures: a general approach", Statistics
   in Medicine 27 (2008) 1693.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel

__all__ = ["VariancePart", "correlation", "interval"]

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True, kw_only=True)
class VariancePart:
    """What one parameter makes of the variance, and its ends.

    Attributes
    ----------
    key : (str, str)
        Whose model, and symbol of the estimate.
    value, lower, upper : ndarray, any one shape
        `value` is the part that varies with the parameter: of a correlation time that of its whole term.
    direction : ndarray
        Sign of the slope.
    """

    key: tuple[str, str]
    value: Array
    lower: Array
    upper: Array
    direction: Array


def interval(
    total: Array, parts: Sequence[VariancePart], models: Mapping[str, NoiseModel]
) -> tuple[Array, Array]:
    """Ends of a variance [total's shape]; infinite where an end is open."""
    down, up = np.zeros_like(total), np.zeros_like(total)
    for i, a in enumerate(parts):
        for b in parts[: i + 1]:
            known = correlation(models, a.key, b.key) * (1 if a is b else 2)
            if known == 0.0:
                continue
            r = known * a.direction * b.direction
            down += r * (a.value - a.lower) * (b.value - b.lower)
            with np.errstate(
                invalid="ignore"
            ):  # infinite times nothing: the term of that end by itself is infinite
                up += np.nan_to_num(r * (a.upper - a.value) * (b.upper - b.value), nan=0.0, posinf=np.inf)
    return np.maximum(total - np.sqrt(np.maximum(down, 0.0)), 0.0), total + np.sqrt(np.maximum(up, 0.0))


def correlation(models: Mapping[str, NoiseModel], a: tuple[str, str], b: tuple[str, str]) -> float:
    """Of two estimates: those of different models are independent."""
    if a == b:
        return 1.0
    if a[0] != b[0]:
        return 0.0
    covariance = models[a[0]].covariance
    symbols = list(covariance.get("symbols", ()))
    if a[1] not in symbols or b[1] not in symbols:
        return 0.0
    matrix = np.asarray(covariance["matrix"], dtype=np.float64)
    i, j = symbols.index(a[1]), symbols.index(b[1])
    size = float(np.sqrt(matrix[i, i] * matrix[j, j]))
    return float(np.clip(matrix[i, j] / size, -1.0, 1.0)) if size > 0 else 0.0
