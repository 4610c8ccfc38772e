# SPDX-License-Identifier: BSD-3-Clause
"""Noise models out of the files of other programs.

Kalibr's imu.yaml (that of allan_variance_ros too), OpenVINS, ORB-SLAM3, OKVIS
    Root densities in SI, continuous: white noise and a random walk of the bias. What the walk holds (the random walk
    alone, or bias instability with it) the file does not say.
imuSensor of MATLAB as JSON
    NoiseDensity, BiasInstability and RandomWalk of gyroparams and accelparams, by axis: the noise that imuSensor makes
    of them. Its default NoiseType, "double-sided", gives a sample the deviation NoiseDensity sqrt(rate/2): N is
    NoiseDensity/sqrt(2) there, and K is sqrt(2) RandomWalk.

Files that do not say what their numbers are, are refused with the reason: those of imu_utils, whose "walk" is a bias
instability, and whose noise is the deviation of one sample in some of them; and those of VINS, which are of one step at
a rate that they do not name.

References
----------
.. [1] https://github.com/ethz-asl/kalibr/wiki/IMU-Noise-Model
.. [2] MathWorks documentation of gyroparams and of imuSensor.loadparams.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from difflib import get_close_matches
from pathlib import Path
from typing import Any

from allanite.errors import FormatError, InputError
from allanite.noise import Flicker, GaussMarkov, NoiseModel, RandomWalk, TermType, White
from allanite.noise.datasheet import ENTRIES
from allanite.plain_files.yaml_text import read_yaml_texts

__all__ = ["models_of_matlab", "models_of_yaml"]

Json = Mapping[str, Any]
RoleModels = tuple[dict[str, NoiseModel], float | None]

_ROLES = {"gyro": "rate", "accelerometer": "acceleration"}


# -- YAML -------------------------------------------------------------------------------------------------------

#: Program -> keys of N and of the walk by role, and that of the rate.
_DENSITIES: Mapping[str, tuple[Mapping[str, tuple[str, str]], str]] = {
    "Kalibr": (
        {
            "gyro": ("gyroscope_noise_density", "gyroscope_random_walk"),
            "accelerometer": ("accelerometer_noise_density", "accelerometer_random_walk"),
        },
        "update_rate",
    ),
    "ORB-SLAM3": (
        {
            "gyro": ("IMU.NoiseGyro", "IMU.GyroWalk"),
            "accelerometer": ("IMU.NoiseAcc", "IMU.AccWalk"),
        },
        "IMU.Frequency",
    ),
    "OKVIS": (
        {"gyro": ("sigma_g_c", "sigma_gw_c"), "accelerometer": ("sigma_a_c", "sigma_aw_c")},
        "imu_rate",
    ),
}
_NEAR = 0.85
_VINS = frozenset({"gyr_n", "gyr_w", "acc_n", "acc_w"})
_OF_ALLAN_VARIANCE_ROS = frozenset({"imu_topic", "imu_rate", "measure_rate", "sequence_time"})


def models_of_yaml(path: Path) -> RoleModels | None:
    """Noise models of a configuration of another program, and its rate [Hz].

    Returns
    -------
    tuple, or None
        None where it is none of them.

    Raises
    ------
    InputError
        A file whose numbers do not say what they are, a key that is misspelt, one that is missing, or no noise at all.
    FormatError
        A value that is no number, or not a positive one.
    """
    texts = _loaded(path)
    if texts is None:
        return None
    sections = [texts, *(value for value in texts.values() if isinstance(value, Mapping))]
    _refuse_unclear(path, texts, sections)
    for program, (keys, rate) in _DENSITIES.items():
        for section in sections:
            if _is_of(section, keys):
                return _densities(path, program, section, keys, rate)
    return None


def _loaded(path: Path) -> Json | None:
    """The mapping of a file with all values as text; None where it cannot be one of these."""
    try:
        texts = read_yaml_texts(path, "configuration of a program")
    except FormatError:
        return None
    return texts if isinstance(texts, Mapping) and all(isinstance(key, str) for key in texts) else None


def _refuse_unclear(path: Path, texts: Json, sections: list[Json]) -> None:
    inner = [
        {*section, *(k for v in section.values() if isinstance(v, Mapping) for k in v)}
        for section in sections
    ]
    if texts.get("type") == "IMU" and any(_VINS & keys for keys in inner):
        raise InputError(
            f"{path} is from imu_utils, and its numbers are not what their names suggest: gyr_w and acc_w are bias "
            "instabilities, not random walks, and gyr_n and acc_n are root densities in some files and deviations of "
            "one sample (times the root of the rate) in others. State the known coefficients: 'N=0.3 "
            "deg/√h, B=5 deg/h'; or fit the record itself"
        )
    if any(_VINS & {*section} for section in sections):
        raise InputError(
            f"{path} is a configuration of VINS: gyr_n and gyr_w apply to one step at the rate of the "
            "IMU, which is not in the file. With the rate f in Hz, N = gyr_n/√(2 f) and K = gyr_w/√f: "
            "state them as 'N=… rad/s/√Hz, K=… rad/s/√s'"
        )
    if len(_OF_ALLAN_VARIANCE_ROS & {*texts}) >= 2 and "update_rate" not in texts:
        raise InputError(
            f"{path} is the configuration of allan_variance_ros for reading a bag, without noise. Use the "
            "imu.yaml that it wrote"
        )


def _is_of(section: Json, keys: Mapping[str, tuple[str, str]]) -> bool:
    names = [key for pair in keys.values() for key in pair]
    return any(name in section or _misspelt(section, name) for name in names)


def _misspelt(section: Json, name: str) -> str:
    """A key that is nearly this one, and none of a data sheet."""
    near = get_close_matches(name, [k for k in section if k not in ENTRIES], 1, _NEAR)
    return near[0] if near and near[0] != name else ""


def _densities(
    path: Path, program: str, section: Json, keys: Mapping[str, tuple[str, str]], rate_key: str
) -> RoleModels:
    names = [key for pair in keys.values() for key in pair]
    for name in names:
        near = _misspelt(section, name)
        if near and near not in names:
            raise InputError(f"{path}: {near!r} is not a key of {program}: did you mean {name!r}?")
    models = {}
    for role, (noise, walk) in keys.items():
        there = [key for key in (noise, walk) if section.get(key) not in (None, "")]
        if not there:
            continue
        if len(there) == 1:
            missing = walk if there == [noise] else noise
            raise InputError(f"{path}: {there[0]} needs {missing}; write 0.0 if there is none")
        n, k = (_number(path, key, section[key]) for key in (noise, walk))
        origin = f"From {path.name} of {program}: white noise and the bias walk, as defined there."
        models[role] = _model(path, role, (White(N=n), RandomWalk(K=k)), origin)
    if not models:
        raise InputError(f"{path} has no noise for {program}: fill in {', '.join(names)}")
    rate = section.get(rate_key)
    return models, None if rate is None else _positive(path, rate_key, rate)


def _model(path: Path, role: str, terms: tuple[TermType, ...], origin: str) -> NoiseModel:
    """The terms that are not zero."""
    kept = tuple(t for t in terms if getattr(t, t.symbols[0]) > 0)
    if not kept:
        raise InputError(f"{path}: the noise of the {role} is zero: that is not a model of a sensor")
    return NoiseModel(terms=kept, kind=_ROLES[role.partition("_")[0]], verdict=origin)


def _number(path: Path, key: str, given: Any) -> float:
    try:
        value = float(given)
    except (TypeError, ValueError):
        raise FormatError(f"{path}: {key} is {given!r}, which is not a number") from None
    if not (math.isfinite(value) and value >= 0):
        raise FormatError(f"{path}: {key} is {given!r}: it cannot be negative or infinite")
    return value


def _positive(path: Path, key: str, given: Any) -> float:
    value = _number(path, key, given)
    if value == 0:
        raise FormatError(f"{path}: {key} is zero")
    return value


# -- MATLAB -----------------------------------------------------------------------------------------------------

_PARTS = {"Gyroscope": "gyro", "Accelerometer": "accelerometer"}
_NOISE = ("NoiseDensity", "BiasInstability", "RandomWalk")
#: NoiseType -> factors that make N of NoiseDensity and K of RandomWalk: its band is the rate, or half of it by default.
_TYPES = {"single-sided": (1.0, 1.0), "double-sided": (math.sqrt(0.5), math.sqrt(2.0))}
#: The default filter of BiasInstability: nothing slow is left behind it, and nobody means that.
_DEFAULT_FILTER = (1.0, -0.5)


def models_of_matlab(variables: Json, path: Path) -> RoleModels | None:
    """Noise models of gyroparams and accelparams, and the sample rate [Hz] where it stands there.

    Parameters
    ----------
    variables : mapping
        An object of parts as `loadparams` reads it, or one part.

    Returns
    -------
    tuple, or None
        Models by "gyro" and "accelerometer", or by axis ("gyro_x") where the axes differ; None where it is no such
        object.

    Raises
    ------
    InputError
        Several parts, a misspelt property, a NoiseType that is none, or a filter without a sample rate.
    FormatError
        Values that are no numbers.
    """
    parts = {"": variables, **{name: part for name, part in variables.items() if isinstance(part, Mapping)}}
    able = {
        name: part for name, part in parts.items() if any(isinstance(part.get(k), Mapping) for k in _PARTS)
    }
    if not able:
        return None
    if len(able) > 1:
        raise InputError(f"{path} holds several parts ({', '.join(able)}): keep one of them in the file")
    part = next(iter(able.values()))
    rate = None if "SampleRate" not in part else _positive(path, "SampleRate", part["SampleRate"])
    models: dict[str, NoiseModel] = {}
    for key, role in _PARTS.items():
        if isinstance(part.get(key), Mapping):
            models |= _of_sensor(path, role, key, part[key], rate)
    return models, rate


def _of_sensor(
    path: Path, role: str, key: str, properties: Json, rate: float | None
) -> dict[str, NoiseModel]:
    for name in properties:
        near = get_close_matches(name, _NOISE, 1, _NEAR)
        if near and name not in _NOISE:
            raise InputError(f"{path}: {name!r} is not a property of {key}: did you mean {near[0]!r}?")
    kind = str(properties.get("NoiseType", "double-sided"))
    if kind not in _TYPES:
        near = get_close_matches(kind, _TYPES, 1, 0.3)
        meant = f"; did you mean {near[0]!r}?" if near else ""
        raise InputError(
            f"{path}: NoiseType of {key} must be {' or '.join(map(repr, _TYPES))}, not {kind!r}{meant}"
        )
    axes = {name: _axes(path, f"{key}.{name}", properties.get(name, 0.0)) for name in _NOISE}
    if all(len(set(values)) == 1 for values in axes.values()):
        names = {role: 0}
    else:
        names = {f"{role}_{axis}": i for i, axis in enumerate("xyz")}
    of_noise, of_walk = _TYPES[kind]
    bias = _filter(path, key, properties.get("BiasInstabilityCoefficients"), rate)
    return {
        name: _model(
            path,
            name,
            (
                White(N=of_noise * axes["NoiseDensity"][i]),
                _slow(axes["BiasInstability"][i], bias),
                RandomWalk(K=of_walk * axes["RandomWalk"][i]),
            ),
            f"From {path.name}, {key} of MATLAB, {kind}.",
        )
        for name, i in names.items()
    }


def _axes(path: Path, name: str, given: Any) -> tuple[float, float, float]:
    """A number, or three of them."""
    values = given if isinstance(given, list) else [given] * 3
    if len(values) != 3:
        raise FormatError(
            f"{path}: {name} has {len(values)} values: one value, or one for each of three axes, is needed"
        )
    x, y, z = (_number(path, name, v) for v in values)
    return x, y, z


def _filter(path: Path, key: str, given: Any, rate: float | None) -> tuple[float, float] | None:
    """sigma over B, and the correlation time, of a filter with one pole; None where the bias is flicker."""
    if not isinstance(given, Mapping):
        return None
    name = f"{key}.BiasInstabilityCoefficients"
    try:
        top = [_number(path, name, v) for v in _listed(given["Numerator"])]
        below = [float(v) for v in _listed(given["Denominator"])]
    except (KeyError, TypeError, ValueError):
        raise FormatError(f"{path}: {name} needs a Numerator and a Denominator of numbers") from None
    if len(top) != 1 or len(below) != 2 or (top[0], below[1]) == _DEFAULT_FILTER:
        return None
    phi = -below[1] / below[0] if below[0] else math.nan
    if not 0 < phi < 1:
        raise FormatError(
            f"{path}: {name} has its pole at {phi:g}: a bias that decays has it between 0 and 1"
        )
    if rate is None:
        raise InputError(f"{path}: {name} is a filter of samples, and there is no SampleRate with {key}")
    sigma = top[0] / abs(below[0]) / math.sqrt(-math.expm1(2 * math.log(phi)))
    return sigma, -1 / (rate * math.log(phi))


def _listed(given: Any) -> list[Any]:
    return given if isinstance(given, list) else [given]


def _slow(B: float, bias: tuple[float, float] | None) -> TermType:
    if bias is None:
        return Flicker(B=B)
    return GaussMarkov.from_sigma(bias[0] * B, bias[1])
