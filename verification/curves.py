# SPDX-License-Identifier: BSD-3-Clause
"""Coverage of the intervals of the curve itself: 68.27 %, with and without gaps (battery rows U3, U4 and U13).

Each record has 1024 samples. The degrees of freedom are the exact ones of the true model and of the record's own gaps.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

import allanite as al
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.noise.allan import covariance, degrees
from allanite.noise.allan.statistics import STATISTICS, phase_of, sums_of_squares
from allanite.recording.records import Recording
from verification.gates import at_least

__all__ = ["LAGS", "MODELS", "run_curves"]

Json = dict[str, Any]
N, LEVEL = 1024, 0.6827
LAGS = np.array([1, 4, 16, 64, 128], dtype=np.int64)
MODELS = {
    "white": NoiseModel.of(White(N=1.0)),
    "flicker": NoiseModel.of(Flicker(B=1.0)),
    "random walk": NoiseModel.of(RandomWalk(K=1.0)),
    "Gauss-Markov, T = 100": NoiseModel.of(GaussMarkov.from_sigma(1.0, 100.0)),
}
#: At few degrees of freedom the chi-square law is slightly wide, never narrow: the upper end for 10 000 records is that
#: of row U3; records with gaps, where still fewer windows are left, have none.
MOST = {10_000: 0.710, 2000: 1.0}


def _gaps(rng: np.random.Generator) -> dict[str, NDArray[np.bool_]]:
    """Which samples are missing: none, 1, 10 and 40 % at random, and 10 and 40 % in blocks of 51."""
    patterns = {"none": np.zeros(N, dtype=bool)}
    for share in (0.01, 0.1, 0.4):
        patterns[f"{share:.0%} at random"] = rng.random(N) < share
    for share in (0.1, 0.4):
        mask = np.zeros(N, dtype=bool)
        for start in np.sort(rng.choice(N // 64, size=round(share * N / 51), replace=False)) * 64:
            mask[start : start + 51] = True
        patterns[f"{share:.0%} in blocks"] = mask
    return patterns


def run_curves(seed: int, say: Callable[[str], None]) -> list[Json]:
    """Coverage of every model and gap pattern, one row each."""
    rows = []
    for k, (name, model) in enumerate(MODELS.items()):
        patterns = _gaps(np.random.default_rng([seed, k]))
        for pattern, mask in patterns.items():
            runs = 10_000 if pattern == "none" else 2000
            row = _coverage(model, mask, runs, seed + 100 * k)
            rows.append({"model": name, "missing": pattern, "records": runs, **row})
            say(f"{name}, missing {pattern}: {row['coverage']}")
    return rows


def _coverage(model: NoiseModel, mask: NDArray[np.bool_], runs: int, seed: int) -> Json:
    statistic = STATISTICS["oadev"]
    truth = model.avar_sampled(LAGS, 1.0)
    inside = np.zeros(len(LAGS))
    total, count, bounds = np.zeros(len(LAGS)), None, None
    samples = (
        al.simulate(model, rate=1.0, duration=float(N * runs), seed=seed).values("gyro").reshape(runs, N)
    )
    for y in samples:
        phase = phase_of(Recording.from_rate(np.where(mask, np.nan, y), rate=1.0, unit="rad/s"), "signal")
        variance, terms = sums_of_squares(phase, statistic, LAGS, threads=1)
        if bounds is None:
            starts = [phase.starts(statistic, int(m)) for m in LAGS]
            count = terms
            able = terms > 0
            edf = np.full(len(LAGS), np.nan)
            edf[able] = covariance.edf(model, LAGS[able], N, 1.0, "mean", [s for s in starts if len(s)])
            bounds = degrees.chi_square_factors(edf, LEVEL)
        low, high = variance * bounds[0] ** 2, variance * bounds[1] ** 2
        inside += (low <= truth) & (truth <= high)
        total += np.where(np.isfinite(variance), variance, 0.0)
    assert count is not None
    gate, most = at_least(runs, LEVEL), MOST[runs]
    share = np.where(count > 0, inside / runs, np.nan)
    error = np.abs(total / runs / truth - 1) / np.sqrt(2 / np.maximum(edf, 0.5) / runs)
    return {
        "coverage": [None if np.isnan(s) else round(float(s), 4) for s in share],
        "mean_error_sd": [None if c == 0 else round(float(e), 2) for e, c in zip(error, count, strict=True)],
        "terms": count.tolist(),
        "gate": [gate.low, most],
        "rejects": gate.columns()["rejects"],
        "passes": gate.holds(*share[count > 0]) and bool(np.all(share[count > 0] <= most)),
    }
