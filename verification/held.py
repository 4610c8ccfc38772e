# SPDX-License-Identifier: BSD-3-Clause
"""Held samples: the rate of a sensor slower than its log, and coverage of N of its values, each taken once.

A sensor of white noise renews its value by its own clock; the log reads it at jittering times. A case passes where the
95 % set of N covers as stated (`verification.gates`) and the rate lies within four standard uncertainties in all
records.
"""

from __future__ import annotations

import math
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from allanite.fitting import fit
from allanite.noise.allan import allan_curve
from allanite.recording.cleaning.rows import at_own_rates
from allanite.recording.health.examination import check
from allanite.recording.records import Recording
from verification.gates import within
from verification.spread import Say, place_of, spread

__all__ = ["run_alarms", "run_held"]

Json = dict[str, Any]

LOG, ROWS = 95.0, 4000
#: Name; rates of the sensors, one for each axis; jitter of the rows in intervals; step of the values in deviations.
CASES: tuple[tuple[str, tuple[float, ...], float, float], ...] = (
    ("three axes together at 47 Hz", (47.0,), 0.3, 0.0),
    ("three axes together at 80 Hz, on steps of one deviation", (80.0,), 0.2, 1.0),
    ("each of three axes at its own rate: 23, 47.3 and 71 Hz", (23.0, 47.3, 71.0), 0.2, 0.0),
)


def _log(rates: tuple[float, ...], jitter: float, step: float, rng: np.random.Generator) -> Recording:
    """Three axes of white noise of sd 1, by one clock or by three."""
    t = (np.arange(ROWS) + rng.uniform(-jitter, jitter, ROWS)) / LOG
    axes = []
    for rate in rates:
        value = np.floor(t * rate + rng.random() + 2.0).astype(np.int64)
        axes.append(rng.standard_normal((value[-1] + 2, 3 // len(rates)))[value])
    samples = np.hstack(axes)
    samples = np.round(samples / step) * step if step else samples
    return Recording.from_rate(5.0 + samples, rate=LOG, unit="rad/s", names=["x", "y", "z"])


def _one(root: int, case: int, i: int) -> tuple[bool, bool, bool, float]:
    """Of one axis: N covered; rate within four standard uncertainties; found on all axes; N over the truth."""
    _, rates, jitter, step = CASES[case]
    log = _log(rates, jitter, step, np.random.default_rng([root, 47, case, i]))
    name, k = (("x", 0), ("y", 1), ("z", 2))[i % 3]
    once = at_own_rates(log)
    if len(once) < 3:
        return False, False, False, math.nan
    rate = rates[k % len(rates)]
    fresh = once[name]
    sd = float(fresh.history[-1]["rate_sd"])
    model = fit(allan_curve(fresh)[name])
    (n,) = (e for e in model.estimates if e.symbol == "N")
    truth = math.sqrt((1.0 + step**2 / 12.0) / rate)
    covered = n.supported and n.lower <= truth <= n.upper
    return bool(covered), abs(fresh.rate - rate) < 4.0 * sd, True, (n.value or math.nan) / truth


def run_held(root: int, say: Say, records: int, workers: int, cache: Path | None = None) -> list[Json]:
    """Logs that hold the values of slower sensors."""
    rows = []
    for case, (name, _, jitter, _) in enumerate(CASES):
        place = place_of(cache, "held", name)
        work = partial(_one, root, case)
        found = spread(work, range(records), workers=workers, say=say, place=place)
        gate = within(records)
        covered, rated, seen = (sum(bool(f[k]) for f in found) / records for k in (0, 1, 2))
        rows.append(
            {
                "case": name,
                "jitter_of_the_rows": jitter,
                "records": records,
                "held_found": seen,
                "rate_within_4_u": rated,
                "N_over_truth": float(np.nanmean([f[3] for f in found])),
                "N_covered": covered,
                **gate.columns(),
                "passes": gate.holds(covered) and rated == 1.0 and seen == 1.0,
            }
        )
        say(f"{name}: {rows[-1]}")
    return rows


def _alarm(root: int, i: int) -> bool:
    """White noise on steps of up to one deviation, read once a row, called held."""
    rng = np.random.default_rng([root, 48, i])
    step = rng.uniform(0.0, 1.0)
    samples = np.round(rng.standard_normal((ROWS, 3)) / step) * step + 5.0
    log = Recording.from_rate(samples, rate=LOG, unit="rad/s", names=["x", "y", "z"])
    return any(f.code == "held_samples" for f in check(log))


def run_alarms(root: int, say: Say, records: int, workers: int, cache: Path | None = None) -> list[Json]:
    """Records of which no value is held."""
    place = place_of(cache, "held", "alarms")
    found = spread(partial(_alarm, root), range(records), workers=workers, say=say, place=place)
    row = {
        "case": "white noise on steps of 0 to 1 deviation",
        "records": records,
        "called_held": sum(found) / records,
    }
    return [{**row, "passes": not any(found)}]
