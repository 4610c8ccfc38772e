# SPDX-License-Identifier: BSD-3-Clause
"""Contaminated noise: coverage of N with and without the contaminated samples, and what is taken for it.

A case passes where both 95 % sets cover as stated (`verification.gates`). The look-alikes are called contaminated in
no more records than the stated false-alarm probability makes once in 1000 runs.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.fitting import fit
from allanite.fitting.tails import contamination_of, with_tails
from allanite.noise.allan import allan_curve
from allanite.recording.health.tails import ALARM, law_of
from allanite.recording.records import Recording
from verification.gates import at_most, within
from verification.spread import Say, place_of, spread

__all__ = ["run_contaminated", "run_look_alikes"]

Json = dict[str, Any]
Samples = NDArray[np.float64]

SAMPLES = 27_000
#: Share of contaminated samples and ratio of their spread to that of the others.
CASES: tuple[tuple[float, float], ...] = ((0.03, 5.0), (0.03, 10.0), (0.01, 7.0))


def _recording(y: Samples) -> Recording:
    return Recording.from_rate(y, rate=1.0, unit="rad/s", names=["x"])


def _one(root: int, case: int, i: int) -> tuple[bool, bool, bool, bool]:
    """Recognized; N of all samples covered by the Gaussian set, by the set that holds the tails; N without covered."""
    share, ratio = CASES[case]
    rng = np.random.default_rng([root, 53, case, i])
    record = _recording(rng.standard_normal(SAMPLES) * np.where(rng.random(SAMPLES) < share, ratio, 1.0))
    tails = law_of(record, "x")
    plain = fit(allan_curve(record)["x"])
    model = with_tails(plain, tails, SAMPLES)
    truth = math.sqrt(1.0 + share * (ratio**2 - 1.0))
    gaussian, whole = (
        any(e.symbol == "N" and e.supported and e.lower <= truth <= e.upper for e in m.estimates)
        for m in (plain, model)
    )
    entry = contamination_of(model, tails, 1.0, 1.0)
    if entry is None:
        return False, gaussian, whole, False
    return True, gaussian, whole, entry.N_without.lower <= 1.0 <= entry.N_without.upper


def run_contaminated(
    root: int, say: Say, records: int, workers: int, cache: Path | None = None
) -> list[Json]:
    """White noise of which some samples scatter several times as much."""
    rows = []
    for case, (share, ratio) in enumerate(CASES):
        place = place_of(cache, "contaminated", share, ratio)
        found = spread(partial(_one, root, case), range(records), workers=workers, say=say, place=place)
        gate = within(records)
        seen, gaussian, whole, without = (sum(bool(f[k]) for f in found) / records for k in range(4))
        rows.append(
            {
                "share": share,
                "ratio": ratio,
                "records": records,
                "recognized": seen,
                "covered_by_a_Gaussian_interval": gaussian,
                "N_covered": whole,
                "N_without_covered": without,
                **gate.columns(),
                "passes": gate.holds(whole, without),
            }
        )
        say(f"{share} {ratio}: {rows[-1]}")
    return rows


# -- what is no mixture -----------------------------------------------------------------------------------


def _bursts(rng: np.random.Generator) -> Samples:
    y = rng.standard_normal(SAMPLES)
    for start in rng.integers(0, SAMPLES - 300, 3):
        y[start : start + 270] *= 7.0
    return y


def _short_bursts(rng: np.random.Generator) -> Samples:
    y = rng.standard_normal(SAMPLES)
    for start in rng.integers(0, SAMPLES - 3, 270):
        y[start : start + 3] = 7.0 * rng.standard_normal(3)
    return y


def _spikes(rng: np.random.Generator) -> Samples:
    y = rng.standard_normal(SAMPLES)
    y[rng.integers(0, SAMPLES, 15)] += 30.0
    return y


LOOK_ALIKES: dict[str, Callable[[np.random.Generator], Samples]] = {
    "Gaussian": lambda rng: rng.standard_normal(SAMPLES),
    "Gaussian on steps of 1.4 deviations": lambda rng: np.round(rng.standard_normal(SAMPLES) / 1.4) * 1.4,
    "Gaussian on steps of 3 deviations": lambda rng: np.round(rng.standard_normal(SAMPLES) / 3.0) * 3.0,
    "Student, 4 degrees of freedom": lambda rng: rng.standard_t(4, SAMPLES),
    "Student, 8 degrees of freedom": lambda rng: rng.standard_t(8, SAMPLES),
    "Laplace": lambda rng: rng.laplace(size=SAMPLES),
    "uniform": lambda rng: rng.uniform(-1.0, 1.0, SAMPLES),
    "clipped at 1.5 deviations": lambda rng: np.clip(rng.standard_normal(SAMPLES), -1.5, 1.5),
    "15 spikes": _spikes,
    "three bursts of 270 samples": _bursts,
    "270 bursts of 3 samples": _short_bursts,
}


def _law(root: int, name: str, i: int) -> str:
    rng = np.random.default_rng([root, 54, list(LOOK_ALIKES).index(name), i])
    record = _recording(LOOK_ALIKES[name](rng))
    return law_of(record, "x").law.value


def run_look_alikes(root: int, say: Say, records: int, workers: int, cache: Path | None = None) -> list[Json]:
    """Records that hold no mixture: what their law is called."""
    rows = []
    for name in LOOK_ALIKES:
        place = place_of(cache, "look-alikes", name)
        found = Counter(
            spread(partial(_law, root, name), range(records), workers=workers, say=say, place=place)
        )
        wrong, gate = found.get("contaminated", 0) / records, at_most(records, ALARM)
        rows.append(
            {
                "case": name,
                "records": records,
                "called": {k: v / records for k, v in sorted(found.items())},
                "called_contaminated": wrong,
                **gate.columns(),
                "passes": gate.holds(wrong),
            }
        )
        say(f"{name}: {rows[-1]}")
    return rows
