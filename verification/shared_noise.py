# SPDX-License-Identifier: BSD-3-Clause
"""Two and three sensors taken apart: coverage of the intervals of every part, with gaps and without a common part."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.filtering.simulation import simulate
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from allanite.recording.records import Recording
from allanite.stability.shared_noise import separate_noise
from verification.gates import at_least, within
from verification.spread import Say, place_of, spread

__all__ = ["run_shared_noise"]

Json = dict[str, Any]
Array = NDArray[np.float64]

SAMPLES = 16_384
OWN = NoiseModel.of(White(N=1.0), Flicker(B=0.03))
WALK = NoiseModel.of(White(N=0.3), RandomWalk(K=0.01))
QUIET = NoiseModel.of(White(N=0.1))

#: Name, sensors, own noise, common noise, share of samples missing at random.
CASES: tuple[tuple[str, int, NoiseModel, NoiseModel | None, float], ...] = (
    ("two, common walk", 2, OWN, WALK, 0.0),
    ("two, nothing common", 2, OWN, None, 0.0),
    ("two, own noise a tenth of the common", 2, QUIET, OWN, 0.0),
    ("two, common walk, 10 % missing", 2, OWN, WALK, 0.1),
    ("two, common walk, 40 % missing", 2, OWN, WALK, 0.4),
    ("three, common walk", 3, OWN, WALK, 0.0),
    ("three, nothing common", 3, OWN, None, 0.0),
    ("three, own noise a tenth of the common", 3, QUIET, OWN, 0.0),
    ("three, common walk, 10 % missing", 3, OWN, WALK, 0.1),
)
LAGS = (1, 16, 256, 1024, 2048)
#: Of an eighth of the record on, no chi-square has the law of overlapping windows: intervals are wide, 97 to 98 %.
WIDE = 2048


def _samples(model: NoiseModel, seed: tuple[int, ...]) -> Array:
    number = int(np.random.SeedSequence(seed).generate_state(1)[0])
    made = simulate(model, rate=1.0, duration=float(SAMPLES), seed=number)
    return made.values(made.names[0])


def _record(root: int, case: int, i: int) -> Recording:
    _, n, own, common, missing = CASES[case]
    shared = 0.0 if common is None else _samples(common, (root, 40, case, i, 9))
    y = np.column_stack([_samples(own, (root, 41, case, i, k)) + shared for k in range(n)])
    if missing:
        y[np.random.default_rng([root, 42, case, i]).random(y.shape) < missing / n] = np.nan
    return Recording.from_rate(y, rate=1.0, unit="rad/s", names=[f"g{k}" for k in range(n)])


def _covers(root: int, case: int, i: int) -> tuple[dict[str, bool], bool]:
    """Which intervals hold the truth, and whether shared noise was seen."""
    _, _, own, common, _ = CASES[case]
    found = separate_noise(_record(root, case, i))
    held: dict[str, bool] = {}
    for name, part, model in (("own", found.own[0], own), ("common", found.common, common)):
        for m in LAGS:
            at = np.flatnonzero(np.isclose(found.tau, m))
            if len(at):
                truth = 0.0 if model is None else float(model.adev(float(m)))
                held[f"{name} at {m} s"] = bool(part.lower[at[0]] <= truth <= part.upper[at[0]])
        values = {} if model is None else {s: getattr(t, s) for t in model.terms for s in t.symbols}
        for e in part.model.estimates:
            if e.symbol != "Q":
                held[f"{name} {e.symbol}"] = bool(e.lower <= values.get(e.symbol, 0.0) <= e.upper)
    return held, found.verdict == "noise is shared"


def run_shared_noise(
    seed: int, say: Say, runs: int = 2000, workers: int = 1, cache: Path | None = None
) -> list[Json]:
    """One row for each case: the coverage of every interval.

    It passes where none covers less than chance allows, and none of a deviation above zero more: the sets of
    coefficients that are zero, or that the record does not show, are one-sided.
    """
    rows = []
    for case, (name, _, _, common, _) in enumerate(CASES):
        found = spread(
            partial(_covers, seed, case),
            range(runs),
            workers=workers,
            say=say,
            place=place_of(cache, "shared_noise", name),
            chunk=8,
        )
        keys = list(dict.fromkeys(k for held, _ in found for k in held))
        counts = {k: sum(k in held for held, _ in found) for k in keys}
        share = {k: sum(held.get(k, False) for held, _ in found) / counts[k] for k in keys}
        curve = {k: v for k, v in share.items() if " at " in k}
        positive = {
            k: v
            for k, v in curve.items()
            if (common is not None or not k.startswith("common")) and f" {WIDE} " not in k
        }
        gate = within(runs)
        rows.append(
            {
                "case": name,
                "records": runs,
                "shared_noise_seen": sum(seen for _, seen in found) / runs,
                **share,
                **gate.columns(),
                "passes": at_least(runs).holds(*share.values()) and gate.holds(*positive.values()),
            }
        )
        say(f"{name}: {rows[-1]}")
    return rows
