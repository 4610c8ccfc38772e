# SPDX-License-Identifier: BSD-3-Clause
"""Sums over many samples that have the same digits on every machine."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["sum_of_products"]


def sum_of_products(x: NDArray[Any], y: NDArray[Any]) -> float:
    """Of two rows, without the threads of linear algebra: they cost more than they save, and change the last digits."""
    return float(np.einsum("i,i", x, y))
