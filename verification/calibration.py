# SPDX-License-Identifier: BSD-3-Clause
"""Do the intervals of a calibration and of an alignment hold? Whole records of six designs, over and over.

Every twin has its own unit (all parameters of both triads drawn anew), its own attitudes, missed by the operator's
hand, its own place on the Earth and its own noise. Records are full ones: samples at rest and in the turns; static
spans, turns and positions are found by the tool. The noise models, the latitude and gravity are given and true.

Flicker has no end at low frequencies, so what it does to a record as a whole, and with it the sd of a bias, is a matter
of convention: in the estimators its band ends at five records, and a simulated record holds 0.74 to 1.02 of B^2, by its
number of samples, in place of 0.869. The sample rates here are those at which it holds 0.84 to 0.87.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.calibration import CalibrationEstimate, Prediction
from allanite.filtering.simulation import UnitMotion, simulate_unit, true_attitudes
from allanite.noise import Flicker, NoiseModel, White
from allanite.quantities.attitude import angles_of, rotation
from allanite.recording.calibration import ACCELEROMETER, GYRO, Calibration, parameter_names
from allanite.recording.records import Recording
from verification.gates import within
from verification.spread import Say, place_of, spread

__all__ = ["ALIGNMENTS", "CALIBRATIONS", "NEAR", "align_twin", "calibrate_twin", "run_calibration"]

Json = dict[str, Any]
Array = NDArray[np.float64]

DEG = math.pi / 180
DEG_H, DEG_RT_H, G = DEG / 3600, DEG / 60, 9.80665
#: Band of the heading's sd against its prediction.
NEAR = (0.95, 1.05)
CHANNELS = {
    GYRO: ("gyro_x", "gyro_y", "gyro_z"),
    ACCELEROMETER: ("acc_x", "acc_y", "acc_z"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Grade:
    """A class of unit: noise of its gyros and accelerometers, and standard deviations of their errors.

    Attributes
    ----------
    N, B : (float, float)
        White noise [deg/rt-h], [m/s/rt-s] and flicker [deg/h], [g], of gyros and accelerometers.
    bias : (float, float)
        [deg/h], [g].
    scale, misalignment : (float, float)
        Relative, and [rad].
    """

    N: tuple[float, float]
    B: tuple[float, float]
    bias: tuple[float, float]
    scale: tuple[float, float]
    misalignment: tuple[float, float]

    @property
    def models(self) -> dict[str, NoiseModel]:
        """Of the simulation, and given to the estimators."""
        return {
            GYRO: NoiseModel.of(White(N=self.N[0] * DEG_RT_H), Flicker(B=self.B[0] * DEG_H)),
            ACCELEROMETER: NoiseModel.of(White(N=self.N[1]), Flicker(B=self.B[1] * G), kind="acceleration"),
        }

    def drawn(self, rng: np.random.Generator) -> Calibration:
        """A unit of this grade; its body is that of the accelerometers, z first."""
        names = parameter_names(ACCELEROMETER, frame="z") + parameter_names(GYRO)
        values = np.array([self._drawn(name, rng) for name in names])
        k = len(names)
        return Calibration(
            names=names,
            values=values,
            covariance=np.zeros((k, k)),
            status=("held",) * k,
            channels=CHANNELS,
            units={GYRO: "rad/s", ACCELEROMETER: "m/s²"},
        )

    def _drawn(self, name: str, rng: np.random.Generator) -> float:
        sensor, kind = name.split(".")
        i = 0 if sensor == GYRO else 1
        if kind.startswith("bias"):
            return float(self.bias[i] * (DEG_H, G)[i] * rng.standard_normal())
        if kind.startswith("scale"):
            return float(1 + self.scale[i] * rng.standard_normal())
        return float(self.misalignment[i] * rng.standard_normal())


NAVIGATION = Grade(
    N=(0.002, 5e-5), B=(0.003, 3e-6), bias=(0.1, 1e-4), scale=(1e-4, 2e-4), misalignment=(5e-4, 5e-4)
)
TACTICAL = Grade(
    N=(0.1, 5e-4), B=(1.0, 3e-5), bias=(30.0, 5e-3), scale=(2e-3, 2e-3), misalignment=(2e-3, 2e-3)
)
CONSUMER = Grade(
    N=(0.4, 2e-3), B=(10.0, 4e-5), bias=(2000.0, 3e-2), scale=(1e-2, 1e-2), misalignment=(1e-2, 1e-2)
)


# -- calibration ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class CalibrationDesign:
    """A unit set to positions."""

    grade: Grade
    rate: float
    motion: Callable[[np.random.Generator], UnitMotion]
    number: int


def _faces(rng: np.random.Generator) -> UnitMotion:
    return UnitMotion.faces(
        dwell=60.0, turn=(3.0, 6.0), heading=float(rng.uniform(0, 2 * math.pi)), pointing_sd=0.5 * DEG
    )


def _faces_twice(rng: np.random.Generator) -> UnitMotion:
    """Once more, turned by a quarter about the vertical."""
    heading = float(rng.uniform(0, 2 * math.pi))
    once = [UnitMotion.faces(dwell=1.0, heading=heading + k * math.pi / 2).attitudes for k in (0, 1)]
    return UnitMotion.positions(np.concatenate(once), dwell=60.0, turn=(3.0, 6.0), pointing_sd=0.5 * DEG)


def _nineteen(rng: np.random.Generator) -> UnitMotion:
    return UnitMotion.nineteen(
        dwell=180.0, turn=9.0, heading=float(rng.uniform(0, 2 * math.pi)), pointing_sd=0.1 * DEG
    )


def _in_hand(rng: np.random.Generator) -> UnitMotion:
    heading = rotation(
        [0.0, 0.0, rng.uniform(0, 2 * math.pi)]
    )  # north is anywhere, and the gyros do not see it
    attitudes = heading @ UnitMotion.icosahedron(30, dwell=1.0).attitudes
    return UnitMotion.positions(
        attitudes, dwell=3.0, turn=(0.8, 1.6), pointing_sd=5 * DEG, tremor=0.2 * DEG, sway=0.002
    )


CALIBRATIONS = {
    "six faces, tactical": CalibrationDesign(grade=TACTICAL, rate=30.0, motion=_faces, number=1),
    "six faces twice, tactical": CalibrationDesign(grade=TACTICAL, rate=50.0, motion=_faces_twice, number=7),
    "nineteen positions, navigation": CalibrationDesign(
        grade=NAVIGATION, rate=10.0, motion=_nineteen, number=2
    ),
    "thirty poses by hand, consumer": CalibrationDesign(
        grade=CONSUMER, rate=100.0, motion=_in_hand, number=3
    ),
}


def _place(rng: np.random.Generator) -> tuple[float, float]:
    """A latitude [rad] and a height [m]."""
    return float(rng.choice([-1, 1]) * rng.uniform(0.0, 60.0) * DEG), float(rng.uniform(0.0, 2000.0))


def calibration_record(name: str, seed: int, number: int) -> tuple[Recording, Calibration]:
    """One twin: its record, and its true errors."""
    design = CALIBRATIONS[name]
    rng = np.random.default_rng([seed, design.number, number])
    true = design.grade.drawn(rng)
    latitude, height = _place(rng)
    record = simulate_unit(
        design.grade.models,
        rate=design.rate,
        motion=design.motion(rng),
        latitude=latitude,
        height=height,
        calibration=true,
        seed=int(rng.integers(2**31)),
        axes="FRD",
    )
    return record, true


def calibrate_twin(job: tuple[int, str, int]) -> Json:
    """Errors, standard deviations and intervals of one twin."""
    from allanite.experiments.calibration import calibrate

    seed, name, number = job
    record, true = calibration_record(name, seed, number)
    truth = record.history[-1]
    begun = time.process_time()
    found = calibrate(
        record,
        model=_by_channel(CALIBRATIONS[name].grade.models),
        latitude=truth["latitude"],
        gravity=truth["gravity"],
    )
    seconds = time.process_time() - begun
    plan = _planned(record, true, found, CALIBRATIONS[name].grade.models)
    parameters = {}
    for p in found.parameters:
        if p.name in true.names:
            value = true[p.name][0]
            inside = p.interval[0] <= value <= p.interval[1]
            planned = None if plan is None else plan[p.name]
            parameters[p.name] = [p.value - value, p.sd, bool(inside), p.status, planned]
    return {
        "verdict": found.verdict,
        "parameters": parameters,
        "positions": [len(found.positions), len(truth["motion"]["positions"])],
        "inflated": found.inflated,
        "outliers": len(found.outliers),
        "failed": [c.name for c in found.checks if not c.passed],
        "seconds": seconds,
    }


def _planned(
    record: Recording, true: Calibration, found: CalibrationEstimate, models: dict[str, NoiseModel]
) -> Prediction | None:
    """The prediction for the true attitudes, with the times at rest that were usable."""
    from allanite.experiments.calibration import predict

    truth = record.history[-1]
    positions = truth["motion"]["positions"]
    if len(found.positions) != len(positions):
        return None
    start, stop = (np.array([getattr(p, end) for p in found.positions]) for end in ("start", "stop"))
    return predict(
        np.array([p["attitude"] for p in positions]),
        dwell=stop - start,
        turn=start[1:] - stop[:-1],
        models=models,
        latitude=truth["latitude"],
        gravity=truth["gravity"],
        calibration=true,
        rate=record.rate,
    )


def _by_channel(models: dict[str, NoiseModel]) -> dict[str, NoiseModel]:
    return {channel: models[sensor] for sensor, channels in CHANNELS.items() for channel in channels}


# -- alignment --------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class AlignmentDesign:
    """A calibrated unit that finds its attitude.

    Attributes
    ----------
    known : Grade
        Of the errors that the calibration leaves; its noise plays no part.
    repeatability : (float, float)
        Of the biases from one switching-on to the next: [deg/h], [g].
    """

    grade: Grade
    known: Grade
    repeatability: tuple[float, float]
    rate: float
    tilt: float
    motion: Callable[[Array], UnitMotion]
    plan: Callable[[Array], Any]
    number: int

    @property
    def repeated(self) -> tuple[float, float]:
        """The repeatability in SI."""
        return self.repeatability[0] * DEG_H, self.repeatability[1] * G


def _known(bias: tuple[float, float], scale: tuple[float, float], misalignment: tuple[float, float]) -> Grade:
    return Grade(N=(0.0, 0.0), B=(0.0, 0.0), bias=bias, scale=scale, misalignment=misalignment)


def _two(attitude: Array) -> UnitMotion:
    return UnitMotion.two(attitude, dwell=297.5, turn=5.0, pointing_sd=0.2 * DEG)


def _two_plan(attitude: Array) -> Any:
    from allanite.experiments.alignment import AlignmentPlan

    after = _turned(attitude)
    return AlignmentPlan(attitudes=(tuple(attitude.tolist()), after), dwell=297.5, turn=5.0)


def _turned(attitude: Array) -> tuple[float, float, float]:
    """Half a turn about the vertical."""
    roll, pitch, heading = attitude.tolist()
    return roll, pitch, (heading + math.pi) % (2 * math.pi)


def _still(attitude: Array) -> UnitMotion:
    return UnitMotion.still(attitude, duration=600.0)


def _still_plan(attitude: Array) -> Any:
    from allanite.experiments.alignment import AlignmentPlan

    return AlignmentPlan(attitudes=(tuple(attitude.tolist()),), dwell=600.0)


def _rotating(attitude: Array) -> UnitMotion:
    roll, pitch, heading = attitude.tolist()
    return UnitMotion.rotation(6 * DEG, 600.0, tilt=(roll, pitch), heading=heading)


def _rotating_plan(attitude: Array) -> Any:
    from allanite.experiments.alignment import AlignmentPlan

    return AlignmentPlan(attitudes=(tuple(attitude.tolist()),), dwell=600.0, rate=6 * DEG)


ALIGNMENTS = {
    "two positions": AlignmentDesign(
        grade=NAVIGATION,
        known=_known((0.1, 5e-5), (5e-5, 5e-5), (5e-5, 5e-5)),
        repeatability=(1.0, 5e-5),
        rate=20.0,
        tilt=2 * DEG,
        motion=_two,
        plan=_two_plan,
        number=4,
    ),
    "static, tilted": AlignmentDesign(
        grade=NAVIGATION,
        known=_known((0.005, 2e-5), (5e-5, 5e-5), (5e-5, 5e-5)),
        repeatability=(0.01, 2e-5),
        rate=20.0,
        tilt=20 * DEG,
        motion=_still,
        plan=_still_plan,
        number=5,
    ),
    "rotation": AlignmentDesign(
        grade=Grade(
            N=(0.01, 1e-4), B=(0.02, 1e-5), bias=(1.0, 1e-4), scale=(1e-4, 2e-4), misalignment=(5e-4, 5e-4)
        ),
        known=_known((0.1, 5e-5), (5e-5, 5e-5), (5e-5, 5e-5)),
        repeatability=(1.0, 5e-5),
        rate=20.0,
        tilt=0.5 * DEG,
        motion=_rotating,
        plan=_rotating_plan,
        number=6,
    ),
}


def alignment_record(name: str, seed: int, number: int) -> tuple[Recording, Calibration, Array]:
    """One twin: its record, what a calibration says of it, and its nominal attitude."""
    design = ALIGNMENTS[name]
    rng = np.random.default_rng([seed, design.number, number])
    true = design.grade.drawn(rng)
    certificate = _certificate(true, design, rng)
    latitude, height = _place(rng)
    roll, pitch = design.tilt * rng.standard_normal(2)
    attitude = np.array([roll, pitch, rng.uniform(0, 2 * math.pi)])
    record = simulate_unit(
        design.grade.models,
        rate=design.rate,
        motion=design.motion(attitude),
        latitude=latitude,
        height=height,
        calibration=true,
        seed=int(rng.integers(2**31)),
        axes="FLU",
    )
    return record, certificate, attitude


def _certificate(true: Calibration, design: AlignmentDesign, rng: np.random.Generator) -> Calibration:
    """Values off by what the certificate says, and biases besides by their repeatability, which it does not hold."""
    nominal = Calibration.nominal(ACCELEROMETER, GYRO)
    known = design.known.drawn(rng)
    off = known.values - np.array([nominal[n][0] for n in known.names])
    again = dict(zip(("gyro.bias", "accelerometer.bias"), design.repeated, strict=True))
    moved = np.array([again.get(n[:-2], 0.0) for n in true.names]) * rng.standard_normal(len(true.names))
    return Calibration(
        names=true.names,
        values=true.values - off - moved,
        covariance=np.diag([_sd(n, design.known) ** 2 for n in true.names]),
        status=("estimated",) * len(true.names),
        channels=CHANNELS,
        units=true.units,
    )


def _sd(name: str, grade: Grade) -> float:
    sensor, kind = name.split(".")
    i = 0 if sensor == GYRO else 1
    if kind.startswith("bias"):
        return grade.bias[i] * (DEG_H, G)[i]
    return grade.scale[i] if kind.startswith("scale") else grade.misalignment[i]


def align_twin(job: tuple[int, str, int]) -> Json:
    """Errors, standard deviations and intervals of one twin, and what was predicted of it."""
    from allanite.experiments.alignment import align, predict_alignment

    seed, name, number = job
    design = ALIGNMENTS[name]
    record, certificate, attitude = alignment_record(name, seed, number)
    latitude, height = (record.history[-1][k] for k in ("latitude", "height"))
    models = _by_channel(design.grade.models)
    begun = time.process_time()
    same: Json = {
        "model": models,
        "calibration": certificate,
        "latitude": latitude,
        "bias_repeatability": design.repeated,
        "axes": "FLU",
    }
    found = align(record, height=height, **same)
    seconds = time.process_time() - begun
    plan = predict_alignment(plan=design.plan(attitude), rate=design.rate, **same)
    out = {}
    for which, at in (("first", found.first), ("last", found.last)):
        true = angles_of(true_attitudes(record, at.time)[0])
        for k, angle in enumerate(("roll", "pitch")):
            error = math.remainder(getattr(at, angle) - true[k], 2 * math.pi)
            sd = getattr(at, f"{angle}_sd")
            out[f"{angle}, {which}"] = [error, sd, abs(error) <= 1.959964 * sd]
        off = math.remainder(at.heading - true[2], 2 * math.pi) if math.isfinite(at.heading) else None
        out[f"heading, {which}"] = [off, at.heading_sd, at.interval.contains(true[2])]
    return {
        "verdict": found.verdict,
        "angles": out,
        "predicted": [plan.heading_sd, plan.roll_sd, plan.pitch_sd],
        "stands": len(found.stands),
        "inflation": found.inflation,
        "failed": [c.name for c in found.checks if not c.passed],
        "seconds": seconds,
    }


# -- tables -----------------------------------------------------------------------------------------------


def run_calibration(
    count: int,
    seed: int,
    say: Say,
    workers: int = 1,
    cache: Path | None = None,
    designs: tuple[str, ...] = (*CALIBRATIONS, *ALIGNMENTS),
) -> dict[str, list[Json]]:
    """Coverage by design and parameter; `count` twins of each."""
    parts: dict[str, list[Json]] = {}
    summary = []
    for name in designs:
        one = _calibrate if name in CALIBRATIONS else _align
        tasks = [(seed, name, k) for k in range(count)]
        found = spread(one, tasks, workers=workers, say=say, place=place_of(cache, "calibration", name))
        rows = _parameter_rows(found) if name in CALIBRATIONS else _angle_rows(found)
        summary.append(_design_row(name, found, rows))
        parts[f"{name[0].upper()}{name[1:]}"] = rows
        say(f"{summary[-1]}")
    return {"Designs": summary, **parts}


def _calibrate(job: tuple[int, str, int]) -> Json:
    return calibrate_twin(job)


def _align(job: tuple[int, str, int]) -> Json:
    return align_twin(job)


def _design_row(name: str, found: list[Json], rows: list[Json]) -> Json:
    verdicts = {v: sum(f["verdict"] == v for f in found) for v in sorted({f["verdict"] for f in found})}
    failed = [c for f in found for c in f["failed"]]
    return {
        "design": name,
        "twins": len(found),
        "verdicts": verdicts,
        "failed_checks": {c: failed.count(c) for c in sorted(set(failed))},
        "widened": sum(bool(f.get("inflated", f.get("inflation", 1.0) != 1.0)) for f in found),
        "right_positions": sum(f["positions"][0] == f["positions"][1] for f in found)
        if "positions" in found[0]
        else None,
        "seconds_each": round(float(np.median([f["seconds"] for f in found])), 4),
        "parameters": len(rows),
        "hold": sum(r["passes"] for r in rows),
        "passes": all(r["passes"] for r in rows),
    }


def _parameter_rows(found: list[Json]) -> list[Json]:
    """Of the twins in which a parameter is estimated; of one that mostly is not, none."""
    rows = []
    for name in dict.fromkeys(n for f in found for n in f["parameters"]):
        own = [f["parameters"][name] for f in found if name in f["parameters"]]
        estimated = [p for p in own if p[3] == "estimated"]
        if len(estimated) < len(own) / 2:
            continue
        foreseen = [p for p in estimated if p[4] is not None]
        error, stated, planned = (np.array([p[k] for p in foreseen]) for k in (0, 1, 4))
        rows.append(
            {
                "parameter": name,
                "estimated": len(estimated),
                **_score([p[:3] for p in estimated]),
                "stated_over_predicted": float(np.median(stated / planned)),
                "rms_over_predicted": float(np.sqrt(np.mean((error / planned) ** 2))),
            }
        )
    return rows


def _angle_rows(found: list[Json]) -> list[Json]:
    rows = []
    for name in found[0]["angles"]:
        row = {"parameter": name, "estimated": len(found), **_score([f["angles"][name] for f in found])}
        k = {"heading, last": 0, "roll, last": 1, "pitch, last": 2}.get(name)
        if k is not None:
            planned = np.array([f["predicted"][k] for f in found])
            error = np.array([f["angles"][name][0] or 0.0 for f in found])
            stated = np.array([f["angles"][name][1] for f in found])
            row["stated_over_predicted"] = float(np.median(stated / planned))
            row["rms_over_predicted"] = float(np.sqrt(np.mean((error / planned) ** 2)))
            if k == 0:
                near = all(
                    NEAR[0] <= row[key] <= NEAR[1] for key in ("stated_over_predicted", "rms_over_predicted")
                )
                row["passes"] = row["passes"] and near
        rows.append(row)
    return rows


def _score(cells: list[list[Any]]) -> Json:
    """Of errors, standard deviations and whether the truth is inside."""
    known = [(e, s) for e, s, _ in cells if e is not None and math.isfinite(s) and s > 0]
    ratio = np.array([e / s for e, s in known])
    coverage, gate = float(np.mean([c[2] for c in cells])), within(len(cells))
    return {
        "sd": float(np.median([s for _, s in known])),
        "coverage": coverage,
        "rms_over_sd": float(np.sqrt(np.mean(ratio**2))),
        "mean_over_sd": float(np.mean(ratio)),
        **gate.columns(),
        "passes": gate.holds(coverage),
    }
