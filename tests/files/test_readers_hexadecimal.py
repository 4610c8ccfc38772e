# SPDX-License-Identifier: BSD-3-Clause
"""Text logs of hexadecimal words and packed floats, read by a layout; headers of one column."""

from __future__ import annotations

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.errors import DataQualityError, FormatError, InputError
from allanite.files.readers import read

CODES = {"u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i", "f32": "f", "f64": "d"}


def frame_of(types: list[str], endian: str = "big") -> dict[str, Any]:
    return {
        "endian": endian,
        "fields": [{"name": f"c{k}", "type": t, "unit": "LSB"} for k, t in enumerate(types)],
    }


@pytest.mark.long
def test_words_of_any_type_come_back(tmp_path: Path) -> None:
    for seed in range(200):
        rng = np.random.default_rng(seed)
        types = [str(t) for t in rng.choice(list(CODES), size=rng.integers(1, 5))]
        endian, timed = str(rng.choice(["big", "little"])), bool(rng.random() < 0.4)
        joint, prefix = str(rng.choice([",", " ", ";", "\t", ""])), str(rng.choice(["", "0x"]))
        n, rows, lines = 20, list[tuple[float, ...]](), ["# a logger", "time,words"]
        lost = set(np.flatnonzero(rng.random(n) < 0.1).tolist()) - {0}
        for k in range(n):
            row = tuple(_any(t, rng) for t in types)
            sign = ">" if endian == "big" else "<"
            packed = [struct.pack(sign + CODES[t], v).hex() for t, v in zip(types, row, strict=True)]
            words = [prefix + w for w in packed] if joint else [prefix + "".join(packed)]
            rows.append(row)
            line = joint.join(words) + ("Z" if k in lost else "")
            lines.append((f"{k / 10:.1f}," if timed else "") + line)
        (tmp_path / "log.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
        layout = {
            "lines": {"time": {"column": 0, "unit": "s"}} if timed else {},
            "frame": frame_of(types, endian),
        }
        got = read(tmp_path / "log.txt", layout=layout | ({} if timed else {"rate": 10.0}))
        assert got.rate == pytest.approx(10.0), seed
        keep = [k for k in range(n) if k not in lost]
        for i, name in enumerate(got.names):
            there = got.values(name)
            np.testing.assert_array_equal(there[keep], [rows[k][i] for k in keep], err_msg=str(seed))
            assert np.isnan(there[[k for k in lost if k < len(there)]]).all(), seed


def _any(kind: str, rng: np.random.Generator) -> float:
    if kind in ("f32", "f64"):
        return float(np.float32(rng.normal()))
    bits = 8 * struct.calcsize(CODES[kind])
    low = 0 if kind[0] == "u" else -(1 << bits - 1)
    return int(rng.integers(low, low + (1 << bits)))


def test_short_words_chosen_columns_and_scale(tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text("".join(f"{k:X};ok;{(1 << 16) - k - 1:X}\n" for k in range(300)), encoding="utf-8")
    layout = {
        "rate": 100,
        "lines": {"columns": [0, 2]},
        "frame": {
            "endian": "big",
            "counter": {"at": 0, "type": "u16"},
            "fields": [{"name": "wx", "at": 2, "type": "i16", "unit": "deg/s", "scale": 0.5}],
        },
    }
    got = read(path, layout=layout)
    np.testing.assert_allclose(got.values("wx"), -0.5 * np.arange(1, 301))
    assert got.channels[0].kind.value == "rate"


def test_the_order_of_bytes_is_asked_about(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_text("FFE5\n" * 9, encoding="utf-8")
    frame = {"fields": [{"name": "a", "type": "i16"}]}
    with pytest.raises(FormatError, match="FFE5 means -27"):
        read(tmp_path / "log.txt", layout={"rate": 1, "lines": {}, "frame": frame})


def test_lines_that_do_not_fit_are_shown(tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_text("FFE5,0001\n" * 9, encoding="utf-8")
    with pytest.raises(DataQualityError, match=r"2 bytes, 4 hexadecimal digits \(it begins 'FFE5,0001'\)"):
        read(tmp_path / "log.txt", layout={"rate": 1, "lines": {}, "frame": frame_of(["i16"])})


@pytest.mark.parametrize("row", ["FFE5,00A1,0BCD", "0xFFE5 0x00A1", "3F80A3D7BFC00000"])
def test_the_error_about_words_names_the_layout(row: str, tmp_path: Path) -> None:
    (tmp_path / "log.txt").write_text((row + "\n") * 30, encoding="utf-8")
    with pytest.raises(FormatError, match=r"hexadecimal.*--layout"):
        read(tmp_path / "log.txt", rate=10.0)


@pytest.mark.parametrize(
    ("head", "name"),
    [("spin_sensor", "spin_sensor"), ("Ch A", "Ch_A"), ("output [V]", "output"), ("# gyro_z", "gyro_z"),
     ('"x1"', "x1"), ("data", "data")],
)  # fmt: skip
def test_a_header_of_one_column_is_its_name(head: str, name: str, tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text(head + "\n" + "".join(f"{k % 5}.25\n" for k in range(40)), encoding="utf-8")
    assert read(path, rate=10.0).names == (name,)


@pytest.mark.parametrize(
    "head", ["This file was written by the bench program, version 2.", "rate: 100 Hz", "---"]
)
def test_a_sentence_is_no_name(head: str, tmp_path: Path) -> None:
    path = tmp_path / "log.txt"
    path.write_text(head + "\n" + "".join(f"{k % 5}.25\n" for k in range(40)), encoding="utf-8")
    assert read(path, rate=100.0).names == ("ch0",)


def test_a_layout_without_lines_takes_bytes(tmp_path: Path) -> None:
    (tmp_path / "log.bin").write_bytes(b"\xff\xe5" * 20)
    got = read(tmp_path / "log.bin", layout={"rate": 1, "frame": frame_of(["i16"])})
    assert got.values("c0").tolist() == [-27.0] * 20
    with pytest.raises(InputError, match="lines"):
        read(tmp_path / "log.bin", variable="lines", layout={"rate": 1, "frame": frame_of(["i16"])})
