# SPDX-License-Identifier: BSD-3-Clause
"""Sentences with a checksum: every sound one is read in its place, every damaged one is missing and counted."""

from __future__ import annotations

import binascii
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.errors import InputError
from allanite.files.readers import read
from allanite.files.readers.delimited.sentence_kinds import known_fields
from allanite.recording.health.examination import check

#: Sentences out of the manuals that `sentence_kinds` cites, with the sums that stand there.
PUBLISHED = (
    "%RAWIMUSA,2209,491612.254;2209,491612.253588,ea5afe00,329303960,-2512321,4410363,309705,607017,-1009773*1fb76c28",
    (
        "%RAWIMUSXA,1692,484620.664;"
        "00,11,1692,484620.664389000,00801503,43110635,-817242,-202184,-215194,-41188,-9895*a5db8c7b"
    ),
    "$FP,RAWIMU,2,2368,228734.073983,-0.118514,-0.082600,9.894035,0.014381,0.004794,-0.003196,0,1,*1C",
    "$FP,CORRIMU,1,2197,126191.777855,-0.195224,0.393969,9.869998,0.013342,-0.004620,-0.000728*7D",
    "$VNRRG,17,+1.0647,-0.2498,+3.0628*66",
    "$VNRRG,80,+0.665016,-000.119,-000.409,-000.025,+000.011,-000.084,-006.702*6A",
    "$PCHRS,1,105.015,-0.9987,-0.9987,-0.9987,*79",
    "$PCHRR,105.015,15.23,15.23,15.23,-450.26,-450.26,-450.26,*68",
)


def summed(body: str, digits: int = 2) -> str:
    data = body.encode()
    if digits == 4:
        return f"${body}*{binascii.crc_hqx(data, 0):04X}"
    if digits == 8:
        return f"%{body}*{zlib.crc32(data, 0xFFFFFFFF) ^ 0xFFFFFFFF:08x}"
    return f"${body}*{int(np.bitwise_xor.reduce(np.frombuffer(data, dtype=np.uint8))):02X}"


def text_of(path: Path, lines: list[str], end: str = "\n") -> Path:
    path.write_bytes((end.join(lines) + end).encode())
    return path


@pytest.mark.parametrize("sentence", PUBLISHED, ids=lambda s: s[:12])
def test_sentences_of_manuals(sentence: str, tmp_path: Path) -> None:
    got = read(text_of(tmp_path / "log.txt", [sentence] * 5), rate=10.0)
    assert got.n_samples == 5
    assert got.notes["text"]["sentences_failed"] == 0
    assert got.notes["text"]["checksum"]
    assert all(not name.startswith("ch") for name in got.names)


@pytest.mark.parametrize("more", ["", "00,11,"])
def test_a_long_header_is_no_channel(more: str, tmp_path: Path) -> None:
    kind = "RAWIMUXA" if more else "RAWIMUA"
    head = f"{kind},COM1,0,68.0,EXACT,1105,{{:.3f}},00040000,b8ed,0;{more}1105,{{:.9f}},00111607"
    bodies = [
        head.format(425384.18 + k / 100, 425384.156 + k / 100)
        + f",{43088060 + k % 3},4303,-3033,-132,{k % 5},823"
        for k in range(80)
    ]
    lines = [f"#{b}*{zlib.crc32(b.encode(), 0xFFFFFFFF) ^ 0xFFFFFFFF:08x}" for b in bodies]
    got = read(text_of(tmp_path / "log.txt", lines))
    assert got.rate == pytest.approx(100.0) and got.n_samples == 80
    assert [n for n in got.names if n[:4] in ("gyro", "acc_")] == [
        "acc_z", "acc_minus_y", "acc_x", "gyro_z", "gyro_minus_y", "gyro_x"
    ]  # fmt: skip


def test_units_and_names_of_a_known_unit(tmp_path: Path) -> None:
    rows = [
        summed(f"VNIMU,+0.2,+0.1,+0.4,+00.01,+00.02,-09.8{k},+0.001,+0.002,-0.00{k},+24.5,+101.3")
        for k in range(9)
    ]
    got = read(text_of(tmp_path / "log.txt", rows), rate=40.0)
    assert [(c.name, c.unit) for c in got.channels[3:]] == [
        *((f"acc_{a}", "m/s²") for a in "xyz"), *((f"gyro_{a}", "rad/s") for a in "xyz"),
        ("temperature", "°C"), ("pressure", "kPa"),
    ]  # fmt: skip
    np.testing.assert_array_equal(got.values("gyro_z"), [-k / 1000 for k in range(9)])


def test_last_field_is_kept_of_an_unknown_unit(tmp_path: Path) -> None:
    rows = [summed(f"XYZ,{k},{k * k * 0.5}") for k in range(9)]
    got = read(text_of(tmp_path / "log.txt", rows), rate=1.0)
    np.testing.assert_array_equal(got.values(got.names[-1]), np.arange(9) ** 2 * 0.5)


@pytest.mark.long
def test_every_sound_sentence_is_in_its_place(tmp_path: Path) -> None:
    for seed in range(100):  # a fault of 2.3 % of them is found with 90 %
        rng = np.random.default_rng(seed)
        kind, digits = str(rng.choice(["VNGYR", "IMU", "PABC", "QX7"])), int(rng.choice([2, 4, 8]))
        n, several = int(rng.integers(12, 40)), bool(rng.random() < 0.4)
        front = str(rng.choice(["", "seconds", "iso"])) if digits != 8 else ""
        values = np.round(rng.normal(size=(n, 3)), 4)
        lines, lost = ["# a log", ""], set(np.flatnonzero(rng.random(n) < 0.15).tolist())
        for k in range(n):
            line = summed(kind + "," + ",".join(f"{v:+.4f}" for v in values[k]), digits)
            lines.append(_stamp(front, k) + (_damaged(line, len(kind), rng) if k in lost else line))
            if several and k % 3 == 0:
                lines.append(_stamp(front, k) + summed(f"GPZDA,{k:06d}.00,01,02,2024,00,00", digits))
        path = text_of(tmp_path / "log.txt", lines, str(rng.choice(["\n", "\r\n"])))
        got = read(path, rate=100.0, variable=kind if several else None)
        assert got.n_samples == n, seed
        assert got.notes["text"]["sentences_failed"] == len(lost), seed
        there = np.array([got.values(name) for name in got.names[-3:]]).T
        keep = np.array([k not in lost for k in range(n)])
        np.testing.assert_array_equal(there[keep], values[keep])
        assert np.isnan(there[~keep]).all()
        assert ("checksum_failed" in {f.code for f in check(got)}) == bool(lost)


def _stamp(front: str, k: int) -> str:
    return {"": "", "seconds": f"{1.7e9 + k / 100:.2f},", "iso": f"[2024-01-01 00:00:{k:02d}.500] "}[front]


def _damaged(line: str, kind: int, rng: np.random.Generator) -> str:
    """One character behind the kind becomes another, goes, or comes twice; or the line is cut."""
    at = int(rng.integers(kind + 2, len(line) - 1))
    how = rng.integers(4)
    if how == 0:
        return line[:at] + ("7" if line[at] != "7" else "x") + line[at + 1 :]
    if how == 1:
        return line[:at] + line[at + 1 :] if line[at] != line[at - 1] else line[:at]
    if how == 2:
        return line[:at] + "#" + line[at:]
    return line[:at]


def test_a_damaged_sentence_anywhere_does_not_hide_the_time(tmp_path: Path) -> None:
    """A clock without a name is told by its even steps; a row that was lost leaves a longer one."""
    for bad in (0, 3, 10, 250, 499):
        rows = []
        for k in range(500):
            body = f"IMU,{k / 50:.2f},{np.sin(k):.5f},{np.cos(k):.5f}"
            total = 0
            for sign in body:
                total ^= ord(sign)
            rows.append(f"${body}*{total ^ (k == bad):02X}")
        path = tmp_path / "log.txt"
        path.write_text("\n".join(rows) + "\n")
        found = read(path)
        assert (found.rate, len(found.names)) == (50.0, 2), bad


def test_stamps_of_a_logger_and_damage(tmp_path: Path) -> None:
    lines = [f"{10 + 0.01 * k:.3f};{summed(f'VNGYR,{k},0,{k}')}" for k in range(50)]
    lines[20] = lines[20].replace("VNGYR,20", "VNGYR,21")
    got = read(text_of(tmp_path / "log.txt", lines))
    assert got.rate == pytest.approx(100.0)
    assert np.flatnonzero(np.isnan(got.values("gyro_z"))).tolist() == [20]
    assert got.values("gyro_z")[30] == 30.0


@pytest.mark.parametrize("head", ["a,b,gyro_z [deg/s]", "$kind,a,b,gyro_z [deg/s]"])
def test_a_header_in_front_names_the_fields(head: str, tmp_path: Path) -> None:
    lines = [head, *(summed(f"QX7,{k % 3},{k % 7},0.{k}") for k in range(30))]
    got = read(text_of(tmp_path / "log.txt", lines), rate=10.0)
    assert (got.names, got.n_samples, got.channels[2].unit) == (("a", "b", "gyro_z"), 30, "deg/s")
    assert got.notes["text"]["sentences_failed"] == 0


def test_two_sentences_in_one_line_are_two_samples(tmp_path: Path) -> None:
    lines = [summed(f"VNGYR,{k},0,{k}") for k in range(20)]
    lines[5:7] = [lines[5] + lines[6]]
    got = read(text_of(tmp_path / "log.txt", lines), rate=10.0)
    np.testing.assert_array_equal(got.values("gyro_x"), np.arange(20.0))


def test_kinds_are_listed_and_chosen(tmp_path: Path) -> None:
    lines = [
        line for k in range(9) for line in (summed(f"PCHRS,0,{k}.5,1,2,3,"), summed(f"PCHRS,1,{k}.5,0,0,1,"))
    ]
    path = text_of(tmp_path / "um7.txt", lines)
    with pytest.raises(InputError, match=r"PCHRS,0 \(time, gyro\), PCHRS,1 \(time, acc\)"):
        read(path)
    for variable in ("PCHRS,1", "$pchrs,1"):
        assert [c.unit for c in read(path, variable=variable).channels] == ["g"] * 3
    with pytest.raises(InputError, match="no sentences"):
        read(path, variable="PCHRS,7")


def test_the_only_inertial_kind_is_read_and_said(tmp_path: Path) -> None:
    lines = [line for k in range(9) for line in (summed(f"VNYPR,1,2,{k}"), summed(f"VNGYR,1,2,{k}"))]
    got = read(text_of(tmp_path / "log.txt", lines), rate=10.0)
    assert got.names == ("gyro_x", "gyro_y", "gyro_z")
    assert any("VNYPR" in guess for guess in got.notes["text"]["guesses"])


def test_unknown_checksum_is_said(tmp_path: Path) -> None:
    lines = [f"$ABC,{k % 7},{k % 5}.5*{(37 * k + 11) % 256:02X}" for k in range(40)]
    got = read(text_of(tmp_path / "log.txt", lines), rate=10.0)
    assert got.n_samples == 40
    assert any("not checked" in guess for guess in got.notes["text"]["guesses"])


def test_increments_are_not_called_rates(tmp_path: Path) -> None:
    lines = [summed(f"VNDTV,0.01,0.{k},0.1,0.1,0.2,0.2,0.2") for k in range(9)]
    got = read(text_of(tmp_path / "log.txt", lines), rate=10.0)
    kinds: dict[str, Any] = {c.name: c.kind.value for c in got.channels}
    assert kinds["delta_theta_x"] == "unknown"
    assert any("increments" in guess for guess in got.notes["text"]["guesses"])


def test_known_kinds_have_names_that_are_understood() -> None:
    assert known_fields("VNIMU")[-1] == "pressure[kPa]"
    assert known_fields("nothing") == ()
