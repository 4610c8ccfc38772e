# SPDX-License-Identifier: BSD-3-Clause
"""What the decimated engine loses: its degrees of freedom against those of the exact one, from theory.

    python -m benchmarks.decimation_loss

For Gaussian noise with stationary second differences, the mean of M squares at starts that lie `stride` apart has
``edf = M² r(0)² / sum over k of (M - |k|) r(k stride)²``, with r the covariance of two second differences. No
simulation is needed: the ratio of the two edf is exact. The worst lag of a level spans 64 of its steps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .machine import describe, save

Array = NDArray[np.float64]
WEIGHTS = (1, -2, 1)

#: Generalised autocovariance of the phase, up to a constant factor.
NOISES: dict[str, Callable[[Array], Array]] = {
    "white": lambda t: -np.abs(t),
    "flicker": lambda t: t * t * np.log(np.where(t == 0, 1.0, np.abs(t))),
    "random walk": lambda t: np.abs(t) ** 3,
}


def covariance(noise: str, m: int, k: Array) -> Array:
    """Of two second differences at spacing m whose starts lie k apart, up to a constant factor."""
    s = NOISES[noise]
    return sum(
        (a * b * s(k + (j - i) * m) for i, a in enumerate(WEIGHTS) for j, b in enumerate(WEIGHTS)),
        start=np.zeros_like(k),
    )


def edf(noise: str, n: int, m: int, stride: int) -> float:
    """Equivalent degrees of freedom of the mean square over every stride-th start."""
    count = -(-(n - 2 * m + 1) // stride)
    k = np.arange(1 - count, count, dtype=float)
    r = covariance(noise, m, k * stride)
    return float(count**2 * covariance(noise, m, np.zeros(1))[0] ** 2 / np.sum((count - np.abs(k)) * r * r))


def losses(stride: int = 32) -> list[dict[str, Any]]:
    """Loss of edf, as a fraction, at 64 and 96 positions per window and several record lengths."""
    return [
        {
            "noise": noise,
            "positions": positions,
            "windows": windows,
            "loss": 1 - edf(noise, n, m, stride) / edf(noise, n, m, 1),
        }
        for noise in NOISES
        for positions in (64, 96)
        for windows in (3, 10, 100)
        for m in [positions * stride]
        for n in [windows * m]
    ]


def main() -> None:
    lost = losses()
    worst = max(row["loss"] for row in lost)
    result = {
        "machine": describe(),
        "losses": lost,
        "worst": worst,
        "notes": [
            f"largest loss: {worst:.3%} of the degrees of freedom; the bar is 0.1 %",
            "negative: a gain, because the windows at both ends of the record weigh a little more",
        ],
    }
    rows = [[row["noise"], str(row["positions"]), str(row["windows"]), f"{row['loss']:.4%}"] for row in lost]
    header = ["noise", "positions per window", "record / lag", "loss of edf"]
    print(save("decimation_loss", "Degrees of freedom lost by the decimated engine", result, header, rows))


if __name__ == "__main__":
    main()
