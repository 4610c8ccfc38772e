# SPDX-License-Identifier: BSD-3-Clause
"""The floor of an instrument, removed: do the 95 % sets of the sensor hold the sensor?

A sensor is simulated through an instrument, and the instrument once more, alone. Both are fitted together. A set covers
where it holds the sensor's own coefficient; for a term that the sensor does not have, zero. The difference of the two
curves is counted lag by lag. Where the truth is zero only the lower end of the gate
applies.
"""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

import allanite as al
from allanite.fitting.instrument_floor import over_floor
from allanite.noise import Flicker, NoiseModel, RandomWalk, TermType, White
from verification.gates import at_least, within
from verification.spread import Say, place_of, spread

__all__ = ["CASES", "run_floor"]

Json = dict[str, Any]
Terms = tuple[TermType, ...]

RATE = 32.0
#: Name, sensor, instrument, samples of the measured record and of the floor.
CASES: tuple[tuple[str, Terms, Terms, int, int], ...] = (
    ("instrument half of the white noise", (White(N=1e-4),), (White(N=1e-4),), 40_000, 40_000),
    (
        "white noise and flicker in both",
        (White(N=1e-4), Flicker(B=4e-5)),
        (White(N=7e-5), Flicker(B=2e-5)),
        60_000,
        60_000,
    ),
    (
        "flicker of the instrument alone",
        (White(N=1e-4),),
        (White(N=3e-5), Flicker(B=3e-5)),
        60_000,
        30_000,
    ),
    (
        "random walk of the sensor, short floor",
        (White(N=1e-4), RandomWalk(K=5e-6)),
        (White(N=2e-4),),
        60_000,
        6_000,
    ),
    ("no sensor at all", (), (White(N=1e-4), Flicker(B=2e-5)), 40_000, 40_000),
)


def _record(terms: Terms, n: int, seed: np.random.SeedSequence) -> al.Recording:
    return al.simulate(
        NoiseModel.of(*terms), rate=RATE, duration=n / RATE, seed=int(seed.generate_state(1, np.uint64)[0])
    )


def one(seed: int, case: int, index: int) -> tuple[dict[str, tuple[bool, bool]], tuple[int, int]]:
    """Of one pair of records: does each set hold the truth, and is the term supported; lags covered, and lags."""
    _, sensor, instrument, n, n_floor = CASES[case]
    first, second = np.random.SeedSequence([seed, 7919, case, index]).spawn(2)
    curve = al.allan_curve(_record(sensor + instrument, n, first), threads=1)
    floor = al.allan_curve(_record(instrument, n_floor, second), threads=1)
    truth = {t.symbols[0]: float(getattr(t, t.symbols[0])) for t in sensor}
    model = al.fit(curve, floor=floor)
    held = {}
    for e in model.families[0].estimates:
        if e.symbol in ("Q", "N", "B", "K", "R"):
            value = truth.get(e.symbol, 0.0)
            held[e.symbol] = (e.lower <= value <= e.upper, e.supported)
    above = over_floor(curve, floor)
    known = np.isfinite(above.upper[:, 0]) & (curve.count[:, 0] >= curve.lags)
    true = NoiseModel.of(*sensor).adev(above.tau[known]) if sensor else np.zeros(int(known.sum()))
    inside = (above.lower[known, 0] <= true) & (true <= above.upper[known, 0])
    return held, (int(inside.sum()), int(known.sum()))


def run_floor(
    seed: int, say: Say, records: int = 400, workers: int = 1, cache: Path | None = None
) -> list[Json]:
    """One row for each case and term: coverage of the sets, and how often the term is called supported."""
    rows: list[Json] = []
    for case, (name, sensor, *_) in enumerate(CASES):
        truth = {t.symbols[0] for t in sensor}
        place = place_of(cache, "floor", name)
        found = spread(partial(one, seed, case), range(records), workers=workers, say=say, place=place)
        for symbol in ("Q", "N", "B", "K", "R"):
            answers = [held[symbol] for held, _ in found if symbol in held]
            if not answers:
                continue
            covered, supported = (sum(a[k] for a in answers) / len(answers) for k in (0, 1))
            # a set of a coefficient that is zero, or that an upper limit ends, covers more often
            gate = (within if symbol in truth and supported == 1 else at_least)(len(answers))
            rows.append(
                {
                    "case": name,
                    "what": symbol,
                    "records": len(answers),
                    "coverage": covered,
                    "supported": supported,
                    **gate.columns(),
                    "passes": gate.holds(covered),
                }
            )
        inside, lags = (sum(counts[k] for _, counts in found) for k in (0, 1))
        rows.append(
            {
                "case": name,
                "what": "difference of the curves",
                "records": records,
                "coverage": inside / lags,
                "supported": None,
                "passes": inside / lags >= 0.94,
            }
        )
        say(f"floor: {name}")
    return rows
