# SPDX-License-Identifier: BSD-3-Clause
"""Do the intervals of a calibration hold where a hand holds the unit? Sixty units, twenty records of each.

Every record has its own rests, turns, hand and lost samples (`hand_held`); nothing is given but gravity and the
latitude. Counted are the records that the verdict does not take away. The twenty records of a unit are held against
their common mean besides, which needs no truth: that is what a user can repeat.
"""

from __future__ import annotations

import time
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from scipy.special import ndtri, stdtr
from scipy.stats import chi2

from allanite.errors import AllaniteError
from allanite.experiments.calibration import calibrate
from verification.gates import within
from verification.hand_held import LATITUDE, G, held_record
from verification.spread import Say, place_of, spread

__all__ = ["SCATTER_OF_TURNS", "TWENTY", "calibrate_held", "repeats", "run_hand_held"]

Json = dict[str, Any]

#: Records of one unit.
TWENTY = 20
#: Probability of the bands.
BAND = 0.999
#: A table: scatter that few turns cannot tell from chance widens the intervals where it is found.
SCATTER_OF_TURNS = "Gyro misalignments where the turns were found to scatter beyond the noise, and where not"
#: Verdicts after which the numbers stand.
STANDING = ("calibrated", "partly calibrated")


def calibrate_held(number: int, *, seed: int) -> Json:
    """One record: its verdict, and each parameter's error, sd, degrees of freedom, and whether its interval holds."""
    made = held_record(seed + number, unit=seed + number // TWENTY)
    begun = time.process_time()
    try:
        found = calibrate(made.recording, latitude=LATITUDE, gravity=G)
    except AllaniteError as error:
        return {"verdict": str(error).partition(":")[0].partition(",")[0], "parameters": {}}
    truth = made.values
    return {
        "verdict": found.verdict,
        "why": found.reason,
        "seconds": time.process_time() - begun,
        "rests": [len(found.positions), int(made.steady.sum())],
        "turns_scatter": any(s.what == "turns" and s.sd > 0 for s in found.scatter),
        "parameters": {
            p.name: [
                p.value - truth[p.name],
                p.sd,
                p.dof,
                bool(p.interval[0] <= truth[p.name] <= p.interval[1]),
            ]
            for p in found.parameters
            if p.status == "estimated"
        },
    }


def run_hand_held(
    count: int, seed: int, say: Say, workers: int = 1, cache: Path | None = None
) -> dict[str, list[Json]]:
    """Tables: verdicts, coverage of every parameter, agreement of the repeats."""
    records = spread(
        partial(calibrate_held, seed=seed),
        list(range(count)),
        workers=workers,
        say=say,
        place=place_of(cache, "hand-held", seed),
    )
    verdicts = [r["verdict"] for r in records]
    standing = [r for r in records if r["verdict"] in STANDING]
    names = list(dict.fromkeys(n for r in standing for n in r["parameters"]))
    return {
        "Verdicts": [
            {"verdict": v, "records": verdicts.count(v), "share": verdicts.count(v) / count}
            for v in sorted(set(verdicts))
        ],
        "Coverage of 95 % intervals": [_coverage(n, standing) for n in names],
        SCATTER_OF_TURNS: [_turns(standing, scatter) for scatter in (True, False)],
        "Twenty records of one unit about their mean": [_agreement(n, records) for n in names],
    }


def _coverage(name: str, records: list[Json]) -> Json:
    own = [r["parameters"][name] for r in records if name in r["parameters"]]
    share, gate = float(np.mean([p[3] for p in own])), within(len(own))
    return {
        "parameter": name,
        "records": len(own),
        "sd": float(np.median([p[1] for p in own])),
        "coverage": share,
        **gate.columns(),
        "passes": gate.holds(share),
    }


def _turns(records: list[Json], scatter: bool) -> Json:
    own = [r["parameters"] for r in records if r["turns_scatter"] == scatter]
    held = [p[3] for each in own for name, p in each.items() if name.startswith("gyro.misalignment")]
    return {
        "scatter": "found" if scatter else "not found",
        "share": len(own) / len(records),
        "coverage": float(np.mean(held)),
    }


def _agreement(name: str, records: list[Json]) -> Json:
    """Chi-square of all units together."""
    total, dof = 0.0, 0
    for first in range(0, len(records), TWENTY):
        unit = [r for r in records[first : first + TWENTY] if r["verdict"] in STANDING]
        own = np.array([r["parameters"][name][:3] for r in unit if name in r["parameters"]])
        if len(own) > 1:
            total, dof = total + repeats(*own.T), dof + len(own) - 1
    low, high = (float(chi2.ppf(p, dof)) / dof for p in ((1 - BAND) / 2, (1 + BAND) / 2))
    return {
        "parameter": name,
        "dof": dof,
        "chi2_over_dof": total / dof,
        "band": [low, high],
        "passes": total / dof <= high,
    }


def repeats(value: np.ndarray, sd: np.ndarray, dof: np.ndarray) -> float:
    """Chi-square of estimates of one quantity about their weighted mean, by normal scores of their Student laws."""
    mean = np.sum(value / sd**2) / np.sum(1 / sd**2)
    z = -np.abs(value - mean) / sd
    score = np.where(np.isfinite(dof), ndtri(stdtr(np.where(np.isfinite(dof), dof, 1e9), z)), z)
    return float((score**2).sum())
