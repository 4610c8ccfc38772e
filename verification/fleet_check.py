# SPDX-License-Identifier: BSD-3-Clause
"""How often does the bench test of a unit decide wrongly?

Records of units whose N, B and K are exactly at their limits, simulated sample by sample: a coefficient may pass in
5 % of them at most, and a unit fail in 5 % at most.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from allanite.filtering.simulation import simulate
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from allanite.noise.allan import allan_curve
from allanite.stability.fleet.checking import AcceptanceLimit, CheckVerdict, LimitSource, check_unit
from verification.gates import at_most
from verification.spread import Say, place_of, spread

__all__ = ["run_at_the_limit"]

Json = dict[str, Any]

_LIMITS = {"N": 1e-4, "B": 2e-5, "K": 1e-6}
_RATE = 10.0
_DURATIONS = (3600.0, 7200.0)
_WRONG = 0.05


def _checked(task: tuple[float, int]) -> Json:
    """Verdicts of the coefficients of one record, and of the unit."""
    duration, seed = task
    model = NoiseModel.of(White(N=_LIMITS["N"]), Flicker(B=_LIMITS["B"]), RandomWalk(K=_LIMITS["K"]))
    curve = allan_curve(simulate(model, rate=_RATE, duration=duration, seed=seed, unit="rad/s"), threads=1)
    (channel,) = curve.names
    limits = [
        AcceptanceLimit(channel=channel, symbol=symbol, value=value, source=LimitSource.GIVEN)
        for symbol, value in _LIMITS.items()
    ]
    result = check_unit(curve, limits)
    verdicts = {c.limit.symbol: c.verdict.value for c in result.coefficients}
    return verdicts | {"unit": result.verdict.value}


def _row(duration: float, results: Sequence[Json]) -> Json:
    counts = {what: Counter(r[what] for r in results) for what in (*_LIMITS, "unit")}
    gate = at_most(len(results), _WRONG)
    row: Json = {"record [h]": duration / 3600, "records": len(results)}
    for symbol in _LIMITS:
        row[f"{symbol} passes"] = counts[symbol][CheckVerdict.PASS.value] / len(results)
        row[f"{symbol} fails"] = counts[symbol][CheckVerdict.FAIL.value] / len(results)
    row["unit passes"] = counts["unit"][CheckVerdict.PASS.value] / len(results)
    row["unit fails"] = counts["unit"][CheckVerdict.FAIL.value] / len(results)
    wrong = [*(row[f"{symbol} passes"] for symbol in _LIMITS), row["unit fails"]]
    return row | {**gate.columns(), "passes": gate.holds(*wrong)}


def run_at_the_limit(seed: int, say: Say, records: int, workers: int, cache: Path | None) -> list[Json]:
    """Verdicts of units at their limits, bound at 99.9 % for 5 %."""
    rows = []
    for i, duration in enumerate(_DURATIONS):
        tasks = [(duration, seed % 10_000 + 100_000 * i + j) for j in range(records)]
        place = place_of(cache, "fleet check", f"{duration:g}")
        rows.append(_row(duration, spread(_checked, tasks, workers=workers, say=say, place=place)))
        say(str(rows[-1]))
    return rows
