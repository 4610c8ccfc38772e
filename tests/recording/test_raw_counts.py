# SPDX-License-Identifier: BSD-3-Clause
"""Whole numbers without a unit are called raw counts, with the factor that fits; headings that leave a unit open."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from allanite.errors import InputError
from allanite.files.readers import read
from allanite.recording.health.examination import check
from allanite.recording.health.finding import Finding
from allanite.recording.health.raw_counts import raw_counts
from allanite.recording.health.scale_questions import scale_questions
from allanite.recording.health.survey import survey
from allanite.recording.records import Recording

SENSITIVITIES = (16384, 8192, 4096, 2048, 256_000)


def recorded(columns: dict[str, np.ndarray]) -> Recording:
    y = np.column_stack(list(columns.values())).astype(float)
    return Recording.from_rate(y, rate=100.0, unit="unknown", names=list(columns))


def hints(recording: Recording) -> list[Finding]:
    return [f for f in check(recording) if f.code == "raw_counts"]


@pytest.mark.long
def test_gravity_tells_the_scale_factor_of_an_accelerometer() -> None:
    for seed in range(200):
        rng = np.random.default_rng(seed)
        per_g = int(rng.choice(SENSITIVITIES))
        direction = rng.normal(size=3)
        g = per_g * direction / np.linalg.norm(direction) + rng.uniform(-0.01, 0.01, 3) * per_g
        noise = rng.normal(scale=rng.uniform(2.0, 40.0), size=(300, 3))
        names = [f"{rng.choice(['acc_', 'a', 'Accel_'])}" + axis for axis in "xyz"]
        stem = names[0][:-1]
        log = recorded(dict(zip((stem + a for a in "xyz"), np.round(g + noise).T, strict=True)))
        [found] = raw_counts([survey(log, name) for name in log.names])
        assert f"={per_g} LSB/g'" in found.advice, seed


def test_the_advice_makes_a_rate_and_an_acceleration(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    y = np.round(rng.normal(scale=30, size=(2000, 6)) + [100, -30, 20, 0, 200, 16384]).astype(int)
    rows = "".join(f"{k / 100:.2f}," + ",".join(map(str, row)) + "\n" for k, row in enumerate(y))
    path = tmp_path / "log.csv"
    path.write_text("time [s],gx,gy,gz,ax,ay,az\n" + rows, encoding="utf-8")
    said = [re.search(r"--scale-factor '(.*?)=(.*?)'", f.advice) for f in hints(read(path))]
    factors = {m[1]: m[2] for m in said if m}
    got = read(path, scale_factor=factors)
    assert factors == {"g": "131 LSB/(deg/s)", "a": "16384 LSB/g"}
    assert [c.kind.value for c in got.channels] == ["rate"] * 3 + ["acceleration"] * 3
    norm = np.linalg.norm([c.scale * got.values(c.name).mean() for c in got.channels[3:]])
    assert norm == pytest.approx(9.80665, rel=2e-3)
    assert not hints(got)
    # A page asks sensor by sensor for what the finding advises.
    gyro, acc = scale_questions(read(path))
    assert (gyro.option, gyro.keys, gyro.likely) == ("scale_factor", ("g",), "")
    assert [a.value.split()[0] for a in gyro.answers] == ["131", "65.5", "32.8", "16.4"]
    assert (acc.option, acc.keys, acc.likely) == ("scale_factor", ("a",), factors["a"])
    assert acc.likely in [a.value for a in acc.answers] and "gravity" in acc.reason
    assert not scale_questions(got)


@pytest.mark.parametrize(("length", "unit"), [(9.80665, "m/s^2"), (1.0, "g"), (1000.0, "mg"), (3.0, "")])
def test_gravity_tells_the_unit_of_an_accelerometer(length: float, unit: str) -> None:
    y = length * (np.random.default_rng(5).normal(scale=1e-3, size=(500, 3)) + [0.6, 0.0, 0.8])
    log = recorded({**dict(zip(("acc_x", "acc_y", "acc_z"), y.T, strict=True)), "acc_temp": y[:, 0]})
    (asked,) = scale_questions(recorded({name: log.values(name) for name in log.names[:3]}))
    assert (asked.option, asked.likely, asked.keys) == ("unit", unit, ("acc",))
    assert unit in ("", *(a.value for a in asked.answers))
    # The beginning of a name is no name for a group where it names others as well.
    assert scale_questions(log)[0].keys == log.names[:3]


def test_wider_words_have_their_own_ranges() -> None:
    rng = np.random.default_rng(1)
    [found] = hints(recorded({"gyro_z": np.round(rng.normal(scale=3000, size=500) + 4e6)}))
    assert "33554 for ±250 deg/s" in found.advice
    assert "24 bits" in found.advice


@pytest.mark.parametrize("kind", ["decimals", "switch", "constant"])
def test_look_alikes_are_no_counts(kind: str) -> None:
    rng = np.random.default_rng(2)
    y = {
        "decimals": np.round(rng.normal(size=500), 2),
        "switch": (rng.random(500) < 0.5).astype(float),
        "constant": np.full(500, 7.0),
    }[kind]
    assert hints(recorded({"gyro_z": y})) == []


def log(path: Path, head: str) -> Path:
    path.write_text(head + "\n" + "".join(f"{k / 10:.1f},{k % 7}.5\n" for k in range(50)), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("head", "kind"),
    [("gyro_x [mDeg]", "rate"), ("gyro_z (deg)", "rate"), ("wx [rad]", "rate"), ("acc_x [m/s]", "acceleration"),
     ("y [cycle]", "rate"), ("y [turn]", "rate"), ("y [rev]", "rate"), ("frequency [cycle]", "rate")],
)  # fmt: skip
def test_units_that_leave_it_open_are_asked_about(head: str, kind: str, tmp_path: Path) -> None:
    path = log(tmp_path / "log.csv", "time [s]," + head)
    with pytest.raises(InputError, match="If the samples are") as caught:
        read(path)
    for way in re.findall(r"--unit (\S+?)=(\S+?)(?: |$)", str(caught.value)):
        got = read(path, unit={way[0]: way[1]}).channels[0]
        assert got.kind.value == (
            kind if way[1].endswith("/s") and "m/s" != way[1] else {"rate": "angle"}.get(kind, "velocity")
        )


@pytest.mark.parametrize("head", ["phase [cycle]", "angle_z [deg]", "gyro_angle [mdeg]", "y [deg]"])
def test_names_that_say_it_are_not_asked_about(head: str, tmp_path: Path) -> None:
    assert read(log(tmp_path / "log.csv", "time [s]," + head)).channels[0].kind.value == "angle"


def test_a_scale_factor_from_volts_implies_volts(tmp_path: Path) -> None:
    got = read(log(tmp_path / "log.csv", "time [s],gyro"), scale_factor="24 mV/(deg/s)")
    assert (got.channels[0].kind.value, got.channels[0].unit) == ("rate", "V")
    assert got.channels[0].scale == pytest.approx(np.radians(1 / 0.024))
    assert any("taken to be in V" in guess for guess in got.notes["text"]["guesses"])


def test_the_unit_that_is_asked_for_fits_the_name() -> None:
    samples = np.random.default_rng(4).normal(0.0, 1.0, (64, 3))
    names = ["gx", "ay", "acc_z"]
    log = Recording.from_rate(samples, rate=10.0, unit="", names=names)
    (advice,) = {f.advice for f in check(log) if f.code == "unit_missing"}
    assert advice == "state it, as in --unit gx=deg/s,ay=m/s^2,acc_z=m/s^2"


def test_a_thermometer_in_counts_is_offered_no_scale_factor_of_a_gyro() -> None:
    """Whatever it is called, with or without a unit; the gyros beside it keep their advice."""
    rng = np.random.default_rng(6)
    for name in ("boardtmp", "imuTempRaw", "gyro_temperature", "tmp", "thermistor"):
        columns = {"gyro_x": rng.normal(0, 20, 300).round(), name: rng.normal(28_000, 9, 300).round()}
        for unit in ("unknown", "LSB"):
            log = Recording.from_rate(
                np.column_stack(list(columns.values())), rate=100.0, unit=unit, names=list(columns)
            )
            advice = {f.message.split(":")[0]: f.advice for f in hints(log)}
            assert "LSB/(deg/s)" in advice.pop("gyro_x")
            assert all(a.startswith(f"if so, --unit {name}=LSB") for a in advice.values())
            assert not any("deg/s" in a for a in advice.values())
