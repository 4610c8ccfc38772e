# SPDX-License-Identifier: BSD-3-Clause
"""Time-resolved deviation: constant noise said to change in at most 5 %, and coverage of size and time of changes."""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.filtering.simulation import simulate
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.recording.records import Recording
from allanite.stability.variation import examine_variation
from verification.gates import at_least, at_most, within
from verification.spread import Say, place_of, spread

__all__ = ["run_changes", "run_constant"]

Json = dict[str, Any]
Array = NDArray[np.float64]

SAMPLES, LEVEL = 40_000, 0.05
WHITE = NoiseModel.of(White(N=1.0))
SLOW = NoiseModel.of(White(N=1.0), Flicker(B=0.1), RandomWalk(K=1e-3))
MARKOV = NoiseModel.of(White(N=1.0), GaussMarkov.from_sigma(0.2, 300.0))
WALK = NoiseModel.of(White(N=0.3), RandomWalk(K=0.05))

#: Name, model, share of samples missing at random, degrees of freedom of Student's law for the white noise, samples.
CONSTANT: tuple[tuple[str, NoiseModel, float, float, int], ...] = (
    ("white", WHITE, 0.0, 0.0, SAMPLES),
    ("white, flicker, walk", SLOW, 0.0, 0.0, SAMPLES),
    ("white, Gauss-Markov", MARKOV, 0.0, 0.0, SAMPLES),
    ("walk", WALK, 0.0, 0.0, SAMPLES),
    ("white, flicker, walk; 10 % missing", SLOW, 0.1, 0.0, SAMPLES),
    ("white, flicker, walk; a quarter missing in one piece", SLOW, -0.25, 0.0, SAMPLES),
    ("white with heavy tails (Student, 6)", WHITE, 0.0, 6.0, SAMPLES),
    ("white, flicker, walk; short", SLOW, 0.0, 0.0, 2_000),
)

#: Name, term that changes, factor, part of the record before the step (None: drift).
CHANGES: tuple[tuple[str, str, float, float | None], ...] = (
    ("N steps by 10 %", "N", 1.1, 0.65),
    ("N steps to a half", "N", 0.5, 0.3),
    ("N drifts by 30 %", "N", 1.3, None),
    ("the noise as a whole doubles", "all", 2.0, 0.5),
)


def _samples(model: NoiseModel, n: int, seed: tuple[int, ...]) -> Array:
    number = int(np.random.SeedSequence(seed).generate_state(1)[0])
    made = simulate(model, rate=1.0, duration=float(n), seed=number)
    return made.values(made.names[0]).copy()


def _recording(y: Array) -> Recording:
    return Recording.from_rate(y, rate=1.0, unit="rad/s", names=["gyro"])


def _constant(root: int, case: int, i: int) -> tuple[bool, bool, int, int]:
    _, model, missing, tails, n = CONSTANT[case]
    rng = np.random.default_rng([root, 3, case, i])
    y = _samples(model, n, (root, 1, case, i))
    if tails:
        y = rng.standard_t(tails, n) / math.sqrt(tails / (tails - 2))
    if missing > 0:
        y[rng.random(n) < missing] = np.nan
    elif missing < 0:
        y[n // 3 : n // 3 - round(missing * n)] = np.nan
    found = examine_variation(_recording(y), false_alarm=LEVEL).channels[0]
    marked = sum(int(lag.significant.sum()) for lag in found.lags)
    own = sum(lag.p < LEVEL for lag in found.lags)
    return found.verdict != "constant within its intervals", marked > 0, own, len(found.lags)


def run_constant(
    seed: int, say: Say, runs: int = 1000, workers: int = 1, cache: Path | None = None
) -> list[Json]:
    """Records whose noise is constant."""
    rows = []
    for case, (name, *_) in enumerate(CONSTANT):
        found = spread(
            partial(_constant, seed, case),
            range(runs),
            workers=workers,
            say=say,
            place=place_of(cache, "variation", name),
        )
        wrong, marked = (sum(r[k] for r in found) / runs for k in (0, 1))
        own = sum(r[2] for r in found) / sum(r[3] for r in found)
        gate = at_most(runs, LEVEL)
        rows.append(
            {
                "case": name,
                "records": runs,
                "said_to_change": wrong,
                "with_a_marked_window": marked,
                "tests_of_single_lags_below_5_%": own,
                **gate.columns(),
                "passes": gate.holds(wrong),
            }
        )
        say(f"{name}: {rows[-1]}")
    return rows


def _changed(root: int, case: int, i: int) -> tuple[bool, bool, bool, bool, float]:
    _, symbol, factor, place = CHANGES[case]
    y = _samples(SLOW, SAMPLES, (root, 2, case, i))
    x = np.arange(SAMPLES) / SAMPLES if place is None else (np.arange(SAMPLES) >= place * SAMPLES) * 1.0
    amplitude = factor**x
    if symbol == "N":
        rest = NoiseModel.of(*(t for t in SLOW.terms if t.type != "white"))
        rng = np.random.default_rng([root, 4, case, i])
        y = _samples(rest, SAMPLES, (root, 5, case, i)) + amplitude * rng.standard_normal(SAMPLES)
    else:
        y = y * amplitude
    found = examine_variation(_recording(y), false_alarm=LEVEL).channels[0]
    if len(found.changes) != 1:
        return bool(found.changes), False, False, False, math.nan
    one = found.changes[0]
    right = one.symbol == symbol and (one.time is None) == (place is None)
    timed = place is None or (one.time is not None and one.time.lower <= place * SAMPLES <= one.time.upper)
    return True, right, one.ratio.lower <= factor <= one.ratio.upper, timed, one.ratio.value


def run_changes(
    seed: int, say: Say, runs: int = 1000, workers: int = 1, cache: Path | None = None
) -> list[Json]:
    """Records whose noise changes: seen, rightly named, and the intervals of those with one change."""
    rows = []
    for case, (name, _, factor, _) in enumerate(CHANGES):
        found = spread(
            partial(_changed, seed, case),
            range(runs),
            workers=workers,
            say=say,
            place=place_of(cache, "variation", name),
        )
        single = [r for r in found if math.isfinite(r[4])]
        named = [r for r in single if r[1]]
        gate = within(max(len(named), 1))
        size, time = (sum(r[k] for r in named) / max(len(named), 1) for k in (2, 3))
        rows.append(
            {
                "case": name,
                "records": runs,
                "seen": sum(r[0] for r in found) / runs,
                "one_change": len(single) / runs,
                "rightly_named": len(named) / runs,
                "size_covered": size,
                "time_covered": time,
                "mean_size": float(np.mean([r[4] for r in named])) if named else math.nan,
                "true_size": factor,
                **gate.columns(),
                "passes": gate.holds(size) and at_least(gate.records).holds(time),
            }
        )
        say(f"{name}: {rows[-1]}")
    return rows
