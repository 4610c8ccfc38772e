# SPDX-License-Identifier: BSD-3-Clause
"""A self-calibration made by hand, for tests of what is shown: its numbers are plausible, and known."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from allanite.experiments.calibration.checks import CalibrationCheck
from allanite.experiments.calibration.results import (
    CalibrationEstimate,
    CalibrationParameter,
    CalibrationPosition,
    CalibrationTurn,
    EarthSeen,
    ObservationScatter,
)
from allanite.experiments.calibration.verdict import CalibrationCheckKind, CalibrationNoise, ParameterStatus
from allanite.quantities.attitude import rotation
from allanite.quantities.earth import EARTH_RATE
from allanite.recording.calibration import Calibration, parameter_names
from allanite.study.model_file import model_of

__all__ = ["DEG_H", "LEFT_OUT", "MG", "OPEN", "OUTLIER", "estimate"]

MG, DEG_H = 9.80665e-3, math.radians(1) / 3600
OUTLIER, LEFT_OUT = 7, 12
OPEN = ("gyro.scale_z", "gyro.misalignment_xz", "gyro.misalignment_yz")
_SIZES = {"bias": (12 * MG, 40 * DEG_H), "scale": (8e-3, 4e-3), "misalignment": (6e-3, 9e-3)}
_SDS = {"bias": (0.1 * MG, 2 * DEG_H), "scale": (1.5e-4, 4e-4), "misalignment": (2e-4, 5e-4)}
_UPS = (
    (0, 0, 1), (0, 0, -1), (0, 1, 0), (0, -1, 0), (1, 0, 0), (-1, 0, 0), (0, 1, 1), (0, -1, 1), (1, 0, 1),
    (-1, 0, 1), (1, 1, 0), (-1, 1, 0), (1, -1, 0), (-1, -1, 0),
)  # fmt: skip
_ADD = ("on an edge, -x and -y up",)


def estimate(**changes: Any) -> CalibrationEstimate:
    """Fourteen positions, of which one is an outlier and one was left out; three parameters are open."""
    rng = np.random.default_rng(4)
    names = (*parameter_names("accelerometer", frame="z"), *parameter_names("gyro"))
    k = len(names)
    sizes = [_of(_SIZES, n) for n in names]
    values = rng.uniform(-1, 1, k) * sizes + np.array([".scale_" in n for n in names])
    sd = np.array([0.05 if n in OPEN else _of(_SDS, n) for n in names])
    mixed = rng.standard_normal((k, 2 * k))
    mixed = mixed @ mixed.T
    scale = np.sqrt(np.diag(mixed))
    covariance = mixed / np.outer(scale, scale) * np.outer(sd, sd)
    status = tuple("assumed" if n in OPEN else "estimated" for n in names)
    values[[n in OPEN for n in names]] = [1.0 if ".scale_" in n else 0.0 for n in OPEN]
    calibration = Calibration(
        names=names,
        values=values,
        covariance=covariance,
        status=status,
        channels={
            "accelerometer": ("acc_x", "acc_y", "acc_z"),
            "gyro": ("gyro_x", "gyro_y", "gyro_z"),
        },
        units={"accelerometer": "m/s²", "gyro": "rad/s"},
        gravity=9.80665,
        source="twin.parquet",
    )
    parameters = tuple(
        CalibrationParameter(
            name=n,
            unit=_unit(n),
            value=float(v),
            sd=float(s),
            interval=(float(v - 1.96 * s), float(v + 1.96 * s)),
            status=ParameterStatus(w),
            open=1.0 if n in OPEN else 0.0,
            dof=math.inf,
            add=_ADD if n in OPEN else (),
        )
        for n, v, s, w in zip(names, values, sd, status, strict=True)
    )
    found: dict[str, Any] = {
        "calibration": calibration,
        "parameters": parameters,
        "add": _ADD,
        "checks": _checks(),
        "scatter": _scatter(),
        "positions": _positions(rng),
        "turns": _turns(rng),
        "earth": EarthSeen(
            vector=np.array([5e-5, 1e-5, 5e-5]),
            sd=np.full(3, 3e-5),
            length=5e-5,
            length_sd=3e-5,
            expected=EARTH_RATE,
            resolved=False,
        ),
        "gravity": 9.80665,
        "gravity_source": "standard",
        "latitude": None,
        "temperature_span": (24.5, 26.75),
        "models": {
            "acc_x": model_of("N=0.1 m/s/√h"),
            "gyro_x": model_of("N=0.3 deg/√h"),
        },
        "model_source": CalibrationNoise.RECORD,
        "spans_source": "found",
        "confidence": 0.95,
        "rate": 100.0,
        "duration": 169.0,
        "source": "twin.parquet",
    }
    made = CalibrationEstimate(**{**found, **changes})
    return replace(made, verdict=made.judged()[0])


def _of(sizes: Mapping[str, tuple[float, float]], name: str) -> float:
    sensor, _, rest = name.partition(".")
    return sizes[rest.partition("_")[0]][sensor == "gyro"]


def _unit(name: str) -> str:
    if ".bias" in name:
        return "rad/s" if name.startswith("gyro") else "m/s²"
    return "1" if ".scale" in name else "rad"


def _checks() -> tuple[CalibrationCheck, ...]:
    forces, alone = CalibrationCheckKind.FORCES, CalibrationCheckKind.ALONE
    return (
        CalibrationCheck(kind=forces, statistic=61.0, dof=3.0, p=1e-9, passed=False, widens=True),
        CalibrationCheck(kind=alone, statistic=9.2, dof=5.0, p=0.1, passed=True, parameter="bias_z"),
    )


def _scatter() -> tuple[ObservationScatter, ...]:
    facts: dict[str, Any] = {"chi2": 40.0, "dof": 12.0, "sd_dof": 10.0, "ratio": 1.83}
    return (
        ObservationScatter(what="accelerometers at rest", unit="m/s²", sd=0.2 * MG, **facts),
        ObservationScatter(what="gyros at rest", unit="rad/s", sd=0.0, walk=DEG_H, walk_dof=1.0, **facts),
        ObservationScatter(what="turns", unit="rad", sd=0.0, **facts),
    )


def _positions(rng: np.random.Generator) -> tuple[CalibrationPosition, ...]:
    made = []
    for i, up in enumerate(_UPS, 1):
        direction = np.array(up) + 0.05 * rng.standard_normal(3)
        odd, out = i == OUTLIER, i == LEFT_OUT
        made.append(
            CalibrationPosition(
                number=i,
                start=12.5 * (i - 1),
                stop=12.5 * i - 2.5,
                up=direction / np.linalg.norm(direction),
                words=f"position {i} up",
                attitude=np.eye(3),
                heading_known=True,
                temperature=25.0 + 0.1 * i,
                excess=2.5 * MG if odd else float(0.3 * MG * rng.standard_normal()),
                excess_sd=0.3 * MG,
                rate=3 * DEG_H * rng.standard_normal(3),
                rate_sd=np.full(3, 3 * DEG_H),
                misfit=8.2 if odd else math.nan if i == 1 else float(abs(rng.standard_normal())) + 0.3,
                p=1e-9 if odd else 0.4,
                outlier=odd,
                used=not out,
                why="left out" if out else "",
            )
        )
    return tuple(made)


def _turns(rng: np.random.Generator) -> tuple[CalibrationTurn, ...]:
    numbers = [i for i in range(1, len(_UPS) + 1) if i != LEFT_OUT]
    return tuple(
        CalibrationTurn(
            before=a,
            after=b,
            start=12.5 * a - 2.5,
            stop=12.5 * (b - 1),
            angle=math.pi / 2,
            axis=rotation([0, 0, math.pi / 2])[0],
            residual=np.full(3, math.nan) if a == 3 else 1e-3 * rng.standard_normal(3),
            misfit=math.nan if a == 3 else float(abs(rng.standard_normal())) + 0.3,
            p=0.5,
            outlier=False,
            used=a != 3,
            why="clipped" if a == 3 else "",
        )
        for a, b in zip(numbers[:-1], numbers[1:], strict=True)
    )
