# SPDX-License-Identifier: BSD-3-Clause
"""gyroparams and accelparams of MATLAB's imuSensor: a JSON file for loadparams, and a MAT file of version 5 (SI).

A sample has white noise of NoiseDensity sqrt(b), and RandomWalk/sqrt(b) is a step of the walk; b is the sample rate f
where NoiseType is "single-sided", and f/2 where it is "double-sided", its default (setupBandwidth of imuSensor, R2023b;
before NoiseType came, b was f/2). A sample of two-sided density N^2 has the deviation N sqrt(f). So the MAT file has
NoiseType = "single-sided", NoiseDensity = N and RandomWalk = K (the rate random walk, not the angle random walk). The
JSON file cannot say NoiseType: NoiseDensity = sqrt(2) N and RandomWalk = K/sqrt(2) give the same samples by default.

BiasInstability is B of IEEE Std 952: in each sample white noise of that deviation goes through the filter of
BiasInstabilityCoefficients. By default that filter is 1/(1 - 0.5 z^-1), white beyond two samples: nothing slow is
left of the bias instability. The MAT file holds the filter of the fitted process: for a Gauss-Markov bias (sigma, T)
the numerator sigma/B sqrt(1 - phi^2) and the denominator [1, -phi], phi = exp(-1/(f T)), exact at the sample rate.
Flicker without a correlation time has no filter of few coefficients; `fractalcoef(n)` of MATLAB approximates it to n
samples.

loadparams takes an object of parts, each with "Gyroscope" and "Accelerometer", whose values must be numbers (R2020a):
the filter and NoiseType have no place in it.
"""

from __future__ import annotations

import io
import json
import math
import re
from collections.abc import Mapping
from typing import Any, Unpack

import numpy as np

from allanite import __version__
from allanite.errors import InputError
from allanite.exporters.imu import (
    ACCELEROMETER,
    GYROSCOPE,
    B,
    Consumer,
    K,
    MarkovImu,
    N,
    NoiseOptions,
    Program,
    Remark,
    Slot,
    Usage,
    WalkImu,
    gauss_markov_imu,
    white_and_walk,
)
from allanite.exporters.imu.axes import UNITS
from allanite.exporters.imu.json_comments import json_comments
from allanite.exporters.imu.walks import GAUSS_MARKOV
from allanite.noise import SIGMA_PER_B

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "TERMS", "USAGE", "write"]

NAME = "matlab"
JSON_NAME, MAT_NAME = "imu_sensor.json", "imu_sensor.mat"
FILE_NAME = f"{JSON_NAME}, {MAT_NAME}"
SUMMARY = "MATLAB: gyroparams and accelparams of imuSensor, as JSON for loadparams and as a MAT file"
TAKES = "study"
_PARTS = {GYROSCOPE: "Gyroscope", ACCELEROMETER: "Accelerometer"}
USAGE = Usage(
    programs=(Program("MATLAB imuSensor", "imuSensor of R2023b: setupBandwidth; loadparams of R2020a"),),
    slots=tuple(
        slot
        for sensor, part in _PARTS.items()
        for slot in (
            Slot(f"{part}.NoiseDensity", sensor, N, UNITS[sensor][0]),
            Slot(f"{part}.BiasInstability", sensor, B, UNITS[sensor][0].replace("/sqrt(Hz)", "")),
            Slot(f"{part}.RandomWalk", sensor, K, UNITS[sensor][1]),
        )
    ),
    trap=(
        f"{JSON_NAME}: NoiseDensity sqrt(2) larger and RandomWalk sqrt(2) smaller, for loadparams leaves NoiseType at "
        "its default, double-sided, where a sample has the deviation NoiseDensity sqrt(rate/2)"
    ),
)
CONSUMER = Consumer(
    name="MATLAB imuSensor",
    file="imu_sensor",
    usage=USAGE,
    convention=(
        "continuous-time root densities in SI units; imuSensor makes them discrete itself",
        f"{MAT_NAME}: NoiseType single-sided, NoiseDensity = N",
        Remark(f"{MAT_NAME}: RandomWalk = K (rate random walk)", "K", unless="walk"),
        Remark(f"{MAT_NAME}: RandomWalk = walk; BiasInstability is zero", "walk"),
        Remark("BiasInstability = B", "B", unless="walk"),
        Remark("BiasInstability = sigma/1.0760", GAUSS_MARKOV, unless="walk"),
    ),
    per_axis=True,
    simulator=True,
    holds_K=True,
    holds_flicker=True,
)
TERMS = CONSUMER.terms

Json = Mapping[str, Any]

#: Factors of the JSON file, where half of the rate is the band.
_DOUBLE_SIDED = {"NoiseDensity": math.sqrt(2), "BiasInstability": 1.0, "RandomWalk": math.sqrt(0.5)}
_JSON_LOSES = (
    "loadparams leaves the filter of BiasInstability at its default, 1/(1 - 0.5 z^-1): NOTHING SLOW is left of the "
    "bias instability"
)
_FLICKER = (
    "no filter of the flicker is in these files: set BiasInstabilityCoefficients = fractalcoef(n), flicker up to n "
    "samples, or export with a correlation time"
)


def write(
    document: Json, *, part: str = "allanite", **options: Unpack[NoiseOptions]
) -> dict[str, str | bytes]:
    """The two files, by their names.

    Parameters
    ----------
    document : dict
        A study document.
    part : str
        Name of the part in the JSON file, which loadparams asks for.
    **options
        `NoiseOptions`; axes="rms" by default, as this is a simulator. With `walk` the bias is a random walk alone.

    Raises
    ------
    InputError
        A part that MATLAB cannot name, several correlation times in a triad, or what `gauss_markov_imu` refuses.
    """
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,62}", part):
        raise InputError(f"part must be the name of a MATLAB variable, not {part!r}")
    if options.get("walk") is None:
        imu = gauss_markov_imu(document, CONSUMER, **options)
        sensors = {s: _markov(imu, s) for s in imu.noise}
        comments = [*imu.comments, *_filters(sensors)]
        style = imu.style
    else:
        walking = white_and_walk(document, CONSUMER, **options)
        sensors = {s: _walk(walking, s) for s in walking.noise}
        comments, style = list(walking.comments), walking.style
    rate = document["recording"]["rate"]
    return {
        JSON_NAME: _json_text(part, rate, sensors, comments, style),
        MAT_NAME: _mat_bytes(rate, sensors, comments, style),
    }


def _three(values: tuple[float, ...]) -> list[float]:
    return list(values) * (3 if len(values) == 1 else 1)


def _markov(imu: MarkovImu, sensor: str) -> dict[str, Any]:
    """The properties of a sensor whose bias is slow."""
    time = math.nan
    if not any(math.isnan(t) for t in imu.time[sensor]):
        time = imu.common_time(CONSUMER.file, [sensor])
    return {
        "NoiseDensity": _three(imu.noise[sensor]),
        "BiasInstability": _three(imu.B[sensor]),
        "RandomWalk": _three(imu.K[sensor]),
        "T": time,
    }


def _walk(imu: WalkImu, sensor: str) -> dict[str, Any]:
    return {
        "NoiseDensity": _three(imu.noise[sensor]),
        "BiasInstability": [0.0] * 3,
        "RandomWalk": _three(imu.walk[sensor]),
        "T": math.nan,
    }


def _filters(sensors: Mapping[str, Json]) -> list[str]:
    """Comments on what filters the bias instability."""
    lines = [""]
    for sensor, values in sensors.items():
        if not any(values["BiasInstability"]):
            continue
        if math.isnan(values["T"]):
            lines.append(f"{sensor}: {_FLICKER}")
        else:
            lines.append(
                f"{sensor}: the filter of a Gauss-Markov bias of T = {values['T']:.6g} s is in {MAT_NAME}"
            )
    return lines


def _json_text(part: str, rate: float, sensors: Mapping[str, Json], comments: list[str], style: str) -> str:
    slow = [_JSON_LOSES] if any(any(v["BiasInstability"]) for v in sensors.values()) else []
    entries = [
        f"loadparams(sensor, '{JSON_NAME}', '{part}')",
        *comments,
        *slow,
    ]
    lines = ["{", f" {json.dumps(part)}: {{", f'  "SampleRate": {rate:{style}},']
    lines += json_comments(entries, 2)
    for sensor, values in sensors.items():
        lines[-1] += ","
        rows = ",\n".join(
            f'   "{key}": [{", ".join(format(_DOUBLE_SIDED[key] * v, style) for v in value)}]'
            for key, value in values.items()
            if key != "T"
        )
        lines += [f'  "{_PARTS[sensor]}": {{', rows, "  }"]
    return "\n".join([*lines, " }", "}"]) + "\n"


def _mat_bytes(rate: float, sensors: Mapping[str, Json], comments: list[str], style: str) -> bytes:
    from scipy.io import savemat

    content: dict[str, Any] = {"SampleRate": rate}
    for sensor, values in sensors.items():
        rounded: dict[str, Any] = {k: _rounded(v, style) for k, v in values.items() if k != "T"}
        rounded["NoiseType"] = "single-sided"
        if math.isfinite(values["T"]):
            phi = math.exp(-1 / (rate * values["T"]))
            step = SIGMA_PER_B * math.sqrt(-math.expm1(-2 / (rate * values["T"])))
            rounded["BiasInstabilityCoefficients"] = {
                "Numerator": step,
                "Denominator": np.array([[1.0, -phi]]),
            }
        content[_PARTS[sensor]] = rounded
    usage = (
        "s = load('imu_sensor.mat'); p = gyroparams; g = s.imu.Gyroscope; "
        "for f = fieldnames(g)', p.(f{1}) = g.(f{1}); end  % likewise accelparams with s.imu.Accelerometer"
    )
    content["Comments"] = np.array([usage, *(c for c in comments if c.strip())], dtype=object)
    place = io.BytesIO()
    savemat(place, {"imu": content})  # type: ignore[arg-type]  # a file object does
    head = f"MATLAB 5.0 MAT-file, written by allanite {__version__}".ljust(116)
    return head.encode("ascii") + place.getvalue()[116:]  # its own head holds the time of writing


def _rounded(values: list[float], style: str) -> Any:
    """The numbers with the digits of the JSON file."""
    return np.array([[float(format(v, style)) for v in values]])
