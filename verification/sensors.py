# SPDX-License-Identifier: BSD-3-Clause
"""Sensors drawn from a stated prior, characterized as a user would: do intervals hold at every level, and evenly?

Of each sensor one record is simulated, sample by sample, and given to `characterize` at five levels of confidence, with
nothing else said. The prior:

* 10, 32 or 100 Hz; 2^13 to 2^17 samples, evenly in the logarithm;
* white noise always; flicker in half of the sensors, a random walk in half, a ramp in a tenth, each with a tenth to ten
  times the deviation of the white noise over a quarter of the record, evenly in the logarithm;
* half of the records rounded, to steps of up to one standard deviation of a sample;
* half of them with samples missing, up to a fifth, half one by one and half in outages of a hundredth of the record.

A truth of zero cannot lie below a set, so it counts in coverage from below only. Where the truth is not zero, its
*rank* is the part of the confidence distribution below it, known from the sets up to their levels: of calibrated sets
it is uniform.
"""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.stats import binom

import allanite as al
from allanite.errors import AllaniteError
from allanite.noise import SIGMA_PER_B, Flicker, NoiseModel, Ramp, RandomWalk, TermType, White
from allanite.recording.records import Recording
from verification.gates import HOLDS, Gate, at_least, within
from verification.spread import Say, place_of, spread

__all__ = ["LEVELS", "draw", "draw_ranks", "run_coverage", "run_ranks", "run_sensors"]

Json = dict[str, Any]
Samples = NDArray[np.float64]

LEVELS = (0.50, 0.6827, 0.90, 0.95, 0.99)
POINTS = tuple((1 - level) / 2 for level in reversed(LEVELS)) + tuple((1 + level) / 2 for level in LEVELS)
_FEWEST = 50  # ranks that a row is made of
SYMBOLS = ("Q", "N", "B", "K", "R")
_UNIT = 1e-4  # white noise [rad/s/rt-Hz] of all sensors: what counts are the others' sizes beside it


def draw(root: int, number: int) -> tuple[Recording, dict[str, float]]:
    """A record of one sensor, and the truth of every coefficient."""
    rng = np.random.default_rng([root, 84, number])
    rate, n = float(rng.choice([10.0, 32.0, 100.0])), round(2 ** rng.uniform(13, 17))
    model = _model(rng, n / rate)
    y = al.simulate(model, rate=rate, duration=n / rate, seed=int(rng.integers(2**31))).values("gyro").copy()
    truth = dict.fromkeys(SYMBOLS, 0.0) | {t.symbols[0]: float(getattr(t, t.symbols[0])) for t in model.terms}
    if rng.random() < 0.5:
        step = rng.uniform(0.0, 1.0) * _UNIT * math.sqrt(rate)
        y = np.round(y / step) * step
        truth["N"] = math.hypot(truth["N"], step / math.sqrt(12 * rate))
    if rng.random() < 0.5:
        y[_missing(rng, len(y), rng.uniform(0.0, 0.2))] = np.nan
    return Recording.from_rate(y, rate=rate, unit="rad/s", names=["gyro"]), truth


def _model(rng: np.random.Generator, duration: float) -> NoiseModel:
    """Slow terms by their deviation over a quarter of the record, a long averaging time that is still seen."""
    tau = duration / 4
    of_white = _UNIT / math.sqrt(tau)
    terms: list[TermType] = [White(N=_UNIT)]
    for share, term in (
        (0.5, lambda size: Flicker(B=size / SIGMA_PER_B)),
        (0.5, lambda size: RandomWalk(K=size / math.sqrt(tau / 3))),
        (0.1, lambda size: Ramp(R=size * math.sqrt(2) / tau)),
    ):
        if rng.random() < share:
            terms.append(term(of_white * 10 ** rng.uniform(-1, 1)))
    return NoiseModel(terms=tuple(terms))


def _missing(rng: np.random.Generator, n: int, share: float) -> NDArray[np.bool_]:
    lost = rng.random(n) < share / 2
    while lost.mean() < share:
        start = int(rng.integers(n))
        lost[start : start + n // 100] = True
    return lost


# -- one sensor -----------------------------------------------------------------------------------------------------


def characterized(root: int, number: int) -> Json:
    """Of every coefficient the truth, and its set at every level: [lower, upper, supported]; empty where refused."""
    record, truth = draw(root, number)
    sets: dict[str, list[Any]] = {symbol: [] for symbol in SYMBOLS}
    for level in LEVELS:
        try:
            (channel,) = al.characterize(record, confidence=level, threads=1).channels
        except AllaniteError as refusal:
            return {"truth": truth, "refused": type(refusal).__name__}
        if not channel.models:
            return {"truth": truth, "refused": "no model"}
        known = {e.symbol: e for e in channel.models[0].estimates}
        for symbol in SYMBOLS:
            e = known.get(symbol)
            sets[symbol].append(None if e is None else [e.lower, e.upper, e.supported])
    return {"truth": truth, "sets": sets}


def run_sensors(root: int, say: Say, count: int, workers: int, cache: Path | None) -> list[Json]:
    """All sensors."""
    place = place_of(cache, "sensors", root)
    return spread(partial(characterized, root), range(count), workers=workers, say=say, place=place)


# -- tables ---------------------------------------------------------------------------------------------------------


def _inside(chosen: list[Any] | None, truth: float) -> bool:
    if chosen is None:
        return False
    lower, upper, _ = chosen
    return (lower or 0.0) <= truth and (upper is None or truth <= upper)


def run_coverage(sensors: list[Json]) -> list[Json]:
    """One row for each coefficient, present or absent, with the share of sets that hold it at every level."""
    rows = []
    for symbol in SYMBOLS:
        for present in (True, False):
            own = [s for s in sensors if "sets" in s and (s["truth"][symbol] > 0) == present]
            if not own:
                continue
            row: Json = {"coefficient": symbol, "present": "yes" if present else "no", "records": len(own)}
            gates = {}
            for i, level in enumerate(LEVELS):
                row[f"{100 * level:g} %"] = sum(
                    _inside(s["sets"][symbol][i], s["truth"][symbol]) for s in own
                ) / len(own)
                # a set that ends at zero, or an upper limit, covers more
                sharp = present and all(s["sets"][symbol][i] and s["sets"][symbol][i][2] for s in own)
                gates[level] = (within if sharp else at_least)(len(own), level)
            rows.append(row | _gated(row, gates))
    return rows


def _gated(row: Json, gates: dict[float, Gate]) -> Json:
    """Every level has its gate; those of 68 and 95 % are stated."""
    one, two = gates[0.6827].columns(), gates[0.95].columns()
    return {
        "gate of 68.27 %": one["gate"],
        "rejects of 68.27 %": one["rejects"],
        **two,
        "passes": all(gate.holds(row[f"{100 * level:g} %"]) for level, gate in gates.items()),
    }


def run_ranks(sensors: list[Json]) -> list[Json]:
    """Share of ranks below each end of the sets, where a coefficient is there, and the band of all ends together."""
    rows = []
    for symbol in ("N", "B", "K"):
        own = [
            s
            for s in sensors
            if "sets" in s and s["truth"][symbol] > 0 and all(e and e[2] for e in s["sets"][symbol])
        ]
        if len(own) < _FEWEST:
            continue  # hardly anything is tested
        row: Json = {"coefficient": symbol, "records": len(own)}
        inside = True
        for i, point in enumerate(POINTS):
            upper = i >= len(LEVELS)
            at = i - len(LEVELS) if upper else len(LEVELS) - 1 - i
            below = sum(_below(s["sets"][symbol][at], s["truth"][symbol], upper=upper) for s in own)
            row[f"{100 * point:.4g} %"] = below / len(own)
            low, high = _band(point, len(own))
            inside = inside and low <= row[f"{100 * point:.4g} %"] <= high
        rows.append(row | {"passes": inside})
    return rows


def _band(point: float, count: int) -> tuple[float, float]:
    """Shares of ranks below a point that agree with uniform ranks, at all points together with 99.9 %."""
    tail = (1 - HOLDS) / 2 / len(POINTS)
    low, high = (float(binom.ppf(q, count, point)) / count for q in (tail, 1 - tail))
    return low, high


def draw_ranks(rows: list[Json], path: Path) -> None:
    """Distribution of the ranks, known at the ends of the sets, beside that of uniform ranks with its band."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(8, 3.4), layout="constrained")
    for axes, row in zip(np.atleast_1d(figure.subplots(1, len(rows), sharey=True)), rows, strict=True):
        low, high = np.array([_band(point, row["records"]) for point in POINTS]).T
        axes.fill_between(POINTS, low, high, color="#d5e5f5", label="uniform ranks, 99.9 % band")
        shares = [row[f"{100 * point:.4g} %"] for point in POINTS]
        axes.plot(POINTS, shares, "o-", color="#1f5a96" if row["passes"] else "#c0392b", ms=4, lw=1)
        axes.set_title(f"{row['coefficient']}, {row['records']} sensors", fontsize=9)
        axes.set_xlabel("part of the confidence distribution")
        axes.spines[["top", "right"]].set_visible(False)
    figure.axes[0].set_ylabel("share of sensors with the truth below")
    figure.axes[0].legend(fontsize=7, frameon=False, loc="upper left")
    figure.savefig(path, dpi=130, metadata={"Software": None})


def _below(chosen: list[Any], truth: float, *, upper: bool) -> bool:
    """Whether the truth lies below the upper end of a set, or below its lower one."""
    end = chosen[1] if upper else chosen[0]
    return upper if end is None else truth < end
