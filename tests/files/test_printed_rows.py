# SPDX-License-Identifier: BSD-3-Clause
"""What programs print: rows in brackets, messages echoed one key a line, numbers with thousands, units by sensor."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import allanite as al
from allanite.errors import AllaniteError, FormatError

FORMS = {
    "tuple": lambda v: "(" + ", ".join(v) + ")",
    "tight tuple": lambda v: "(" + ",".join(v) + ")",
    "list": lambda v: "[" + ", ".join(v) + "]",
    "array": lambda v: "[" + " ".join(f"{x:>9}" for x in v) + " ]",
    "braces": lambda v: "{" + "; ".join(v) + "}",
    "nested": lambda v: "[[" + ", ".join(v[:1]) + "], (" + ", ".join(v[1:]) + ")]",
}
#: What stands before the bracket, and the columns of numbers that this adds.
STAMPS = {"": 0, "{t:.2f}: ": 1, "{t:.2f}, ": 1, "{t:.2f} ": 1, "[{t:.2f}] ": 1, "[INFO] [{t:.2f}]: imu ": 1}


def values_of(got: al.Recording) -> NDArray[np.float64]:
    return np.column_stack([got.values(name) for name in got.names])


@pytest.mark.long
def test_every_number_in_brackets_is_read(tmp_path: Path) -> None:
    """Any bracket, any stamp before it: every value in its place, none left out."""
    for seed in range(100):  # a fault of 2.3 % of them is found with 90 %
        rng = np.random.default_rng(seed)
        form, stamp = str(rng.choice([*FORMS])), str(rng.choice([*STAMPS]))
        values = np.round(
            rng.normal(scale=10.0 ** rng.integers(-2, 3), size=(80, int(rng.integers(1, 7)))), 4
        )
        lines = [
            stamp.format(t=1.6e9 + k / 10) + FORMS[form]([f"{v:.4f}" for v in row])
            for k, row in enumerate(values)
        ]
        path = tmp_path / "printed.txt"
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")
        got = al.read(path) if STAMPS[stamp] else al.read(path, rate=10.0)
        np.testing.assert_array_equal(values_of(got), values, err_msg=f"{seed} {form} {stamp}")
        assert got.rate == pytest.approx(10.0), (seed, form, stamp)


@pytest.mark.parametrize("cell", ["0.{k:03d}(4)", "{k} (V)", "x({k})"])
def test_other_brackets_are_left_alone(tmp_path: Path, cell: str) -> None:
    """An uncertainty in brackets, a unit, an index: none becomes a column of its own."""
    path = tmp_path / "log.txt"
    path.write_text(
        "".join(f"{k / 10:.1f},{cell.format(k=100 + k)},{k % 7}.5\n" for k in range(60)), encoding="utf-8"
    )
    try:
        got = al.read(path, rate=10.0)
    except AllaniteError:
        return
    assert len(got.names) <= 3


def echoed(k: int, values: NDArray[np.float64], ros: int) -> str:
    seconds, nanoseconds = ("secs", "nsecs") if ros == 1 else ("sec", "nanosec")
    xyz = [f"  {axis}: {v!r}\n" for axis, v in zip("xyzxyz", values.tolist(), strict=True)]
    covariance = " [0.0, 0.0]\n" if ros == 1 else "\n- 0.0\n- 0.0\n"
    return (
        f"header:\n  stamp:\n    {seconds}: {1609459200 + k // 100}\n    {nanoseconds}: {k % 100 * 10**7}\n"
        f"  frame_id: 'imu'\nangular_velocity:\n{''.join(xyz[:3])}angular_velocity_covariance:{covariance}"
        f"linear_acceleration:\n{''.join(xyz[3:])}---\n"
    )


@pytest.mark.long
@pytest.mark.parametrize("ros", [1, 2])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_an_echoed_topic_is_a_log(tmp_path: Path, ros: int, end: str) -> None:
    values = np.random.default_rng(ros).normal(size=(1500, 6))
    text = "".join(echoed(k, v, ros) for k, v in enumerate(values))
    path = tmp_path / "imu.txt"
    path.write_bytes((text + echoed(1500, values[0], ros)[:200]).replace("\n", end).encode())
    got = al.read(path)
    assert (got.rate, got.start, got.n_samples) == (pytest.approx(100.0), 1609459200 * 10**9, 1500)
    names = [f"{sensor}_{axis}" for sensor in ("angular_velocity", "linear_acceleration") for axis in "xyz"]
    assert {got[name].kind.value for name in names} == {"rate", "acceleration"}
    np.testing.assert_array_equal(np.column_stack([got.values(name) for name in names]), values)


def test_an_imu_echoed_as_csv_has_its_names(tmp_path: Path) -> None:
    values = np.random.default_rng(5).normal(size=(300, 6))
    nine = ",".join(["0.0"] * 9)
    rows = [
        f"{1609459200 + k // 100},{k % 100 * 10**7},imu,0.0,0.0,0.0,1.0,{nine},"
        f"{','.join(map(repr, v[:3]))},{nine},{','.join(map(repr, v[3:]))},{nine}"
        for k, v in enumerate(values.tolist())
    ]
    path = tmp_path / "imu.csv"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    got = al.read(path)
    assert (got.rate, got.n_samples) == (pytest.approx(100.0), 300)
    names = [f"{sensor}.{axis}" for sensor in ("angular_velocity", "linear_acceleration") for axis in "xyz"]
    assert [got[name].unit for name in names] == ["rad/s"] * 3 + ["m/s²"] * 3
    np.testing.assert_array_equal(np.column_stack([got.values(name) for name in names]), values)
    path.write_text("\n".join(f"{row[:-3]}{k}.5" for k, row in enumerate(rows)) + "\n", encoding="utf-8")
    assert "angular_velocity.x" not in al.read(path).names  # its covariance would change: another message


@pytest.mark.parametrize("time", [None, "rosbagTimestamp", "rosbagTimestamp:ns", "secs", "nsecs"])
@pytest.mark.parametrize("messages", [True, False])
def test_a_bag_as_a_table_has_its_time_and_the_names_of_its_messages(
    tmp_path: Path, messages: bool, time: str | None
) -> None:
    """As rosbag_to_csv writes it: an empty column for each message, and stamps of the bag and of the header."""
    values = np.random.default_rng(6).normal(size=(500, 6)).tolist()
    stamps = [(1732000000 + k // 100, k % 100 * 10**7) for k in range(500)]
    parts = ("orientation,x,y,z,w", "angular_velocity,x,y,z", "linear_acceleration,x,y,z")
    head = f"rosbagTimestamp,secs,nsecs,{','.join(parts) if messages else 'a,b,c,d,e,f'}\n"
    cells = (
        f",0.0,0.0,0.0,1.0,,{','.join(map(repr, v[:3]))},,{','.join(map(repr, v[3:]))}"
        if messages
        else ",".join(map(repr, v))
        for v in values
    )
    rows = (f"{s}{n:09d},{s},{n},{row}\n" for (s, n), row in zip(stamps, cells, strict=True))
    (tmp_path / "bag.csv").write_text(head + "".join(rows), encoding="utf-8")
    got = al.read(tmp_path / "bag.csv", **({} if time is None else {"time": time}))
    assert (got.rate, got.n_samples, got.start) == (pytest.approx(100.0), 500, 1732000000 * 10**9)
    names = [f"{sensor}.{axis}" for sensor in ("angular_velocity", "linear_acceleration") for axis in "xyz"]
    names = names if messages else [*"abcdef"]
    np.testing.assert_array_equal(np.column_stack([got.values(name) for name in names]), values)


def test_a_damaged_message_is_a_missing_sample(tmp_path: Path) -> None:
    values = np.random.default_rng(3).normal(size=(400, 6))
    messages = [echoed(k, v, 2) for k, v in enumerate(values)]
    messages[200] = messages[200][:120] + "\x00A message was lost!!!\n---\n"
    path = tmp_path / "imu.txt"
    path.write_text("".join(messages), encoding="utf-8")
    got = al.read(path)
    x = got.values("angular_velocity_x")
    assert got.n_samples == 400
    assert np.flatnonzero(~np.isfinite(x)).tolist() == [200]
    np.testing.assert_array_equal(np.delete(x, 200), np.delete(values[:, 0], 200))


def test_a_comma_in_quotes_is_not_taken_for_a_decimal_sign(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text(
        "time_ms,raw\n" + "".join(f'"{10 * k:,}","{16384 + k % 5:,}"\n' for k in range(500)), encoding="utf-8"
    )
    with pytest.raises(FormatError, match=r"decimal comma.*--decimal ,"):
        al.read(path)
    path.write_text("y\n" + "".join(f'"2,5{k % 7}4"\n' for k in range(500)), encoding="utf-8")
    with pytest.raises(FormatError, match=r"'2,5.4' is 25.4, or 2.5.4 with a decimal comma"):
        al.read(path, rate=10.0)
    assert al.read(path, rate=10.0, decimal=",").values("y")[1] == 2.514
    path.write_text("y\n" + "".join(f'"0,5{k % 7}4"\n' for k in range(500)), encoding="utf-8")
    assert al.read(path, rate=10.0).values("y")[1] == 0.514


@pytest.mark.parametrize("count", [2, 3])
def test_units_stated_by_sensor_are_those_of_their_columns(tmp_path: Path, count: int) -> None:
    """Several statements of units: one for each column, or none; never the first for all."""
    stated = [("x-axis", "g"), ("light", "lux"), ("button", "")][:count]
    head = ["Measurement Frequency,100 Hz"] + [f"Sensor type,{name}\nUnits,{unit}" for name, unit in stated]
    rows = [f"{0.01 * (k % 7):.2f},{10 + k % 3},0" for k in range(300)]
    path = tmp_path / "wrist.csv"
    path.write_text("\n".join([*head, "", *rows]) + "\n", encoding="utf-8")
    kinds = [channel.kind.value for channel in al.read(path).channels]
    assert kinds == (["acceleration", "unknown", "unknown"] if count == 3 else ["unknown"] * 3)


def test_units_stated_by_sensor_go_to_the_columns_that_they_fit(tmp_path: Path) -> None:
    head = ["# gyro unit: deg/s", "# accel unit: g", "time [s],gx,gy,gz,ax,ay,az,other"]
    path = tmp_path / "log.csv"
    rows = [f"{k / 100:.2f}," + ",".join(f"{(k * j) % 7 / 10}" for j in range(1, 8)) for k in range(300)]
    path.write_text("\n".join([*head, *rows]) + "\n", encoding="utf-8")
    got = al.read(path)
    assert [c.unit for c in got.channels] == ["deg/s"] * 3 + ["g"] * 3 + [""]


@pytest.mark.parametrize("sign", ["-", "\u2212"])
def test_rows_of_kinds_are_told_whatever_their_minus_sign(tmp_path: Path, sign: str) -> None:
    values = np.round(np.random.default_rng(4).normal(size=(300, 3)), 4)
    lines = []
    for k, row in enumerate(values):
        cells = ",".join(f"{v:.4f}" for v in row)
        lines += [f"GYRO,{k / 100:.2f},{cells}", f"ACC,{k / 100:.2f},{cells}"]
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines).replace("-", sign) + "\n", encoding="utf-8")
    np.testing.assert_array_equal(values_of(al.read(path, variable="GYRO")), values)


@pytest.mark.parametrize(
    ("heading", "unit"),
    [("Drehrate X in °/s", "°/s"), ("Acceleration in m/s^2", "m/s^2"), ("output in mV", "mV")],
)
def test_a_unit_may_stand_behind_in(tmp_path: Path, heading: str, unit: str) -> None:
    path = tmp_path / "log.csv"
    path.write_text(
        f"time [s];{heading}\n" + "".join(f"{k / 10:.1f};{k % 7}\n" for k in range(200)), encoding="utf-8"
    )
    assert al.read(path).channels[0].unit == unit


def number_in(form: str, value: float) -> str:
    if form == "exponent of Fortran":
        return f"{value:.6E}".replace("E", "D")
    return f"{value:.4f}".replace("-", "\N{MINUS SIGN}")


@pytest.mark.parametrize("form", ["exponent of Fortran", "minus sign"])
@pytest.mark.parametrize("delimiter", [",", ";", "\t", "  "])
def test_numbers_of_other_programs_are_numbers(tmp_path: Path, form: str, delimiter: str) -> None:
    values = np.round(np.random.default_rng(2).normal(size=(200, 2)), 4)
    rows = [
        delimiter.join([number_in(form, k / 10), *(number_in(form, v) for v in row)])
        for k, row in enumerate(values)
    ]
    path = tmp_path / "log.dat"
    path.write_text("\n".join(rows) + "\n", encoding="utf-8")
    got = al.read(path)
    assert got.rate == pytest.approx(10.0)
    np.testing.assert_array_equal(values_of(got), values)


@pytest.mark.parametrize("mark", ["'", "\u2019", "\u00a0", "\u202f", "\u2009"])
def test_signs_between_thousands_are_refused(tmp_path: Path, mark: str) -> None:
    path = tmp_path / "log.csv"
    rows = (f"{k / 10:.1f};{16384 + k % 5:,}".replace(",", mark) for k in range(300))
    path.write_text("t [s];raw\n" + "\n".join(rows) + "\n", encoding="utf-8")
    with pytest.raises(FormatError, match="a thousands separator; write the numbers without it, as in '1638"):
        al.read(path)


@pytest.mark.parametrize(("first", "then"), [(2, 3), (3, 2), (4, 7)])
@pytest.mark.parametrize("share", [0.3, 0.6])
def test_rows_of_another_width_are_never_a_preamble(
    tmp_path: Path, first: int, then: int, share: float
) -> None:
    """A logger that was changed on the way: no row is lost without a word."""
    n = 900
    widths = [first] * int(share * n) + [then] * (n - int(share * n))
    rows = [
        ",".join([f"{k / 10:.1f}", *(f"{(k * j) % 7 / 10}" for j in range(1, w))])
        for k, w in enumerate(widths)
    ]
    path = tmp_path / "log.csv"
    path.write_text("t [s],gx [deg/s]\n" + "\n".join(rows) + "\n", encoding="utf-8")
    with pytest.raises(FormatError, match="rows of"):
        al.read(path)


def test_a_matrix_as_matlab_displays_it_is_refused(tmp_path: Path) -> None:
    rows = np.random.default_rng(1).normal(size=(100, 3))
    path = tmp_path / "shown.txt"
    path.write_text(
        "   1.0e-03 *\n\n" + "".join("   " + "   ".join(f"{v:.4f}" for v in r) + "\n" for r in rows),
        encoding="utf-8",
    )
    with pytest.raises(FormatError, match=r"common factor 1\.0e-03"):
        al.read(path, rate=100.0)
