# SPDX-License-Identifier: BSD-3-Clause
"""The errors of a unit: their equation and its inverse, records calibrated as they are read, files."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import allanite as al
from allanite.errors import FormatError, InputError
from allanite.recording.calibration import ACCELEROMETER, GYRO, Calibration, TriadErrors, parameter_names
from allanite.recording.records import Kind

CHANNELS = {ACCELEROMETER: ("ax", "ay", "az"), GYRO: ("gx", "gy", "gz")}


def some(
    rng: np.random.Generator, *, frame: Any = "z", temperature: bool = False, following: bool = False
) -> Calibration:
    """A consumer unit: every parameter far from nominal, with a full covariance; its gyros may follow gravity."""
    names = parameter_names(ACCELEROMETER, frame=frame, quadratic=True) + parameter_names(
        GYRO, temperature=temperature, gravity_sensitivity=following
    )
    size = {"bias": 0.1, "scale": 0.02, "misalignment": 0.02, "quadratic": 1e-4, "bias_temperature": 1e-3}
    size["gravity_sensitivity"] = 1e-3
    sds = np.array([size[n.split(".")[1].rpartition("_")[0]] for n in names])
    values = sds * rng.standard_normal(len(names)) + [1.0 if ".scale_" in n else 0.0 for n in names]
    root = sds[:, None] * rng.standard_normal((len(names), len(names))) / 100
    return Calibration(
        names=names,
        values=values,
        covariance=root @ root.T,
        status=("estimated",) * len(names),
        frame=frame,
        channels=CHANNELS,
        units={ACCELEROMETER: "m/s²", GYRO: "rad/s"},
        temperature=25.0,
        gravity=9.81,
        date="2026-01-02",
        source="unit.csv",
    )


# -- names ------------------------------------------------------------------------------------------------


def test_names_of_the_parameters() -> None:
    gyro = parameter_names(GYRO)
    assert len(gyro) == 12
    assert gyro[:4] == ("gyro.bias_x", "gyro.bias_y", "gyro.bias_z", "gyro.scale_x")
    assert {n for n in gyro if "mis" in n} == {
        f"gyro.misalignment_{p}" for p in ("xy", "xz", "yx", "yz", "zx", "zy")
    }
    assert len(parameter_names(ACCELEROMETER, frame="z", quadratic=True, temperature=True)) == 15
    following = parameter_names(GYRO, gravity_sensitivity=True)[12:]
    assert len(following) == 9 and following[1] == "gyro.gravity_sensitivity_xy"
    assert parameter_names(ACCELEROMETER, gravity_sensitivity=True) == parameter_names(ACCELEROMETER)


@pytest.mark.parametrize(("frame", "fixed"), [("z", (2, 1)), ("x", (0, 1))])
def test_a_triad_that_defines_the_body(frame: Any, fixed: tuple[int, int], rng: np.random.Generator) -> None:
    """Its first axis is that of the body, and the second lies in the plane of the first two."""
    matrix = some(rng, frame=frame).errors(ACCELEROMETER).matrix
    axis, second = fixed
    third = 3 - axis - second
    assert matrix[axis, second] == matrix[axis, third] == matrix[second, third] == 0
    assert np.count_nonzero(matrix) == 6


# -- the equation -----------------------------------------------------------------------------------------


def test_equation_1_by_hand() -> None:
    values = {
        "gyro.bias_x": 0.5,
        "gyro.scale_x": 2.0,
        "gyro.scale_y": 3.0,
        "gyro.misalignment_xy": 0.1,
        "gyro.misalignment_zx": -0.2,
        "gyro.quadratic_y": 0.01,
        "gyro.bias_temperature_z": 0.25,
        "gyro.gravity_sensitivity_xz": 0.5,
        "gyro.gravity_sensitivity_yx": -2.0,
    }
    names = tuple(values)
    k = len(names)
    errors = Calibration(
        names=names,
        values=np.array(list(values.values())),
        covariance=np.zeros((k, k)),
        status=("held",) * k,
    ).errors(GYRO)
    x = np.array([1.0, 2.0, 3.0])
    curved = 2.0 + 0.01 * 4.0
    expected = [2.0 * (1.0 + 0.1 * curved) + 0.5, 3.0 * curved, 3.0 - 0.2 * 1.0]
    np.testing.assert_allclose(errors.seen(x, force=np.zeros(3)), expected, rtol=1e-15)
    seen = errors.seen(x, 4.0, [1.0, 50.0, 10.0])
    np.testing.assert_allclose(seen, np.add(expected, [5.0, -2.0, 1.0]), rtol=1e-15)
    with pytest.raises(InputError, match="follow gravity"):
        errors.seen(x)


@given(
    st.lists(st.floats(-50.0, 50.0), min_size=3, max_size=3), st.integers(0, 2**32 - 1), st.floats(-40, 40)
)
def test_true_is_the_inverse_of_seen(x: list[float], seed: int, warmer: float) -> None:
    unit = some(np.random.default_rng(seed), temperature=True, following=True)
    force = np.array([3.0, -7.0, 5.0])
    for sensor in unit.sensors:
        errors = unit.errors(sensor)
        seen = errors.seen(x, warmer, force)
        np.testing.assert_allclose(errors.true(seen, warmer, force), x, rtol=1e-10, atol=1e-12)


def test_vectors_of_any_shape_and_their_temperatures(rng: np.random.Generator) -> None:
    errors = some(rng, temperature=True).errors(GYRO)
    x, warmer = rng.standard_normal((4, 5, 3)), rng.standard_normal((4, 5))
    y = errors.seen(x, warmer)
    assert y.shape == x.shape
    np.testing.assert_allclose(y[2, 3], errors.seen(x[2, 3], warmer[2, 3]), rtol=1e-14)
    np.testing.assert_allclose(errors.true(y, warmer), x, atol=1e-14)


def test_perfect_sensors_change_nothing(rng: np.random.Generator) -> None:
    unit = Calibration.nominal(GYRO, ACCELEROMETER)
    x = rng.standard_normal((7, 3))
    for sensor in (GYRO, ACCELEROMETER):
        np.testing.assert_array_equal(unit.errors(sensor).seen(x), x)
    assert unit.sensors == (ACCELEROMETER, GYRO)
    assert not unit.sd.any() and set(unit.status) == {"held"}
    np.testing.assert_array_equal(TriadErrors(bias=np.zeros(3), matrix=np.eye(3)).true(x), x)


# -- parameters -------------------------------------------------------------------------------------------


def test_one_parameter_by_its_name(rng: np.random.Generator) -> None:
    unit = some(rng)
    i = unit.names.index("gyro.scale_y")
    assert unit["gyro.scale_y"] == (unit.values[i], math.sqrt(unit.covariance[i, i]))
    with pytest.raises(InputError, match=r"no parameter 'gyro.scale'; there are: accelerometer.bias_x"):
        unit["gyro.scale"]


def test_with_values_moves_only_the_values(rng: np.random.Generator) -> None:
    unit = some(rng)
    moved = unit.with_values(unit.values + 1)
    np.testing.assert_array_equal(moved.values, unit.values + 1)
    assert replace(moved, values=unit.values).to_json() == unit.to_json()


def test_with_repeatability_adds_variances(rng: np.random.Generator) -> None:
    unit = some(rng)
    more = unit.with_repeatability(
        {"gyro.bias": 0.3, "accelerometer.bias_z": 0.04, "gyro.misalignment": 0.01}
    )
    added = np.diag(more.covariance) - np.diag(unit.covariance)
    for name, got in zip(unit.names, added, strict=True):
        sensor, kind = name.split(".")
        expected = 0.0
        if sensor == GYRO and kind.startswith("bias_"):
            expected = 0.3**2
        elif name == "accelerometer.bias_z":
            expected = 0.04**2
        elif sensor == GYRO and kind.startswith("misalignment_"):
            expected = 0.01**2
        assert got == pytest.approx(expected, abs=1e-15), name
    off = ~np.eye(len(unit.names), dtype=bool)
    np.testing.assert_array_equal(more.covariance[off], unit.covariance[off])


def test_repeatability_of_a_bias_is_not_that_of_its_slope(rng: np.random.Generator) -> None:
    unit = some(rng, temperature=True)
    added = np.diag(unit.with_repeatability({"gyro.bias": 1.0}).covariance - unit.covariance)
    assert [n for n, a in zip(unit.names, added, strict=True) if a] == [f"gyro.bias_{a}" for a in "xyz"]


# -- records ----------------------------------------------------------------------------------------------


def recorded(
    unit: Calibration, rng: np.random.Generator, count: int = 500
) -> tuple[al.Recording, np.ndarray]:
    """A record of known vectors, in everyday units, with a temperature, and the vectors (count, 6)."""
    true = rng.standard_normal((count, 6)) * [9.8, 9.8, 9.8, 1.0, 1.0, 1.0]
    force, rate = true[:, :3], true[:, 3:]
    y = np.hstack([unit.errors(ACCELEROMETER).seen(force), unit.errors(GYRO).seen(rate, force=force)])
    parts = [
        al.Recording.from_rate(y[:, :3] / 9.80665, rate=100.0, unit="g", names=CHANNELS[ACCELEROMETER]),
        al.Recording.from_rate(np.degrees(y[:, 3:]), rate=100.0, unit="deg/s", names=CHANNELS[GYRO]),
        al.Recording.from_rate(np.full(count, 25.0), rate=100.0, unit="°C", names="t"),
    ]
    return al.Recording(
        channels=sum((p.channels for p in parts), ()), columns=sum((p.columns for p in parts), ()), rate=100.0
    ), true


@pytest.mark.parametrize("following", [False, True])
def test_applied_to_a_record_in_everyday_units(rng: np.random.Generator, following: bool) -> None:
    unit = some(rng, following=following)
    record, true = recorded(unit, rng)
    got = unit.apply(record)
    values = np.stack([got.values(n) for n in (*CHANNELS[ACCELEROMETER], *CHANNELS[GYRO])], axis=1)
    np.testing.assert_allclose(values, true, atol=1e-12)
    assert [(c.kind, c.unit, c.scale) for c in got.channels[2:4]] == [
        ("acceleration", "m/s²", 1.0), ("rate", "rad/s", 1.0),
    ]  # fmt: skip
    assert got.names == record.names
    np.testing.assert_array_equal(got.values("t"), record.values("t"))
    assert got.history[-1]["step"] == "calibrate" and got.history[-1]["source"] == "unit.csv"
    json.dumps(got.history[-1], allow_nan=False)


def test_applied_to_counts_gives_true_units(rng: np.random.Generator) -> None:
    """What was counts is a rate and an acceleration afterwards: other commands find the triads by it."""
    unit = some(rng, following=True)
    record, true = recorded(unit, rng)
    counted = tuple(
        replace(c, kind=Kind.COUNTS, unit="LSB", scale=1.0) if c.name != "t" else c for c in record.channels
    )
    columns = tuple(
        al.Recording.from_rate(record.values(c.name) * c.scale, rate=100.0, unit="LSB").columns[0]
        for c in record.channels
    )
    got = unit.apply(replace(record, channels=counted, columns=columns))
    assert [c.kind for c in got.channels] == [Kind.ACCELERATION] * 3 + [Kind.RATE] * 3 + [Kind.TEMPERATURE]
    np.testing.assert_allclose(got.values("gy"), true[:, 4], atol=1e-12)


def test_gyros_that_follow_gravity_need_the_accelerometers(rng: np.random.Generator) -> None:
    unit = some(rng, following=True)
    keep = [i for i, n in enumerate(unit.names) if n.startswith(GYRO)]
    alone = replace(
        unit,
        names=tuple(unit.names[i] for i in keep),
        values=unit.values[keep],
        covariance=unit.covariance[np.ix_(keep, keep)],
        status=("estimated",) * len(keep),
    )
    record, _ = recorded(unit, rng)
    with pytest.raises(InputError, match="the accelerometers are needed, too"):
        alone.apply(record)
    assert Calibration.from_json(unit.to_json()).names == unit.names


def test_m10_read_in_blocks_or_as_a_whole(rng: np.random.Generator) -> None:
    unit = some(rng)
    got = unit.apply(recorded(unit, rng)[0])
    whole = got.values("gy")
    parts = [block for _, block in got.blocks("gy", 7)]
    np.testing.assert_array_equal(np.concatenate(parts), whole)
    np.testing.assert_array_equal(got.window(1.0, 2.0).values("gy"), whole[100:200])


def test_a_missing_axis_takes_the_vector_with_it(rng: np.random.Generator) -> None:
    unit = some(rng)
    record, true = recorded(unit, rng)
    columns = list(record.columns)
    y = record.values("ay").copy()
    y[[3, 5]] = math.nan, 9.9e37
    columns[1] = al.Recording.from_rate(y, rate=100.0, unit="g").columns[0]
    got = unit.apply(replace(record, columns=tuple(columns)))
    for name in CHANNELS[ACCELEROMETER]:
        assert np.flatnonzero(np.isnan(got.values(name))).tolist() == [3, 5]
    np.testing.assert_allclose(got.values("gx"), true[:, 3], atol=1e-12)


def test_one_triad_alone(rng: np.random.Generator) -> None:
    unit = some(rng)
    record, true = recorded(unit, rng)
    keep = [i for i, n in enumerate(unit.names) if n.startswith(GYRO)]
    gyro = Calibration(
        names=tuple(unit.names[i] for i in keep),
        values=unit.values[keep],
        covariance=unit.covariance[np.ix_(keep, keep)],
        status=("estimated",) * len(keep),
        channels={GYRO: CHANNELS[GYRO]},
    )
    got = gyro.apply(record)
    np.testing.assert_array_equal(got.values("ax"), record.values("ax"))
    np.testing.assert_allclose(got.values("gz"), true[:, 5], atol=1e-13)
    with pytest.raises(InputError, match="of gyro, not of the accelerometer"):
        gyro.errors(ACCELEROMETER)


def test_b11_records_that_cannot_be_calibrated(rng: np.random.Generator) -> None:
    unit = some(rng)
    record, _ = recorded(unit, rng)
    with pytest.raises(InputError, match="no channel 'az'"):
        unit.apply(record.select("ax", "ay", "gx", "gy", "gz"))
    with pytest.raises(InputError, match="does not name the three channels of its accelerometer"):
        replace(unit, channels={GYRO: CHANNELS[GYRO]}).apply(record)
    with pytest.raises(InputError, match="depend on temperature"):
        some(rng, temperature=True).apply(record)


# -- files ------------------------------------------------------------------------------------------------


def same(a: Calibration, b: Calibration) -> bool:
    return a.to_json() == b.to_json()


def test_round_trip_through_json_keeps_every_digit(rng: np.random.Generator, tmp_path: Path) -> None:
    unit = some(rng, frame="x", temperature=True)
    text = json.dumps(unit.to_json(), allow_nan=False)
    again = Calibration.from_json(json.loads(text))
    assert same(again, unit)
    np.testing.assert_array_equal(again.values, unit.values)
    np.testing.assert_array_equal(again.covariance, unit.covariance)
    file = tmp_path / "cal.json"
    file.write_text(json.dumps({"format": "allanite-calibrate", "version": 1, "calibration": unit.to_json()}))
    assert same(Calibration.load(file), unit)


def test_nominal_goes_through_json() -> None:
    unit = Calibration.nominal(GYRO, channels={GYRO: CHANNELS[GYRO]})
    assert same(Calibration.from_json(json.loads(json.dumps(unit.to_json()))), unit)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"format": "allanite-study"}, "no calibration"),
        ({"version": 2}, "version 2; this program reads version 1"),
        ({"values": [1.0]}, "damaged"),
        ({"values": "many"}, "damaged"),
        ({"covariance": None}, "damaged"),
        ({"names": None}, "damaged"),
        ({"channels": ["gx"]}, "damaged"),
        ({"names": ["gyro.bias_w"]}, "damaged"),
    ],
)
def test_b11_files_that_are_no_calibration(
    change: dict[str, Any], message: str, rng: np.random.Generator
) -> None:
    with pytest.raises(FormatError, match=message):
        Calibration.from_json({**some(rng).to_json(), **change})


def test_b11_paths_that_are_no_calibration(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        Calibration.load(tmp_path / "absent.json")
    for content in (b"{", b"\xff\xfe\x00", b"[1, 2]", b"null"):
        file = tmp_path / "bad.json"
        file.write_bytes(content)
        with pytest.raises(
            FormatError, match=r"not JSON \(.*: expected a calibration, .*allanite calibrate|no calibration"
        ):
            Calibration.load(file)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"values": np.zeros(3)}, "needs 24 values"),
        ({"covariance": np.zeros((3, 3))}, "needs 24 values"),
        ({"status": ("held",)}, "needs 24 values"),
        ({"values": np.full(24, math.nan)}, "finite"),
        ({"covariance": np.full((24, 24), math.inf)}, "finite"),
        ({"names": ("gyro.bias_x",) * 24}, "twice"),
        ({"names": ("gyro.colour",) + parameter_names(GYRO) + parameter_names(ACCELEROMETER)[1:]}, "colour"),
    ],
)
def test_b11_calibrations_that_make_no_sense_are_refused(change: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        replace(Calibration.nominal(GYRO, ACCELEROMETER), **change)


@pytest.mark.parametrize(
    ("sds", "message"),
    [({"gyro.colour": 1.0}, "no parameter 'gyro.colour'"), ({"gyro.bias": -1.0}, "not negative"),
     ({"gyro.bias": math.nan}, "finite")],
)  # fmt: skip
def test_b11_repeatabilities_that_make_no_sense_are_refused(sds: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Calibration.nominal(GYRO).with_repeatability(sds)
