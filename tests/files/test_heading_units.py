# SPDX-License-Identifier: BSD-3-Clause
"""Units in a heading: scales in front of a suffix, units of no sensor, columns of a sensor that hold text."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import FormatError, InputError
from allanite.files.readers.headings import read_heading
from allanite.recording.health.examination import check
from allanite.recording.health.finding import Severity

N = 400
T = np.arange(N) / 100
Y = np.random.default_rng(1).normal(0.5, 0.1, N)
#: Suffix -> its unit; and the unit with each prefix that it may carry.
SUFFIXES = {
    "dps": "deg/s",
    "rad_s": "rad/s",
    "deg_s": "deg/s",
    "rad_per_s": "rad/s",
    "g": "g",
    "m_s2": "m/s²",
}
WORDS = {"milli": 1e-3, "micro": 1e-6, "MICRO": 1e-6}
SCALES = (
    *(
        "m",
        "u",
        "k",
        "x1000",
        "x10",
        "×10",
        "x_10",
        "10",
        "1000",
        "0_1",
        "0_01",
        "1e-3",
        "10^-3",
        "e-3",
        "250",
        "100x",
    ),
    *(
        "per",
        "lsb_per",
        "counts_per",
        "mv_per",
        "mg_per",
        "lsb",
        "counts",
        "mv",
        "times_10",
        "tenths",
        "hundredths",
    ),
    *("sqrt", "deci"),
)
INDICES = ("0", "1", "2", "01", "x1", "imu0", "raw", "cal", "filtered", "lp", "b", "body", "left", "nano33")


def name_for(suffix: str) -> str:
    return "acc_x" if suffix in ("g", "m_s2") else "gyro_x"


@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("joint", ["_", ".", " "])
def test_scales_in_front_of_a_suffix(suffix: str, joint: str) -> None:
    """A prefix that is spelled out multiplies; any other scale leaves the unit open; numbers of sensors do neither."""
    name, unit = name_for(suffix), SUFFIXES[suffix]
    for word, factor in WORDS.items():
        got = read_heading(joint.join([name, word, suffix]))
        assert got.name == name
        if factor * al.parse_unit(unit).factor != pytest.approx(al.parse_unit(got.unit).factor):
            raise AssertionError((got, word))
    for scale in SCALES:
        got = read_heading(joint.join([name, scale.replace("_", joint), suffix]))
        assert got.unit == "", got
    for word in INDICES:
        got = read_heading(joint.join([name, word, suffix]))
        assert got.unit == unit, got


def test_a_prefix_that_the_unit_does_not_carry_leaves_it_open() -> None:
    for heading in ("gyro_x_kilo_dps", "acc_x_milli_mg", "gyro_x_mega_lsb", "temp_milli_c"):
        assert read_heading(heading).unit == "", heading


@pytest.mark.parametrize(
    ("heading", "unit"), [("time_milli_s", "ms"), ("t_us", "µs"), ("ticks_ms", "ms"), ("time_100_ns", "")]
)
def test_clocks_have_scales_too(heading: str, unit: str) -> None:
    assert read_heading(heading).unit == unit


@pytest.mark.parametrize("joint", ["/", " / "])
@pytest.mark.parametrize(
    ("name", "unit"),
    [("U", "mV"), ("U_a", "V"), ("Spannung", "V"), ("T", "K"), ("ϑ", "°C"), ("t", "s"), ("Zeit", "ms"), ("a", "g"),
     ("ω", "(deg/s)"), ("ω", "(°/s)"), ("ω", "rad/s"), ("gyro_x", "(deg/h)"), ("a_x", "(m/s²)"), ("p", "hPa")],
)  # fmt: skip
def test_a_quantity_may_be_divided_by_its_unit(name: str, joint: str, unit: str) -> None:
    """As ISO 80000-1 heads the columns of tables."""
    read = read_heading(name + joint + unit)
    assert (read.name, read.unit) == (name, unit.strip("()"))


@pytest.mark.parametrize(
    "heading",
    ["V/g", "mV/g", "µV/°C", "ppm/K", "V/V", "LSB/g", "deg/s", "m/s", "samples/s", "frames/s", "drift/h", "raw/LSB",
     "imu/T", "imu/x", "/imu/V", "imu/acc/g", "nav/V", "gyro/g"],
)  # fmt: skip
def test_a_unit_of_something_else_and_a_path_have_no_unit(heading: str) -> None:
    read = read_heading(heading)
    assert (read.name, read.unit) == (heading, "")


@pytest.mark.parametrize(("heading", "unit"), [("U_mV", "mV"), ("V_mV", "mV"), ("U_uV", "µV"), ("u_mg", "")])
def test_a_voltage_may_be_called_by_its_symbol(heading: str, unit: str) -> None:
    assert read_heading(heading).unit == unit


def test_an_open_unit_is_a_finding(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack([T, Y]), "%.6f", ",", header="t_s,gyro_x_x1000_dps", comments="")
    got = al.read(path)
    assert got.channels[0].kind.value == "unknown"
    assert any(f.code == "unit_missing" and f.severity is Severity.WARNING for f in check(got))


# -- units of no sensor ------------------------------------------------------------------------------------


@pytest.mark.parametrize("unit", ["1/s", "s^-1", "s⁻¹", "d/s", "Hz", "kHz", "s", "ppm", "uT", "Pa"])
@pytest.mark.parametrize("name", ["gyro_x", "Gyroscope Y", "angular_velocity_z", "omega_x", "acc_x"])
@pytest.mark.parametrize("door", ["text", "memory", "parquet", "unit="])
def test_a_unit_of_no_sensor_is_refused(unit: str, name: str, door: str, tmp_path: Path) -> None:
    """The error names the channel and the unit; its option reads the log; other channels are read without it."""
    heading = name if door == "unit=" else f"{name} [{unit}]"
    path, given = tmp_path / "log.csv", None
    if door in ("text", "unit="):
        head = f"t [s],{heading},acc_z [m/s^2]"
        path.write_text(
            "\n".join([head, *(f"{t:.2f},{y:.5f},{y:.4f}" for t, y in zip(T, Y, strict=True))]),
            encoding="utf-8",
        )
        given = {name.replace(" ", "_"): unit} if door == "unit=" else None
    elif door == "parquet":
        pd = pytest.importorskip("pandas")
        pytest.importorskip("pyarrow")
        path = tmp_path / "log.parquet"
        pd.DataFrame({"t_s": T, heading: Y, "acc_z [m/s^2]": Y}).to_parquet(path)

    def read(**options: object) -> al.Recording:
        if door == "memory":
            return al.Recording.from_samples({"t": T, heading: Y, "acc_z [m/s^2]": Y}, time="t:s", **options)  # type: ignore[arg-type]
        return al.read(path, **options)  # type: ignore[arg-type]

    if door == "unit=" and name == "angular_velocity_z":
        return  # its unit is that of the message definition
    with pytest.raises(InputError) as caught:
        read(unit=given)
    message = str(caught.value)
    assert repr(unit) in message
    option = "m/s^2" if name == "acc_x" else "rad/s" if unit in ("1/s", "s^-1", "s⁻¹") else "deg/s"
    assert f"={option}" in message
    assert read(unit={name.replace(" ", "_"): option}).channels[0].kind.noise_bearing
    assert read(channels=["acc_z"]).names == ("acc_z",)


@pytest.mark.parametrize(
    "heading", ["gyro_odr [Hz]", "hAcc [m]", "gyro_rate [Hz]", "gyro_temp [°C]", "acc_noise [%]", "rate [Hz]"]
)
def test_settings_and_accuracies_are_companions(heading: str) -> None:
    got = al.Recording.from_samples({"t": T, heading: Y, "gyro_x [deg/s]": Y}, time="t:s")
    assert got.names[1] == "gyro_x"
    assert not got.channels[0].kind.noise_bearing


# -- columns of text ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("share", [0.01, 0.3, 0.7, 1.0])
@pytest.mark.parametrize("form", ["({:.4f})", "{:.4f}-", "( {:.4f} )", '"({:.4f})"', "(${:.2f})"])
@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
@pytest.mark.parametrize("head", [True, False])
def test_signs_of_accounting_are_refused(
    share: float, form: str, delimiter: str, head: bool, tmp_path: Path
) -> None:
    marked = np.random.default_rng(2).random(N) < share
    marked[3] = True
    rows = [
        delimiter.join([f"{t:.2f}", form.format(abs(y)) if m else f"{y:.4f}", f"{y:.4f}"])
        for t, y, m in zip(T, Y, marked, strict=True)
    ]
    path = tmp_path / "log.csv"
    path.write_text(
        "\n".join([delimiter.join(["t [s]", "gyro_x [deg/s]", "gyro_y [deg/s]"])] * head + rows) + "\n",
        encoding="utf-8",
    )
    with pytest.raises(FormatError, match=r"format of accounting"):
        al.read(path)


def test_parentheses_around_signed_numbers_are_no_signs(tmp_path: Path) -> None:
    path, values = tmp_path / "log.csv", np.round(Y - 0.5, 4)
    rows = [f"{t:.2f}, ({y:.4f})\n" for t, y in zip(T, values, strict=True)]
    path.write_text("".join(rows), encoding="utf-8")
    got = al.read(path)
    np.testing.assert_array_equal(got.values(got.names[0]), values)


@pytest.mark.parametrize("word", ["n/a?", "0.5 0.6", "#REF!", "1.2x.3", "0x1G", "ok"])
@pytest.mark.parametrize("door", ["text", "memory", "pandas", "parquet"])
def test_an_axis_that_holds_text_is_a_warning(word: str, door: str, tmp_path: Path) -> None:
    cells = np.array([f"{word}{k}" for k in range(N)])
    columns = {"t_s": T, "gyro_x [deg/s]": cells, "gyro_y [deg/s]": Y, "remark": cells}
    if door == "text":
        path = tmp_path / "log.csv"
        rows = [",".join(map(str, row)) for row in zip(*columns.values(), strict=True)]
        path.write_text("\n".join([",".join(columns), *rows]) + "\n", encoding="utf-8")
        got = al.read(path)
    elif door == "memory":
        got = al.Recording.from_samples(columns)
    else:
        pd = pytest.importorskip("pandas")
        pytest.importorskip("pyarrow")
        frame = pd.DataFrame(columns)
        if door == "parquet":
            frame.to_parquet(tmp_path / "log.parquet")
            got = al.read(tmp_path / "log.parquet")
        else:
            got = al.Recording.from_samples(frame)
    [found] = [f for f in check(got) if f.code == "sensor_left_out"]
    assert found.severity is Severity.WARNING
    assert "gyro_x" in found.message
    assert "remark" not in found.message
