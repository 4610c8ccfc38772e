# SPDX-License-Identifier: BSD-3-Clause
"""Plans of positions against simulated calibrations: the rms error of each kind of parameter is the planned sd.

Each case plans the positions for some goals, simulates records of units in them, missed by nothing, and calibrates each
with the spans as planned. 1000 records of three axes know a standard deviation to 1.3 %. A plan says what the noise
costs: records in which a check of the scatter fails by chance, so that it is estimated and widens the interval, are
counted and left out of the ratio.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from allanite.experiments.calibration import calibrate
from allanite.experiments.position_planning import plan_positions
from allanite.experiments.position_planning.results import Candidates
from allanite.filtering.simulation import UnitMotion, simulate_unit
from allanite.noise import Flicker, NoiseModel, White
from allanite.quantities.attitude import attitude_of

__all__ = ["CASES", "GATE", "run_position_planning"]

Json = dict[str, Any]
GATE = (0.95, 1.05)
LATITUDE, RATE = math.radians(48.1), 20.0
ACCELEROMETER = NoiseModel.of(White(N=1e-3), Flicker(B=2e-4), kind="acceleration")
MEMS = NoiseModel.of(White(N=1e-4), Flicker(B=2e-5))
NAVIGATION = NoiseModel.of(White(N=3e-7), Flicker(B=5e-9))
#: Name, models, goals, candidates.
CASES: tuple[tuple[str, dict[str, NoiseModel], dict[str, float], Candidates], ...] = (
    (
        "MEMS, faces and edges",
        {"accelerometer": ACCELEROMETER, "gyro": MEMS},
        {"accelerometer.bias": 1e-3, "accelerometer.misalignment": 1e-4, "gyro.scale": 3e-4},
        "edges",
    ),
    (
        "MEMS, all positions",
        {"accelerometer": ACCELEROMETER, "gyro": MEMS},
        {"accelerometer.scale": 3e-5, "gyro.scale": 2e-4, "gyro.misalignment": 2e-4},
        "all",
    ),
    (
        "navigation, all positions",
        {"accelerometer": ACCELEROMETER, "gyro": NAVIGATION},
        {"gyro.bias": 2e-8, "gyro.scale": 3e-5},
        "all",
    ),
)


def run_position_planning(seed: int, say: Callable[[str], None], runs: int = 1000) -> list[Json]:
    """One row for each kind of parameter of each case."""
    rows = []
    for number, (name, models, goals, candidates) in enumerate(CASES):
        plan = plan_positions(models, goals=goals, latitude=LATITUDE, candidates=candidates, rate=RATE)
        dwells = [p.dwell for p in plan.positions]
        motion = UnitMotion.positions(
            np.stack([attitude_of(*p.attitude) for p in plan.positions]), dwell=dwells, turn=plan.turn
        )
        start = np.array([row["start"] for row in plan.table()])
        spans = np.round(np.stack([start, start + dwells], axis=1) * RATE).astype(int)
        made = [_errors(models, motion, spans, plan.names, seed + 1000 * number + i) for i in range(runs)]
        errors = np.array([e for e, sound in made if sound])
        for group in plan.groups:
            hit = [
                n.rpartition("_")[0] == group and n not in plan.open for n in plan.names
            ]  # those left open have no error by noise
            if any(hit):
                ratio = math.sqrt(float(np.mean((errors[:, hit] / plan.sd[hit]) ** 2)))
                rows.append(
                    {
                        "case": name,
                        "positions": len(dwells),
                        "length": plan.total,
                        "kind": group,
                        "records": runs,
                        "failed_a_check": runs - len(errors),
                        "rms_over_sd": round(ratio, 4),
                        "passes": GATE[0] <= ratio <= GATE[1],
                    }
                )
                say(f"{name}, {group}: rms/sd {ratio:.3f}")
    return rows


def _errors(
    models: dict[str, NoiseModel], motion: UnitMotion, spans: Any, names: tuple[str, ...], seed: int
) -> tuple[list[float], bool]:
    record = simulate_unit(models, rate=RATE, motion=motion, latitude=LATITUDE, seed=seed)
    by_channel = {n: models["gyro" if n.startswith("gyro") else "accelerometer"] for n in record.names}
    found = calibrate(record, spans=spans, model=by_channel, latitude=LATITUDE)
    errors = [found.calibration[n][0] - (1.0 if ".scale_" in n else 0.0) for n in names]
    return errors, all(check.passed for check in found.checks)
