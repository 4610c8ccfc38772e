# SPDX-License-Identifier: BSD-3-Clause
"""Coverage of the interval of north (battery rows E4 and E9), and its budget against simulation (row E7).

E4: 100 000 measured vectors at each signal to noise, through the interval of the library. E9: 2000 records with a
bias that wanders while the table is indexed, from samples to verdict. E7: 2000 set-ups with random errors.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

import allanite as al
from allanite.experiments.north import Rotation, find_north
from allanite.experiments.north.circle import direction_set
from allanite.experiments.reversals import Position, Reversals
from allanite.filtering.simulation import Motion, simulate
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from allanite.quantities.earth import EARTH_RATE
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.recording.records import Recording
from verification.gates import within

__all__ = ["SNR", "WANDERING", "run_budget", "run_circle", "run_indexing"]

Json = dict[str, Any]
DEG = math.pi / 180
DEG_H = DEG / 3600
LATITUDE = 45 * DEG
SNR = (0.0, 0.3, 1.0, 2.0, 3.0, 5.0, 10.0, 30.0)
#: Row E4 asks for 0.94; theory says 0.950 to 0.9622.
CIRCLE_GATE = (0.948, 0.965)
QUARTERS = tuple(k * math.pi / 2 for k in range(4))
WHITE = White(N=0.05 * DEG / 60)
WANDERING = {
    "Gauss-Markov": NoiseModel.of(WHITE, GaussMarkov.from_sigma(0.5 * DEG_H, 100.0)),
    "random walk": NoiseModel.of(WHITE, RandomWalk(K=2.0 * DEG_H / 60)),
    "flicker": NoiseModel.of(WHITE, Flicker(B=0.3 * DEG_H)),
}


def run_circle(seed: int, say: Callable[[str], None], runs: int = 100_000) -> list[Json]:
    """Row E4, with unequal and correlated components."""
    factor = np.array([[2.0, 0.0], [-0.9, 0.5]])
    covariance, rows = factor @ factor.T, []
    for number, snr in enumerate(SNR):
        rng = np.random.default_rng([seed, number])
        truth = factor @ (snr * np.array([math.cos(2.0), math.sin(2.0)]))
        psi = math.atan2(truth[1], truth[0])
        arcs = (direction_set(truth + factor @ e, covariance, 0.95) for e in rng.standard_normal((runs, 2)))
        held, width, full = np.array([(a.contains(psi), a.width, a.full) for a in arcs]).mean(axis=0)
        rows.append(
            {
                "signal_to_noise": snr,
                "runs": runs,
                "coverage": round(float(held), 4),
                "mean_width_deg": round(math.degrees(width), 2),
                "whole_circle": round(float(full), 4),
                "passes": bool(CIRCLE_GATE[0] <= held <= CIRCLE_GATE[1]),
            }
        )
        say(f"signal to noise {snr:g}: coverage {held:.4f}, whole circle {full:.3f}")
    return rows


def run_indexing(seed: int, say: Callable[[str], None], runs: int = 2000) -> list[Json]:
    """Row E9: four positions of 30 s, four times; and a table that turns all the time, once a minute."""
    rows = []
    for number, (name, model) in enumerate(WANDERING.items()):
        for kind in ("positions", "rotation"):
            held, errors = 0, []
            for i in range(runs):
                own = np.random.SeedSequence([seed, number, kind == "rotation", i])
                psi = float(np.random.default_rng(own).uniform(0, math.tau))
                found = _found(model, kind, psi, int(own.generate_state(1)[0]))
                held += found.contains(psi)
                errors.append(math.remainder(found.azimuth - psi, math.tau) / found.sd)
            coverage, rms = held / runs, math.sqrt(float(np.mean(np.square(errors))))
            gate = within(runs)
            rows.append(
                {
                    "bias": name,
                    "table": kind,
                    "records": runs,
                    "coverage": coverage,
                    "rms_over_sd": round(rms, 4),
                    **gate.columns(),
                    "passes": gate.holds(coverage),
                }
            )
            say(f"{name}, {kind}: coverage {coverage:.4f}, rms/sd {rms:.3f}")
    return rows


def _found(model: NoiseModel, kind: str, psi: float, seed: int) -> Any:
    n, rate = 960, 2.0
    noise = al.simulate(model, rate=rate, duration=n / rate, seed=seed).values("gyro")
    horizontal = EARTH_RATE * math.cos(LATITUDE)
    if kind == "rotation":
        spin = math.tau / 60
        middle = psi + spin * (np.arange(n) + 0.5) / rate
        shrunk = math.sin(spin / rate / 2) / (spin / rate / 2)
        recording = Recording.from_rate(horizontal * shrunk * np.cos(middle) + noise, rate=rate, unit="rad/s")
        return find_north(recording, model=model, latitude=LATITUDE, rotation=Rotation(rate=spin))
    where = _positions(QUARTERS * 4, 60, rate)
    heading = np.repeat([p.heading for p in where.positions], 60)
    recording = Recording.from_rate(horizontal * np.cos(psi + heading) + noise, rate=rate, unit="rad/s")
    return find_north(recording, model=model, latitude=LATITUDE, positions=where)


def _positions(headings: tuple[float, ...], samples: int, rate: float, dead_time: float = 0.0) -> Reversals:
    places = tuple(
        Position(start=i * samples, stop=(i + 1) * samples, heading=h, sign=0) for i, h in enumerate(headings)
    )
    return Reversals.cut(
        rate=rate,
        n_samples=samples * len(places),
        turns=(),
        positions=places,
        source="file",
        first="unknown",
        dead_time=dead_time,
        guard=0.0,
    )


def run_budget(seed: int, say: Callable[[str], None], runs: int = 2000) -> list[Json]:
    """Row E7: scale factor 1000 ppm, misalignment 1 mrad, tilt 0.1 deg, heading 1 mrad; two axes, two positions.

    Each record has random errors of one kind in the set-up and next to no noise; the spread of the azimuth is held
    against the budget.
    """
    stated = SetupUncertainty(scale=1e-3, tilt=0.1 * DEG, heading=1e-3)
    rows = []
    for number, term in enumerate(("scale factor", "misalignment", "tilt", "heading")):
        rng = np.random.default_rng([seed, number])
        found = [_setup(rng, term, stated) for _ in range(runs)]
        spread = math.sqrt(float(np.mean([error**2 for error, _ in found])))
        said = float(np.mean([budget for _, budget in found]))
        rows.append(
            {
                "term": term,
                "records": runs,
                "simulated_mrad": round(1e3 * spread, 4),
                "budget_mrad": round(1e3 * said, 4),
                "passes": bool(abs(spread / said - 1) <= 0.05),
            }
        )
        say(f"{term}: simulated {1e3 * spread:.4f} mrad, budget {1e3 * said:.4f} mrad")
    return rows


def _setup(rng: np.random.Generator, term: str, stated: SetupUncertainty) -> tuple[float, float]:
    """Error of the azimuth, and the budget's term."""
    silent = NoiseModel.of(White(N=1e-14))
    psi, right = 35 * DEG, math.pi / 2
    scale, axes = {"x": 0.0, "y": 0.0}, {"x": 0.0, "y": right}
    options: dict[str, Any] = {"turn_time": (0.1, 0.1), "coupling": 0.0}
    first, second = rng.standard_normal(2)
    if term == "scale factor":
        scale = {"x": 1e-3 * first, "y": 1e-3 * second}
    elif term == "misalignment":
        axes = {"x": 1e-3 * first, "y": right + 1e-3 * second}
    elif term == "tilt":  # 0.1 deg towards the north and towards the east
        options["table_tilt"] = stated.tilt * math.hypot(first, second)
        options["table_tilt_heading"] = math.atan2(second, first)
    else:
        options["pointing_sd"] = stated.heading
    motion = Motion.positions([psi, psi + math.pi], 10.0, axes=axes, **options)
    recording = simulate(
        {"x": silent, "y": silent},
        rate=4.0,
        duration=80.0,
        seed=int(rng.integers(2**31)),
        motion=motion,
        latitude=LATITUDE,
        scale_error=scale,
    )
    found = find_north(
        recording,
        model=silent,
        latitude=LATITUDE,
        positions=_positions((0.0, math.pi) * 4, 40, 4.0, dead_time=1.0),
        channels=["x", "y"],
        stated=stated,
        misalignment=1e-3,
    )
    return math.remainder(found.azimuth - psi, math.tau), found.budget[term]
