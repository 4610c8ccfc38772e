# SPDX-License-Identifier: BSD-3-Clause
"""The rows on Earth rate and north of the test battery, put to `align`: poles, wrapping, biases, budget, no north."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.experiments.alignment import AlignmentEstimate, AlignmentPlan, align, predict_alignment
from allanite.experiments.north import mean_direction
from allanite.filtering.simulation import UnitMotion, simulate_unit, true_attitudes
from allanite.noise import Flicker, NoiseModel, White
from allanite.quantities.attitude import angles_of
from allanite.quantities.setup_uncertainty import SetupUncertainty
from allanite.recording.calibration import ACCELEROMETER, AXES, GYRO, Calibration, parameter_names
from allanite.recording.records import ArrayColumn, Recording
from verification.calibration import CHANNELS, CONSUMER, DEG, DEG_H, DEG_RT_H

__all__ = ["BATTERY", "run_battery"]

Json = dict[str, Any]
Array = NDArray[np.float64]
Say = Callable[[str], None]

SILENT = {GYRO: NoiseModel.of(), ACCELEROMETER: NoiseModel.of()}
#: What an estimator is told of a record without noise: far below all that is asked for.
QUIET = {
    GYRO: NoiseModel.of(White(N=1e-6 * DEG_RT_H)),
    ACCELEROMETER: NoiseModel.of(White(N=1e-9), kind="acceleration"),
}
PERFECT = Calibration.nominal(ACCELEROMETER, GYRO, channels=CHANNELS)
#: 2000 records know a standard deviation to 1.6 %.
NEAR = (0.95, 1.05)


def _aligned(motion: UnitMotion, latitude: float, **options: Any) -> tuple[AlignmentEstimate, float]:
    """An estimate and the error of its heading [rad]; `options` of `align`, and "rate", "true", "models", "seed"."""
    record = simulate_unit(
        options.pop("models", SILENT),
        rate=options.pop("rate", 10.0),
        motion=motion,
        latitude=latitude,
        calibration=options.pop("true", None),
        seed=options.pop("seed", 1),
        axes="FLU",
    )
    options = {"model": QUIET, "calibration": PERFECT, "checkpoints": 2, **options}
    return _judged(record, latitude, **options)


def _judged(record: Recording, latitude: float, **options: Any) -> tuple[AlignmentEstimate, float]:
    found = align(record, latitude=latitude, **options)
    true = angles_of(true_attitudes(record, found.last.time)[0])[2]
    error = math.remainder(found.heading - true, 2 * math.pi) if math.isfinite(found.heading) else math.nan
    return found, error


def _row(what: str, expected: str, found: str, passes: bool) -> Json:
    return {"what": what, "expected": expected, "found": found, "passes": bool(passes)}


# -- E1, E3: geometry and the pole ------------------------------------------------------------------------


def _e1(seed: int, count: int) -> list[Json]:
    worst, rates = 0.0, list[float]()
    for k in range(12):
        motion = UnitMotion.still((0, 0, 30 * k * DEG), duration=60.0)
        found, error = _aligned(motion, math.pi / 4, spans=[[0, 600]])
        worst, rates = max(worst, abs(error)), [*rates, found.horizontal_rate / DEG_H]
    off = float(np.abs(np.array(rates) - 10.635640598320).max())
    return [
        _row(
            "heading, twelve of them, latitude 45", "1e-9 deg", f"{worst / DEG:.1e} deg", worst / DEG < 1e-9
        ),
        _row("horizontal rate", "10.635640598320 deg/h", f"{rates[0]:.12f} deg/h", off < 1e-11),
    ]


_POLE = {0.0: 0.0038093, 60.0: 0.0076186, 80.0: 0.021937, 89.0: 0.21827, 89.99: 21.826}


def _e3(seed: int, count: int) -> list[Json]:
    """A rate known to 0.001 deg/h: by white noise over the record."""
    rows = []
    duration = 600.0
    model = {
        GYRO: NoiseModel.of(White(N=0.001 * DEG_H * math.sqrt(duration))),
        ACCELEROMETER: QUIET[ACCELEROMETER],
    }
    for degrees, expected in _POLE.items():
        motion = UnitMotion.still(duration=duration)
        spans = [[0, round(duration * 10)]]
        found, _ = _aligned(motion, degrees * DEG, model=model, spans=spans)
        across = math.sqrt(found.horizontal_covariance[1, 1]) / found.expected_rate
        plan = predict_alignment(
            plan=AlignmentPlan.static(duration),
            model=model,
            latitude=degrees * DEG,
            rate=10.0,
            calibration=PERFECT,
        )
        stated = min(found.heading_sd, across)  # near the pole there is no heading, and its sd infinite
        both = stated / DEG, plan.heading_sd / DEG
        holds = all(abs(x / expected - 1) < 1e-3 for x in both)
        words = " and ".join(f"{x:.5g}" for x in both)
        rows.append(_row(f"heading sd at latitude {degrees:g}", f"{expected:g} deg", f"{words} deg", holds))
    try:
        _aligned(UnitMotion.still(duration=duration), math.pi / 2)
        said = "a heading"
    except InputError as error:
        said = str(error)
    return [*rows, _row("at the pole", "undefined", said.split(":")[0], "undefined" in said)]


# -- E5, E6: wrapping and bias ----------------------------------------------------------------------------


def _e5(seed: int, count: int) -> list[Json]:
    models = {**QUIET, GYRO: NoiseModel.of(White(N=0.02 * DEG_RT_H))}
    headings, wraps = [], []
    for degrees in (359.9, 0.1):
        motion = UnitMotion.still((0, 0, degrees * DEG), duration=300.0)
        found, _ = _aligned(motion, 0.5, model=models, spans=[[0, 3000]])
        headings.append(found.heading)
        wraps.append(found.interval.contains(0.0) and not found.interval.contains(math.pi))
    mean = math.remainder(mean_direction(headings), 2 * math.pi) / DEG
    return [
        _row("mean of the headings 359.9 and 0.1", "0 deg", f"{mean:.1e} deg", abs(mean) < 1e-6),
        _row("their intervals", "hold 0, not 180", f"{wraps}", all(wraps)),
    ]


def _biased(size: float) -> Calibration:
    values = PERFECT.values.copy()
    values[[PERFECT.names.index(f"gyro.bias_{a}") for a in AXES]] = size * np.array([1.0, -0.7, 0.4])
    return PERFECT.with_values(values)


def _e6(seed: int, count: int) -> list[Json]:
    """The shift that a bias of 1000 deg/h brings, with the same turns; the calibration knows of biases of that size."""
    rows = []
    unknown = {"calibration": PERFECT, "bias_repeatability": (1e4 * DEG_H, 0.0)}
    for headings in ((0.0, 180.0), (0.0, 90.0, 180.0, 270.0)):
        attitudes = [(0.0, 0.0, (20.0 + h) * DEG) for h in headings]
        for rate in (100.0, 1000.0):
            motion = UnitMotion.positions(attitudes, dwell=20.0, turn=4.0)
            edges = [[round(24 * k * rate), round((24 * k + 20) * rate)] for k in range(len(headings))]
            options = {"rate": rate, "spans": edges, **unknown}
            _, without = _aligned(motion, 0.6, **options)
            _, biased = _aligned(motion, 0.6, true=_biased(1e3 * DEG_H), **options)
            shift = abs(biased - without) / DEG
            rows.append(
                _row(
                    f"{len(headings)} positions, bias of 1000 deg/h, {rate:g} Hz", "shift below 1e-9 deg",
                    f"{shift:.1e} deg", shift < 1e-9,
                )
            )  # fmt: skip
    return rows


# -- E7: the budget ---------------------------------------------------------------------------------------


def _e7(seed: int, count: int) -> list[Json]:
    """One source at a time, without noise; static at random headings and attitudes."""
    cases: dict[str, tuple[str, Callable[[np.random.Generator], Calibration], Calibration, SetupUncertainty]] = {
        "gyro scale factors, 1000 ppm": (
            "gyro scale and misalignment", _off("gyro.scale", 1e-3), _knowing("gyro.scale", 1e-3), SetupUncertainty(),
        ),
        "gyro misalignments, 1 mrad": (
            "gyro scale and misalignment", _off("gyro.misalignment", 1e-3), _knowing("gyro.misalignment", 1e-3),
            SetupUncertainty(),
        ),
        "tilt between the triads, 0.1 deg": ("tilt", _leaning(0.1 * DEG), PERFECT, SetupUncertainty(tilt=0.1 * DEG)),
        "accelerometer biases, 1 mg": (
            "accelerometer calibration", _off("accelerometer.bias", 9.8e-3), _knowing("accelerometer.bias", 9.8e-3),
            SetupUncertainty(),
        ),
        "gyro biases, 0.01 deg/h": (
            "gyro bias", _off("gyro.bias", 0.01 * DEG_H), _knowing("gyro.bias", 0.01 * DEG_H), SetupUncertainty(),
        ),
    }  # fmt: skip
    rows = []
    for k, (what, (source, draw, certificate, stated)) in enumerate(cases.items()):
        rng = np.random.default_rng([seed, 7, k])
        pairs = []
        for _ in range(count):
            attitude = (*(0.2 * rng.standard_normal(2)), rng.uniform(0, 2 * math.pi))
            latitude = rng.uniform(-60, 60) * DEG
            motion = UnitMotion.still(attitude, duration=3.0)
            found, error = _aligned(
                motion,
                latitude,
                rate=1.0,
                true=draw(rng),
                calibration=certificate,
                stated=stated,
                spans=[[0, 3]],
            )
            pairs.append((error, found.budget[source]))
        # pooled: where the first order vanishes, as that of a scale factor does at some headings, a ratio means nothing
        rms = float(np.divide(*np.sqrt(np.mean(np.square(pairs), axis=0))))
        rows.append(_row(what, "rms over budget 0.95 to 1.05", f"{rms:.3f}", NEAR[0] <= rms <= NEAR[1]))
    return rows


def _off(kind: str, size: float) -> Callable[[np.random.Generator], Calibration]:
    """Units whose parameters of a kind are off by so much, rms."""
    hit = np.array([n.rpartition("_")[0] == kind for n in PERFECT.names])
    return lambda rng: PERFECT.with_values(PERFECT.values + size * hit * rng.standard_normal(len(hit)))


def _knowing(kind: str, size: float) -> Calibration:
    return PERFECT.with_repeatability({kind: size})


def _leaning(size: float) -> Callable[[np.random.Generator], Calibration]:
    """Units whose accelerometers are turned against the gyros."""
    names = parameter_names(ACCELEROMETER)

    def draw(rng: np.random.Generator) -> Calibration:
        x, y, z = size * rng.standard_normal(3)
        lean = {"xy": -z, "xz": y, "yx": z, "yz": -x, "zx": -y, "zy": x}
        values = [1.0 if ".scale_" in n else lean.get(n[-2:], 0.0) if "mis" in n else 0.0 for n in names]
        k = len(names)
        return Calibration(
            names=names, values=np.array(values), covariance=np.zeros((k, k)), status=("held",) * k
        )

    return draw


# -- E8: no north -----------------------------------------------------------------------------------------


def _e8(seed: int, count: int) -> list[Json]:
    consumer, tactical = CONSUMER.models, NoiseModel.of(White(N=0.1 * DEG_RT_H), Flicker(B=1 * DEG_H))
    cases: dict[str, Callable[[int], AlignmentEstimate]] = {
        "gyros that do not see the Earth": lambda k: _unseen(k),
        "consumer unit, static": lambda k: _aligned(
            UnitMotion.still((0, 0, k), duration=300.0), 0.8, models=consumer, model=consumer, seed=k,
            calibration=PERFECT, bias_repeatability=(0.5 * DEG, 0.05), true=_biased(0.3 * DEG),
        )[0],
        "consumer unit, nothing known": lambda k: _aligned(
            UnitMotion.still((0, 0, k), duration=300.0), 0.8, models=consumer, model=consumer, seed=k,
            calibration=None, true=_biased(0.3 * DEG),
        )[0],
        "consumer unit, two positions": lambda k: _aligned(
            UnitMotion.two((0, 0, k), dwell=60.0, turn=3.0), 0.8, models=consumer, model=consumer, seed=k, rate=20.0,
            calibration=None, true=_biased(0.3 * DEG),
        )[0],
        "tactical unit, static, bias not known": lambda k: _aligned(
            UnitMotion.still((0, 0, k), duration=300.0), 0.8, models={**consumer, GYRO: tactical},
            model={**consumer, GYRO: tactical}, seed=k, calibration=None, true=_biased(20 * DEG_H),
        )[0],
    }  # fmt: skip
    rows = []
    for what, make in cases.items():
        found = [make(k) for k in range(max(count // 20, 2))]
        full = sum(f.interval.full for f in found)
        verdicts = {v: sum(f.verdict == v for f in found) for v in sorted({f.verdict for f in found})}
        words = ", ".join(f"{v} {n}" for v, n in verdicts.items())
        headings = sum(f.verdict == "resolved" for f in found)
        # noise alone points somewhere with the probability that the confidence leaves
        allowed = 0.05 * len(found) + 3 * math.sqrt(0.05 * len(found))
        rows.append(
            _row(
                what, "no heading; the full circle", f"{words}; full circle {full} of {len(found)}",
                headings <= allowed and len(found) - full <= allowed,
            )
        )  # fmt: skip
    return rows


def _unseen(k: int) -> AlignmentEstimate:
    """A table locked to inertial space: gyros of navigation grade that read their noise alone."""
    model = {**QUIET, GYRO: NoiseModel.of(White(N=0.002 * DEG_RT_H))}
    record = simulate_unit(
        model, rate=10.0, motion=UnitMotion.still((0, 0, k), duration=300.0), latitude=0.8, seed=k, axes="FLU"
    )
    perfect = simulate_unit(
        SILENT,
        rate=10.0,
        motion=UnitMotion.still((0, 0, k), duration=300.0),
        latitude=0.8,
        seed=k,
        axes="FLU",
    )
    columns = list(record.columns)
    for i in range(3):
        noise = record.values(record.names[i]) - perfect.values(record.names[i])
        columns[i] = ArrayColumn(noise)
    locked = replace(record, columns=tuple(columns))
    return align(locked, latitude=0.8, model=model, calibration=PERFECT, spans=[[0, 3000]], checkpoints=2)


BATTERY: dict[str, Callable[[int, int], list[Json]]] = {
    "E1": _e1,
    "E3": _e3,
    "E5": _e5,
    "E6": _e6,
    "E7": _e7,
    "E8": _e8,
}


def run_battery(seed: int, say: Say, count: int = 2000) -> list[Json]:
    """Rows of the battery; `count` records for each row of E7, a twentieth of it for E8."""
    rows = []
    for key, part in BATTERY.items():
        for row in part(seed, count):
            rows.append({"id": key, **row})
            say(f"{rows[-1]}")
    return rows
