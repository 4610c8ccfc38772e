# SPDX-License-Identifier: BSD-3-Clause
"""Frames and lines of a described device: checksums, description, bytes in and samples out."""

from __future__ import annotations

import math
import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from allanite.acquisition.instruments import Flag
from allanite.acquisition.instruments.serial_imu import Description, Framer, Samples, read_description
from allanite.acquisition.instruments.serial_imu.checksums import KINDS, SIZES, checksum
from allanite.acquisition.instruments.serial_imu.encoding import Encoder
from allanite.acquisition.instruments.serial_imu.faults import ImuFault, noise, wire
from allanite.acquisition.instruments.serial_imu.sequence import Sequence
from allanite.acquisition.instruments.serial_imu.tally import Tally
from allanite.errors import FormatError, InputError, LimitError

FRAME: dict[str, Any] = {
    "header": "A5 5A",
    "length": 18,
    "counter": {"at": 2, "type": "u16"},
    "fields": [
        {"name": "gyro_x", "at": 4, "type": "i24", "unit": "deg/s", "scale": 1e-4},
        {"name": "gyro_y", "type": "i24", "unit": "deg/s", "scale": 1e-4, "endian": "big"},
        {"name": "acc_z", "type": "f32", "unit": "g"},
    ],
    "status": [
        {
            "at": 14,
            "type": "u8",
            "bits": [
                {"bit": 0, "flag": "overload", "fields": ["gyro_x"]},
                {"bit": 7, "flag": "doubtful"},
            ],
        }
    ],
    "checksum": {"kind": "crc16-ccitt", "from": 2},
}
LINES: dict[str, Any] = {
    "begins": "$IMU",
    "counter": {"column": 1, "modulus": 10_000},
    "columns": [
        {"name": "gyro_z", "column": 2, "unit": "deg/h"},
        {"name": "temperature", "column": 3, "unit": "°C"},
    ],
    "checksum": {},
}


def binary(**changes: Any) -> Description:
    return Description.of({"model": "X1", "rate": 200, "frame": {**FRAME, **changes}})


def textual(**changes: Any) -> Description:
    return Description.of({"model": "T1", "rate": 100, "lines": {**LINES, **changes}})


def rows(described: Description, count: int, first: int = 0) -> np.ndarray:
    """Samples of the simulator's noise as the device rounds them."""
    return noise(len(described.channels))(first, count)


def stream(described: Description, count: int, *faults: ImuFault) -> bytes:
    """What a device sends that misbehaves, absences left out."""
    source = noise(len(described.channels))
    sent = wire(Encoder(described), source, faults, rate=described.rate, total=count)
    return b"".join(what for _, what in sent if isinstance(what, bytes))


def fed(described: Description, sent: bytes, cuts: tuple[int, ...] = ()) -> tuple[list[Samples], Framer]:
    framer = Framer(described)
    ends = [0, *sorted(min(cut, len(sent)) for cut in cuts), len(sent)]
    return [framer.feed(sent[a:b]) for a, b in zip(ends, ends[1:], strict=False)], framer


def joined(parts: list[Samples]) -> tuple[np.ndarray, np.ndarray, np.ndarray | None]:
    counters = [p.counter for p in parts if p.counter is not None]
    return (
        np.concatenate([p.values for p in parts]),
        np.concatenate([p.flags for p in parts]),
        np.concatenate(counters) if counters else None,
    )


# -- checksums -----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_every_checksum_travels_and_refuses_every_flipped_bit(kind: Any) -> None:
    size = SIZES[kind]
    described = binary(length=15 + size, checksum={"kind": kind, "from": 2, "endian": "big"}, confirm=False)
    frame = stream(described, 1)
    assert len(joined(fed(described, frame)[0])[0]) == 1
    for bit in range(16, 8 * len(frame)):
        hurt = bytearray(frame)
        hurt[bit // 8] ^= 1 << bit % 8
        if (hurt[bit // 8] ^ frame[bit // 8], kind) != (0xFF, "fletcher16"):  # 0 and 255 are one modulo 255
            assert len(joined(fed(described, bytes(hurt))[0])[0]) == 0, f"bit {bit}"


# -- the description -----------------------------------------------------------------------------------------

WRONG = """\
model: X1
rate: -5
frame:
  header: A5 5
  length: 12
  fields:
    - {name: a, at: 4, type: i33, unit: deg/s}
    - {name: b, typ: i16, unit: deg/s}
  checksum: {kind: crc17, from: 2}
color: red
"""
CONTRADICTORY = """\
model: X1
rate: 5
frame:
  header: A5 5A
  length: 12
  counter: {at: 5, type: u8, modulus: 300}
  fields:
    - {name: a, at: 4, type: i16, unit: deg/s}
    - {name: a, at: 10, type: f64, unit: deg/fortnight}
  status:
    - {at: 6, type: u8, bits: [{bit: 9, flag: overload, fields: [c]}]}
  checksum: {kind: sum8, from: 2, init: 1}
"""


def test_every_fault_is_told_at_once_with_its_line(tmp_path: Path) -> None:
    place = tmp_path / "imu.yaml"
    place.write_text(WRONG, encoding="utf-8")
    with pytest.raises(FormatError) as caught:
        read_description(place)
    told = str(caught.value)
    for wanted in (
        "line 2, rate:",
        "line 4, frame.header: bytes in hexadecimal",
        "line 7, frame.fields[0].type:",
        "line 8, frame.fields[1].type: is missing",
        "line 8, frame.fields[1].typ: is not a known entry",
        "line 9, frame.checksum.kind:",
        "line 10, color: is not a known entry",
    ):
        assert wanted in told
    assert "has 7 faults" in told


def test_every_contradiction_is_told_at_once_with_its_line(tmp_path: Path) -> None:
    place = tmp_path / "imu.yaml"
    place.write_text(CONTRADICTORY, encoding="utf-8")
    with pytest.raises(FormatError) as caught:
        read_description(place)
    told = str(caught.value)
    for wanted in (
        "line 6, frame.counter.at: byte 5 belongs already to frame.fields[0]",
        "line 6, frame.counter.modulus: 300 does not fit into u8",
        "line 9, frame.fields[1]: ends at byte 18, but the frame has 12",
        "line 9, frame.fields[1].name: 'a' is there twice",
        "line 9, frame.fields[1].unit: ",
        "line 11, frame.status[0].bits[0].bit: bit 9 of a word of 8 bits",
        "line 11, frame.status[0].bits[0].fields: no field 'c'",
        "line 12, frame.checksum.init: sum8 has no such parameter",
    ):
        assert wanted in told


@pytest.mark.parametrize(
    ("entries", "said"),
    [
        ({}, "give either 'frame' (binary) or 'lines' (text)"),
        ({"frame": FRAME, "lines": LINES}, "give either 'frame'"),
        ({"lines": {**LINES, "separator": ", "}}, "lines.separator: is one character"),
        ({"lines": {**LINES, "decimal": ","}}, "lines.decimal: is the separator as well"),
        ({"lines": {**LINES, "cells": 3}}, "column 3 of a line with 3 cells"),
        ({"lines": {**LINES, "counter": {"column": 2, "modulus": 100}}}, "column 2 belongs already to"),
        (
            {"lines": {**LINES, "counter": {"column": 1, "modulus": 100, "step": 50}}},
            "quarter of the modulus",
        ),
        ({"frame": {**FRAME, "header": 5555}}, "in quotes"),
        ({"frame": {**FRAME, "checksum": {"kind": "xor", "from": 40}}}, "lies outside a frame of 18 bytes"),
        ({"frame": {**FRAME, "checksum": {"kind": "xor", "from": 17}}}, "covers no byte"),
        ({"frame": {**FRAME, "checksum": {"kind": "xor", "from": 2, "modulus": 256}}}, "fletcher16 only"),
        ({"lines": LINES, "start": [{}]}, "start[0]: give either 'text' or 'hex'"),
        ({"lines": LINES, "identity": {"ask": {"text": "?"}, "answer": "("}}, "not a regular expression"),
        ({"lines": LINES, "identity": {"ask": {"text": "?"}, "answer": "x"}}, "names no group"),
        (
            {"frame": {**FRAME, "fields": [{"name": "a", "type": "f32", "scale": 0, "unit": "V"}]}},
            "scale of 0",
        ),
    ],
)
def test_what_does_not_fit_is_refused(entries: dict[str, Any], said: str) -> None:
    with pytest.raises(FormatError) as caught:
        Description.of({"model": "X1", "rate": 100, **entries})
    assert said in str(caught.value)


def test_files_that_are_none(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="no such file"):
        read_description(tmp_path / "none.yaml")
    for text, said in (
        ("a: [1", "is not YAML"),
        ("- 1", "not a description"),
        ("a: 1\na: 2", "is not YAML"),
        ("a: &a [1, *a]\n", "imu|bad"),
        ("x" * 300_000, "300000 bytes"),
        ("a: &a [" + "0," * 99 + "]\nb: &b [" + "*a," * 99 + "]\nc: [" + "*b," * 99 + "]\n", "entries"),
    ):
        (tmp_path / "bad.yaml").write_text(text, encoding="utf-8")
        with pytest.raises((FormatError, LimitError), match=said):
            read_description(tmp_path / "bad.yaml")


def test_the_channels_follow_from_the_fields() -> None:
    described = Description.of(
        {
            "model": "X1",
            "rate": 10,
            "sampling": "point",
            "frame": {
                "header": "AA",
                "length": 4,
                "fields": [
                    {"name": "g", "type": "i16", "unit": "LSB", "scale_factor": "131 LSB/(deg/s)"},
                    {"name": "raw", "type": "u8"},
                ],
            },
        }
    )
    gyro, raw = described.channels
    assert gyro.kind.value == "rate" and gyro.scale == pytest.approx(math.radians(1 / 131))
    assert (raw.kind.value, raw.unit, raw.sampling) == ("unknown", "", "point")


# -- the normal course ---------------------------------------------------------------------------------------


def test_a_frame_is_what_its_bytes_say() -> None:
    body = struct.pack("<H", 7) + (-8_388_608).to_bytes(3, "little", signed=True)
    body += (8_388_607).to_bytes(3, "big", signed=True) + struct.pack("<fB", 0.5, 0x80) + b"\0"
    frame = b"\xa5\x5a" + body + struct.pack("<H", checksum("crc16-ccitt")(body))
    (samples,), framer = fed(binary(), frame)
    np.testing.assert_allclose(samples.values, [[-838.8608, 838.8607, 0.5]], rtol=1e-15)
    assert samples.flags.tolist() == [Flag.DOUBTFUL] and samples.counter is not None
    assert samples.counter.tolist() == [0] and framer.tally == Tally(frames=1)


@pytest.mark.parametrize("endian", ["little", "big"])
@pytest.mark.parametrize(
    "kind", ["u8", "i8", "u16", "i16", "u24", "i24", "u32", "i32", "u64", "i64", "f32", "f64"]
)
def test_every_type_travels(kind: str, endian: str) -> None:
    fields = [{"name": "v", "type": kind, "scale": 0.5, "offset": 3.0}]
    frame = {"header": "AA 55", "endian": endian, "length": 14, "fields": fields}
    described = Description.of(
        {"model": "X", "rate": 1, "frame": {**frame, "checksum": {"kind": "crc32", "from": 0, "at": 10}}}
    )
    bits = 8 * int(kind[1:]) // 8
    raws = [0, 1, 100] + ([-1, -(1 << bits - 1)] if kind[0] == "i" else [(1 << min(bits, 53)) - 1])
    encoder = Encoder(described)
    raws = raws if kind[0] != "f" else [0.0, -2.5, 1024.0]
    sent = b"".join(encoder.encode(i, [0.5 * raw + 3.0]) for i, raw in enumerate(raws))
    (samples,), _ = fed(described, sent)
    assert samples.values[:, 0].tolist() == [0.5 * raw + 3.0 for raw in raws]
    assert samples.counter is None


def test_raw_values_that_mean_missing_and_overload() -> None:
    field = {"name": "v", "type": "i16", "unit": "V", "missing": [-32768], "overload": [32767, -32767]}
    described = Description.of(
        {
            "model": "X",
            "rate": 1,
            "frame": {
                "header": "AA",
                "length": 3,
                "fields": [
                    field,
                ],
                "confirm": False,
            },
        }
    )
    sent = b"".join(b"\xaa" + struct.pack("<h", raw) for raw in (5, -32768, 32767, -32767))
    (samples,), _ = fed(described, sent)
    np.testing.assert_equal(samples.values[:, 0], [5.0, np.nan, np.nan, np.nan])
    assert samples.flags.tolist() == [0, Flag.MISSING, Flag.OVERLOAD, Flag.OVERLOAD]


def test_status_bits_take_the_values_that_they_name() -> None:
    described = binary()
    sent = Encoder(described).encode(0, [1.0, 2.0, 3.0], Flag.OVERLOAD)
    (samples,), _ = fed(described, sent)
    np.testing.assert_allclose(samples.values, [[np.nan, 2.0, 3.0]])
    assert samples.flags.tolist() == [Flag.OVERLOAD]


def test_floats_that_are_no_numbers_are_flagged() -> None:
    fields = [{"name": "v", "type": "f32", "unit": "V"}]
    described = Description.of(
        {"model": "X", "rate": 1, "frame": {"header": "AA", "length": 5, "fields": fields, "confirm": False}}
    )
    sent = b"".join(b"\xaa" + struct.pack("<f", v) for v in (1.0, math.nan, -math.inf, 9.91e37))
    (samples,), _ = fed(described, sent)
    np.testing.assert_equal(samples.values[:, 0], [1.0, np.nan, np.nan, np.nan])
    assert samples.flags.tolist() == [0, Flag.MISSING, Flag.OVERLOAD, Flag.OVERLOAD]


def test_frames_of_several_lengths_and_kinds() -> None:
    frame = {
        "header": "B5 62",
        "length": {"at": 4, "type": "u16", "add": 8, "longest": 60},
        "kind": {"at": 2, "bytes": "10 02"},
        "fields": [{"name": "g", "at": 6, "type": "i32", "unit": "deg/s", "scale": 1e-3}],
        "checksum": {"kind": "fletcher16", "modulus": 256, "from": 2},
    }
    described = Description.of({"model": "U", "rate": 10, "frame": frame})
    wanted = Encoder(described).encode(0, [1.25])
    body = b"\x01\x07\x0a\x00" + bytes(range(10))
    other = b"\xb5\x62" + body + checksum("fletcher16", modulus=256)(body).to_bytes(2, "little")
    too_long = b"\xb5\x62\x10\x02\xff\xff"
    (samples,), framer = fed(described, wanted + other + too_long + wanted)
    assert samples.values[:, 0].tolist() == [1.25, 1.25]
    assert (framer.tally.others, framer.tally.skipped) == (1, len(too_long))


def test_a_line_is_what_its_cells_say() -> None:
    (samples,), framer = fed(textual(), b"$IMU,17,-1.25e1,25.5*6F\r\n")
    assert framer.tally.failed == 1 and not len(samples)
    (samples,), framer = fed(textual(), Encoder(textual()).encode(17, [-12.5, 25.5]))
    assert samples.values.tolist() == [[-12.5, 25.5]] and framer.tally == Tally(frames=1)


@pytest.mark.parametrize(
    ("cell", "value", "flag"),
    [
        ("1.5", 1.5, 0),
        ("+.5e-1", 0.05, 0),
        ("NaN", None, Flag.MISSING),
        ("", None, Flag.MISSING),
        ("undefined", None, Flag.MISSING),
        ("OVLD", None, Flag.OVERLOAD),
        ("-Infinity", None, Flag.OVERLOAD),
        ("9.9E37", None, Flag.OVERLOAD),
        ("9.91E37", None, Flag.OVERLOAD),
        ("1E+38", None, Flag.OVERLOAD),
    ],
)
def test_cells_that_are_numbers_and_cells_that_mean_something(
    cell: str, value: float | None, flag: int
) -> None:
    plain = {"begins": "G", "columns": [{"name": "v", "column": 1, "unit": "V"}]}
    described = Description.of({"model": "T", "rate": 1, "lines": plain})
    (samples,), _ = fed(described, f"G, {cell}\n".encode())
    np.testing.assert_equal(samples.values, [[np.nan if value is None else value]])
    assert samples.flags.tolist() == [flag]


@pytest.mark.parametrize("line", ["1_0", "0x10", "1.2.3", "1,2", "1 2", "one", "٣", "--1", "1e"])
def test_cells_that_are_nothing_are_refused(line: str) -> None:
    described = Description.of(
        {"model": "T", "rate": 1, "lines": {"columns": [{"name": "v", "column": 0, "unit": "V"}]}}
    )
    (samples,), framer = fed(described, f"first\n1\n{line}\n2\n".encode())
    assert samples.values[:, 0].tolist() == [1.0, 2.0]
    assert samples.flags.tolist() == [0, Flag.RESYNC]
    assert (framer.tally.unreadable, framer.tally.uneven) == ((0, 1) if "," in line else (1, 0))


def test_blanks_decimal_commas_and_hexadecimal_counters() -> None:
    lines = {
        "separator": "blank",
        "decimal": ",",
        "counter": {"column": 0, "modulus": 256, "numbers": "hexadecimal"},
        "columns": [{"name": "v", "column": 1, "unit": "V", "scale": 1e-3}],
        "status": [{"column": 2, "bits": [{"bit": 0, "flag": "doubtful", "when": 0}]}],
    }
    described = Description.of({"model": "T", "rate": 1, "lines": lines})
    (samples,), _ = fed(described, b"5 9 1\nFE  1,5 1\nFF  2,5 0\n01 3,5 1\n")
    np.testing.assert_allclose(samples.values[:, 0], [1.5e-3, 2.5e-3, 3.5e-3])
    assert samples.flags.tolist() == [0, Flag.DOUBTFUL, Flag.RESYNC]
    assert samples.counter is not None and samples.counter.tolist() == [0, 1, 3]


def test_a_first_line_that_may_be_a_half_is_dropped() -> None:
    described = Description.of(
        {"model": "T", "rate": 1, "lines": {"columns": [{"name": "v", "column": 0, "unit": "V"}]}}
    )
    (samples,), framer = fed(described, b"1.23\n11.23\n4")
    assert samples.values.tolist() == [[11.23]] and (framer.tally.skipped, framer.pending) == (5, 1)
    framer.cut()
    assert len(framer.feed(b"5\n7\n")) == 1 and framer.tally.skipped == 5 + 1 + 2


@pytest.mark.parametrize(("begins", "wanted"), [("$G", [2.0, 3.0]), ("G", [3.0])])
def test_what_stands_before_a_line_is_passed_over_but_a_word_is_not_cut(
    begins: str, wanted: list[float]
) -> None:
    lines = {"begins": begins, "columns": [{"name": "v", "column": 1, "unit": "V"}]}
    described = Description.of({"model": "T", "rate": 1, "lines": lines})
    (samples,), _ = fed(described, f"OR{begins},2\n{begins},3\n".encode())
    assert samples.values[:, 0].tolist() == wanted


def test_a_line_without_end_does_not_fill_memory() -> None:
    framer = Framer(textual())
    for _ in range(100):
        framer.feed(b"x" * 1000)
        assert framer.pending <= 512
    assert framer.tally.skipped == 100_000


# -- the counter ---------------------------------------------------------------------------------------------


def numbers(raws: list[int], modulus: int = 256, step: int = 1) -> tuple[list[int | None], Tally]:
    sequence, tally, found = Sequence[int](modulus, step), Tally(), []
    for raw in raws:
        found += [(p.piece, p.number) for p in sequence.admit(raw, raw, tally)]
    return found, tally


@pytest.mark.parametrize(
    ("raws", "found", "dropped"),
    [
        ([254, 255, 0, 1], [(254, 0), (255, 1), (0, 2), (1, 3)], {}),
        ([5, 6, 6, 7], [(5, 0), (6, 1), (7, 2)], {"doubled": 1}),
        ([5, 6, 9], [(5, 0), (6, 1), (9, 4)], {"jumps": 1, "lost": 2}),
        ([5, 6, 5, 7], [(5, 0), (6, 1), (7, 2)], {"stale": 1}),
        ([5, 6, 100, 7], [(5, 0), (6, 1), (7, 2)], {"stray": 1}),
        ([5, 6, 100, 101], [(5, 0), (6, 1), (100, 95), (101, 96)], {"jumps": 1, "lost": 93}),
        (
            [100, 101, 0, 0, *range(1, 5)],
            [(100, 0), (101, 1), *((i, 2 + i) for i in range(5))],
            {"doubled": 1, "jumps": 1, "restarts": 1},
        ),
        ([5, 6, 100, 180, 7, 8], [(5, 0), (6, 1), (7, 2), (8, 3)], {"stray": 1, "stale": 1}),
    ],
)
def test_the_counter_tells(raws: list[int], found: list[Any], dropped: dict[str, int]) -> None:
    got, tally = numbers(raws)
    assert got == found
    assert tally == Tally(**dropped)


def test_a_long_replay_is_old_and_a_counter_that_stays_elsewhere_is_new() -> None:
    found, tally = numbers([*range(5000, 5300), *range(5100, 5302)], modulus=65_536)
    assert [number for _, number in found] == list(range(302)) and tally.stale + tally.doubled == 200
    found, tally = numbers([50_000, *range(30_000, 30_400)], modulus=65_536)
    assert [raw for raw, _ in found] == [50_000, *range(30_000, 30_400)]
    assert (tally.stale, tally.restarts) == (0, 1)


def test_a_clock_is_a_counter_with_a_step() -> None:
    found, tally = numbers([10, 5013, 9990, 25_020, 25_020], modulus=1 << 32, step=5000)
    assert [number for _, number in found] == [0, 1, 2, 5]
    assert (tally.lost, tally.doubled) == (2, 1)


# -- what goes wrong -----------------------------------------------------------------------------------------

MISBEHAVIOUR = (
    ImuFault(kind="garbage", at=3, size=400),
    ImuFault(kind="partial", at=7, size=9),
    ImuFault(kind="flipped", at=11, size=77),
    ImuFault(kind="doubled", at=15),
    ImuFault(kind="replayed", at=19, size=4),
    ImuFault(kind="lost", at=23, size=5),
    ImuFault(kind="overload", at=31),
    ImuFault(kind="doubled", at=39),
    ImuFault(kind="garbage", at=39, size=2),
)


@pytest.mark.parametrize("described", [binary(), textual()], ids=["binary", "text"])
def test_no_wrong_sample_and_none_twice(described: Description) -> None:
    parts, framer = fed(described, stream(described, 40, *MISBEHAVIOUR))
    values, flags, counter = joined(parts)
    assert counter is not None and (np.diff(counter) > 0).all()
    lost = {7, 11, *range(23, 28)}
    assert sorted(set(range(40)) - set(counter.tolist())) == sorted(lost)
    wanted = rows(described, 40)[counter]
    sound = flags & Flag.OVERLOAD == 0
    assert counter[~sound].tolist() == [31]
    np.testing.assert_allclose(values[sound], wanted[sound], atol=6e-5)
    assert (framer.tally.doubled, framer.tally.stale) == (3, 3)
    jumped = np.flatnonzero(flags & Flag.RESYNC)
    assert jumped.tolist() == (np.flatnonzero(np.diff(counter) > 1) + 1).tolist()


def test_without_a_checksum_a_frame_counts_when_the_next_one_follows() -> None:
    described = binary(checksum=None)
    sent = stream(
        described, 40, ImuFault(kind="partial", at=10, size=9), ImuFault(kind="garbage", at=20, size=33)
    )
    values, _, counter = joined(fed(described, sent)[0])
    assert counter is not None
    assert sorted(set(range(40)) - set(counter.tolist())) == [
        10,
        19,
        39,
    ]  # before garbage, and the last: unproven
    np.testing.assert_allclose(values, rows(described, 40)[counter], atol=6e-5)


def test_equal_frames_without_a_counter_are_samples_or_not_as_the_description_says() -> None:
    for identical, wanted in (("keep", [1.0, 1.0, 2.0]), ("drop", [1.0, 2.0])):
        lines = {"begins": "G", "columns": [{"name": "v", "column": 1, "unit": "V"}], "identical": identical}
        described = Description.of({"model": "T", "rate": 1, "lines": lines})
        (samples,), _ = fed(described, b"G,1\nG,1\nG,2\n")
        assert samples.values[:, 0].tolist() == wanted


def test_after_an_interruption_the_next_sample_is_flagged_and_no_half_is_joined() -> None:
    described = binary()
    sent = stream(described, 4)
    framer = Framer(described)
    framer.feed(sent[:27])
    framer.cut()
    samples = framer.feed(sent[36:])
    assert samples.counter is not None and samples.counter.tolist() == [2, 3]
    assert samples.flags.tolist() == [Flag.RESYNC, 0] and samples.jumps[0].far
    assert "9 bytes" in framer.tally.sentences()[0]


FAULTS = st.lists(
    st.builds(
        ImuFault,
        kind=st.sampled_from(["garbage", "partial", "flipped", "doubled", "replayed", "lost", "overload"]),
        at=st.integers(1, 29),
        size=st.integers(1, 40),
    ),
    max_size=6,
)
FORMATS = {
    "crc16": binary(),
    "sum8": binary(length=16, checksum={"kind": "sum8", "from": 0}),
    "bare": binary(length=15, checksum=None),
    "uncounted": binary(counter=None),
    "text": textual(),
    "bare text": textual(checksum=None, begins=None, counter=None),
}
QUICK = settings(max_examples=40, suppress_health_check=[HealthCheck.too_slow])


@pytest.mark.parametrize("name", FORMATS)
@QUICK
@given(faults=FAULTS, cuts=st.lists(st.integers(0, 900), max_size=12), tail=st.binary(max_size=40))
def test_cuts_of_the_stream_change_nothing(
    name: str, faults: list[ImuFault], cuts: list[int], tail: bytes
) -> None:
    described = FORMATS[name]
    sent = tail + stream(described, 30, *faults) + tail
    whole, one = fed(described, sent)
    parts, many = fed(described, sent, tuple(cuts))
    for wanted, got in zip(joined(whole), joined(parts), strict=True):
        np.testing.assert_array_equal(got, wanted)
    assert many.tally == one.tally
    assert many.pending == one.pending


@QUICK
@given(faults=FAULTS)
def test_whatever_goes_wrong_every_sample_is_true_and_in_order(faults: list[ImuFault]) -> None:
    described = FORMATS["crc16"]
    values, flags, counter = joined(fed(described, stream(described, 30, *faults))[0])
    assert counter is not None and (np.diff(counter) > 0).all()
    # sample 0 is never hurt, so that numbers are those of the source
    sound = flags & Flag.OVERLOAD == 0
    np.testing.assert_allclose(values[sound], rows(described, 30)[counter][sound], atol=6e-5)


@QUICK
@given(garbage=st.binary(max_size=2000))
def test_garbage_gives_no_error_and_every_byte_is_accounted_for(garbage: bytes) -> None:
    for described in (FORMATS["crc16"], FORMATS["text"]):
        parts, framer = fed(described, garbage)
        assert len(joined(parts)[0]) == framer.tally.frames
        if not framer.tally.frames and described.frame is not None:
            assert framer.tally.skipped + framer.pending == len(garbage)


def test_a_single_byte_at_a_time_gives_the_same() -> None:
    described = FORMATS["crc16"]
    sent = stream(described, 40, *MISBEHAVIOUR)
    whole, one = fed(described, sent)
    parts, many = fed(described, sent, tuple(range(len(sent))))
    np.testing.assert_array_equal(joined(parts)[0], joined(whole)[0])
    assert many.tally == one.tally


# -- values that no sensor gives ----------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "size"), [("f32", 4), ("f64", 8), ("i16", 2), ("i32", 4), ("text", 0)], ids=lambda x: str(x)
)
def test_a_value_beyond_its_limits_is_none_and_is_counted(kind: str, size: int) -> None:
    """One rule for all types; without limits, 1e30 is a number like any other."""
    gyro = {"name": "gz", "unit": "deg/s", "scale": 0.01 if kind[0] == "i" else 1.0, "limits": [-250, 250]}
    if kind == "text":
        described = {"lines": {"columns": [{**gyro, "column": 0}]}}
        sent = [1.0, 1e30, -250.0, 250.5, float("nan"), 1e38, 249.0, 0.0]
    else:
        frame = {"header": "A5 5A", "length": 2 + size, "fields": [{**gyro, "at": 2, "type": kind}]}
        described = {"frame": {**frame, "confirm": False}}
        largest = {"i16": 327.67, "i32": 1e7}.get(kind, 1e30)
        odd = [float("nan"), float("inf")] if kind[0] == "f" else [0.0, 0.0]
        sent = [1.0, largest, -250.0, 250.5, *odd, 249.0, 0.0]
    imu = Description.of({"model": "X1", "rate": 100, **described})
    raw = np.array(sent) / gyro["scale"]
    if kind == "text":
        data = "".join(f"{v!r}\r\n" for v in [0.0, *sent]).encode()  # the first line may have begun before
    else:
        data = b"".join(b"\xa5\x5a" + v.tobytes() for v in raw.round(6).astype(f"<{kind[0]}{size}"))
    framer = Framer(imu)
    samples = framer.feed(data)
    given = samples.values[:, 0]
    assert len(given) == len(sent) and not (np.abs(given) > 250).any()
    assert np.flatnonzero(np.isnan(given)).tolist() == [1, 3] + (
        [4, 5] if kind in ("f32", "f64", "text") else []
    )
    assert (samples.flags[[1, 3]] == Flag.MISSING).all()
    assert framer.tally.impossible == 2
    assert framer.tally.sentences()[-1] == "left out values beyond their limits in 2 samples"


@pytest.mark.parametrize("limits", [[1, 1], [2, 1], [float("nan"), 1], [0, float("inf")], [1]])
def test_limits_that_are_none_are_refused(limits: list[float]) -> None:
    with pytest.raises(FormatError, match="limits"):
        Description.of(
            {
                "model": "X1",
                "rate": 100,
                "lines": {"columns": [{"name": "gz", "column": 0, "unit": "deg/s", "limits": limits}]},
            }
        )
