# SPDX-License-Identifier: BSD-3-Clause
"""What errors of the set-up do to a heading, to first order.

Write M_i for the information that axis i gives on the vector (x, y) = H (cos psi, sin psi), M for their sum, u for
the unit vector along it and v for the one across. An error that changes what axis i sees by A_i d, A_i being its
columns, moves the vector by M^-1 M_i d and the heading by v' M^-1 M_i d / H:

    scale factor of axis i, relative e      d = e H u
    direction of axis i off by a            d = a H v
    axis of the table leaning b to the east the whole vector turns by b tan(latitude)

One axis alone has M_i = M: its scale factor does not touch the heading, its direction does one to one.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

__all__ = ["axis_terms", "direction"]

Array = NDArray[np.float64]


def direction(psi: float) -> tuple[Array, Array]:
    """Unit vectors along the heading psi [rad] and across it, towards larger psi."""
    return np.array([math.cos(psi), math.sin(psi)]), np.array([-math.sin(psi), math.cos(psi)])


def axis_terms(information: Sequence[Array], psi: float) -> tuple[float, float]:
    """Standard deviation of the heading for independent errors of size one of the axes.

    Parameters
    ----------
    information : sequence of ndarray, shape (2, 2)
        M_i of each axis.
    psi : float [rad]

    Returns
    -------
    scale, misalignment : float
        Factors of a relative error of the scale factor, and of an error of direction [rad].
    """
    along, across = direction(psi)
    whole = np.linalg.inv(np.sum(information, axis=0))
    shares = [across @ whole @ m for m in information]
    return (
        math.sqrt(sum(float(share @ along) ** 2 for share in shares)),
        math.sqrt(sum(float(share @ across) ** 2 for share in shares)),
    )
