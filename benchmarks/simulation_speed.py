# SPDX-License-Identifier: BSD-3-Clause
"""Simulated samples per second of processor time, the normal numbers included.

python -m benchmarks.simulation_speed
"""

from __future__ import annotations

import time
from typing import Any

import numpy as np

from allanite import simulate
from allanite.noise import Flicker, NoiseModel, RandomWalk, White

from .machine import describe, save

RATE = 32.0
DURATION = 604_800.0

WHITE, WALK, FLICKER = White(N=2e-4), RandomWalk(K=1e-6), Flicker(B=4e-5)
MODELS = {
    "white": NoiseModel(terms=(WHITE,)),
    "white + random walk": NoiseModel(terms=(WHITE, WALK)),
    "white + flicker + random walk": NoiseModel(terms=(WHITE, FLICKER, WALK)),
}


def best_time(model: NoiseModel, rounds: int = 3) -> float:
    """Seconds of processor time for a week at 32 Hz."""
    times = []
    for _ in range(rounds):
        start = time.process_time()
        simulate(model, rate=RATE, duration=DURATION, seed=1)
        times.append(time.process_time() - start)
    return min(times)


def main() -> None:
    n = round(RATE * DURATION)
    speed = {name: n / best_time(model) for name, model in MODELS.items()}
    start = time.process_time()
    np.random.Generator(np.random.SFC64(1)).standard_normal(n)
    normals = n / (time.process_time() - start)
    result: dict[str, Any] = {
        "machine": describe(),
        "n_samples": n,
        "samples_per_second": speed,
        "normals_per_second": normals,
        "notes": [
            f"processor time of one thread, {n} samples, best of three",
            f"NumPy alone draws {normals / 1e6:.0f} million normal numbers per second; white + walk needs two a sample",
        ],
    }
    rows = [[name, f"{value / 1e6:.0f}"] for name, value in speed.items()]
    print(
        save(
            "simulation_speed",
            "Simulation of a week at 32 Hz",
            result,
            ["model", "million samples per second"],
            rows,
        )
    )


if __name__ == "__main__":
    main()
