# SPDX-License-Identifier: BSD-3-Clause
"""Do the intervals of a fleet's population cover, and how many of the units that stand out are false alarms?

Two kinds of fleets. *From samples*: every log is simulated sample by sample and goes through the Allan curve, the
profiles and the nine numbers of the table; a random walk that about two in five logs do not resolve is among the
terms.
*By their law*: profiles of normal estimates, and of estimates of a square with limits where it is small; these are
cheap, so that lots, repeats, conditions and outliers can be told apart in many fleets.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
from numpy.typing import NDArray
from scipy.special import ndtr

from allanite.filtering.simulation import simulate
from allanite.noise import Flicker, NoiseModel, RandomWalk, White
from allanite.noise.allan import allan_curve
from allanite.stability.fleet.levels import LEVELS, levels_of
from allanite.stability.fleet.log_profiles import profiles_of
from allanite.stability.fleet.population import describe_fleet
from allanite.stability.fleet.results import CoefficientPopulation, FleetPopulation
from allanite.stability.record_comparison.series import record_of
from verification.gates import at_least, within
from verification.spread import Say, place_of, spread

__all__ = ["run_discoveries", "run_law", "run_samples"]

Json = dict[str, Any]
Array = NDArray[np.float64]

LEVEL = np.array(LEVELS)
_MIDDLE = -5.0  # ln of every coefficient that is simulated by its law


@dataclass(frozen=True, slots=True, kw_only=True)
class Fleet:
    """How a fleet is made: standard deviations of the logarithm, and what each log knows.

    Attributes
    ----------
    units, lots, repeats : int
    unit, lot, repeat : float
        Spreads.
    known : float
        Standard deviation of one log.
    limits : bool
        Estimates of a square, of which two in five are limits.
    per_degree : float
        Effect of the temperature, which varies by 6 degrees.
    outliers, apart : float
        Share of units that are displaced, and by how many spreads.
    """

    name: str
    units: int
    lots: int = 1
    repeats: int = 1
    unit: float = 0.3
    lot: float = 0.0
    repeat: float = 0.0
    known: float = 0.1
    limits: bool = False
    per_degree: float = 0.0
    outliers: float = 0.0
    apart: float = 0.0


FLEETS = (
    Fleet(name="12 units", units=12),
    Fleet(name="60 units", units=60),
    Fleet(name="60 units, each log as uncertain as they spread", units=60, known=0.3),
    Fleet(name="60 units, two logs in five give a limit", units=60, limits=True),
    Fleet(name="40 units, two logs each", units=40, repeats=2, repeat=0.15),
    Fleet(name="80 units from 8 lots", units=80, lots=8, lot=0.3),
    Fleet(name="60 units at temperatures", units=60, per_degree=0.02),
)
DISCOVERIES = tuple(
    Fleet(name=f"200 units, {name}", units=200, outliers=share, apart=apart)
    for name, share, apart in (
        ("none apart", 0.0, 0.0),
        ("1 in 20 apart by 3 spreads", 0.05, 3.0),
        ("1 in 20 apart by 5 spreads", 0.05, 5.0),
        ("1 in 20 apart by 8 spreads", 0.05, 8.0),
    )
)


# -- fleets by their law ----------------------------------------------------------------------------------


def _table(fleet: Fleet, rng: np.random.Generator) -> tuple[pa.Table, NDArray[np.bool_]]:
    """Rows of one coefficient, and which units are displaced."""
    lot = np.sort(np.arange(fleet.units) % fleet.lots)
    apart = rng.random(fleet.units) < fleet.outliers
    of_unit = fleet.lot * rng.standard_normal(fleet.lots)[lot] + fleet.unit * rng.standard_normal(fleet.units)
    of_unit += np.where(apart, fleet.apart * fleet.unit * rng.choice([-1.0, 1.0], fleet.units), 0.0)
    unit = np.repeat(np.arange(fleet.units), fleet.repeats)
    degrees = 20 + 6 * rng.standard_normal(len(unit))
    x = of_unit[unit] + fleet.repeat * rng.standard_normal(len(unit)) + fleet.per_degree * (degrees - 20)
    knots, floor = _squares(x, rng) if fleet.limits else _normal(x, fleet.known, rng)
    columns = {
        "log": [f"{u}-{i}" for i, u in enumerate(unit)],
        "unit": [str(u) for u in unit],
        "lot": [str(lot[u]) for u in unit],
        "channel": ["gyro"] * len(unit),
        "kind": ["rate"] * len(unit),
        "term": ["N"] * len(unit),
        "unit_of_measure": ["rad/s^0.5"] * len(unit),
        "profile": pa.FixedSizeListArray.from_arrays(
            pa.array((knots + _MIDDLE).astype(np.float32).ravel()), 9
        ),
        "root_at_zero": pa.array(floor.astype(np.float32)),
    }
    if fleet.per_degree:
        columns["temperature"] = degrees
    return pa.table(columns), apart


def _normal(x: Array, known: float, rng: np.random.Generator) -> tuple[Array, Array]:
    sd = known * np.exp(0.3 * rng.standard_normal(len(x)))
    best = x + sd * rng.standard_normal(len(x))
    return best[:, None] + sd[:, None] * LEVEL, np.full(len(x), -np.inf)


def _squares(x: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Estimates of 2 exp(2 x) with unit variance, never negative: below 1.96 it is a limit."""
    y = 2 * np.exp(2 * x) + rng.standard_normal(len(x))
    beyond = np.where(LEVEL > 0, np.hypot(LEVEL, y[:, None]) - np.abs(y[:, None]), 0.0)
    square = np.where(y[:, None] < 0, beyond, LEVEL + np.maximum(y, 0.0)[:, None])
    with np.errstate(divide="ignore"):
        knots = np.where(square > 0, 0.5 * np.log(np.maximum(square, 1e-300) / 2), -np.inf)
    return knots, -np.maximum(y, 0.0)


def _law(task: tuple[str, int]) -> Json:
    name, seed = task
    fleet = next(f for f in FLEETS if f.name == name)
    table, _ = _table(fleet, np.random.default_rng([seed, 25]))
    (c,) = describe_fleet(table).coefficients
    # the tolerance bound is for units of all lots; `spread` of one without them
    every = math.hypot(fleet.lot, fleet.unit)
    return _covered(c, fleet.unit, every) | _levels_covered(c, fleet)


def _covered(c: CoefficientPopulation, unit: float, every: float, middle: float = _MIDDLE) -> Json:
    """Which intervals hold, and the probability that the next unit's does."""
    low, high = ((math.log(end) - middle) / every for end in c.next_unit)
    low_bound, high_bound = ((math.log(end) - middle) / every for end in c.tolerance)
    return {
        "middle": c.middle.lower <= math.exp(middle) <= c.middle.upper,
        "spread": c.spread.lower <= unit <= c.spread.upper,
        "spread_value": c.spread.value,
        "next": float(ndtr(high) - ndtr(low)),
        "upper bound": float(ndtr(high_bound)) >= c.content,
        "lower bound": float(ndtr(-low_bound)) >= c.content,
        "resolved": c.resolved / c.logs,
    }


def _levels_covered(c: CoefficientPopulation, fleet: Fleet) -> Json:
    made: Json = {}
    for name, quantity, truth in (
        ("lots", c.between_lots, fleet.lot),
        ("repeats", c.between_repeats, fleet.repeat),
    ):
        if quantity is not None:
            made[name] = quantity.lower <= truth <= quantity.upper
    for effect in c.effects:
        made["temperature"] = effect.change.lower <= fleet.per_degree <= effect.change.upper
    return made


_TESTED = ("middle", "spread", "lots", "repeats", "temperature", "upper bound", "lower bound")


def _row(name: str, results: Sequence[Json]) -> Json:
    row: Json = {"fleet": name, "fleets": len(results)}
    n = len(results)
    gate, bound, inside = within(n), at_least(n), []
    for what in _TESTED:
        if what in results[0]:
            row[what] = sum(r[what] for r in results) / n
            inside.append((bound if "bound" in what else gate).holds(row[what]))
    row["next unit"] = float(np.mean([r["next"] for r in results]))
    row["logs resolved"] = float(np.mean([r["resolved"] for r in results]))
    row |= {**gate.columns(), "passes": all(inside) and abs(row["next unit"] - 0.95) < 0.022}
    return row


def run_law(seed: int, say: Say, fleets: int, workers: int, cache: Path | None) -> list[Json]:
    """Coverage of the 95 % intervals, band at 99.9 %."""
    rows = []
    for i, fleet in enumerate(FLEETS):
        tasks = [(fleet.name, seed + 100_000 * i + j) for j in range(fleets)]
        results = spread(
            _law, tasks, workers=workers, say=say, place=place_of(cache, "fleet", "law", fleet.name)
        )
        rows.append(_row(fleet.name, results))
        say(str(rows[-1]))
    return rows


# -- fleets from samples ----------------------------------------------------------------------------------

_UNITS, _RATE, _DURATION = 20, 10.0, 3600.0
_N, _B, _K, _SPREAD = 3e-4, 1.5e-4, 1.2e-5, 0.3


def _rows_of_samples(seed: int) -> Iterator[Json]:
    rng = np.random.default_rng([seed, 26])
    for unit in range(_UNITS):
        n, b, k = (middle * math.exp(_SPREAD * rng.standard_normal()) for middle in (_N, _B, _K))
        model = NoiseModel(terms=(White(N=n), Flicker(B=b), RandomWalk(K=k)))
        curve = allan_curve(
            simulate(model, rate=_RATE, duration=_DURATION, seed=100 * seed + unit), threads=1
        )
        record = record_of(curve)
        (channel,) = record.channels
        profiles = profiles_of(record.series(channel), 0.95)
        for symbol in ("N", "B", "K"):
            knots, floor = levels_of(profiles[symbol])
            yield {
                "log": str(unit), "unit": str(unit), "lot": "", "channel": "gyro", "kind": "rate", "term": symbol,
                "unit_of_measure": "1", "profile": knots.astype(np.float32).tolist(), "root_at_zero": floor,
            }  # fmt: skip


def _samples(seed: int) -> Json:
    rows = list(_rows_of_samples(seed))
    table = pa.table({name: [row[name] for row in rows] for name in rows[0] if name != "profile"})
    flat = pa.array(np.array([row["profile"] for row in rows], dtype=np.float32).ravel())
    table = table.append_column("profile", pa.FixedSizeListArray.from_arrays(flat, 9))
    result: FleetPopulation = describe_fleet(table)
    made: Json = {}
    for c in result.coefficients:
        middle = math.log({"N": _N, "B": _B, "K": _K}[c.symbol])
        made[c.symbol] = _covered(c, _SPREAD, _SPREAD, middle)
    return made


def run_samples(seed: int, say: Say, fleets: int, workers: int, cache: Path | None) -> list[Json]:
    """The same from samples, through curve and profiles; 20 units a fleet, one hour at 10 Hz each."""
    tasks = [seed % 10_000 + j for j in range(fleets)]
    results = spread(_samples, tasks, workers=workers, say=say, place=place_of(cache, "fleet", "samples"))
    rows = []
    for symbol in ("N", "B", "K"):
        every = [r[symbol] for r in results if symbol in r]
        row = _row(f"20 units from samples: {symbol}", every)
        values = np.array([r["spread_value"] for r in every])
        resolved = np.isfinite(values)
        row["spread resolved"] = float(resolved.mean())
        row["median of the spread"] = float(np.median(np.where(resolved, values, 0.0)))
        rows.append(row)
        say(str(row))
    return rows


# -- who stands out ---------------------------------------------------------------------------------------


def _discovered(task: tuple[str, int]) -> Json:
    name, seed = task
    fleet = next(f for f in DISCOVERIES if f.name == name)
    table, apart = _table(fleet, np.random.default_rng([seed, 27]))
    named = [int(u) for u in describe_fleet(table).names_standing_out]
    return {"named": len(named), "false": int(sum(not apart[u] for u in named)), "apart": int(apart.sum())}


def run_discoveries(seed: int, say: Say, fleets: int, workers: int, cache: Path | None) -> list[Json]:
    """Share of false alarms among the units that stand out, and of the displaced units that do."""
    rows = []
    for i, fleet in enumerate(DISCOVERIES):
        tasks = [(fleet.name, seed + 100_000 * i + j) for j in range(fleets)]
        place = place_of(cache, "fleet", "discoveries", fleet.name)
        results = spread(_discovered, tasks, workers=workers, say=say, place=place)
        share = np.array([r["false"] / max(r["named"], 1) for r in results])
        error = float(share.std(ddof=1)) / math.sqrt(len(share))
        row: Json = {
            "fleet": fleet.name,
            "fleets": len(results),
            "false alarms among those named": float(share.mean()),
            "standard error": error,
            "displaced units named": sum(r["named"] - r["false"] for r in results)
            / max(sum(r["apart"] for r in results), 1),
            "passes": bool(share.mean() - 3.3 * error <= 0.05),
        }
        rows.append(row)
        say(str(row))
    return rows
