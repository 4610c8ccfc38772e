# SPDX-License-Identifier: BSD-3-Clause
"""Plans against simulation: the sd from covariance alone is that of simulated estimates within 5 %.

Each row simulates records of one sensor, one dwell and one length, estimates the Earth rate or the heading from each,
and compares the root mean square of the errors with the plan. 2000 records know a standard deviation to 1.6 %.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

import allanite as al
from allanite.experiments.north import find_north
from allanite.experiments.planning import plan
from allanite.experiments.reversals import Position, Reversals
from allanite.filtering.regression import LEVEL, regress
from allanite.noise import SIGMA_PER_B, Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.quantities.earth import EARTH_RATE
from allanite.recording.records import Recording

__all__ = ["CASES", "GATE", "LATITUDE", "run_planning"]

Json = dict[str, Any]
DEG = math.pi / 180
LATITUDE = -23.31 * DEG
GATE = (0.95, 1.05)


def _gyro(N: float, B: float, T: float | None, K: float) -> NoiseModel:
    """N [deg/sqrt(h)], B [deg/h], T [s] or None for true 1/f noise, K [deg/h/sqrt(h)]."""
    b = B * DEG / 3600
    bias = Flicker(B=b) if T is None else GaussMarkov.from_sigma(SIGMA_PER_B * b, T)
    return NoiseModel.of(White(N=N * DEG / 60), bias, RandomWalk(K=K * DEG / 216000))


SENSORS = {
    "tactical": _gyro(0.05, 1, 100, 1),
    "MEMS": _gyro(0.3, 5, 300, 5),
    "MEMS, flicker": _gyro(0.3, 5, None, 5),
    "wandering": _gyro(0.3, 20, 100, 30),
}
#: what, sensor, dwell [s], length [s], dead time [s], positions, axes
CASES = (
    ("rate", "tactical", 30.0, 1800.0, 2.0, 2, 1),
    ("rate", "MEMS", 30.0, 7200.0, 2.0, 2, 1),
    ("rate", "MEMS, flicker", 20.0, 3600.0, 2.0, 2, 1),
    ("rate", "MEMS, flicker", 300.0, 3600.0, 2.0, 2, 1),
    ("rate", "wandering", 120.0, 3600.0, 3.0, 2, 1),
    ("rate", "wandering", 1800.0, 7200.0, 0.0, 2, 1),
    ("north", "tactical", 30.0, 3600.0, 2.0, 4, 1),
    ("north", "tactical", 60.0, 1800.0, 2.0, 2, 2),
    ("north", "tactical", 30.0, 3600.0, 2.0, 12, 1),
)


def run_planning(seed: int, say: Callable[[str], None], runs: int = 2000) -> list[Json]:
    """One row for each case."""
    rows = []
    for number, (what, sensor, dwell, duration, dead, positions, axes) in enumerate(CASES):
        model = SENSORS[sensor]
        found = plan(
            model,
            latitude=LATITUDE,
            what=what,  # type: ignore[arg-type]
            dwells=[dwell],
            durations=[duration],
            dead_time=dead,
            positions=positions,
            axes=axes,
        )
        where = _positions(dwell, duration, dead, positions)
        error = _rate_error if what == "rate" else _north_error
        errors = [error(model, where, np.random.SeedSequence([seed, number, i]), axes) for i in range(runs)]
        ratio = math.sqrt(float(np.mean(np.square(errors)))) / float(found.sd[0, 0])
        rows.append(
            {
                "what": what,
                "sensor": sensor,
                "dwell": dwell,
                "duration": duration,
                "dead_time": dead,
                "positions": positions,
                "axes": axes,
                "records": runs,
                "sd": float(found.sd[0, 0]),
                "rms_over_sd": round(ratio, 4),
                "passes": GATE[0] <= ratio <= GATE[1],
            }
        )
        say(f"{what}, {sensor}, dwells of {dwell:g} s, {duration:g} s: rms/sd {ratio:.3f}")
    return rows


def _positions(dwell: float, duration: float, dead: float, count: int) -> Reversals:
    """Samples of 1 s; dead times are cut from the second dwell on."""
    length, n = round(dwell), round(duration)
    places = tuple(
        Position(start=a, stop=min(a + length, n), heading=(k % count) * math.tau / count, sign=0)
        for k, a in enumerate(range(0, n, length))
    )
    return Reversals.cut(
        rate=1.0,
        n_samples=n,
        turns=(),
        positions=places,
        source="file",
        first="unknown",
        dead_time=dead,
        guard=0.0,
    )


def _noise(model: NoiseModel, where: Reversals, seed: np.random.SeedSequence, axis: int) -> Any:
    own = int(seed.generate_state(axis + 1)[axis])
    return al.simulate(model, rate=1.0, duration=float(where.n_samples), seed=own).values("gyro")


def _rate_error(model: NoiseModel, where: Reversals, seed: np.random.SeedSequence, axes: int) -> float:
    sign = np.full(where.n_samples, np.nan)
    for d in where.dwells:
        sign[d.start : d.stop] = math.cos(d.heading) * math.cos(LATITUDE)
    y = EARTH_RATE * sign + _noise(model, where, seed, 0)
    fit = regress(y, np.column_stack([sign, np.ones(len(sign))]), model, dt=1.0, names=("rate", LEVEL))
    return fit["rate"][0] - EARTH_RATE


def _north_error(model: NoiseModel, where: Reversals, seed: np.random.SeedSequence, axes: int) -> float:
    psi = float(np.random.default_rng(seed).uniform(0, math.tau))
    heading = np.zeros(where.n_samples)
    for p in where.positions:
        heading[p.start : p.stop] = p.heading
    made = [
        EARTH_RATE * math.cos(LATITUDE) * np.cos(psi + heading + k * math.pi / 2)
        + _noise(model, where, seed, k)
        for k in range(axes)
    ]
    names = ["x", "y"][:axes]
    recording = Recording.from_rate(np.column_stack(made), rate=1.0, unit="rad/s", names=names)
    found = find_north(recording, model=model, latitude=LATITUDE, positions=where, channels=names)
    return math.remainder(found.azimuth - psi, math.tau)
