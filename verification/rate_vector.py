# SPDX-License-Identifier: BSD-3-Clause
"""Does the interval of the length hold the Earth's rate? Three gyros in a vehicle with people in it, over and over.

Every record has its own sensor (white noise, flicker, quantised angles, dither), attitude, and disturbances: sways of
the body on its springs that die away, which come back to the same angle, and now and then a tilt that stays.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from multiprocessing import Pool
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.rate_vector import RateVector, measure_rate_vector
from allanite.filtering.simulation import simulate
from allanite.noise import Flicker, NoiseModel, White
from allanite.quantities.earth import EARTH_RATE
from allanite.recording.records import Recording
from verification.gates import at_least

__all__ = ["KINDS", "run_rate_vector", "vehicle"]

Json = dict[str, Any]
Array = NDArray[np.float64]

ARCSEC = math.pi / 180 / 3600
DEG_H, DEG_RT_H = ARCSEC, math.pi / 180 / 60
RATE = 50.0
#: What disturbs: nothing, sways, sways and tilts that stay below and beyond a degree, people nearly all the time.
KINDS = ("at rest", "sways", "sways and tilts", "sways and turns", "crowded")
_AXES = ("x", "y", "z")


def vehicle(kind: str, seed: int, *, duration: float | None = None) -> tuple[Recording, Json]:
    """A record, and what is in it."""
    rng = np.random.default_rng([seed, 17])
    truth = {
        "N": _log_uniform(rng, 1e-3, 2e-2),  # deg/rt-h
        "B": _log_uniform(rng, 1e-3, 5e-2),  # deg/h
        "step": _log_uniform(rng, 0.01, 0.3),  # arcsec
        "dither": _log_uniform(rng, 0.1, 1.0),  # arcsec
        "duration": duration or _log_uniform(rng, 600.0, 3600.0),
    }
    model = NoiseModel.of(White(N=truth["N"] * DEG_RT_H), Flicker(B=truth["B"] * DEG_H))
    noise = simulate(dict.fromkeys(_AXES, model), rate=RATE, duration=truth["duration"], seed=seed)
    time = np.arange(noise.n_samples + 1) / RATE
    direction = _direction(rng)
    swaying, earth = _motion(rng, kind, time, direction)
    frequency = rng.uniform(5.0, 20.0)
    swaying += (
        truth["dither"] * ARCSEC * np.sin(2 * math.pi * frequency * time[:, None] + rng.uniform(0, 6, 3))
    )
    rates = np.diff(swaying, axis=0) * RATE + earth
    rates += np.stack([noise.values(axis) for axis in _AXES], axis=1)
    step = truth["step"] * ARCSEC
    angle = np.vstack([np.zeros(3), np.cumsum(rates, axis=0) / RATE])
    counts = np.diff(np.floor(angle / step + rng.random(3)), axis=0)
    return Recording.from_rate(counts * step * RATE, rate=RATE, unit="rad/s", names=list(_AXES)), truth


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(np.exp(rng.uniform(math.log(low), math.log(high))))


def _direction(rng: np.random.Generator) -> Array:
    vector = rng.standard_normal(3)
    return np.asarray(vector / np.linalg.norm(vector))


def _motion(rng: np.random.Generator, kind: str, time: Array, direction: Array) -> tuple[Array, Array]:
    """Angle of the body, shape (n + 1, 3) [rad], and what the axes see of the Earth, shape (n, 3) [rad/s]."""
    angle = np.zeros((len(time), 3))
    earth = np.broadcast_to(direction * EARTH_RATE, (len(time) - 1, 3)).copy()
    per_hour = {"at rest": 0, "sways": 40, "sways and tilts": 40, "sways and turns": 40, "crowded": 250}[kind]
    count = rng.poisson(per_hour * time[-1] / 3600)
    # people come in groups: half of the disturbances in the first fifth of the record
    early = rng.random(count) < 0.5
    starts = np.where(early, 0.2, 1.0) * rng.random(count) * time[-1]
    tilts = {"sways and tilts": (1e-4, 1.5e-2), "sways and turns": (1e-2, 0.5)}.get(kind)
    for start in np.sort(starts):
        since = np.maximum(time - start, 0.0)
        amplitude, frequency = _log_uniform(rng, 1e-4, 1e-2), rng.uniform(0.2, 2.0)
        decay = np.exp(-since / rng.uniform(1.0, 10.0))
        angle += amplitude * (decay * np.sin(2 * math.pi * frequency * since))[:, None] * _direction(rng)
        if tilts and rng.random() < 0.15:
            turn = _log_uniform(rng, *tilts) * _direction(rng)
            done = 0.5 - 0.5 * np.cos(math.pi * np.clip(since / rng.uniform(1.0, 3.0), 0.0, 1.0))
            angle += done[:, None] * turn
            after = _rotated(earth[-1], -turn)
            earth += 0.5 * (done[1:] + done[:-1])[:, None] * (after - earth[-1])
    return angle, earth


def _rotated(vector: Array, by: Array) -> Array:
    """Rodrigues' formula."""
    angle = float(np.linalg.norm(by))
    axis = by / angle
    return np.asarray(
        vector * math.cos(angle)
        + np.cross(axis, vector) * math.sin(angle)
        + axis * (axis @ vector) * (1 - math.cos(angle))
    )


def _one(job: tuple[str, bool, int]) -> Json:
    kind, with_model, seed = job
    recording, truth = vehicle(kind, seed)
    model = (
        NoiseModel.of(White(N=truth["N"] * DEG_RT_H), Flicker(B=truth["B"] * DEG_H)) if with_model else None
    )
    return {**truth, **summary(measure_rate_vector(recording, model=model))}


def summary(found: RateVector) -> Json:
    """What is counted of one record."""
    return {
        "verdict": found.verdict,
        "error": (found.length - EARTH_RATE) / DEG_H,
        "sd": found.sd / DEG_H,
        "inside": found.interval[0] <= EARTH_RATE <= found.interval[1],
        "share": found.share,
        "turns": len(found.turns) - 1,
    }


def run_rate_vector(
    seed: int, say: Callable[[str], None], *, records: int = 1000, workers: int = 2
) -> list[Json]:
    """Coverage of the 95 % interval, one row for each kind of disturbance, without and with the sensor's noise model.

    "sd_ratio" is the robust spread of the errors over the stated standard deviations, "rms_ratio" their root mean
    square: below one, the interval is wider than it need be. "wrong" counts errors beyond three of them.
    """
    rows = []
    for with_model in (False, True):
        for k, kind in enumerate(KINDS):
            jobs = [(kind, with_model, seed + 100_000 * k + i) for i in range(records)]
            with Pool(workers) as pool:
                found = pool.map(_one, jobs, chunksize=4)
            rows.append({"kind": kind, "model": "given" if with_model else "none", **_row(found)})
            say(f"{rows[-1]}")
    return rows


def _row(found: list[Json]) -> Json:
    stated = [f for f in found if math.isfinite(f["error"])]
    score = np.array([f["error"] / f["sd"] for f in stated])
    coverage = sum(f["inside"] for f in stated) / max(len(stated), 1)
    gate = at_least(len(stated))  # an interval may be wider, not narrower
    return {
        "records": len(found),
        "with_number": len(stated),
        "coverage": coverage,
        "sd_ratio": round(float(np.median(np.abs(score)) / 0.6745), 3),
        "rms_ratio": round(float(np.sqrt(np.mean(score**2))), 3),
        "wrong": int((np.abs(score) > 3).sum()),
        "resolved": sum(f["verdict"] == "resolved" for f in found),
        "share_used": round(float(np.median([f["share"] for f in found])), 3),
        **gate.columns(),
        "passes": gate.holds(coverage),
    }
