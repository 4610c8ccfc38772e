# SPDX-License-Identifier: BSD-3-Clause
"""Logs whose cells are labeled: each value goes to the channel of its label, and what breaks is counted."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.errors import AllaniteError, FormatError, InputError, LimitError
from allanite.files.readers import read
from allanite.recording.health.examination import check
from allanite.recording.health.finding import Severity

N = 40
NAMES = ("gx", "GY", "AcX", "acc_y", "Temp", "Gyro 1", "Accel X", "ω", "baro.p", "q-w", "mag2", "x", "roll")
UNITS = ("deg/s", "V", "mg", "m/s2", "°C")


def written(path: Path, lines: list[str], end: str = "\n", encoding: str = "utf-8") -> Path:
    path.write_bytes((end.join(lines) + end).encode(encoding))
    return path


def notes(path: Path, **options: Any) -> dict[str, Any]:
    return dict(read(path, **options).notes["text"])


@pytest.mark.long
def test_every_value_goes_to_its_label(tmp_path: Path) -> None:
    """Random labels, separators, delimiters, units, decimal commas; lines in another order, with gaps and damage."""
    for seed in range(40):
        rng = np.random.default_rng([31, seed])
        names = [str(n) for n in rng.permutation(NAMES)[: rng.integers(2, 6)]]
        mark = str(rng.choice([":", "=", ": ", " = ", " -> ", "=> ", ":\t"]))
        gap = str(rng.choice([" ", ", ", ";", "\t", " | ", ",", "  "]))
        comma = gap not in (", ", ",") and rng.random() < 0.3
        unit = {n: str(rng.choice(UNITS)) if rng.random() < 0.4 else "" for n in names}
        bracketed, glue = rng.random() < 0.5, str(rng.choice(["", " "]))
        values = np.round(rng.normal(scale=10.0 ** rng.integers(-1, 3), size=(N, len(names))), 3)
        front = str(rng.choice(["", "", "12:00:{:02d}.000 -> ", "[{:d}] ", "{:d},"]))
        lines, truth, damaged, stray, lacking = ["# a log", "IMU ready", ""], [], 0, 0, 0
        for k, row in enumerate(values):
            cells = []
            for name, value in zip(names, row, strict=True):
                number = f"{value:.3f}".replace(".", "," if comma else ".")
                label = f"{name}[{unit[name]}]" if unit[name] and bracketed else name
                cells.append(
                    f"{label}{mark}{number}" + ("" if bracketed or not unit[name] else glue + unit[name])
                )
            event = rng.random() if k else 1.0
            kept = row.copy()
            if event < 0.1:
                drop = int(rng.integers(len(names)))
                del cells[drop]
                kept[drop], lacking = np.nan, lacking + 1
            elif event < 0.2:
                rng.shuffle(cells)
            elif event < 0.27:
                cells[0] = cells[0].rpartition(mark)[0] + mark + "0x.1"
                kept[:], damaged = np.nan, damaged + 1
            elif event < 0.33:
                lines.append("Calibrating, please wait")
                stray += 1
            lines.append(front.format(k) + gap.join(cells))
            truth.append(kept)
        path = written(tmp_path / "log.txt", lines, str(rng.choice(["\n", "\r\n"])))
        got = read(path, rate=10.0)
        place = [c.name for c in got.channels]
        expected = [n.replace(" ", "_") for n in names]
        assert place[-len(names) :] == expected, (seed, place, lines[3])
        np.testing.assert_array_equal(
            np.column_stack([got.values(n) for n in expected]), np.array(truth), err_msg=f"{seed} {lines[3]}"
        )
        facts = got.notes["text"]
        assert (facts["labels_damaged"], facts["labels_stray"]) == (damaged, stray), (seed, lines)
        assert facts["labels_lacking"] == lacking, seed
        for name, c in zip(names, got.channels[-len(names) :], strict=True):
            assert (c.unit != "") == (unit[name] != ""), (seed, name, c.unit)
        found = [f for f in check(got) if f.code == "labeled_lines"]
        assert bool(found) == bool(damaged + stray + lacking)
        if found:
            assert (found[0].severity is Severity.WARNING) == bool(damaged + stray)


def test_objects_of_json(tmp_path: Path) -> None:
    """One object a line: nested, with lists, in another order, with null, in a list of all."""
    for seed in range(20):
        rng = np.random.default_rng([32, seed])
        values = np.round(rng.normal(size=(N, 5)), 4)
        lines, truth = [], values.copy()
        for k, row in enumerate(values.tolist()):
            entry: dict[str, Any] = {"t": k / 100, "acc": {"x": row[0], "y": row[1]}, "gyro": row[2:]}
            entry["state"] = str(rng.choice(["idle", "busy"]))
            if rng.random() < 0.1:
                entry["acc"]["y"], truth[k, 1] = None, np.nan
            if rng.random() < 0.1:
                del entry["gyro"]
                truth[k, 2:] = np.nan
            order = rng.permutation(list(entry)) if k and rng.random() < 0.2 else list(entry)
            lines.append(json.dumps({str(key): entry[str(key)] for key in order}))
        if seed % 2:
            lines = ["[", *(line + "," for line in lines[:-1]), lines[-1], "]"]
        got = read(written(tmp_path / "log.json", lines))
        names = ("acc_x", "acc_y", "gyro_x", "gyro_y", "gyro_z")
        assert got.rate == pytest.approx(100.0)
        assert got.names == names
        np.testing.assert_array_equal(
            np.column_stack([got.values(n) for n in names]), truth, err_msg=str(seed)
        )


@pytest.mark.parametrize(
    ("line", "names"),
    [
        ("acc: {0} {1} {2}\tgyr: {3} {4} {5}", "acc_x acc_y acc_z gyr_x gyr_y gyr_z"),
        ("acc[g]=({0}, {1}, {2}); gyr[dps]=({3}, {4}, {5})", "acc_x acc_y acc_z gyr_x gyr_y gyr_z"),
        ("Accel: x={0} y={1} z={2} Gyro: x={3} y={4} z={5}", "Accel_x Accel_y Accel_z Gyro_x Gyro_y Gyro_z"),
        ("x={0} y={1} z={2} | x={3} y={4} z={5}", "x y z x_2 y_2 z_2"),
        ("{{ax:{0},ay:{1},az:{2},gx:{3},gy:{4},gz:{5}}}", "ax ay az gx gy gz"),
        ("Accel X: {0} g Accel Y: {1} g Accel Z: {2} g GX: {3} dps GY: {4} dps GZ: {5} dps",
         "Accel_X Accel_Y Accel_Z GX GY GZ"),
        ("I (812) imu: ax={0} ay={1} az={2} gx={3} gy={4} gz={5}", "imu_ax imu_ay imu_az imu_gx imu_gy imu_gz"),
    ],
)  # fmt: skip
def test_forms_of_lines(line: str, names: str, tmp_path: Path) -> None:
    values = np.round(np.random.default_rng(5).normal(size=(N, 6)), 3)
    got = read(written(tmp_path / "log.txt", [line.format(*row) for row in values.tolist()]), rate=50.0)
    wanted = names.split()
    assert got.names[-6:] == tuple(wanted)
    np.testing.assert_array_equal(np.column_stack([got.values(n) for n in wanted]), values)


def test_a_unit_that_changes_is_refused(tmp_path: Path) -> None:
    lines = [f"v: {k % 7}.5 V" for k in range(N)]
    lines[30] = "v: 700.5 mV"
    with pytest.raises(AllaniteError, match=r"'V' .* and 'mV' .*one unit"):
        read(written(tmp_path / "log.txt", lines), rate=10.0)


def test_commas_that_may_be_decimal_signs_are_asked_about(tmp_path: Path) -> None:
    rng = np.random.default_rng(3)
    lines = [f"a={k % 5},{rng.integers(1, 2000)};b={k % 3},{rng.integers(1, 900)}" for k in range(N)]
    path = written(tmp_path / "log.txt", lines)
    with pytest.raises(InputError, match=r"--decimal , or --decimal \."):
        read(path, rate=1.0)
    assert read(path, rate=1.0, decimal=",").names == ("a", "b")
    assert read(path, rate=1.0, decimal=".").names == ("a_0", "a_1", "b_0", "b_1")


def test_records_of_several_kinds_are_chosen(tmp_path: Path) -> None:
    lines = [f"gx={k % 5}.5 gy=0.{k}" if k % 2 else f"P={k}.25 T=20.{k}" for k in range(N)]
    path = written(tmp_path / "log.txt", lines)
    with pytest.raises(InputError, match=r"never share a line: P, T; gx, gy.*--variable P"):
        read(path, rate=1.0)
    assert read(path, rate=1.0, variable="gy").names == ("gx", "gy")
    assert notes(path, rate=1.0, variable="gy")["labels_stray"] == 0


def test_a_column_that_names_sensors(tmp_path: Path) -> None:
    path = written(tmp_path / "log.txt", [f'{{"id": "imu{k % 2}", "gx": {k}.5}}' for k in range(N)])
    with pytest.raises(InputError, match="imu0, imu1"):
        read(path, rate=1.0)
    np.testing.assert_array_equal(
        read(path, rate=1.0, variable="imu1").values("gx"), np.arange(1, N, 2) + 0.5
    )


def test_a_label_that_comes_late_is_reported(tmp_path: Path) -> None:
    lines = [f"gx={k % 5}.5 gy=0.{k}" for k in range(N)]
    lines[-1] += " gz=1"
    got = read(written(tmp_path / "log.txt", lines), rate=1.0)
    assert got.names == ("gx", "gy")
    [found] = [f for f in check(got) if f.code == "labeled_lines"]
    assert "gz (1)" in found.message


@pytest.mark.parametrize(
    "lines",
    [
        [f"2024-01-01 12:00:{k:02d},{k}.5" for k in range(N)],
        [f"{k},0.{k},T:OK" for k in range(N)],
        ["fs: 100 Hz", "range = 250", "unit: V", *(f"{k % 7}.25" for k in range(N))],
    ],
)
def test_plain_tables_stay_plain(lines: list[str], tmp_path: Path) -> None:
    assert "labels_stray" not in notes(written(tmp_path / "log.txt", lines), rate=100.0)


def test_many_labels_are_refused(tmp_path: Path) -> None:
    line = " ".join(f"k{k}:1" for k in range(5000))
    with pytest.raises(LimitError, match="labels; at most 4096"):
        read(written(tmp_path / "log.txt", [line] * 5), rate=1.0)
    with pytest.raises(AllaniteError):
        read(written(tmp_path / "one.txt", [f"k{k}:1" for k in range(5000)]), rate=1.0)


@pytest.mark.parametrize(
    "form",
    ["X{0:.2f}Y{1:.2f}Z{2:.2f}", "ax={0:.3f}ay={1:.3f}az={2:.3f}", "{3},X{0:.2f}Y{1:.2f}", "gx:{0:.2e}gy:{1:.2e}",
     "X{0:+.2f} Y{1:+.2f} Z{2:+.2f}", "X{0:.2f},Y{1:.2f}", "t={3}ax={0:.3f}gay={1:.3f}g", "a{3}b{3}c{3}"],
)  # fmt: skip
def test_labels_that_run_into_numbers_are_refused_with_the_way_to_write_them(
    form: str, tmp_path: Path
) -> None:
    rng = np.random.default_rng(9)
    log = tmp_path / "log.txt"
    log.write_text(
        "".join(form.format(*rng.standard_normal(3), k) + "\n" for k in range(50)), encoding="utf-8"
    )
    with pytest.raises(FormatError, match=r"are not separated .*Write a blank") as refused:
        read(log)
    assert re.search(r"as in '(\w+=[-+.\de]+ ?){2,}'", str(refused.value))
