# SPDX-License-Identifier: BSD-3-Clause
"""Exported files: what the consumer's own code makes of them, and what is refused.

The worked example is a gyroscope with N = 0.3 deg/sqrt(h), B = 5 deg/h, T = 100 s, K = 5 deg/h/sqrt(h) and an
accelerometer with N = 0.03 m/s/sqrt(h), B = 20 ug, T = 100 s, K = 5 ug/sqrt(h), at 200 Hz.
"""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
import sample_study
from allanite import exporters
from allanite.errors import InputError, StorageError
from allanite.noise import FLICKER_FLOOR, SIGMA_PER_B, Flicker, GaussMarkov, NoiseModel, RandomWalk, White

GOLDEN = Path(__file__).parents[1] / "published"
DEG, MICRO_G = math.radians(1), 9.80665e-6
KEYS = [
    "rostopic",
    "update_rate",
    "accelerometer_noise_density",
    "accelerometer_random_walk",
    "gyroscope_noise_density",
    "gyroscope_random_walk",
]
#: YAML 1.1, https://yaml.org/type/float.html: what a reader of that version takes for a number with a point.
YAML_FLOAT = re.compile(r"[-+]?[0-9][0-9_]*\.[0-9_]*([eE][-+][0-9]+)?")

GYRO = NoiseModel.of(
    White(N=0.3 * DEG / 60),
    GaussMarkov.from_sigma(SIGMA_PER_B * 5 * DEG / 3600, 100.0),
    RandomWalk(K=5 * DEG / 3600 / 60),
)
ACCELEROMETER = NoiseModel.of(
    White(N=0.03 / 60),
    GaussMarkov.from_sigma(SIGMA_PER_B * 20 * MICRO_G, 100.0),
    RandomWalk(K=5 * MICRO_G / 60),
    kind="acceleration",
)
EXAMPLE = {"gyro": GYRO, "accel": ACCELEROMETER}


def parse(text: str) -> dict[str, Any]:
    """The keys of a flat YAML file, as a reader of YAML 1.1 takes them."""
    found: dict[str, Any] = {}
    for line in text.splitlines():
        line = line.split("#")[0].strip()
        if line:
            key, value = (part.strip() for part in line.split(":", 1))
            found[key] = float(value) if YAML_FLOAT.fullmatch(value) else value
    return found


def exported(**options: Any) -> dict[str, Any]:
    return parse(al.export("kalibr", EXAMPLE, rate=200.0, **options))


def estimate(
    symbol: str, value: float | None, lower: float = 0.0, upper: float | None = None
) -> dict[str, Any]:
    supported = value is not None
    return {
        "symbol": symbol,
        "value": value,
        "lower": lower,
        "upper": upper,
        "supported": supported,
        "note": "",
    }


def fitted(name: str, *terms: Any, kind: str = "rate", estimates: Any = ()) -> dict[str, Any]:
    """One channel of a study."""
    model = {**NoiseModel.of(*terms).to_json(), "family": "flicker", "estimates": list(estimates)}
    return {"name": name, "kind": kind, "unit": "rad/s", "models": [model]}


def study(*channels: dict[str, Any]) -> dict[str, Any]:
    return {
        "provenance": {"source": "lab bench.csv", "sha256": "ab" * 32},
        "recording": {"rate": 200.0, "duration": 7200.0},
        "channels": list(channels),
    }


# -- what is said ------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["kalibr", "px4", "gtsam", "vins", "openvins", "matlab", "cpp"])
@pytest.mark.parametrize("factor", [1.5, 4.4721])
def test_a_file_says_that_its_white_noise_is_aliased(name: str, factor: float) -> None:
    """And says nothing where samples average all of their interval."""
    whole = fitted("gyro_x", White(N=1e-4), RandomWalk(K=1e-6))
    part = whole | {"aliasing": {"aperture": 0.005, "interval": 0.005 * factor**2, "factor": factor}}
    options = {"channel": "gyro_x"} if name == "cpp" else {}
    said = str(al.export(name, study(part), **options))
    assert "ALIASED: each sample averages 0.005 s" in said and f"{factor:.4g} times smaller" in said
    assert "ALIASED" not in str(al.export(name, study(whole | {"aliasing": None}), **options))


# -- the numbers ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("walk", "gyro", "accelerometer"),
    [
        ("k-only", 4.0401e-07, 8.1722e-07),
        ("upper-bound", 3.7107e-06, 2.9857e-05),
        ("horizon=30", 3.3309e-06, None),
        ("horizon=100", 2.6504e-06, None),
        ("horizon=1000", 7.1428e-07, None),
    ],
)
def test_worked_example(walk: str, gyro: float, accelerometer: float | None) -> None:
    found = exported(walk=walk)
    assert list(found) == KEYS
    assert found["gyroscope_noise_density"] == pytest.approx(8.7266e-05, rel=1e-5)
    assert found["accelerometer_noise_density"] == pytest.approx(5e-4, rel=1e-6)
    assert found["gyroscope_random_walk"] == pytest.approx(gyro, rel=2e-5)
    if accelerometer is not None:
        assert found["accelerometer_random_walk"] == pytest.approx(accelerometer, rel=2e-5)


def test_flicker_with_a_correlation_time_gives_the_same() -> None:
    flicker = {}
    for name, model in EXAMPLE.items():
        white, gm, walk = model.terms
        flicker[name] = NoiseModel.of(white, Flicker(B=gm.B_equiv), walk, kind=model.kind)
    for walk in ("upper-bound", "horizon=30"):
        again = parse(al.export("kalibr", flicker, rate=200.0, walk=walk, correlation_time=100.0))
        for key, value in exported(walk=walk).items():
            assert again[key] == (pytest.approx(value, rel=1e-6) if isinstance(value, float) else value)


def test_every_value_is_a_yaml_1_1_float() -> None:
    for rate in (200.0, 99.97, 100, 1e-4, 1e6, 1 / 3):
        found = parse(al.export("kalibr", EXAMPLE, rate=rate))
        assert found.pop("rostopic") == "/imu0"
        assert all(isinstance(value, float) for value in found.values()), found
        assert found["update_rate"] == pytest.approx(rate, rel=1e-6)


def test_golden_file() -> None:
    n, b = GYRO.terms[0].N, 5 * DEG / 3600
    flicker = estimate("B", b, 2.2e-5, 2.7e-5)
    x = [estimate("N", n, 8.6e-5, 8.9e-5), flicker, estimate("K", None, upper=4.0401e-7)]
    y = [estimate("N", 8e-5, 7.9e-5, 8.1e-5), flicker, estimate("K", 4.1e-7, 3e-7, 5e-7)]
    z = [
        estimate("N", 8.5e-5, 8.4e-5, 8.6e-5),
        estimate("B", None, upper=1.1e-5),
        estimate("K", None, upper=3e-7),
    ]
    channels = [
        fitted("gx", White(N=n), Flicker(B=b), estimates=x),
        fitted("gy", White(N=8e-5), Flicker(B=b), RandomWalk(K=4.1e-7), estimates=y),
        fitted("gz", White(N=8.5e-5), estimates=z),
    ]
    text = al.export("kalibr", study(*channels)).replace(al.__version__, "VERSION")
    assert text == (GOLDEN / "kalibr_imu.yaml").read_text(encoding="utf-8")


def test_worst_axis_and_root_mean_square() -> None:
    axes = {
        n: NoiseModel.of(White(N=w), RandomWalk(K=k))
        for n, w, k in (("x", 3e-4, 1e-6), ("y", 4e-4, 2e-6), ("z", 1e-4, 7e-6))
    }
    worst = parse(al.export("kalibr", axes, rate=100.0, walk="k-only"))
    rms = parse(al.export("kalibr", axes, rate=100.0, walk="k-only", axes="rms"))
    assert (worst["gyroscope_noise_density"], worst["gyroscope_random_walk"]) == (4e-4, 7e-6)
    assert rms["gyroscope_noise_density"] == pytest.approx(math.sqrt(26e-8 / 3), rel=1e-6)
    assert rms["gyroscope_random_walk"] == pytest.approx(math.sqrt(54e-12 / 3), rel=1e-6)


def test_inflation_is_explicit() -> None:
    plain, text = exported(), al.export("kalibr", EXAMPLE, rate=200.0, inflate=10.0)
    for key in KEYS[2:]:
        assert parse(text)[key] == pytest.approx(10 * plain[key], rel=1e-6)
    assert "INFLATED by 10" in text
    assert "not inflated" in al.export("kalibr", EXAMPLE, rate=200.0)


# -- what Kalibr makes of it ------------------------------------------------------------------------------


def stepped(found: dict[str, Any], seconds: float) -> float:
    """Variance of the bias drift after some time in the consumer: steps of walk/sqrt(rate), rate of them a second."""
    step = found["gyroscope_random_walk"] / math.sqrt(found["update_rate"])
    return seconds * found["update_rate"] * step**2


@pytest.mark.parametrize("seconds", [1.0, 10.0, 100.0, 1000.0])
def test_round_trip_of_the_drift(seconds: float) -> None:
    gm, k = GYRO.term("gauss_markov"), GYRO.term("random_walk")
    walk = k.K**2 * seconds
    drift = walk - 2 * gm.sigma**2 * math.expm1(-seconds / gm.T)
    assert stepped(exported(walk="k-only"), seconds) == pytest.approx(walk, rel=1e-6)
    bound = stepped(exported(walk="upper-bound"), seconds)
    assert drift <= bound <= walk + gm.q**2 * seconds * (1 + 1e-6)
    if seconds == 1.0:
        assert bound == pytest.approx(drift, rel=0.01)
    matched = (
        stepped(exported(walk=f"horizon={seconds}"), seconds) / 3
    )  # Allan variance of a walk after the time
    assert matched == pytest.approx(float(gm.avar(seconds) + k.avar(seconds)), rel=1e-6)


def test_round_trip_of_the_white_noise(rng: np.random.Generator) -> None:
    """Samples made with the consumer's own formula, noise * sqrt(rate), have the density they came from."""
    found, n = exported(), 200_000
    y = found["gyroscope_noise_density"] * math.sqrt(found["update_rate"]) * rng.standard_normal(n)
    curve = al.allan_curve(al.Recording.from_rate(y, rate=200.0, unit="rad/s"), taus=[0.005])
    expected = GYRO.term("white").N / math.sqrt(0.005)
    assert float(curve.deviation[0, 0]) == pytest.approx(expected, rel=4 * math.sqrt(0.5 / (n * 2 / 3)))


def test_upper_bound_of_flicker_lies_above_it_wherever_flicker_exceeds_white_noise() -> None:
    n, b, k = 1e-4, 3e-5, 2e-7
    found = parse(
        al.export("kalibr", {"x": NoiseModel.of(White(N=n), Flicker(B=b), RandomWalk(K=k))}, rate=10.0)
    )
    walk, floor = found["gyroscope_random_walk"], (FLICKER_FLOOR * b) ** 2
    for tau in np.geomspace(1e-2, 1e5, 60):
        model = floor + k**2 * tau / 3
        if floor > n**2 / tau:
            assert walk**2 * tau / 3 >= model * (1 - 1e-6)
        assert n**2 / tau + walk**2 * tau / 3 >= (n**2 / tau + model) / 1.21
    assert walk == pytest.approx(math.hypot(k, math.sqrt(3) * floor / n), rel=1e-6)


@pytest.mark.parametrize("seed", range(12))
def test_upper_bound_of_a_gauss_markov_term_lies_above_it_wherever_it_exceeds_white_noise(seed: int) -> None:
    """And with the white noise it covers the term, though it may be far smaller than the density that drives it."""
    rng = np.random.default_rng([20261128, seed])
    n = 1e-4
    for sigma, time in 10 ** rng.uniform(-3, 3, (8, 2)):
        term = GaussMarkov.from_sigma(n * sigma, time)
        model = NoiseModel.of(White(N=n), term, RandomWalk(K=1e-9 * term.q))
        walk = parse(al.export("kalibr", {"x": model}, rate=1e6))["gyroscope_random_walk"]
        tau = time * np.geomspace(1e-5, 1e6, 300)
        white, bias, drift = n**2 / tau, np.asarray(term.avar(tau)), walk**2 * tau / 3
        assert np.all(drift[bias > white] >= bias[bias > white] * (1 - 1e-6))
        assert np.all(white + drift >= (white + bias) / 1.21)
        assert walk <= term.q * (1 + 1e-6)
        if n > 2.2 * term.q * time:
            assert walk < 1e-6 * term.q


def test_a_term_that_white_noise_hides_does_not_drive_the_walk() -> None:
    """The rival of a random walk whose time the record does not determine."""
    rival = NoiseModel.of(White(N=2e-3), GaussMarkov(q=1.78e-3, T=0.9771), RandomWalk(K=1e-4))
    assert parse(al.export("kalibr", {"x": rival}, rate=200.0))["gyroscope_random_walk"] < 5.3e-4


# -- limits and choices -----------------------------------------------------------------------------------


def test_limits_are_used_and_said() -> None:
    limits = [
        estimate("N", 1e-4, 9e-5, 1.1e-4),
        estimate("B", None, upper=2e-6),
        estimate("K", None, upper=3e-8),
    ]
    document = study(fitted("w", White(N=1e-4), estimates=limits))
    text = al.export("kalibr", document)
    q = math.sqrt(3) * (FLICKER_FLOOR * 2e-6) ** 2 / 1e-4
    assert parse(text)["gyroscope_random_walk"] == pytest.approx(math.hypot(3e-8, q), rel=1e-6)
    assert text.count("95 % upper limit") == 2
    assert parse(al.export("kalibr", document, walk="k-only"))["gyroscope_random_walk"] == 3e-8


def test_missing_limit_is_refused() -> None:
    endless = [
        estimate("N", 1e-4, 9e-5, 1.1e-4),
        estimate("B", 1e-6, 9e-7, 2e-6),
        estimate("K", None, upper=None),
    ]
    for walk in ("k-only", "upper-bound"):
        with pytest.raises(InputError, match="K has neither a value nor an upper limit"):
            al.export(
                "kalibr", study(fitted("w", White(N=1e-4), Flicker(B=1e-6), estimates=endless)), walk=walk
            )


def test_gauss_markov_below_its_limit_is_bounded_by_b_equiv() -> None:
    limits = [
        estimate("N", 1e-4, 9e-5, 1.1e-4),
        estimate("B_equiv", None, upper=2e-6),
        estimate("K", 3e-8, 2e-8, 4e-8),
    ]
    found = parse(
        al.export("kalibr", study(fitted("w", White(N=1e-4), RandomWalk(K=3e-8), estimates=limits)))
    )
    assert found["gyroscope_random_walk"] > 3e-8


def test_undecided_families_give_the_larger_numbers() -> None:
    channel = fitted("w", White(N=1e-4), Flicker(B=1e-5), RandomWalk(K=1e-7))
    other = NoiseModel.of(White(N=1.1e-4), GaussMarkov.from_sigma(1.1e-5, 50.0), RandomWalk(K=2e-7)).to_json()
    text = al.export("kalibr", study({**channel, "models": [*channel["models"], other]}))
    alone = [
        parse(al.export("kalibr", study({**channel, "models": [m]}))) for m in (channel["models"][0], other)
    ]
    for key in ("gyroscope_noise_density", "gyroscope_random_walk"):
        assert parse(text)[key] == max(a[key] for a in alone)
    assert "cannot decide" in text


@pytest.mark.parametrize(("kind", "name"), [("rate", "gyro"), ("acceleration", "accelerometer")])
@pytest.mark.parametrize("consumer", ["kalibr", "cpp", "openvins"])
def test_one_model_by_itself_is_that_of_its_sensor(consumer: str, kind: str, name: str) -> None:
    model = NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-6), kind=kind)
    assert al.export(consumer, model, rate=100.0) == al.export(consumer, {name: model}, rate=100.0)


def test_missing_triad_is_commented_out() -> None:
    text = al.export("kalibr", {"x": GYRO}, rate=200.0)
    assert list(parse(text)) == [k for k in KEYS if not k.startswith("accel")]
    assert "# accelerometer_noise_density:" in text
    assert "accelerometer: the log holds none" in text


def test_six_axes_of_a_whole_study() -> None:
    document = sample_study.build()
    text = al.export("kalibr", document)
    assert list(parse(text)) == KEYS
    for name in ("gyro_x", "gyro_z", "acc_y", document["provenance"]["sha256"]):
        assert name in text
    assert al.export("kalibr", al.Study.from_json(document)) == text
    two = al.export(
        "kalibr", document, gyroscope=["gyro_x"], accelerometer=["acc_x", "acc_y"], rostopic="/imu/data_raw"
    )
    assert "gyro_y" not in two
    assert parse(two)["rostopic"] == "/imu/data_raw"


def test_user_text_stays_in_its_comment() -> None:
    channel = fitted("ω\nrostopic: evil", White(N=1e-4), RandomWalk(K=1e-7))
    text = al.export("kalibr", study(channel))
    assert parse(text)["rostopic"] == "/imu0"
    assert text.isascii()


@pytest.mark.parametrize(
    ("channels", "options", "message"),
    [
        ([fitted("v", White(N=1.0), kind="voltage")], {}, "known units"),
        ([fitted("c", White(N=1.0), kind="unknown")], {}, r"c \(unknown\)"),
        ([], {}, "no channel"),
        ([fitted(f"g{i}", White(N=1.0), RandomWalk(K=1.0)) for i in range(4)], {}, "4 gyroscope channels"),
        ([{**fitted("g", White(N=1.0)), "models": []}], {}, "no noise model"),
        ([fitted("g", RandomWalk(K=1.0))], {}, "above zero"),
        ([fitted("g", White(N=1.0))], {"walk": "k-only"}, "above zero"),
        ([fitted("g", White(N=1.0), RandomWalk(K=1.0))], {"walk": "K"}, "'upper-bound', 'k-only'"),
        ([fitted("g", White(N=1.0), RandomWalk(K=1.0))], {"walk": "horizon=0"}, "horizon"),
        ([fitted("g", White(N=1.0), RandomWalk(K=1.0))], {"walk": "horizon=1e-"}, "horizon"),
        ([fitted("g", White(N=1.0), RandomWalk(K=1.0))], {"axes": "mean"}, "'worst' or 'rms'"),
        ([fitted("g", White(N=1.0), RandomWalk(K=1.0))], {"inflate": 0.0}, "positive factor"),
        ([fitted("g", White(N=1.0), RandomWalk(K=1.0))], {"correlation_time": -1.0}, "correlation_time"),
        ([fitted("g", White(N=1.0), RandomWalk(K=1.0))], {"rostopic": "a: b"}, "ROS topic"),
        ([fitted("g", White(N=1.0), RandomWalk(K=1.0))], {"gyroscope": ["h"]}, "no gyroscope channel 'h'"),
        ([fitted("g", White(N=1.0), RandomWalk(K=1.0))], {"wlak": "k-only"}, "no option wlak="),
    ],
)  # fmt: skip
def test_refusals(channels: list[dict[str, Any]], options: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        al.export("kalibr", study(*channels), **options)


@pytest.mark.parametrize(
    ("given", "message"),
    [
        ({}, "needs a study"),
        ({"a": 1}, "not a study"),
        (3, "not int"),
        (EXAMPLE, "rate="),
        (GYRO, "rate="),
    ],
)
def test_what_is_no_study_is_refused(given: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        al.export("kalibr", given)


# -- registry and files -----------------------------------------------------------------------------------


def test_registry() -> None:
    for name in exporters.EXPORTERS:
        module = exporters.exporter(name)
        assert module.NAME == name
        assert module.SUMMARY
        assert list(GOLDEN.glob(f"{name}[_.]*")), "every exporter has a golden file"
        assert f'"{name.replace("_", "-")}"' in (exporters.export.__doc__ or ""), (
            "its docstring names them all"
        )
    with pytest.raises(InputError, match="there are: kalibr"):
        exporters.exporter("excel")
    for near, meant in {"Kalibr": "kalibr", "orbslam3": "orb-slam3", "gnss_inssim": "gnss-ins-sim"}.items():
        with pytest.raises(InputError, match=f"did you mean '{meant}'"):
            exporters.exporter(near)
    assert exporters.exporter("imu-tk") is exporters.exporter("imu_tk")


def test_file_is_written_whole_and_never_by_accident(tmp_path: Path) -> None:
    path = tmp_path / exporters.exporter("kalibr").FILE_NAME
    text = al.export("kalibr", EXAMPLE, path, rate=200.0)
    assert path.read_text(encoding="utf-8") == text
    with pytest.raises(StorageError, match="--force"):
        al.export("kalibr", EXAMPLE, path, rate=100.0)
    assert path.read_text(encoding="utf-8") == text
    al.export("kalibr", EXAMPLE, path, rate=100.0, force=True)
    assert "update_rate: 100.0" in path.read_text(encoding="utf-8")
    with pytest.raises(StorageError):
        al.export("kalibr", EXAMPLE, tmp_path / "absent" / "imu.yaml", rate=100.0)
