# SPDX-License-Identifier: BSD-3-Clause
"""Spectra: coverage of their intervals and of those of lines; the spectral fit against the bound; false alarms.

Records of the fit are kept in the cache like those of the coverage run. A share passes inside the 99.9 % binomial
bounds of its stated level; sets of parameters whose truth is zero or below three bounds are one-sided.
"""

from __future__ import annotations

import json
import math
import time
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.signal import butter, sosfilt

import allanite as al
from allanite.fitting.spectral.agreement import disagreement
from allanite.fitting.spectral.estimation import fit_spectral
from allanite.fitting.spectral.ordinates import ordinates_of
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, Sinusoid, White
from allanite.noise.allan import allan_curve
from allanite.noise.spectrum.estimation import power_spectrum
from allanite.noise.spectrum.sampled import sampled_psd
from allanite.noise.spectrum.stability import without_stable_lines
from allanite.recording.records import Recording
from verification.coverage import evaluate, printed
from verification.gates import at_most, within
from verification.scenarios import SCENARIOS
from verification.spread import Say, place_of, spread

__all__ = ["run_fits", "run_intervals", "run_lines", "run_power"]

Json = dict[str, Any]
Array = NDArray[np.float64]

_RATE = 100.0
_DT = 1 / _RATE
_NOISES = {
    "white": NoiseModel.of(White(N=0.1)),
    "flicker": NoiseModel.of(Flicker(B=0.5)),
    "random walk": NoiseModel.of(RandomWalk(K=0.3)),
    "Gauss-Markov": NoiseModel.of(GaussMarkov(q=1.0, T=2.0)),
    "all together": NoiseModel.of(White(N=0.1), Flicker(B=0.1), RandomWalk(K=0.02)),
}
_SAMPLES = 8000
_LOWEST = 4


def _seed(*place: int) -> int:
    return int(np.random.SeedSequence(place).generate_state(1, np.uint64)[0])


# -- intervals of densities -------------------------------------------------------------------------------


def _covered(noise: str, method: Any, gaps: bool, task: tuple[int, int]) -> tuple[list[int], list[int]]:
    """Hits and number of points: the lowest ones, and every third of all (neighbours share what they see)."""
    model = _NOISES[noise]
    record = al.simulate(model, rate=_RATE, duration=_SAMPLES * _DT, seed=_seed(*task), name="x")
    if gaps:
        y, rng = record.values("x").copy(), np.random.default_rng(task)
        y[_SAMPLES // 2 : _SAMPLES // 2 + _SAMPLES // 10] = np.nan
        y[rng.random(_SAMPLES) < 0.002] = np.nan
        record = Recording.from_rate(y, rate=_RATE, unit="rad/s", names="x")
    spectrum = power_spectrum(record, "x", method=method)
    truth = sampled_psd(model, spectrum.frequency, _DT)
    hit = (spectrum.lower < truth) & (truth < spectrum.upper)
    low, all_ = hit[: 2 * _LOWEST : 2], hit[::3]
    return [int(low.sum()), len(low)], [int(all_.sum()), len(all_)]


def run_intervals(root: int, say: Say, records: int, workers: int, folder: Path) -> list[Json]:
    """Coverage of the 95 % interval by the true folded density, and of that of the lowest points alone."""
    rows = []
    for i, noise in enumerate(_NOISES):
        for method in ("log", "welch"):
            for gaps in (False, True):
                tasks = [(root, i, k) for k in range(records)]
                work = partial(_covered, noise, method, gaps)
                place = place_of(folder, "density", noise, method, gaps)
                found = spread(work, tasks, workers=workers, place=place, chunk=8)
                low, every = (np.array([f[k] for f in found]).sum(axis=0) for k in (0, 1))
                row: Json = {"noise": noise, "method": method, "gaps": gaps, "records": records}
                for name, (hits, points) in (("lowest points", low), ("all points", every)):
                    row[name] = hits / points
                    row[f"{name} pass"] = within(int(points)).holds(hits / points)
                rows.append(row)
                say(json.dumps(row))
    return rows


# -- lines ------------------------------------------------------------------------------------------------

_LINE = Sinusoid(amplitude=0.05, frequency=3.3217, phase=1.0)


def _line(share: float, task: tuple[int, int]) -> tuple[bool, bool, bool, bool]:
    """Found; called steady; amplitude and frequency inside of their intervals."""
    model = _NOISES["all together"] + Sinusoid(
        amplitude=share * _LINE.amplitude, frequency=_LINE.frequency, phase=_LINE.phase
    )
    record = al.simulate(model, rate=_RATE, duration=1500.0, seed=_seed(*task), name="x")
    lines = [
        each for each in power_spectrum(record, "x").lines if abs(each.frequency - _LINE.frequency) < 0.05
    ]
    if not lines:
        return False, False, False, False
    line, seen = lines[0], share * _LINE.amplitude * float(np.sinc(_LINE.frequency * _DT))
    inside = line.amplitude_lower < seen < line.amplitude_upper
    return True, line.stable, inside, line.frequency_lower < _LINE.frequency < line.frequency_upper


def run_lines(root: int, say: Say, records: int, workers: int, folder: Path) -> list[Json]:
    """A sinusoid in coloured noise, by its amplitude over that which is just found."""
    rows = []
    for share in (1.0, 2.0, 8.0):
        tasks = [(root, 77, k) for k in range(records)]
        place = place_of(folder, "line", share)
        found = np.array(spread(partial(_line, share), tasks, workers=workers, place=place))
        seen = found[found[:, 0]]
        steady = seen[seen[:, 1]]
        gate = within(len(steady))
        amplitude, frequency = float(steady[:, 2].mean()), float(steady[:, 3].mean())
        rows.append(
            {
                "amplitude": share * _LINE.amplitude,
                "records": records,
                "found": float(found[:, 0].mean()),
                "called steady": float(seen[:, 1].mean()),
                "amplitude covered": amplitude,
                "frequency covered": frequency,
                **gate.columns(),
                "pass": gate.holds(amplitude, frequency),
            }
        )
        say(json.dumps(rows[-1]))
    return rows


# -- the fit ----------------------------------------------------------------------------------------------


def _fit(task: tuple[int, int, int]) -> Json:
    """One record of a scenario: the spectral fit, and whether the fit in lag is said to disagree."""
    root, scenario, index = task
    chosen = SCENARIOS[scenario]
    record = al.simulate(
        chosen.model,
        rate=chosen.rate,
        duration=chosen.duration,
        seed=_seed(root, 9, scenario, index),
        name="x",
    )
    begun = time.process_time()
    model = fit_spectral(record)
    spent = time.process_time() - begun
    parted = disagreement(
        al.fit(allan_curve(record, threads=1)), ordinates_of(record, power_spectrum(record, "x"))
    )
    return {
        "index": index,
        "seconds": spent,
        "alarm": None if parted is None else parted.words,
        "printed": printed(model),
    }


def run_fits(
    root: int, say: Say, records: int, workers: int, folder: Path
) -> tuple[list[Json], list[Json], list[Json]]:
    """Rows of parameters, of false declarations, and of false alarms between lags and frequencies."""
    parameters, false, alarms = [], [], []
    for i, scenario in enumerate(SCENARIOS):
        tasks = [(root, i, k) for k in range(scenario.count(records))]
        results = spread(
            _fit, tasks, workers=workers, say=say, place=place_of(folder, "spectral", i), chunk=1
        )
        judged = evaluate(scenario, [r["printed"] for r in results])
        for row in judged["parameters"]:
            bound, rms = row["bound"], row["rms"]
            parameters.append(
                {
                    "scenario": scenario.name,
                    "parameter": row["symbol"],
                    "coverage": row["coverage"],
                    "one-sided": "yes" if row["one_sided"] else "",
                    "gate": row["gate"],
                    "rejects": row["rejects"],
                    "pass": row["passes"],
                    "supported": row["supported"],
                    "rms/bound": rms / bound if rms is not None and bound else None,
                }
            )
        false.append(
            {
                "scenario": scenario.name,
                "records": len(results),
                "declared though absent": judged["false"],
                "undecided": judged["undecided"],
                "p below 0.01": judged["goodness_below_0.01"],
                "seconds": float(np.median([r["seconds"] for r in results])),
            }
        )
        share = float(np.mean([r["alarm"] is not None for r in results]))
        gate = at_most(len(results))
        alarms.append({"scenario": scenario.name, "records": len(results), "alarms": share})
        alarms[-1] |= {**gate.columns(), "pass": gate.holds(share)}
        say(json.dumps([judged, alarms[-1]], default=float))
    return parameters, false, alarms


# -- power of the comparison ------------------------------------------------------------------------------


def _hump(y: Array, rng: np.random.Generator, size: float) -> Array:
    band = butter(2, [7.0, 9.0], "bandpass", fs=_RATE, output="sos")
    hump = sosfilt(band, rng.standard_normal(len(y)))
    return np.asarray(y + size * y.std() * hump / hump.std())


def _wandering(y: Array, rng: np.random.Generator, size: float) -> Array:
    turn = 2 * np.pi * 5.3 * np.arange(len(y)) * _DT + 0.02 * np.cumsum(rng.standard_normal(len(y)))
    return np.asarray(y + size * y.std() * np.sin(turn))


def _louder(y: Array, _: np.random.Generator, size: float) -> Array:
    return np.where(np.arange(len(y)) < 0.7 * len(y), y, (1 + size) * y)


def _filtered(y: Array, _: np.random.Generator, size: float) -> Array:
    return np.asarray(sosfilt(butter(1, size, fs=_RATE, output="sos"), y))


def _transient(y: Array, _: np.random.Generator, size: float) -> Array:
    return np.asarray(y + size * y.std() * np.exp(-np.arange(len(y)) / (0.1 * len(y))))


_CASES: dict[str, tuple[Callable[[Array, np.random.Generator, float], Array], tuple[float, ...]]] = {
    "nothing": (lambda y, _, __: y, (0.0,)),
    "band-limited noise of 2 Hz, part of the deviation": (_hump, (0.1, 0.2, 0.4)),
    "a line that wanders, part of the deviation": (_wandering, (0.1, 0.3, 1.0)),
    "white noise louder at the end, by": (_louder, (0.2, 1.0)),
    "one pole of a filter, Hz": (_filtered, (45.0, 20.0, 5.0)),
    "exponential transient, of the deviation": (_transient, (0.3, 1.0)),
}


def _seen(case: str, size: float, task: tuple[int, int]) -> tuple[bool, bool]:
    """Whether lags and frequencies disagree; whether the fit in lag says by itself that something is wrong."""
    model = NoiseModel.of(White(N=0.1), RandomWalk(K=0.01))
    y = al.simulate(model, rate=_RATE, duration=1000.0, seed=_seed(*task), name="x").values("x")
    disturbed = _CASES[case][0](y, np.random.default_rng(task), size)
    record = Recording.from_rate(disturbed, rate=_RATE, unit="rad/s", names="x")
    spectrum = power_spectrum(record, "x")
    alone = without_stable_lines(record, spectrum)
    left = power_spectrum(alone, "x") if any(line.stable for line in spectrum.lines) else spectrum
    try:
        lag = al.fit(allan_curve(alone, threads=1))
    except al.AllaniteError:
        return False, True
    facts = lag.goodness
    said = bool(facts["left_out"] or facts["discrepancy"] or facts["p"] < 0.01)
    return disagreement(lag, ordinates_of(alone, left)) is not None, said


def run_power(root: int, say: Say, records: int, workers: int, folder: Path) -> list[Json]:
    """Share of records in which the comparison says that lags and frequencies disagree."""
    rows = []
    for i, (case, (_, sizes)) in enumerate(_CASES.items()):
        for size in sizes:
            tasks = [(root, 100 + i, k) for k in range(records)]
            place = place_of(folder, "disagree", i, size)
            found = np.array(spread(partial(_seen, case, size), tasks, workers=workers, place=place, chunk=1))
            rows.append(
                {
                    "case": case if math.isclose(size, 0.0) else f"{case} {size:g}",
                    "records": records,
                    "lags and frequencies disagree": float(found[:, 0].mean()),
                    "the fit in lag says so itself": float(found[:, 1].mean()),
                    "either": float(found.any(axis=1).mean()),
                }
            )
            say(json.dumps(rows[-1]))
    return rows
