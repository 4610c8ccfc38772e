# SPDX-License-Identifier: BSD-3-Clause
"""Do the tests of a comparison keep their level, do they see a difference, and do mean, spread and next sensor cover?

Whole records, simulated and compared from their Allan curves. Three truths: all terms resolved; a random walk that
about half of the records resolve; and records of different length, rate and sampling.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from allanite.filtering.simulation import simulate
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from allanite.noise.allan import AllanCurve, allan_curve
from allanite.quantities.quantity import Quantity
from allanite.recording.records import Sampling
from allanite.stability.record_comparison.estimation import compare
from allanite.stability.record_comparison.results import Comparison
from verification.gates import at_least, at_most
from verification.spread import Say, place_of, spread

__all__ = ["run_coverage", "run_power", "run_size"]

Json = dict[str, Any]

N, B = 1e-3, 1e-4
RESOLVED, BARELY = 1.2e-5, 3e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """A comparison of k records of one truth."""

    name: str
    k: int
    walk: float = RESOLVED
    uneven: bool = False


SETTINGS = (
    Setting(name="all terms resolved", k=2),
    Setting(name="all terms resolved", k=3),
    Setting(name="all terms resolved", k=10),
    Setting(name="walk resolved by some", k=2, walk=BARELY),
    Setting(name="walk resolved by some", k=5, walk=BARELY),
    Setting(name="no walk", k=3, walk=0.0),
    Setting(name="lengths, rates, sampling differ", k=2, uneven=True),
    Setting(name="lengths, rates, sampling differ", k=5, uneven=True),
)
_RATES = (10.0, 7.0, 10.0, 5.0, 20.0)
_HOURS = (6.0, 3.0, 6.0, 9.0, 2.0)
_SAMPLINGS: tuple[Sampling, ...] = ("mean", "mean", "point", "mean", "point")


def _record(model: NoiseModel, i: int, uneven: bool, seed: int) -> AllanCurve:
    j = i % 5 if uneven else 0
    sampling: Sampling = _SAMPLINGS[j] if uneven else "mean"
    recording = simulate(
        model, rate=_RATES[j], duration=3600 * _HOURS[j] if uneven else 18_000.0, seed=seed, sampling=sampling
    )
    return allan_curve(recording, threads=1)


def _model(n: float, b: float, k: float) -> NoiseModel:
    terms = (White(N=n), Flicker(B=b), RandomWalk(K=k))
    return NoiseModel(terms=terms if k > 0 else terms[:2])


def _compared(models: Sequence[NoiseModel], seed: int, uneven: bool = False) -> Comparison:
    curves = [_record(m, i, uneven, 1000 * seed + i) for i, m in enumerate(models)]
    return compare(curves, names=[f"r{i}" for i in range(len(models))], threads=1)


# -- size ------------------------------------------------------------------------------------------------------


def _size(task: tuple[int, int]) -> Json:
    setting, seed = SETTINGS[task[0]], task[1]
    found = _compared([_model(N, B, setting.walk)] * setting.k, seed, setting.uneven)
    c = found.channels[0]
    out: Json = {"channel": c.p, "curves": c.curve.p, "joint": c.joint.p, "lags": min(c.lag_p_adjusted)}
    out |= {p.symbol: p.equality.p for p in c.parameters if p.equality is not None}
    if c.outlier is not None:
        out["stands out"] = c.outlier.p
    return out


def run_size(seed: int, say: Say, records: int, workers: int, cache: Path | None) -> list[Json]:
    """Share of comparisons of one truth that are called different at 5 %, in each setting and in all of them."""
    rows, every = [], []
    for i, setting in enumerate(SETTINGS):
        tasks = [(i, seed % 10_000 + 10_000 * i + j) for j in range(records)]
        place = place_of(cache, "comparison", setting.name, setting.k)
        found = spread(_size, tasks, workers=workers, say=say, place=place)
        every += found
        rows.append({"setting": setting.name, "records": setting.k, **_different(found)})
        say(str(rows[-1]))
    return [*rows, {"setting": "all settings", "records": None, **_different(every)}]


def _different(found: list[Json]) -> Json:
    row: Json = {"comparisons": len(found)}
    passes = True
    for name in ("channel", "curves", "joint", "lags", "stands out", "N", "B", "K"):
        p = [f[name] for f in found if name in f]
        row[name] = sum(v < 0.05 for v in p) / len(p) if p else None
        if p and name not in ("lags", "stands out"):
            passes = passes and at_most(len(p)).holds(row[name])
    return row | at_most(len(found)).columns() | {"passes": passes}


# -- power -----------------------------------------------------------------------------------------------------

DIFFERENCES = {
    "N 1 % more": (1.01, 1.0, 1.0),
    "N 2 % more": (1.02, 1.0, 1.0),
    "B 50 % more": (1.0, 1.5, 1.0),
    "B twice": (1.0, 2.0, 1.0),
    "K twice": (1.0, 1.0, 2.0),
    "K four times": (1.0, 1.0, 4.0),
}


def _power(task: tuple[str, int]) -> Json:
    f = DIFFERENCES[task[0]]
    models = [_model(N, B, RESOLVED)] * 4 + [_model(f[0] * N, f[1] * B, f[2] * RESOLVED)]
    c = _compared(models, task[1]).channels[0]
    own = next((p for p in c.parameters if p.symbol == task[0][0]), None)
    outliers = (c.outlier, None if own is None else own.outlier)
    named = any(o is not None and o.p < 0.05 and o.record == "r4" for o in outliers)
    return {
        "channel": c.p < 0.05,
        "parameter": own is not None and own.equality is not None and own.equality.p < 0.05,
        "named": named,
        "wrong": c.outlier is not None and c.outlier.p < 0.05 and c.outlier.record != "r4",
        "detectable": own and own.detectable,
    }


def run_power(seed: int, say: Say, records: int, workers: int, cache: Path | None) -> list[Json]:
    """One record of five differs: how often it is seen, and named."""
    rows = []
    for i, name in enumerate(DIFFERENCES):
        tasks = [(name, 500_000 + seed % 10_000 + 10_000 * i + j) for j in range(records)]
        place = place_of(cache, "comparison", name)
        found = spread(_power, tasks, workers=workers, say=say, place=place)
        row: Json = {"the fifth has": name, "comparisons": records}
        for key in ("channel", "parameter", "named", "wrong"):
            row[key] = sum(f[key] for f in found) / records
        # none where no two records resolve the parameter
        middle = float(np.median([f["detectable"] or math.inf for f in found]))
        row["detectable_in_four_of_five"] = middle if math.isfinite(middle) else None
        rows.append(row)
        say(str(row))
    return rows


# -- coverage --------------------------------------------------------------------------------------------------

SPREADS = (0.0, 0.1, 0.4)


def _coverage(task: tuple[int, float, int]) -> Json:
    k, spread, seed = task
    rng = np.random.default_rng([seed, 7])
    factors = np.exp(spread * rng.standard_normal((k + 1, 3)))
    models = [_model(N * f[0], B * f[1], RESOLVED * f[2]) for f in factors[:k]]
    found = {p.symbol: p.population for p in _compared(models, seed).channels[0].parameters}
    out: Json = {}
    for i, (symbol, truth) in enumerate((("N", N), ("B", B), ("K", RESOLVED))):
        p = found.get(symbol)
        if p is None:  # the term is in no record's fit, or not in enough of them
            out[symbol] = None
            continue
        low, high = p.next_sensor or (0.0, math.inf)
        ahead = low <= truth * factors[k, i] <= high
        out[symbol] = (_inside(p.middle, truth), _inside(p.spread, spread), ahead)
    return out


def _inside(quantity: Quantity, truth: float) -> bool:
    """Whether an interval, or an upper limit, holds the truth."""
    return bool((quantity.lower or 0.0) <= truth <= (math.inf if quantity.upper is None else quantity.upper))


def run_coverage(seed: int, say: Say, records: int, workers: int, cache: Path | None) -> list[Json]:
    """Coverage of the 95 % intervals of the middle, the spread and the next sensor."""
    rows: list[Json] = []
    for k in (3, 10):
        for sd in SPREADS:
            first = 2_000_000 + seed % 10_000 + 10_000 * len(rows)
            tasks = [(k, sd, first + j) for j in range(records)]
            place = place_of(cache, "comparison", "coverage", k, sd)
            found = spread(_coverage, tasks, workers=workers, say=say, place=place)
            for symbol in ("N", "B", "K"):
                seen = [f[symbol] for f in found if f[symbol] is not None]
                row: Json = {"records": k, "spread": sd, "parameter": symbol, "comparisons": len(seen)}
                for i, name in enumerate(("mean", "spread_covered", "next")):
                    row[name] = sum(s[i] for s in seen) / max(len(seen), 1)
                gate = at_least(len(seen))
                row |= {
                    **gate.columns(),
                    "passes": gate.holds(row["mean"], row["spread_covered"], row["next"]),
                }
                rows.append(row)
                say(str(row))
    return rows
