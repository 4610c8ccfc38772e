# SPDX-License-Identifier: BSD-3-Clause
"""What the programs that read exported noise make of the numbers: their own steps, each written from its definition.

A consumer is a function that takes the content of its file and gives, by sensor, a `Step`: what one step of its own
does to an angle (or a velocity) and to the bias of the sensor. Nothing here is shared with the exporters.
"""

from __future__ import annotations

import io
import json
import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from numpy.typing import NDArray
from ruamel.yaml import YAML
from scipy.io import loadmat

Array = NDArray[np.float64]

RATE = 200.0
GYRO, ACCEL = "gyroscope", "accelerometer"
DEG, HOUR = math.pi / 180, 3600.0
ARW, DEG_H, MICRO_G, MGAL = DEG / 60, DEG / 3600, 9.80665e-6, 1e-5


@dataclass(frozen=True)
class Step:
    """One step of a consumer: (angle, bias) -> transition @ (angle, bias) + noise of this covariance."""

    dt: float
    transition: Array
    covariance: Array

    def after(self, seconds: float) -> Array:
        """Covariance of (angle, bias) that started at zero; steps are composed by doubling."""
        n = round(seconds / self.dt)
        assert abs(n * self.dt / seconds - 1) < 1e-9
        total, f, q = np.zeros((2, 2)), self.transition, self.covariance
        while n:
            if n & 1:
                total = f @ total @ f.T + q
            f, q, n = f @ f, f @ q @ f.T + q, n >> 1
        return total


def step(dt: float, angle: float, phi: float, bias: float) -> Step:
    """Variances that a step adds to angle and bias; the bias decays by phi and moves the angle by dt times itself."""
    return Step(dt, np.array([[1.0, dt], [0.0, phi]]), np.diag([angle, bias]))


# -- readers of the files ------------------------------------------------------------------------------------


def info(text: str) -> dict[str, float]:
    """Keys of the numbers of a property tree in the INFO format, wherever they stand."""
    lines = (line.partition(";")[0].split() for line in text.splitlines())
    return {words[0]: float(words[1]) for words in lines if len(words) == 2}


def yaml_1_1(text: str) -> Any:
    """As PyYAML reads it, which takes 1e-3, 1.0e3 and 5e-05 for text; the first line is for OpenCV alone."""
    return _typed(YAML(typ="base", pure=True).load(text.removeprefix("%YAML:1.0\n")))


#: https://yaml.org/type/float.html and int.html, as far as decimals go.
_FLOAT = re.compile(r"[-+]?([0-9][0-9_]*)\.[0-9_]*([eE][-+][0-9]+)?|[-+]?\.[0-9_]+([eE][-+][0-9]+)?")


def _typed(found: Any) -> Any:
    if isinstance(found, dict):
        return {key: _typed(value) for key, value in found.items()}
    if isinstance(found, list):
        return [_typed(value) for value in found]
    if _FLOAT.fullmatch(found):
        return float(found)
    return int(found) if re.fullmatch(r"[-+]?[0-9]+", found) else found


def floats(found: Any) -> list[float]:
    """All values, each of which must be a number with a point."""
    if isinstance(found, dict):
        return [v for key, value in found.items() if key not in _WORDS for v in floats(value)]
    if isinstance(found, list):
        return [v for value in found for v in floats(value)]
    assert isinstance(found, float), found
    return [found]


_WORDS = ("rostopic", "model")


def python_names(text: str) -> dict[str, Any]:
    names: dict[str, Any] = {}
    exec(compile(text, "exported", "exec"), names)
    return names


def matlab_numbers(text: str) -> dict[str, list[float]]:
    """Assignments of a script."""
    found = {}
    for name, value in re.findall(r"^([\w.]+) = \[?([^\];(]*)\]?;", text, re.M):
        found[name.removeprefix("imu.")] = [float(v) for v in value.split(",")]
    return found


def parameters(text: str, pattern: str) -> dict[str, float]:
    """Lines of a parameter file that are comments."""
    return {key: float(value) for key, value in re.findall(pattern, text, re.M)}


# -- white noise and a walk ------------------------------------------------------------------------------------


def densities(found: dict[str, tuple[float, float]], rate: float = RATE) -> dict[str, Step]:
    """noise sqrt(f) in a sample and walk/sqrt(f) in a step."""
    dt = 1 / rate
    return {
        sensor: step(dt, (noise * math.sqrt(rate) * dt) ** 2, 1.0, (walk / math.sqrt(rate)) ** 2)
        for sensor, (noise, walk) in found.items()
    }


def kalibr(text: str) -> dict[str, Step]:
    k = yaml_1_1(text)
    numbers = {s: (k[f"{s}_noise_density"], k[f"{s}_random_walk"]) for s in (GYRO, ACCEL)}
    return densities(numbers, k["update_rate"])


def openvins(text: str) -> dict[str, Step]:
    """sigma^2/dt with an input matrix of dt."""
    k = yaml_1_1(text)["imu0"]
    dt = 1 / k["update_rate"]
    return {
        s: step(dt, dt**2 * k[f"{s}_noise_density"] ** 2 / dt, 1.0, dt**2 * k[f"{s}_random_walk"] ** 2 / dt)
        for s in (GYRO, ACCEL)
    }


def vins(text: str) -> dict[str, Step]:
    """Mid-point rule: the mean of two samples that are taken as independent; the bias moves by dt times its noise."""
    k, dt = yaml_1_1(text), 1 / RATE
    return {
        s: step(dt, 2 * (0.5 * dt * k[f"{name}_n"]) ** 2, 1.0, (dt * k[f"{name}_w"]) ** 2)
        for s, name in ((GYRO, "gyr"), (ACCEL, "acc"))
    }


def orb_slam3(text: str) -> dict[str, Step]:
    k = yaml_1_1(text)
    keys = {GYRO: ("IMU.NoiseGyro", "IMU.GyroWalk"), ACCEL: ("IMU.NoiseAcc", "IMU.AccWalk")}
    return densities({s: (k[a], k[b]) for s, (a, b) in keys.items()}, k["IMU.Frequency"])


def okvis(text: str) -> dict[str, Step]:
    k = yaml_1_1(text)["imu_params"]
    numbers = {GYRO: (k["sigma_g_c"], k["sigma_gw_c"]), ACCEL: (k["sigma_a_c"], k["sigma_aw_c"])}
    return densities(numbers, k["imu_rate"])


def gtsam(text: str) -> dict[str, Step]:
    """Covariance/dt through a Jacobian of dt; to the bias dt times its covariance."""
    k, dt = python_names(text)["COVARIANCES"], 1 / RATE
    keys = {
        GYRO: ("gyroscopeCovariance", "biasOmegaCovariance"),
        ACCEL: ("accelerometerCovariance", "biasAccCovariance"),
    }
    return {s: step(dt, dt**2 * k[a][0] / dt, 1.0, dt * k[b][0]) for s, (a, b) in keys.items()}


def lio_sam(text: str) -> dict[str, Step]:
    """The squares are GTSAM's covariances: divided by dt, times dt^2; sqrt(dt) times the sigma of the bias."""
    k, dt = yaml_1_1(text)["lio_sam"], 1 / RATE
    keys = {GYRO: ("imuGyrNoise", "imuGyrBiasN"), ACCEL: ("imuAccNoise", "imuAccBiasN")}
    return {
        s: step(dt, dt**2 * k[a] ** 2 / dt, 1.0, (math.sqrt(dt) * k[b]) ** 2) for s, (a, b) in keys.items()
    }


def kimera(text: str) -> dict[str, Step]:
    """As GTSAM, of the squares."""
    k = yaml_1_1(text)
    dt = 1 / k["rate_hz"]
    return {
        s: step(dt, dt**2 * k[f"{s}_noise_density"] ** 2 / dt, 1.0, dt * k[f"{s}_random_walk"] ** 2)
        for s in (GYRO, ACCEL)
    }


def maplab(text: str) -> dict[str, Step]:
    """The squares are derivatives of the covariance."""
    k, dt = yaml_1_1(text), 1 / RATE
    return {
        s: step(
            dt, dt * k[f"{a}_noise_density"] ** 2, 1.0, dt * k[f"{a}_bias_random_walk_noise_density"] ** 2
        )
        for s, a in ((GYRO, "gyro"), (ACCEL, "acc"))
    }


def rovio(text: str) -> dict[str, Step]:
    """A Jacobian of the noise with the root of dt."""
    k, root = info(text), math.sqrt(1 / RATE)
    return {
        s: step(1 / RATE, root * k[f"{white}_0"] * root, 1.0, root * k[f"{walk}_0"] * root)
        for s, white, walk in ((GYRO, "att", "gyb"), (ACCEL, "vel", "acb"))
    }


def fast_lio(text: str) -> dict[str, Step]:
    """(dt f_w) Q (dt f_w)', Q the numbers of the file."""
    k, dt = yaml_1_1(text)["mapping"], 1 / RATE
    return {
        s: step(dt, dt * k[f"{a}_cov"] * dt, 1.0, dt * k[f"b_{a}_cov"] * dt)
        for s, a in ((GYRO, "gyr"), (ACCEL, "acc"))
    }


def basalt(text: str) -> dict[str, Step]:
    """Variance of a sample std^2 rate, with a Jacobian of dt; a change of the bias weighs 1/(std sqrt(dt))."""
    k = json.loads(text)["value0"]
    dt = 1 / k["imu_update_rate"]
    return {
        s: step(
            dt,
            dt**2 * (k[f"{a}_noise_std"][0] * math.sqrt(k["imu_update_rate"])) ** 2,
            1.0,
            (k[f"{a}_bias_std"][0] * math.sqrt(dt)) ** 2,
        )
        for s, a in ((GYRO, "gyro"), (ACCEL, "accel"))
    }


def airsim(text: str) -> dict[str, Step]:
    """Density over the root of dt, at least 1 ms; the bias moves by stability/sqrt(tau) times it."""
    k, dt = json.loads(text)["Imu"], 1 / RATE
    assert k["Enabled"] and k["SensorType"] == 2
    root, found = math.sqrt(max(dt, 1e-3)), {}
    for s, a, name, n, b in (
        (GYRO, "Angular", "Gyro", ARW, DEG_H), (ACCEL, "Velocity", "Accel", 9.80665e-3, MICRO_G),
    ):  # fmt: skip
        walk = k[f"{name}BiasStability"] * b / math.sqrt(k[f"{name}BiasStabilityTau"])
        found[s] = step(dt, (k[f"{a}RandomWalk"] * n / root * dt) ** 2, 1.0, (walk * root) ** 2)
    return found


def pyins(text: str) -> dict[str, Step]:
    names = python_names(text)
    made = {GYRO: names["gyro"](1.0), ACCEL: names["accel"](1.0)}
    return densities({s: (m["noise"], m["bias_walk"]) for s, m in made.items()})


def delta_angle_filter(k: dict[str, float], keys: dict[str, tuple[str, str]], dt: float) -> dict[str, Step]:
    """States are a delta angle and the bias of it, dt times that of the rate: (dt n)^2 and (dt^2 b)^2 in a step."""
    return {
        s: step(dt, (dt * k[noise]) ** 2, 1.0, (dt**2 * k[bias]) ** 2 / dt**2)
        for s, (noise, bias) in keys.items()
    }


def px4(text: str) -> dict[str, Step]:
    k = parameters(text, r"^# 1\t1\t(\w+)\t(\S+)\t9$")
    keys = {GYRO: ("EKF2_GYR_NOISE", "EKF2_GYR_B_NOISE"), ACCEL: ("EKF2_ACC_NOISE", "EKF2_ACC_B_NOISE")}
    return delta_angle_filter(k, keys, 0.01)


def ardupilot(text: str) -> dict[str, Step]:
    """At 12.5 ms, which divides a second; exported with filter_rate=80."""
    k = parameters(text, r"^# (EK3_\w+),(\S+)$")
    keys = {GYRO: ("EK3_GYRO_P_NSE", "EK3_GBIAS_P_NSE"), ACCEL: ("EK3_ACC_P_NSE", "EK3_ABIAS_P_NSE")}
    return delta_angle_filter(k, keys, 0.0125)


# -- white noise alone -------------------------------------------------------------------------------------------


def samples(deviations: dict[str, float]) -> dict[str, Step]:
    """Independent noise of these deviations in every sample, and no bias."""
    return {s: step(1 / RATE, (sd / RATE) ** 2, 1.0, 0.0) for s, sd in deviations.items()}


def isaac(text: str) -> dict[str, Step]:
    """std times a normal number, added to every observation."""
    names = python_names(text)
    return samples({GYRO: names["GYROSCOPE"][0], ACCEL: names["ACCELEROMETER"][0]})


def carla(text: str) -> dict[str, Step]:
    """A normal number of stddev, added to every sample; the attributes are text."""
    told: dict[str, str] = {}
    python_names(text)["apply"](SimpleNamespace(set_attribute=told.__setitem__))
    assert 1 / float(told["sensor_tick"]) == pytest.approx(RATE)
    return samples({s: float(told[f"noise_{a}_stddev_x"]) for s, a in ((GYRO, "gyro"), (ACCEL, "accel"))})


def mujoco(text: str) -> dict[str, Step]:
    """The attribute times a normal number, which its user adds."""
    root = ElementTree.fromstring(text)
    return samples({s: float(root.find(s_).get("noise")) for s, s_ in ((GYRO, "gyro"), (ACCEL, ACCEL))})


def webots(text: str) -> dict[str, Step]:
    """Output (1 + noise g) of the rows about the reading, between which both are interpolated."""
    return samples({s: webots_deviation(text, s, 0.0) for s in (GYRO, ACCEL)})


def webots_deviation(text: str, sensor: str, reading: float) -> float:
    node = {GYRO: "Gyro", ACCEL: "Accelerometer"}[sensor]
    (table,) = re.findall(rf"^{node} {{\s+lookupTable \[([^\]]*)\]", text, re.M)
    rows = np.array([[float(v) for v in line.split()] for line in table.strip().splitlines()])
    output, noise = (np.interp(reading, rows[:, 0], rows[:, i]) for i in (1, 2))
    (offset,) = re.findall(rf"^# {node}: subtract (\d+) ", text, re.M)
    assert output - float(offset) == pytest.approx(reading, abs=1e-9)
    return float(output * noise)


def ros_imu(text: str) -> dict[str, Step]:
    """The variance of a measurement of the rate; robot_localization takes no less than 1e-9."""
    k, names = yaml_1_1(text), {GYRO: "angular_velocity", ACCEL: "linear_acceleration"}
    found = {}
    for s, name in names.items():
        matrix = np.reshape(k[f"{name}_covariance"], (3, 3))
        assert np.array_equal(matrix, np.diag(np.diag(matrix))), "no correlation between axes"
        found[s] = math.sqrt(max(matrix[0, 0], 1e-9))
    return samples(found)


# -- Gauss-Markov ------------------------------------------------------------------------------------------------


def markov(n: float, phi: float, bias: float) -> Step:
    """N in SI, and the step of the bias at the rate of the record."""
    return step(1 / RATE, n**2 / RATE, phi, bias)


def gazebo(text: str) -> dict[str, Step]:
    """stddev in a sample; phi = exp(-dt/T), q^2 T/2 (1 - exp(-2 dt/T)): GaussianNoiseModel of gz-sensors."""
    root = ElementTree.fromstring(text)
    assert (root.tag, root.get("type")) == ("sensor", "imu")
    dt, found = 1 / float(root.findtext("update_rate", "nan")), {}
    for s, element in ((GYRO, "angular_velocity"), (ACCEL, "linear_acceleration")):
        noise = root.find(f"imu/{element}/x/noise")
        if noise is None:
            continue
        assert noise.get("type") == "gaussian"
        k = {e.tag: float(e.text or "nan") for e in noise}
        q, time = k["dynamic_bias_stddev"], k["dynamic_bias_correlation_time"]
        bias = q**2 * time / 2 * (1 - math.exp(-2 * dt / time))
        found[s] = step(dt, (k["stddev"] * dt) ** 2, math.exp(-dt / time), bias)
    return found


def gazebo_classic(text: str) -> dict[str, Step]:
    """phi = exp(-dt/T), q^2 T/2 (1 - exp(-2 dt/T))."""
    k = {e.tag: float(e.text or "nan") for e in ElementTree.fromstring(f"<plugin>{text}</plugin>")}
    found = {}
    for s in (GYRO, ACCEL):
        q, time = k[f"{s}RandomWalk"], k[f"{s}BiasCorrelationTime"]
        bias = q**2 * time / 2 * (1 - math.exp(-2 / RATE / time))
        found[s] = markov(k[f"{s}NoiseDensity"], math.exp(-1 / RATE / time), bias)
    return found


def matlab(text: str, content: Any) -> dict[str, Step]:
    """White noise of BiasInstability through b/(1 + a z^-1); NoiseDensity sqrt(band), RandomWalk/sqrt(band).

    The band is the rate for "single-sided", half of it for "double-sided", which loadparams leaves (imuSensor of
    R2023b, setupBandwidth).
    """
    (part,), found = json.loads(text).values(), {}
    for s, name in ((GYRO, "Gyroscope"), (ACCEL, "Accelerometer")):
        k = content[name]
        assert str(k["NoiseType"][0]) == "single-sided"
        c = k["BiasInstabilityCoefficients"]
        assert c["Denominator"].ravel()[0] == 1.0
        bias = (float(c["Numerator"].item()) * k["BiasInstability"].ravel()[0]) ** 2
        white, walk = matlab_samples(k, RATE)
        assert matlab_samples(part[name], RATE / 2) == pytest.approx((white, walk), rel=1e-9)
        found[s] = step(1 / RATE, (white / RATE) ** 2, -c["Denominator"].ravel()[1], bias)
    return found


def matlab_samples(k: Any, band: float) -> tuple[float, float]:
    """Deviations of a sample of white noise, and of a step of the random walk."""
    density, walk = (float(np.ravel(k[key])[0]) for key in ("NoiseDensity", "RandomWalk"))
    return density * math.sqrt(band), walk / math.sqrt(band)


def gnss_ins_sim(text: str) -> dict[str, Step]:
    """phi = 1 - dt/T, sigma sqrt(1 - exp(-2 dt/T))."""
    k, found = python_names(text)["imu_err"], {}
    for s, name, walk, n, b in ((GYRO, "gyro", "arw", ARW, DEG_H), (ACCEL, "accel", "vrw", 1 / 60, 1.0)):
        sigma, time = k[f"{name}_b_stability"][0] * b, k[f"{name}_b_corr"][0]
        bias = sigma**2 * (1 - math.exp(-2 / RATE / time))
        found[s] = markov(k[f"{name}_{walk}"][0] * n, 1 - 1 / RATE / time, bias)
    return found


def navego(text: str) -> dict[str, Step]:
    """F = -1/corr, and the squares of white noise and psd times dt."""
    k, found = matlab_numbers(text), {}
    for s, letter, noise, n in ((GYRO, "g", "arw", ARW), (ACCEL, "a", "vrw", 1 / 60)):
        phi = math.exp(-1 / RATE / k[f"{letter}b_corr"][0])
        found[s] = markov(k[noise][0] * n, phi, k[f"{letter}b_psd"][0] ** 2 / RATE)
    return found


def psins(text: str) -> dict[str, Step]:
    """sigma sqrt(2/Tau) drives the bias; with Tau = inf sqrtR0 does, per square root of hour."""
    k, found = matlab_numbers(text), {}
    for s, white, sigma, tau, n, b in (
        (GYRO, "web", "sqrtR0G", "TauG", ARW, DEG_H),
        (ACCEL, "wdb", "sqrtR0A", "TauA", MICRO_G, MICRO_G),
    ):
        time, value = k[tau][0], k[sigma][0] * b
        drive = value / 60 if math.isinf(time) else value * math.sqrt(2 / time)
        found[s] = markov(k[white][0] * n, math.exp(-1 / RATE / time), drive**2 / RATE)
    return found


def kf_gins(text: str) -> dict[str, Step]:
    """phi = 1 - dt/T; 2 sigma^2/T times dt, the mean of before and after the step."""
    k, found = yaml_1_1(text)["imunoise"], {}
    for s, white, sigma, n, b in ((GYRO, "arw", "gbstd", ARW, DEG_H), (ACCEL, "vrw", "abstd", 1 / 60, MGAL)):
        time = k["corrtime"] * HOUR
        phi = 1 - 1 / RATE / time
        drive = 2 * (k[sigma][0] * b) ** 2 / time
        found[s] = markov(k[white][0] * n, phi, drive / RATE * (1 + phi**2) / 2)
    return found


def ob_gins(text: str) -> dict[str, Step]:
    """phi = 1 - dt/T; 2 sigma^2/T times dt."""
    k, found = yaml_1_1(text)["imumodel"], {}
    for s, white, sigma, n, b in ((GYRO, "arw", "gbstd", ARW, DEG_H), (ACCEL, "vrw", "abstd", 1 / 60, MGAL)):
        time = k["corrtime"] * HOUR
        found[s] = markov(k[white] * n, 1 - 1 / RATE / time, 2 * (k[sigma] * b) ** 2 / time / RATE)
    return found


Reader = Callable[[str], dict[str, Step]]

WALKERS: dict[str, Reader] = {
    f.__name__: f
    for f in (
        kalibr, openvins, vins, orb_slam3, okvis, gtsam, pyins, px4, ardupilot, kimera, basalt, maplab, rovio, lio_sam,
        fast_lio, airsim,
    )
}  # fmt: skip
WHITES: dict[str, Reader] = {f.__name__: f for f in (ros_imu, carla, isaac, mujoco, webots)}
MARKOVS: dict[str, Reader] = {
    f.__name__: f for f in (gazebo, gazebo_classic, gnss_ins_sim, navego, psins, kf_gins, ob_gins)
}
#: Consumers whose step of a Gauss-Markov bias is exact.
EXACT = ("gazebo", "gazebo_classic")
#: Packages of a registry that run the file's numbers themselves, where they are installed.
PACKAGES = {"gtsam": "GTSAM", "lio_sam": "GTSAM", "kimera": "GTSAM", "mujoco": "MuJoCo"}
OPTIONS: dict[str, dict[str, Any]] = {"ardupilot": {"filter_rate": 80.0}}


def mat(content: bytes) -> Any:
    return _simple(loadmat(io.BytesIO(content))["imu"])


def _simple(found: Any) -> Any:
    """Structures of a MAT file as mappings."""
    if isinstance(found, np.ndarray) and found.dtype.names:
        return {name: _simple(found[name].item()) for name in found.dtype.names}
    return found
