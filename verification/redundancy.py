# SPDX-License-Identifier: BSD-3-Clause
"""Redundant sensors over and over: false alarms, coverage of gains and correlations, faults found and rightly named."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.redundancy import Combination, combine
from allanite.filtering.simulation import simulate
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from allanite.recording.records import Recording
from verification.gates import at_most, within

__all__ = ["run_false_alarms", "run_faults", "run_intervals"]

Json = dict[str, Any]
Array = NDArray[np.float64]
Say = Callable[[str], None]

RATE, DURATION, N = 20.0, 600.0, 1e-3
WHITE = NoiseModel.of(White(N=N))
SLOW = NoiseModel.of(White(N=N), Flicker(B=2e-4), RandomWalk(K=2e-5))


def _cone(n: int) -> Array:
    turn, lean = 2 * np.pi * np.arange(n) / n, math.radians(54.7356)
    side = math.sin(lean)
    return np.column_stack([side * np.cos(turn), side * np.sin(turn), np.full(n, math.cos(lean))])


#: Name, number of sensors, axes, model.
CASES: tuple[tuple[str, int, Array | None, NoiseModel], ...] = (
    ("3 along one axis, white", 3, None, WHITE),
    ("3 along one axis, flicker and walk", 3, None, SLOW),
    ("4 around a cone, white", 4, _cone(4), WHITE),
    ("6 around a cone, flicker and walk", 6, _cone(6), SLOW),
)


def _record(n: int, model: NoiseModel, seed: np.random.SeedSequence) -> Array:
    seeds = seed.generate_state(n)
    parts = [simulate(model, rate=RATE, duration=DURATION, seed=int(s)) for s in seeds]
    return np.column_stack([p.values(p.names[0]) for p in parts])


def _combined(y: Array, model: NoiseModel, directions: Array | None) -> Combination:
    names = [f"g{i}" for i in range(y.shape[1])]
    recording = Recording.from_rate(y, rate=RATE, unit="rad/s", names=names)
    return combine(recording, models=model, directions=directions, false_alarm=0.05)


def run_false_alarms(seed: int, say: Say, runs: int = 1000) -> list[Json]:
    """Records without a fault that give one, stated 5 %; and calls of shared noise, stated 1 %."""
    rows, gate = [], at_most(runs)
    for number, (name, n, directions, model) in enumerate(CASES):
        alarms = shared = 0
        for i in range(runs):
            found = _combined(_record(n, model, np.random.SeedSequence([seed, number, i])), model, directions)
            alarms += bool(found.faults)
            shared += any(p.seen for p in found.shared)
        rows.append(
            {
                "case": name,
                "records": runs,
                "alarms": alarms / runs,
                **gate.columns(),
                "shared_noise_called": shared / runs,
                "passes": gate.holds(alarms / runs) and at_most(runs, 0.01).holds(shared / runs),
            }
        )
        say(f"{name}: alarms {alarms / runs:.3f}, shared noise {shared / runs:.3f}")
    return rows


def run_intervals(seed: int, say: Say, runs: int = 1000) -> list[Json]:
    """Coverage of the 95 % intervals of gain and of a correlation of 0.4, at the shortest time and at 10 s."""
    rows, gate = [], within(runs)
    for r in (0.0, 0.4):
        gain, correlation = np.zeros(2), 0
        for i in range(runs):
            rng = np.random.default_rng([seed, 50, round(10 * r), i])
            own, common = rng.standard_normal((12_000, 3)), rng.standard_normal((12_000, 1))
            y = N * math.sqrt(RATE) * (math.sqrt(1 - r) * own + math.sqrt(r) * common)
            found = _combined(y, WHITE, None)
            w = found.weights[0]
            true = 1 / math.sqrt(float(w @ (r + (1 - r) * np.eye(3)) @ w))
            for k, tau in enumerate((1 / RATE, 10.0)):
                at = int(np.argmin(np.abs(np.log(found.tau / tau))))
                gain[k] += found.gain_lower[at, 0] <= true <= found.gain_upper[at, 0]
            shared = found.shared[0].correlation
            correlation += shared.lower <= r <= shared.upper
        cover = [*(gain / runs), correlation / runs]
        rows.append(
            {
                "correlation": r,
                "records": runs,
                "gain_at_shortest": cover[0],
                "gain_at_10_s": cover[1],
                "correlation_covered": cover[2],
                **gate.columns(),
                "passes": gate.holds(*cover),
            }
        )
        say(f"correlation {r}: coverage {cover}")
    return rows


def run_faults(seed: int, say: Say, runs: int = 200) -> list[Json]:
    """Faults of one sensor of six around a cone: how often seen, and how often rightly and wrongly named."""
    rows, gate = [], at_most(runs)
    for kind, size in (("step", 5.0), ("step", 2.0), ("drift", 10.0), ("noise", 3.0), ("stuck", 0.0)):
        seen = named = wrong = 0
        for i in range(runs):
            y = _record(6, SLOW, np.random.SeedSequence([seed, 90, i]))
            rng = np.random.default_rng([seed, 91, i])
            sensor, a = int(rng.integers(6)), int(rng.integers(3000, 9000))
            _spoil(y, kind, size * N, sensor, a, rng)
            found = _combined(y, SLOW, _cone(6))
            names = {f.sensor for f in found.faults if f.sensor is not None}
            seen += bool(found.faults)
            named += names == {f"g{sensor}"}
            wrong += bool(names - {f"g{sensor}"})
        rows.append(
            {
                "fault": kind,
                "size_over_N": size,
                "records": runs,
                "seen": seen / runs,
                "named": named / runs,
                "wrongly_named": wrong / runs,
                **gate.columns(),
                "passes": gate.holds(wrong / runs),
            }
        )
        say(f"{kind} {size}: seen {seen / runs:.2f}, named {named / runs:.2f}, wrongly {wrong / runs:.3f}")
    return rows


def _spoil(y: Array, kind: str, size: float, sensor: int, a: int, rng: np.random.Generator) -> None:
    left = len(y) - a
    if kind == "step":
        y[a:, sensor] += size
    elif kind == "drift":
        y[a:, sensor] += size * np.arange(left) / left
    elif kind == "noise":
        y[a:, sensor] += size * math.sqrt(RATE) * rng.standard_normal(left)
    else:
        y[a : a + 1000, sensor] = y[a, sensor]
