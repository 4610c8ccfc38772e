# SPDX-License-Identifier: BSD-3-Clause
"""Overlapping Allan deviation of a week at 32 Hz, side by side: allantools, plain NumPy, and our engines.

    python -m benchmarks.allan_speed

Each contender runs in a process of its own on the same samples, twice at least and for ten seconds: the first run also
pays for memory that the machine has to find. The rounds are interleaved and the best time of each counts, so that a
busy moment of the machine does not decide. Peak memory is that of the process, less what it held before the samples
were made, over the size of the samples.
"""

from __future__ import annotations

import json
import sys
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .machine import describe, save
from .processes import best_runs, peak_bytes, resident_bytes

N_SAMPLES = 19_353_600
N_LAGS = 100
ROUNDS = 2
Array = NDArray[np.float64]
Lags = NDArray[np.int64]


def samples(n: int, missing: str = "") -> Array:
    """White noise on a large offset. A hundredth may be missing: in one "hole", or sample by sample, "scattered"."""
    generator = np.random.Generator(np.random.SFC64(7))
    y = generator.standard_normal(n)
    y *= 1e-6
    y += 2.5
    if missing == "hole":
        y[n // 3 : n // 3 + n // 100] = np.nan
    elif missing == "scattered":
        y[generator.integers(0, n, n // 100)] = np.nan
    return y


def log_lags(n: int, count: int = N_LAGS) -> Lags:
    """Log-spaced from 1 to n/3, doubles dropped."""
    return np.unique(np.round(np.geomspace(1, n // 3, count)).astype(np.int64))


def decimated_lags(n: int) -> Lags:
    """The same grid on the nearest lags that the decimated engine serves."""
    from allanite.noise.allan.online import decimable

    return decimable(log_lags(n))


# ---- contenders: samples and lags in, deviation out -----------------------------------------------------------------


def allantools(y: Array, lags: Lags) -> Array:
    from allantools import oadev

    return np.asarray(oadev(y, rate=1.0, data_type="freq", taus=lags)[1])


def plain_numpy(y: Array, lags: Lags) -> Array:
    x = np.concatenate([[0.0], np.cumsum(y - y.mean())])
    deviation = []
    for m in lags.tolist():
        d = x[2 * m :] - 2 * x[m:-m] + x[: -2 * m]
        deviation.append(np.sqrt(np.mean(d * d) / 2) / m)
    return np.array(deviation)


def exact(y: Array, lags: Lags, threads: int = 1) -> Array:
    from allanite import Recording
    from allanite.noise.allan.statistics import STATISTICS, phase_of, sums_of_squares

    recording = Recording.from_rate(y, rate=1.0, unit="V", names="y")
    variance, _ = sums_of_squares(phase_of(recording, "y"), STATISTICS["oadev"], lags, threads)
    return np.sqrt(variance)


def decimated(y: Array, lags: Lags) -> Array:
    from allanite import Recording
    from allanite.noise.allan.online import decimated_sums

    variance, _, _ = decimated_sums(Recording.from_rate(y, rate=1.0, unit="V", names="y"), "y", lags)
    return np.sqrt(variance)


CONTENDERS: dict[str, Callable[[Array, Lags], Array]] = {
    "allantools": allantools,
    "plain NumPy": plain_numpy,
    "exact, 1 thread": exact,
    "exact, 2 threads": lambda y, lags: exact(y, lags, threads=2),
    "exact, 1 thread, 1 % missing: hole": exact,
    "exact, 1 thread, 1 % missing: scattered": exact,
    "decimated, 1 thread": decimated,
}


# ---- measuring ------------------------------------------------------------------------------------------------------


def measure_here(name: str, n: int) -> dict[str, Any]:
    """One contender, in this process."""
    lags = decimated_lags(n) if name.startswith("decimated") else log_lags(n)
    short = samples(4096)
    CONTENDERS[name](short, lags[:5])  # imports and first call are not timed
    before = resident_bytes()
    y = samples(n, missing=name.rpartition(": ")[2])
    times: list[float] = []
    while len(times) < 2 or sum(times) < 10.0:
        start = time.perf_counter()
        deviation = CONTENDERS[name](y, lags)
        times.append(time.perf_counter() - start)
    return {
        "seconds": min(times),
        "memory": (peak_bytes() - before) / y.nbytes,
        "lags": lags.tolist(),
        "deviation": deviation.tolist(),
    }


def per_lag_against_length() -> list[tuple[int, float]]:
    """Nanoseconds per term of the exact engine for records of 1e6, 1e7 and 1e8 samples, the phase being there."""
    from allanite import Recording
    from allanite.noise.allan.statistics import STATISTICS, phase_of, sums_of_squares

    speeds = []
    for n in (10**6, 10**7, 10**8):
        lags = log_lags(n, 20)
        phase = phase_of(Recording.from_rate(samples(n), rate=1.0, unit="V", names="y"), "y")
        times = []
        for _ in range(max(3, 10**7 // n)):
            start = time.perf_counter()
            sums_of_squares(phase, STATISTICS["oadev"], lags, threads=1)
            times.append(time.perf_counter() - start)
        speeds.append((n, 1e9 * min(times) / int(np.sum(n - 2 * lags + 1))))
    return speeds


def check_agreement(best: dict[str, dict[str, Any]]) -> float:
    """Largest relative difference from allantools among the contenders that saw the same samples and lags."""
    truth = np.array(best["allantools"]["deviation"])
    others = ("plain NumPy", "exact, 1 thread", "exact, 2 threads")
    return max(float(np.max(np.abs(np.array(best[name]["deviation"]) / truth - 1))) for name in others)


def main() -> None:
    best = best_runs("allan_speed", CONTENDERS, ROUNDS, "seconds")
    slowest = best["allantools"]["seconds"]
    rows = [
        [
            name,
            str(len(run["lags"])),
            f"{run['seconds']:.3f}",
            f"{slowest / run['seconds']:.1f}",
            f"{run['memory']:.2f}",
        ]
        for name, run in best.items()
    ]
    agreement = check_agreement(best)
    if agreement > 1e-9:
        raise SystemExit(f"the contenders disagree by {agreement:.1e}: no speed is worth that")
    linear = per_lag_against_length()
    gap_ratio = {
        kind: best[f"exact, 1 thread, 1 % missing: {kind}"]["seconds"] / best["exact, 1 thread"]["seconds"]
        for kind in ("hole", "scattered")
    }
    notes = [
        f"{N_SAMPLES} samples; {N_LAGS} log-spaced lags to a third of the record, doubles dropped",
        f"best of {ROUNDS} interleaved rounds; degrees of freedom are not computed here",
        "memory: peak of the process over the size of the samples, the samples included",
        f"largest relative difference from allantools: {agreement:.0e}",
        "one sample in a hundred missing: "
        + ", ".join(f"{kind} {ratio:.2f} times the time without" for kind, ratio in gap_ratio.items()),
        "exact engine, nanoseconds per term: "
        + ", ".join(f"{value:.2f} for {n:.0e} samples" for n, value in linear),
    ]
    result = {
        "machine": describe("allantools"),
        "n_samples": N_SAMPLES,
        "contenders": {
            name: {
                "seconds": run["seconds"],
                "times_faster": slowest / run["seconds"],
                "memory": run["memory"],
            }
            for name, run in best.items()
        },
        "gap_ratio": gap_ratio,
        "agreement": agreement,
        "nanoseconds_per_term": dict(linear),
        "notes": notes,
    }
    header = ["engine", "lags", "seconds", "times allantools", "memory / samples"]
    print(save("allan_speed", "Overlapping Allan deviation, a week at 32 Hz", result, header, rows))


if __name__ == "__main__":
    if len(sys.argv) > 1:
        print(json.dumps(measure_here(sys.argv[1], N_SAMPLES)))
    else:
        main()
