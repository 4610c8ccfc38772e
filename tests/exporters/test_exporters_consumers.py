# SPDX-License-Identifier: BSD-3-Clause
"""Exported noise in its consumers: what their own steps make of the file is the variance of the model.

The steps are in `consumers`, each written from the consumer's definition, and propagated to 1, 10, 100 and 1000 s.
Files are exported with sixteen digits for this, so that what is left is not the rounding of the file; the seven
digits that files have are tested by themselves.
"""

from __future__ import annotations

import json
import math
import re
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.dom import minidom
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.signal import lfilter
from scipy.stats import chi2

import allanite as al
import consumers
import sample_study
from allanite import exporters
from allanite.errors import InputError, StorageError
from allanite.exporters.imu.gauss_markov import WALK_TIME
from allanite.noise import SIGMA_PER_B, Flicker, GaussMarkov, NoiseModel, RandomWalk, White
from consumers import ACCEL, GYRO, MARKOVS, OPTIONS, RATE, WALKERS, WHITES, Step
from shell import Run

GOLDEN = Path(__file__).parents[1] / "published"
SECONDS = (1.0, 10.0, 100.0, 1000.0)
ALL = (*WALKERS, *MARKOVS, *WHITES, "matlab")
#: Files that are squares of the numbers.
SQUARES = ("gtsam", "rovio", "fast_lio", "ros_imu")
#: Simulators: what they make is to be like the sensor, not above it.
SIMULATORS = (
    "gazebo", "gazebo_classic", "gnss_ins_sim", "psins", "matlab", "airsim", "carla", "isaac", "mujoco", "webots",
)  # fmt: skip
DEG, MICRO_G = math.radians(1), 9.80665e-6


def imu(kind: str) -> NoiseModel:
    """N = 0.3 deg/√h, B = 5 deg/h, T = 100 s, K = 5 deg/h/√h; N = 0.03 m/s/√h, B = 20 µg, T = 100 s, K = 5 µg/√h."""
    n, b, k = (0.3 * DEG / 60, 5 * DEG / 3600, 5 * DEG / 3600 / 60)
    if kind == "acceleration":
        n, b, k = 0.03 / 60, 20 * MICRO_G, 5 * MICRO_G / 60
    markov = GaussMarkov.from_sigma(SIGMA_PER_B * b, 100.0)
    return NoiseModel.of(White(N=n), markov, RandomWalk(K=k), kind=kind)


MODELS = {"gyro": imu("rate"), "accel": imu("acceleration")}
OF_SENSOR = {GYRO: MODELS["gyro"], ACCEL: MODELS["accel"]}


def only(*types: str, models: dict[str, NoiseModel] = MODELS) -> dict[str, NoiseModel]:
    """The models with terms of these types."""
    return {
        name: NoiseModel.of(*(t for t in m.terms if t.type in types), kind=m.kind)
        for name, m in models.items()
    }


def steps(name: str, models: Any = MODELS, *, digits: int = 15, **options: Any) -> dict[str, Step]:
    """What the consumer does with the exported file."""
    given = {**OPTIONS.get(name, {}), **options}
    if name == "matlab":
        files = made_by("matlab", models, digits=digits, **given)
        return consumers.matlab(files["imu_sensor.json"], consumers.mat(files["imu_sensor.mat"]))
    text = al.export(name, models, rate=RATE, digits=digits, **given)
    return {**WALKERS, **MARKOVS, **WHITES}[name](text)


def made_by(name: str, models: Any, **options: Any) -> Any:
    document = {
        "provenance": {},
        "recording": {"rate": RATE},
        "channels": [
            {"name": n, "kind": m.kind, "unit": "", "models": [m.to_json()]} for n, m in models.items()
        ],
    }
    return exporters.exporter(name).write(document, **options)


def bias_of(model: NoiseModel, seconds: float) -> float:
    """Variance of the bias that is known at the start: allanite's own discrete form of the model, in one step."""
    space = model.state_space(seconds, sampling="point")
    out = space.rate
    return float(out @ space.process @ out)


# -- white noise and a walk --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", WALKERS)
@pytest.mark.parametrize("sensor", [GYRO, ACCEL])
def test_white_noise_and_walk_come_back(name: str, sensor: str) -> None:
    own, found = OF_SENSOR[sensor], steps(name, walk="k-only")[sensor]
    n, k = own.term("white"), own.term("random_walk")
    alone = Step(found.dt, np.array([[1.0, 0.0], [0.0, 1.0]]), found.covariance)  # the bias moves no angle
    for t in SECONDS:
        white, _, _, bias = alone.after(t).ravel()
        assert white == pytest.approx(float(n.avar(t)) * t**2, rel=1e-9)
        assert bias == pytest.approx(3 * float(k.avar(t)), rel=1e-9)
        assert bias == pytest.approx(bias_of(NoiseModel.of(k), t), rel=1e-9)
        # its rule of integration lags half a step: 3/2 of a step over t of the part of the walk
        angle, exact = found.after(t)[0, 0], float(n.avar(t)) * t**2 + k.K**2 * t**3 / 3
        assert exact * (1 - 1.5 * found.dt / t) - 1e-9 * exact <= angle <= exact * (1 + 1e-9)


@pytest.mark.parametrize("name", WALKERS)
def test_bounds_of_the_bias_hold_in_every_consumer(name: str) -> None:
    for sensor, own in OF_SENSOR.items():
        markov, walk = own.term("gauss_markov"), own.term("random_walk")
        upper = steps(name)[sensor]
        for t in SECONDS:
            drift = bias_of(NoiseModel.of(markov, walk), t)
            assert drift <= upper.after(t)[1, 1] * (1 + 1e-9)
            assert upper.after(t)[1, 1] == pytest.approx((walk.K**2 + markov.q**2) * t, rel=1e-9)
        for t in (10.0, 1000.0):
            matched = steps(name, walk=f"horizon={t}")[sensor].after(t)[1, 1] / 3
            assert matched == pytest.approx(float(markov.avar(t) + walk.avar(t)), rel=1e-9)


# -- white noise alone ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", WHITES)
@pytest.mark.parametrize("sensor", [GYRO, ACCEL])
def test_white_noise_comes_back_and_no_bias(name: str, sensor: str) -> None:
    found, n = steps(name)[sensor], OF_SENSOR[sensor].term("white")
    for t in SECONDS:
        assert found.after(t)[0, 0] == pytest.approx(float(n.avar(t)) * t**2, rel=1e-9)
        assert found.after(t)[1, 1] == 0.0
    said = al.export(name, MODELS, rate=RATE)
    assert "LOST: bias instability and random walk" in said and said.count("LEFT OUT") >= 3
    for option in ({"walk": "k-only"}, {"correlation_time": 9.0}):
        with pytest.raises(InputError, match=f"no option {next(iter(option))}="):
            al.export(name, MODELS, rate=RATE, **option)


def test_variances_that_robot_localization_raises_are_marked() -> None:
    """Below 1e-9 the filter weighs a good gyro too little: N sqrt(f) = 3.2e-5 rad/s is the limit."""
    for n, marked in ((2.3e-6, False), (2.2e-6, True)):
        text = al.export("ros_imu", {"g": NoiseModel.of(White(N=n))}, rate=RATE)
        assert ("rad^2/s^2; robot_localization takes 1e-09" in text) == marked == (n**2 * RATE < 1e-9)


def test_defaults_that_comments_state_in_other_units_are_right() -> None:
    """Of FAST-LIO2 at 200 Hz, of PX4 at 10 ms, and of AirSim (0.1 and 1e-4; 0.015 and 1e-3; 4.6 deg/h over 500 s)."""
    arw, rrw = 60 / DEG, 3600 * 60 / DEG
    for name, n, k in (
        ("fast_lio", math.sqrt(0.1 / 200), math.sqrt(1e-4 / 200)),
        ("px4", 0.015 * math.sqrt(0.01), 1e-3 * math.sqrt(0.01)),
    ):
        text = al.export(name, MODELS, rate=RATE)
        stated = re.search(r"defaults.* N = (\S+) deg/sqrt\(h\) and K = (\S+) deg/h/sqrt\(h\)", text)
        assert stated is not None
        assert [float(v) for v in stated.groups()] == pytest.approx([n * arw, k * rrw], rel=0.01)
    stated = re.search(r"the default, by (\d+) deg/h in an hour", al.export("airsim", MODELS, rate=RATE))
    assert stated is not None and float(stated[1]) == pytest.approx(4.6 / math.sqrt(500) * 60, rel=0.03)


def test_noise_of_webots_is_the_same_over_its_range() -> None:
    """It is a share of the output: a table without an offset has none at zero."""
    text = al.export("webots", MODELS, rate=RATE, digits=15)
    for sensor, span in ((GYRO, 100.0), (ACCEL, 1000.0)):
        sd = OF_SENSOR[sensor].term("white").N * math.sqrt(RATE)
        for reading in np.linspace(-span, span, 41):
            assert consumers.webots_deviation(text, sensor, reading) == pytest.approx(sd, rel=2e-6)


def test_a_reading_of_isaac_sim_gets_its_noise() -> None:
    names = consumers.python_names(al.export("isaac", MODELS, rate=RATE))
    rng = np.random.default_rng(3)
    readings = np.array([names["add_to"]([1.0, 2.0, 3.0], names["GYROSCOPE"], rng) for _ in range(4000)])
    ratio = readings.var(axis=0) / names["GYROSCOPE"][0] ** 2
    lower, upper = chi2.interval(0.9997, len(readings) - 1)
    assert ((lower < 3999 * ratio) & (3999 * ratio < upper)).all()
    assert readings.mean(axis=0) == pytest.approx([1.0, 2.0, 3.0], abs=1e-3)


def test_mujoco_itself_keeps_the_noise_and_adds_none() -> None:
    mujoco = pytest.importorskip("mujoco", reason="MuJoCo's wheel is not installed")
    body = '<body><freejoint/><geom size="0.1"/><site name="imu"/></body>'
    text = f"<mujoco><worldbody>{body}</worldbody>{al.export('mujoco', MODELS, rate=RATE)}</mujoco>"
    model = mujoco.MjModel.from_xml_string(text)
    deviations = [OF_SENSOR[s].term("white").N * math.sqrt(RATE) for s in (GYRO, ACCEL)]
    assert model.sensor_noise == pytest.approx(deviations, rel=1e-6)
    data = mujoco.MjData(model)
    mujoco.mj_step(model, data)
    assert not data.sensordata.any(), "in free fall, without noise"


# -- Gauss-Markov -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [*MARKOVS, "matlab"])
@pytest.mark.parametrize("sensor", [GYRO, ACCEL])
def test_gauss_markov_bias_comes_back(name: str, sensor: str) -> None:
    own, found = OF_SENSOR[sensor], steps(name)[sensor]
    n, markov = own.term("white"), own.term("gauss_markov")
    exact = name in (*consumers.EXACT, "matlab")
    tolerance = 1e-9 if exact else 2 * found.dt / markov.T  # what its own first-order step costs
    alone = Step(found.dt, np.diag(np.diag(found.transition)), found.covariance)
    for t in SECONDS:
        white, _, _, bias = alone.after(t).ravel()
        assert white == pytest.approx(float(n.avar(t)) * t**2, rel=1e-9)
        assert bias == pytest.approx(bias_of(NoiseModel.of(markov), t), rel=tolerance)
    assert -found.dt / math.log(found.transition[1, 1]) == pytest.approx(markov.T, rel=tolerance)


@pytest.mark.parametrize("name", MARKOVS)
def test_what_is_left_out_is_the_walk_and_nothing_else(name: str) -> None:
    for sensor, own in OF_SENSOR.items():
        found, walk = steps(name)[sensor], own.term("random_walk")
        for t in SECONDS:
            whole = bias_of(NoiseModel.of(own.term("gauss_markov"), walk), t)
            missing = whole - found.after(t)[1, 1]
            assert missing == pytest.approx(walk.K**2 * t, abs=2 * found.dt / 100 * whole)
    if name != "navego":
        assert "LEFT OUT" in al.export(name, MODELS, rate=RATE)


@pytest.mark.parametrize("name", MARKOVS)
def test_a_walk_in_a_gauss_markov_consumer(name: str) -> None:
    """A process of 1e6 s is the walk within t/T; PSINS knows the walk itself."""
    for walk, models in (("k-only", MODELS), ("upper-bound", MODELS)):
        found = steps(name, models, walk=walk)
        expected = steps("kalibr", models, walk=walk)
        for sensor in OF_SENSOR:
            for t in SECONDS:
                ratio = found[sensor].after(t)[1, 1] / expected[sensor].after(t)[1, 1]
                assert 1 - t / WALK_TIME - 1e-8 <= ratio <= 1 + 1e-8


def test_navego_and_matlab_have_a_slot_for_the_walk() -> None:
    found = consumers.matlab_numbers(al.export("navego", MODELS, rate=RATE, digits=15))
    content = consumers.mat(made_by("matlab", MODELS, digits=15)["imu_sensor.mat"])
    for sensor, key, part in ((GYRO, "arrw", "Gyroscope"), (ACCEL, "vrrw", "Accelerometer")):
        k = OF_SENSOR[sensor].term("random_walk").K
        assert found[key][0] == pytest.approx(k, rel=1e-12)
        assert content[part]["RandomWalk"].ravel()[0] == pytest.approx(k, rel=1e-12)


def test_flicker_of_matlab_is_flicker_with_its_own_fractal_filter() -> None:
    """BiasInstability B through 1/(1 - z^-1)^(1/2), what fractalcoef gives: B^2/(2 pi f), two-sided."""
    b = 3e-5
    files = made_by("matlab", {"g": NoiseModel.of(White(N=1e-4), Flicker(B=b))})
    gyro = json.loads(files["imu_sensor.json"])["allanite"]["Gyroscope"]
    assert gyro["BiasInstability"] == [b] * 3
    assert "BiasInstabilityCoefficients" not in consumers.mat(files["imu_sensor.mat"])["Gyroscope"]
    a = np.ones(4000)
    for i in range(1, len(a)):
        a[i] = a[i - 1] * (i - 1.5) / i
    f = np.array([0.3, 1.0, 3.0])
    response = 1 / np.abs(np.exp(-2j * np.pi * f[:, None] / RATE * np.arange(len(a))) @ a) ** 2
    assert gyro["BiasInstability"][0] ** 2 / RATE * response == pytest.approx(Flicker(B=b).psd(f), rel=0.03)


def test_default_filter_of_matlab_leaves_nothing_slow() -> None:
    """1/(1 - 0.5 z^-1) is white beyond two samples: what the JSON file says of it."""
    short = lfilter([1.0], [1.0, -0.5], np.eye(1, 60)[0])
    assert short[20:].max() < 1e-6
    assert "NOTHING SLOW" in made_by("matlab", MODELS)["imu_sensor.json"]


# -- the worked example -------------------------------------------------------------------------------------------


def numbers(text: str) -> list[float]:
    """All numbers of the lines that are no comment."""
    text = re.sub(r'<!--.*?-->|"Comments": \[.*?^ *\]', "", text, flags=re.S | re.M)
    lines = [line for line in text.splitlines() if not line.lstrip().startswith((*"#%;", "def", '"""'))]
    return [float(v) for v in re.findall(r"[-+]?\d\.\d+e[-+]\d\d", "\n".join(lines))]


@pytest.mark.parametrize(
    ("name", "walk", "expected"),
    [
        *[
            (name, walk, [8.7266e-05, value])
            for name in ("kalibr", "openvins", "orb_slam3", "okvis", "pyins")
            for walk, value in (("k-only", 4.0401e-07), ("upper-bound", 3.7107e-06))
        ],
        ("vins", "k-only", [1.7453e-03, 5.7136e-06]),
        ("vins", "upper-bound", [1.7453e-03, 5.2478e-05]),
        ("gtsam", "k-only", [7.6154e-09] * 3 + [1.6323e-13] * 3),
        ("gtsam", "upper-bound", [7.6154e-09] * 3 + [1.3770e-11] * 3),
        ("gazebo", None, [1.2341e-03, 3.6887e-06, 1e2] * 3),
        ("gazebo_classic", None, [8.7266e-05, 3.6887e-06, 1e2]),
        ("gnss_ins_sim", None, [0.0] * 3 + [0.3] * 3 + [5.38] * 3 + [100.0] * 3),
        ("navego", None, [0.3] * 3 + [1.4944e-03] * 3 + [100.0] * 3 + [3.6887e-06] * 3 + [4.0401e-07] * 3),
        ("psins", None, [0.0, 0.3, 5.38, 100.0, 0.0]),
        ("psins", "k-only", [0.0, 0.3, 5.0, 0.0]),
        ("kf_gins", None, [0.3] * 3 + [5.38] * 3 + [2.7778e-02]),
        *[(name, "k-only", [8.7266e-05, 4.0401e-07]) for name in ("kimera", "maplab", "lio_sam")],
        ("basalt", "k-only", [8.7266e-05] * 3 + [4.0401e-07] * 3),
        ("rovio", "k-only", [1.6323e-13] * 3 + [7.6154e-09] * 3),
        ("fast_lio", "k-only", [1.5231e-06, 3.2646e-11]),
        ("airsim", "k-only", [0.3, 1.8634, 500.0]),
        ("ros_imu", None, [1.5231e-06] * 3),
        ("carla", None, [5e-3] + [1.2341e-03] * 3),
        ("isaac", None, [1.2341e-03] * 3),
        ("mujoco", None, [1.2341e-03]),
        ("webots", None, [-100.0, 1.2354e-08, 0.0, 1.2341e-08, 100.0, 1.2329e-08]),
        ("ob_gins", None, [0.3, 5.38, 2.7778e-02]),
    ],
)  # fmt: skip
def test_worked_example(name: str, walk: str | None, expected: list[float]) -> None:
    options = {} if walk is None else {"walk": walk}
    text = al.export(name, {"gyro": MODELS["gyro"]}, rate=RATE, **options)
    assert numbers(text) == pytest.approx(expected, rel=3e-5)


def test_worked_example_of_the_autopilots() -> None:
    for walk, bias in (("k-only", 4.0401e-06), ("upper-bound", 3.7107e-05)):
        text = al.export("px4", {"gyro": MODELS["gyro"]}, rate=RATE, walk=walk)
        found = consumers.parameters(text, r"^# 1\t1\t(\w+)\t(\S+)\t9$")
        assert found == pytest.approx({"EKF2_GYR_NOISE": 8.7266e-04, "EKF2_GYR_B_NOISE": bias}, rel=3e-5)
    assert not numbers(text), "nothing of it takes effect by itself"


def test_worked_example_of_matlab() -> None:
    gyro = json.loads(made_by("matlab", MODELS)["imu_sensor.json"])["allanite"]["Gyroscope"]
    two = math.sqrt(2)
    expected = {
        "NoiseDensity": two * 8.7266e-05,
        "BiasInstability": 2.4241e-05,
        "RandomWalk": 4.0401e-07 / two,
    }
    assert gyro.keys() == expected.keys()
    for key, value in expected.items():
        assert gyro[key] == pytest.approx([value] * 3, rel=3e-5)


# -- rules of every file ------------------------------------------------------------------------------------------


def whole(name: str, document: Any, **options: Any) -> str:
    """The text of the file, or of the file that is text."""
    markov = name in MARKOVS or name == "matlab"
    content = exporters.exporter(name).write(
        document, **({"correlation_time": 100.0} if markov else {}), **options
    )
    text = content if isinstance(content, str) else content["imu_sensor.json"]
    assert isinstance(text, str)
    return text.replace(al.__version__, "VERSION")


def golden_name(name: str) -> str:
    file = exporters.exporter(name).FILE_NAME.partition(",")[0]
    return f"{'' if file.startswith(name) else 'matlab_'}{file}{'.txt' * file.endswith('.py')}"


@pytest.mark.parametrize("name", ALL)
def test_golden_files_and_what_they_must_say(name: str) -> None:
    document = sample_study.build()
    text = whole(name, document)
    if name not in ("kalibr", "openvins"):  # these have golden files of their own
        assert text == (GOLDEN / golden_name(name)).read_text(encoding="utf-8")
    said = json.dumps(json.loads(text), ensure_ascii=False) if text.startswith("{") else text
    for needed in (
        "allanite VERSION", "bench <b>7</b> & co.csv", document["provenance"]["sha256"], "100.0 Hz", "gyro_x", "gyro_z",
        "acc_y", "not inflated", "axes", "952", "95 % interval", "upper limit", "cannot decide",
    ):  # fmt: skip
        assert needed in said, needed
    assert text.isascii()
    doubled = whole(name, document, inflate=2.0)
    assert "INFLATED by 2" in doubled
    found = numbers(text), numbers(doubled)
    if name == "matlab":
        found = tuple(json.loads(t)["allanite"]["Gyroscope"]["NoiseDensity"] for t in (text, doubled))
    if name not in ("px4", "ardupilot"):
        assert max(b / a for a, b in zip(*found, strict=True) if a) == pytest.approx(
            4 if name in SQUARES else 2
        )


@pytest.mark.parametrize("name", [n for n in ALL if exporters.exporter(n).FILE_NAME.endswith(".yaml")])
def test_every_number_is_a_float_to_a_reader_of_yaml_1_1(name: str) -> None:
    assert len(consumers.floats(consumers.yaml_1_1(whole(name, sample_study.build())))) >= 4
    first = whole(name, sample_study.build()).splitlines()[0]
    assert (first == "%YAML:1.0") == (name in ("openvins", "vins", "orb_slam3", "okvis", "kimera"))


def test_a_careless_number_would_be_text_to_that_reader() -> None:
    found = consumers.yaml_1_1("a: 5e-05\nb: 5.0e-05\nc: 1.0e3\nd: 1.0e+03\n")
    assert found == {"a": "5e-05", "b": 5e-05, "c": "1.0e3", "d": 1000.0}


@pytest.mark.parametrize(
    "name", ["gtsam", "pyins", "gnss_ins_sim", "navego", "kf_gins", "matlab", "basalt", "isaac"]
)
def test_each_axis_has_its_own_number(name: str) -> None:
    axes = {
        f"g{a}": NoiseModel.of(White(N=n), GaussMarkov.from_sigma(1e-5 * i, 50.0), RandomWalk(K=1e-7))
        for a, n, i in (("x", 1e-4, 1), ("y", 3e-4, 2), ("z", 2e-4, 3))
    }
    text = al.export(name, axes, rate=RATE, axes="each")
    rows = [
        [float(v) for v in row.split(",")] for row in re.findall(r"\[((?:\d\.\d+e[-+]\d\d,? ?){3})\]", text)
    ]
    ratios = [np.array(row) / row[0] for row in rows if row[0] and len(set(row)) == 3]
    power = 2 if name == "gtsam" else 1
    assert any(np.allclose(r, [1, 3**power, 2**power], rtol=1e-5) for r in ratios)
    assert "order x, y, z" in text
    with pytest.raises(InputError, match="needs three gyroscope channels"):
        al.export(name, {"gx": axes["gx"]}, rate=RATE, axes="each")


@pytest.mark.parametrize(
    "name",
    [
        "kalibr",
        "openvins",
        "vins",
        "orb_slam3",
        "okvis",
        "px4",
        "ardupilot",
        "gazebo_classic",
        "psins",
        "ob_gins",
        "kimera",
        "maplab",
        "lio_sam",
        "fast_lio",
        "airsim",
        "mujoco",
        "webots",
    ],
)
def test_one_slot_for_three_axes(name: str) -> None:
    with pytest.raises(InputError, match="'worst' or 'rms', not 'each': the file has one number"):
        al.export(name, MODELS, rate=RATE, axes="each")


@pytest.mark.parametrize("name", [n for n in ALL if n not in ("kalibr", "openvins")])
def test_one_triad_alone_leaves_the_other_open(name: str) -> None:
    for one in MODELS:
        text = al.export(name, {one: MODELS[one]}, rate=RATE)
        assert "the log holds none in known units" in text


def test_each_axis_of_a_covariance_and_of_numbered_keys() -> None:
    noises = {"gx": 1e-4, "gy": 3e-4, "gz": 2e-4}
    axes = {name: NoiseModel.of(White(N=n), RandomWalk(K=n / 100)) for name, n in noises.items()}

    def written(name: str) -> str:
        return al.export(name, axes, rate=RATE, axes="each", filter_rate=250.0, digits=15)

    variances = np.array(list(noises.values())) ** 2
    matrix = consumers.yaml_1_1(written("ros_imu"))["angular_velocity_covariance"]
    assert np.reshape(matrix, (3, 3)) == pytest.approx(np.diag(250 * variances), rel=1e-12)
    attributes = consumers.python_names(written("carla"))["ATTRIBUTES"]
    found = [float(attributes[f"noise_gyro_stddev_{a}"]) for a in "xyz"]
    assert found == pytest.approx(np.sqrt(250 * variances), rel=1e-12)
    assert float(attributes["sensor_tick"]) == pytest.approx(0.004)
    info = consumers.info(al.export("rovio", axes, rate=RATE, axes="each", walk="k-only", digits=15))
    for state, factor in (("att", 1.0), ("gyb", 1e-4)):
        assert [info[f"{state}_{i}"] for i in range(3)] == pytest.approx(factor * variances, rel=1e-12)


def test_each_axis_of_gazebo_has_its_own_noise_and_the_rate_is_that_of_the_simulated_sensor() -> None:
    """A model flies at 250 Hz whatever the log was at: the deviation of its samples is that of this rate."""
    noises = {"gx": 1e-4, "gy": 3e-4, "gz": 2e-4}
    markov = GaussMarkov.from_sigma(1e-5, 50.0)
    axes = {name: NoiseModel.of(White(N=n), markov) for name, n in noises.items()}
    text = al.export("gazebo", axes, rate=RATE, axes="each", filter_rate=250.0)
    root = ElementTree.fromstring(text)
    assert root.findtext("update_rate") == "250.0"
    found = [float(root.findtext(f"imu/angular_velocity/{a}/noise/stddev", "nan")) for a in "xyz"]
    assert found == pytest.approx([n * math.sqrt(250) for n in noises.values()], rel=1e-6)
    assert "linear_acceleration: not in the study" in text and root.find("imu/linear_acceleration") is None


def test_simulators_take_the_root_mean_square_and_estimators_the_worst_axis() -> None:
    for name in ALL:
        text = whole(name, sample_study.build())
        rms = "root mean square of the axes" in text
        assert rms == (name in SIMULATORS)


FLICKER = {"g": NoiseModel.of(White(N=1e-4), Flicker(B=1e-5))}
TWO = {
    "g": NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(1e-5, 50.0), GaussMarkov.from_sigma(1e-5, 500.0))
}
TIMES = {
    "g": NoiseModel.of(White(N=1e-4), GaussMarkov.from_sigma(1e-5, 50.0)),
    "a": NoiseModel.of(White(N=1e-3), GaussMarkov.from_sigma(1e-4, 80.0), kind="acceleration"),
}


@pytest.mark.parametrize(
    ("name", "models", "options", "message"),
    [
        *[(name, FLICKER, {}, "needs the correlation time") for name in MARKOVS],
        ("gazebo", TWO, {}, "2 Gauss-Markov terms"),
        ("kf_gins", TIMES, {}, "one correlation time, and the models have 50, 80 s"),
        ("ob_gins", TIMES, {}, "give correlation_time="),
        ("psins", {"g": NoiseModel.of(White(N=1.0), RandomWalk(K=1.0))}, {"correlation_time": 9.0}, "above zero"),
        ("gazebo", FLICKER, {"walk": "K"}, "'upper-bound', 'k-only'"),
        ("gazebo", FLICKER, {"inflate": math.nan}, "positive factor"),
        ("gazebo", FLICKER, {"inflate": "2"}, "positive factor, not '2'"),
        ("gazebo", FLICKER, {"correlation_time": 0.0}, "correlation_time"),
        ("kalibr", FLICKER, {"correlation_time": "9s"}, "positive number of seconds, not '9s'"),
        ("vins", FLICKER, {"filter_rate": 0.0}, "filter_rate"),
        ("px4", FLICKER, {"filter_rate": math.inf}, "filter_rate"),
        ("gazebo", FLICKER, {"filter_rate": -1.0}, "filter_rate"),
        ("kalibr", FLICKER, {"digits": 2}, "digits"),
        ("matlab", FLICKER, {"part": "my part"}, "MATLAB variable"),
        ("gtsam", FLICKER, {"rostopic": "/imu"}, "no option rostopic="),
        ("openvins", FLICKER, {"intrinsics": "upper"}, "kalibr or rpng"),
        ("openvins", FLICKER, {"model": FLICKER}, "a study itself"),
    ],
)  # fmt: skip
def test_refusals(name: str, models: Any, options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        al.export(name, models, rate=RATE, **options)


def test_a_rate_beside_a_study_is_refused_and_not_ignored() -> None:
    with pytest.raises(InputError, match="the study has a sample rate"):
        al.export("vins", sample_study.build(), rate=50.0)
    with pytest.raises(InputError, match=r"not 'study.json'; read a file first: al.Study.load"):
        al.export("vins", "study.json")


#: Escapes, ends of lines of YAML 1.1 and of Python, ends of comments and of texts, no valid character, a long way up.
HOSTILE = (
    "\0x\x1b[31m\u2028evil: 1\x85evil: 1\x0bevil: 1\revil: 1\nevil: 1 -->*/ ''' \"\"\" \\ \ud800 "
    + "../" * 100
)


@pytest.mark.parametrize("name", [*ALL, "openvins", "cpp"])
def test_f10_names_of_any_kind_stay_in_their_comment(name: str) -> None:
    """No control character, which YAML, XML and Python refuse, and no line of the name's own."""
    document = sample_study.build()
    document["channels"][0]["name"] = document["recording"]["channels"][0]["name"] = HOSTILE
    document["provenance"]["source"] = HOSTILE
    given = {"channel": HOSTILE} if name == "cpp" else OPTIONS.get(name, {})
    given |= {"correlation_time": 100.0} if name in (*MARKOVS, "matlab") else {}
    text = al.export(name, document, **given)
    assert text.isascii() and all(c.isprintable() or c in "\n\t" for c in text)
    lines = [line for line in text.splitlines() if "evil" in line]
    assert lines
    elements = {"gazebo": 4 + 2 * (1 + 3 * 6), "gazebo_classic": 6, "mujoco": 3}
    if name in elements:
        root = minidom.parseString(f"<r>{text}</r>").documentElement
        assert len(root.getElementsByTagName("*")) == elements[name]
    elif name in ("matlab", "basalt", "airsim"):
        json.loads(text[text.index("{") : text.rindex("}") + 1])
    else:
        assert all(line.startswith(("#", "%", ";", "//")) for line in lines)
    if name in ("gtsam", "pyins", "gnss_ins_sim", "carla", "isaac"):
        compile(text, name, "exec")


def test_a_correlation_time_of_all_replaces_those_of_the_models() -> None:
    text = al.export("kf_gins", TIMES, rate=RATE, correlation_time=72.0)
    assert consumers.yaml_1_1(text)["imunoise"]["corrtime"] == 0.02
    assert text.count("with T 72 s") == 2


#: Three axes whose largest sigma, driving density and time are never all those of one.
UNLIKE = [
    ((2e-5, 50.0), (3e-5, 500.0), (1e-5, 200.0)),
    ((1e-5, 1.0), (1e-5, 100.0), (1e-5, 1e4)),
    ((9e-5, 20.0), (1e-5, 3e3), (5e-5, 3.0)),
]


def _bias_of(name: str, text: str) -> GaussMarkov:
    """The Gauss-Markov bias that a filter reads for its gyroscopes."""
    degree_per_hour = math.pi / 180 / 3600
    if name == "navego":
        sigma, time = (float(re.search(rf"{k} = \[(\S+),", text)[1]) for k in ("gb_dyn", "gb_corr"))  # type: ignore[index]
        return GaussMarkov.from_sigma(math.radians(sigma), time)
    noise = next(iter(consumers.yaml_1_1(text).values()))
    sigma = noise["gbstd"][0] if name == "kf_gins" else noise["gbstd"]
    return GaussMarkov.from_sigma(sigma * degree_per_hour, noise["corrtime"] * 3600)


@pytest.mark.parametrize("name", ["kf_gins", "ob_gins", "navego"])
@pytest.mark.parametrize("time", [None, 30.0, 900.0])
@pytest.mark.parametrize("biases", UNLIKE)
def test_the_one_bias_of_a_filter_is_above_that_of_every_axis(
    name: str, time: float | None, biases: tuple[tuple[float, float], ...]
) -> None:
    """At every averaging time, and not above more than it must be: it touches one of them at either end."""
    terms = [GaussMarkov.from_sigma(*bias) for bias in biases]
    models = {axis: NoiseModel.of(White(N=1e-4), term) for axis, term in zip("xyz", terms, strict=True)}
    text = al.export(name, models, rate=RATE, digits=9, **({"correlation_time": time} if time else {}))
    written, taus = _bias_of(name, text), np.geomspace(1e-4, 1e9, 131)
    shares = written.avar(taus) / np.max([term.avar(taus) for term in terms], axis=0)
    assert shares.min() > 1 - 1e-6
    assert min(shares[0], shares[-1]) == pytest.approx(1, rel=1e-3)
    if time is None:
        assert max(shares[0], shares[-1]) == pytest.approx(1, rel=1e-3)
        assert "axes of unlike T" in text


@pytest.mark.parametrize("name", [*MARKOVS, "kalibr", "ros_imu"])
def test_a_refusal_for_want_of_a_term_says_which_one_and_its_way_out_works(name: str) -> None:
    walk, white = RandomWalk(K=1e-6), White(N=1e-4)
    with pytest.raises(InputError, match="must have white noise above zero"):
        al.export(name, {"g": NoiseModel.of(walk, GaussMarkov.from_sigma(1e-5, 50.0))}, rate=RATE)
    if name == "ros_imu":
        return
    with pytest.raises(InputError, match="a model with K or B"):
        al.export(name, {"g": NoiseModel.of(white)}, rate=RATE)
    if name in MARKOVS and name != "navego":
        with pytest.raises(InputError, match="walk='k-only' writes its random walk"):
            al.export(name, {"g": NoiseModel.of(white, walk)}, rate=RATE)
    assert al.export(name, {"g": NoiseModel.of(white, walk)}, rate=RATE, walk="k-only")
    with pytest.raises(InputError, match="walk='upper-bound' writes its bias instability"):
        al.export(name, FLICKER, rate=RATE, walk="k-only")
    assert al.export(name, FLICKER, rate=RATE, walk="upper-bound")
    hidden = {"g": NoiseModel.of(White(N=1.0), GaussMarkov.from_sigma(1e-5, 0.1))}
    with pytest.raises(InputError, match="walk='horizon=<seconds>'"):
        al.export(name, hidden, rate=RATE, walk="upper-bound")
    assert al.export(name, hidden, rate=RATE, walk="horizon=10")


# -- a bound stays a bound -----------------------------------------------------------------------------------------


def test_a_bound_above_the_sensor_stays_one() -> None:
    document = sample_study.build()
    for channel in document["channels"]:
        facts = {"probability": 0.95, "shortest": 0.01, "horizon": 1e4, "mean": 1.1, "greatest": 1.2}
        terms = NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-6)).to_json()["terms"]
        made = {"terms": terms, "estimates": [], "overbound": {**facts, "factors": {"N": 1.1, "K": 1.2}}}
        channel["models"] = [made]
    for name in WALKERS:
        text = str(exporters.exporter(name).write(document, axes="worst"))
        assert "INFLATED: with probability 95 %" in text and "not inflated" not in text
    for name in WHITES:
        with pytest.raises(InputError, match=r"terms=\('N',\)"):
            exporters.exporter(name).write(document, axes="worst")
    write = exporters.exporter("kf_gins").write
    with pytest.raises(InputError, match="walk='k-only'"):
        write(document, correlation_time=100.0)
    assert "INFLATED" in str(write(document, walk="k-only"))
    with pytest.raises(InputError, match="axes='worst'"):
        exporters.exporter("gazebo").write(document, walk="k-only")


# -- files and the command ---------------------------------------------------------------------------------------


@pytest.fixture
def study(tmp_path: Path) -> Path:
    place = tmp_path / "study.json"
    place.write_text(json.dumps(sample_study.build()), encoding="utf-8")
    return place


def test_the_command_writes_every_consumer(run: Run, study: Path, tmp_path: Path) -> None:
    listed = run("export", "--list").out
    for name in (*ALL, "cpp", "imu_tk"):
        assert re.search(rf"^{name.replace('_', '-')} ", listed, re.M), name
    for name in ALL:
        target, time = tmp_path / name, () if name in WHITES else ("--correlation-time", "100s")
        done = run("export", name.replace("_", "-"), study, *time, "-o", target)
        assert done.code == 0, done.err
        assert target.exists()
    assert run("export", "kf-gins", study, "--axes", "each", "--correlation-time", "100s").code == 0
    refused = run("export", "gazebo", study)
    assert refused.code == 1
    assert "give --correlation-time (seconds), or --walk upper-bound" in " ".join(refused.err.split())


def test_binary_files_are_written_whole_and_the_same_every_time(tmp_path: Path) -> None:
    first = al.export("matlab", MODELS, tmp_path / "m", rate=RATE)
    assert re.search(r"# imu_sensor.mat: binary, \d+ bytes", first)
    content = (tmp_path / "m" / "imu_sensor.mat").read_bytes()
    assert content == made_by("matlab", MODELS)["imu_sensor.mat"]
    assert content.startswith(b"MATLAB 5.0 MAT-file, written by allanite")
    assert consumers.mat(content)["SampleRate"].item() == RATE
    with pytest.raises(StorageError, match="--force"):
        al.export("matlab", MODELS, tmp_path / "m", rate=RATE)


def test_json_of_matlab_holds_what_loadparams_takes() -> None:
    """Parts with Gyroscope and Accelerometer, whose values are numbers."""
    parts = json.loads(made_by("matlab", MODELS, part="unit7")["imu_sensor.json"])
    assert list(parts) == ["unit7"]
    assert not any(
        "Gyroscope" in key or "Accelerometer" in key for key in parts["unit7"] if key[0] not in "GA"
    )
    for sensor in ("Gyroscope", "Accelerometer"):
        values: list[Any] = [v for row in parts["unit7"][sensor].values() for v in row]
        assert len(values) == 9
        assert all(isinstance(v, float) for v in values)


def test_gtsam_module_sets_the_parameters_that_there_are() -> None:
    """ImuFactor's parameters have no setters of the bias (GTSAM 4.3): `apply` failed on them."""
    told: dict[str, Any] = {}
    samples, bias = ("setGyroscopeCovariance", "setAccelerometerCovariance"), (
        "setBiasOmegaCovariance",
        "setBiasAccCovariance",
    )  # fmt: skip
    names = consumers.python_names(al.export("gtsam", MODELS, rate=RATE))
    for able in (samples, samples + bias):
        told.clear()
        params = SimpleNamespace(**{n: lambda value, n=n: told.__setitem__(n, np.array(value)) for n in able})
        assert names["apply"](params) is params
        assert set(told) == set(able)
        assert told["setGyroscopeCovariance"] == pytest.approx(np.eye(3) * 7.6154e-09, rel=1e-4)
    with pytest.raises(AttributeError, match="setGyroscopeCovariance"):
        names["apply"](SimpleNamespace())
    walks = np.array([2.9857e-05] * 3 + [3.7107e-06] * 3)
    assert names["bias_sigmas"](4.0) == pytest.approx(2 * walks, rel=1e-4)


@pytest.mark.parametrize("name", ["lio_sam", "kimera"])
def test_gtsam_itself_propagates_what_its_users_give_it(name: str) -> None:
    """The squares of their keys are its covariances; the bias between two scans has sqrt(t) of its sigma."""
    gtsam = pytest.importorskip("gtsam", reason="GTSAM's wheel is not installed")
    k = consumers.yaml_1_1(al.export(name, MODELS, rate=RATE, walk="k-only", digits=15))
    keys = ("imuGyrNoise", "imuGyrBiasN", "imuAccNoise", "imuAccBiasN")
    if name == "kimera":
        keys = tuple(f"{s}_{what}" for s in (GYRO, ACCEL) for what in ("noise_density", "random_walk"))
    noise, walk, noise_a, walk_a = (k.get("lio_sam", k)[key] for key in keys)
    params = gtsam.PreintegrationParams.MakeSharedU(9.81)
    params.setGyroscopeCovariance(np.eye(3) * noise**2)
    params.setAccelerometerCovariance(np.eye(3) * noise_a**2)
    params.setIntegrationCovariance(np.zeros((3, 3)))
    made = gtsam.PreintegratedImuMeasurements(params, gtsam.imuBias.ConstantBias())
    for _ in range(100):
        made.integrateMeasurement(np.zeros(3), np.zeros(3), 1 / RATE)
    found, seconds = made.preintMeasCov(), made.deltaTij()
    for sensor, variance, sigma in ((GYRO, found[0, 0], walk), (ACCEL, found[6, 6], walk_a)):
        own = OF_SENSOR[sensor]
        assert variance == pytest.approx(own.term("white").N ** 2 * seconds, rel=1e-3)
        assert math.sqrt(seconds) * sigma == pytest.approx(
            math.sqrt(bias_of(NoiseModel.of(own.term("random_walk")), seconds)), rel=1e-9
        )


def test_gtsam_itself_propagates_the_variances_of_the_model() -> None:
    gtsam = pytest.importorskip("gtsam", reason="GTSAM's wheel is not installed")
    names = consumers.python_names(al.export("gtsam", MODELS, rate=RATE, walk="k-only", digits=15))
    seconds, dt = 1.0, 1 / RATE
    for kind, name in (
        (gtsam.PreintegrationParams, "PreintegratedImuMeasurements"),
        (gtsam.PreintegrationCombinedParams, "PreintegratedCombinedMeasurements"),
    ):
        params = names["apply"](kind.MakeSharedU(0.0))
        params.setIntegrationCovariance(np.zeros((3, 3)))
        made = getattr(gtsam, name)(params, gtsam.imuBias.ConstantBias())
        for _ in range(round(seconds / dt)):
            made.integrateMeasurement(np.zeros(3), np.zeros(3), dt)
        found = made.preintMeasCov()
        own = {s: (m.term("white").N, m.term("random_walk").K) for s, m in OF_SENSOR.items()}
        (n, k), (n_a, k_a) = own[GYRO], own[ACCEL]
        assert found[0, 0] == pytest.approx(n**2 * seconds, rel=1e-3)
        assert found[6, 6] == pytest.approx(n_a**2 * seconds, rel=1e-3)
        if found.shape == (15, 15):
            assert (found[9, 9], found[12, 12]) == pytest.approx((k_a**2 * seconds, k**2 * seconds), rel=1e-9)
    sigmas = gtsam.noiseModel.Diagonal.Sigmas(np.array(names["bias_sigmas"](seconds)))
    gtsam.BetweenFactorConstantBias(0, 1, gtsam.imuBias.ConstantBias(), sigmas)
    assert sigmas.sigmas() == pytest.approx([k_a] * 3 + [k] * 3, rel=1e-9)


def test_openvins_of_a_study_alone_says_that_nothing_is_calibrated() -> None:
    text = al.export("openvins", MODELS, rate=RATE)
    chain = consumers.yaml_1_1(text)["imu0"]
    assert "NOT CALIBRATED" in text
    for key in ("Tw", "Ta", "R_IMUtoGYRO", "R_IMUtoACC"):
        assert np.array_equal(chain[key], np.eye(3))
    assert not np.array(chain["Tg"]).any()
