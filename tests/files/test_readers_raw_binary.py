# SPDX-License-Identifier: BSD-3-Clause
"""Raw binary files that a layout describes: types and byte orders, counters, clocks, garbage, faults of the layout."""

from __future__ import annotations

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.errors import AllaniteError, DataQualityError, FormatError, InputError
from allanite.files.readers import raw_records, read
from allanite.recording.records import Kind, Recording
from hostile_files import mutations
from shell import Run

RNG = np.random.default_rng(10)
COUNTS = RNG.integers(-(2**23), 2**23, size=(500, 3))


def layout(**frame: Any) -> dict[str, Any]:
    fields = [{"name": f"gyro_{a}", "type": "i24", "unit": "deg/s", "scale": 1.25e-4} for a in "xyz"]
    return {"rate": 200, "frame": {"fields": fields, **frame}}


def i24(value: int) -> bytes:
    return struct.pack("<i", value)[:3]


def rows(counts: Any = COUNTS, header: bytes = b"\xa5\x5a", first: int = 65_400) -> list[bytes]:
    """Header, counter, three numbers of 24 bits."""
    return [
        header + struct.pack("<H", (first + k) % 65_536) + b"".join(i24(int(v)) for v in row)
        for k, row in enumerate(counts)
    ]


def write(folder: Path, *pieces: bytes) -> Path:
    path = folder / "log.bin"
    path.write_bytes(b"".join(pieces))
    return path


HEADED = layout(header="A5 5A", counter={"at": 2, "type": "u16"})
HEADED["frame"]["fields"][0]["at"] = 4


@pytest.mark.parametrize("endian", ["little", "big"])
def test_every_type(tmp_path: Path, endian: str) -> None:
    codes = {"u8": "B", "i8": "b", "u16": "H", "i16": "h", "u32": "I", "i32": "i", "u64": "Q", "i64": "q"}
    codes |= {"f32": "f", "f64": "d"}
    order = "<" if endian == "little" else ">"
    values: dict[str, list[float]] = {}
    for kind in (k for k in codes if k[0] != "f"):
        half = 2 ** (int(kind[1:]) - 2)
        values[kind] = [(half if kind[0] == "u" else -half) + j for j in range(6)]
    values |= {"f32": [0.1 * j for j in range(6)], "f64": [0.1 * j for j in range(6)]}
    values["i24"] = [-5, 8_388_607, -8_388_608, 0, 1, 2]
    values["u24"] = [0, 1, 2**24 - 1, 70_000, 5, 6]
    content = b""
    for j in range(6):
        for kind, given in values.items():
            if kind in codes:
                content += struct.pack(order + codes[kind], given[j])
            else:
                content += int(given[j]).to_bytes(3, endian, signed=kind[0] == "i")  # type: ignore[arg-type]
    fields = [{"name": f"v_{k}", "type": k, "unit": "LSB"} for k in values]
    path = write(tmp_path, content)
    recording = read(path, layout={"rate": 10, "frame": {"endian": endian, "fields": fields}})
    for name, given in zip(recording.names, values.values(), strict=True):
        found = [int(v) + int(recording.origin(name)) if "f" not in name else v for v in recording.raw(name)]
        wanted = [float(np.float32(v)) for v in given] if name == "v_f32" else list(given)
        assert found == wanted, name


def test_records_behind_a_header_of_the_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path, b"x" * 77, *rows())
    for block in (64, 1 << 18):
        monkeypatch.setattr(raw_records, "_BLOCK", block)
        recording = read(path, layout={"skip": 77, **HEADED})
        assert (recording.rate, recording.n_samples) == (200.0, 500)
        assert [c.kind for c in recording.channels] == [Kind.RATE] * 3
        for i, axis in enumerate("xyz"):
            assert np.array_equal(recording.values(f"gyro_{axis}"), COUNTS[:, i] * 1.25e-4)
    assert recording.notes["source"]["guesses"] == []
    assert recording.notes["source"]["layout"]["frame"]["header"] == "A5 5A"


def test_the_counter_tells_what_is_missing_and_turns(tmp_path: Path) -> None:
    kept = [r for k, r in enumerate(rows()) if not 100 <= k < 117]
    recording = read(write(tmp_path, *kept), layout=HEADED)
    assert recording.n_samples == 500
    assert np.flatnonzero(np.isnan(recording.values("gyro_x"))).tolist() == list(range(100, 117))
    assert np.array_equal(recording.values("gyro_z")[117:], COUNTS[117:, 2] * 1.25e-4)


def test_a_clock_gives_the_rate_and_goes_on_when_it_turns(tmp_path: Path) -> None:
    stamps = (2**32 - 40_000 + 5000 * np.arange(100)) % 2**32
    table = np.zeros(100, dtype=[("t", ">u4"), ("x", "<f8")])
    table["t"], table["x"] = stamps, RNG.normal(size=100)
    described = {
        "frame": {
            "time": {"at": 0, "type": "u32", "endian": "big", "unit": "us"},
            "fields": [{"name": "acc_x", "at": 4, "type": "f64", "unit": "g", "offset": 0.5}],
        }
    }
    recording = read(write(tmp_path, table.tobytes()), layout=described)
    assert recording.rate == 200.0
    assert np.array_equal(recording.values("acc_x"), table["x"] + 0.5)
    assert any("restarted 1 time" in g for g in recording.notes["source"]["guesses"])
    assert recording.notes["timebase"]["backward"] == 0


def test_garbage_between_records_is_passed_over(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    good = rows()
    torn = good[200][:9]
    pieces = [b"boot\xa5", *good[:100], b"noise \xa5\x5a", *good[100:200], torn, *good[201:], good[0][:5]]
    path = write(tmp_path, *pieces)
    for window in (100, 1 << 24):
        monkeypatch.setattr(raw_records, "_WINDOW", window)
        recording = read(path, layout=HEADED)
        missing = np.flatnonzero(np.isnan(recording.values("gyro_x")))
        assert missing.tolist() == [99, 200]  # behind record 99 comes none: it could be torn itself
        whole = np.delete(np.arange(500), missing)
        assert np.array_equal(recording.values("gyro_y")[whole], COUNTS[whole, 1] * 1.25e-4)
        assert recording.notes["source"]["records"] == 498
    lost = 5 + 8 + len(good[0]) + len(torn) + 5
    assert any(f"{lost} bytes in 4 place" in g for g in recording.notes["source"]["guesses"])


def test_f7_bytes_that_are_left_over_are_told(tmp_path: Path) -> None:
    table = np.arange(10.0)
    described = {"rate": 1, "frame": {"fields": [{"name": "x", "type": "f64"}]}}
    path = write(tmp_path, table.tobytes()[:77])
    recording = read(path, layout=described)
    assert np.array_equal(recording.values("x"), table[:9])
    assert recording.notes["source"]["guesses"] == [
        "the last 5 bytes are not a complete record of 8: left out"
    ]
    with pytest.raises(DataQualityError, match="no complete record of 8"):
        read(write(tmp_path, b"1234567"), layout=described)
    with pytest.raises(DataQualityError, match="A5 5A"):
        read(write(tmp_path, bytes(500)), layout=HEADED)
    with pytest.raises(InputError, match="--rate"):
        read(write(tmp_path, table.tobytes()), layout={"frame": described["frame"]})


def test_words_that_mean_missing_and_overload_and_scale_factors(tmp_path: Path) -> None:
    raw = np.array([0, 131, -32768, 262, 32767, 131], dtype="<i2")
    field = {"name": "gyro_x", "type": "i16", "unit": "LSB", "scale_factor": "131 LSB/(deg/s)"}
    described = {"rate": 1, "frame": {"fields": [{**field, "missing": [-32768], "overload": [32767]}]}}
    recording = read(write(tmp_path, raw.tobytes()), layout=described)
    assert np.isnan(recording.values("gyro_x")).tolist() == [False, False, True, False, True, False]
    assert recording.channels[0].kind is Kind.RATE
    assert recording.channels[0].scale == pytest.approx(np.radians(1 / 131), rel=1e-12)
    plain = {"rate": 1, "frame": {"fields": [{"name": "a", "type": "i16"}]}}
    assert str(read(tmp_path / "log.bin", layout=plain, unit="V").columns[0].dtype) == "int16"


def test_every_fault_of_a_layout_is_told_at_once(tmp_path: Path) -> None:
    path = write(tmp_path, bytes(100))
    (tmp_path / "a.yaml").write_text(
        'rate: 0\nframe:\n  header: "A5 5"\n  lenght: 7\n'
        "  fields:\n    - {name: x, type: i7}\n    - {type: u8, scale: 0}\n"
    )
    with pytest.raises(FormatError) as error:
        read(path, layout=tmp_path / "a.yaml")
    said = str(error.value)
    assert "a.yaml has 5 faults" in said
    for part in (
        "line 1, rate:",
        "line 3, frame.header: bytes in hexadecimal",
        "line 4, frame.lenght: is not a known entry",
        "line 6, frame.fields[0].type",
        "line 7, frame.fields[1].name: is missing",
    ):
        assert part in said, said
    with pytest.raises(FormatError) as error:
        read(
            path,
            layout={
                "rate": 5,
                "frame": {
                    "header": "A5",
                    "length": 9,
                    "time": {"at": 0, "type": "u16", "unit": "furlong"},
                    "counter": {"at": 3, "type": "u8", "modulus": 300, "step": 90},
                    "fields": [
                        {"name": "x", "at": 2, "type": "i16", "unit": "deg/furlong"},
                        {"name": "x", "at": 7, "type": "f32", "missing": [1], "scale": 0.0},
                    ],
                },
            },
        )
    said = str(error.value)
    for part in (
        "frame.time: bytes 0 to 1 lie in the header", "ends at byte 11, but the record has 9", "belongs already to",
        "rate: the records have a time", "'x' is there twice", "scale of 0", "only for integers", "deg/furlong",
        "300 does not fit", "more than a quarter", "furlong",
    ):  # fmt: skip
        assert part in said, f"{part}: {said}"
    with pytest.raises(InputError, match="no such file"):
        read(path, layout=tmp_path / "none.yaml")
    (tmp_path / "b.yaml").write_text("frame: [")
    with pytest.raises(FormatError, match="not YAML"):
        read(path, layout=tmp_path / "b.yaml")
    (tmp_path / "c.yaml").write_text("just words")
    with pytest.raises(FormatError, match="not a layout of records"):
        read(path, layout=tmp_path / "c.yaml")
    (tmp_path / "d.yaml").write_text("frame: !!python/object/apply:os.system ['true']")
    with pytest.raises(FormatError):
        read(path, layout=tmp_path / "d.yaml")
    with pytest.raises(FormatError, match=r"layout= \(--layout\)"):
        read(write(tmp_path, RNG.bytes(5000)))


def test_from_the_command_line(tmp_path: Path, run: Run) -> None:
    write(tmp_path, *rows())
    (tmp_path / "a.yaml").write_text(
        'rate: 200\nframe:\n  header: "A5 5A"\n  counter: {at: 2, type: u16}\n  fields:\n'
        "    - {name: gyro_x, at: 4, type: i24, unit: deg/s, scale: 1.25e-4}\n"
        "    - {name: gyro_y, type: i24, unit: deg/s, scale: 1.25e-4}\n    - {name: gyro_z, type: i24, unit: deg/s}\n"
    )
    done = run("info", tmp_path / "log.bin", "--layout", tmp_path / "a.yaml")
    assert done.code == 0, done.err
    assert "500 samples" in done.out and "gyro_y" in done.out


def test_damaged_files_harm_nothing(tmp_path: Path) -> None:
    for mutant in mutations(b"".join(rows(COUNTS[:60])), 60):
        path = write(tmp_path, mutant)
        try:
            recording = read(path, layout=HEADED)
        except AllaniteError:
            continue
        assert isinstance(recording, Recording)
        assert all(len(recording.values(n)) == recording.n_samples for n in recording.names)


def test_real_headerless_floats(real_data: Callable[[str], Path]) -> None:
    path = real_data("psins_sysclbt_simulated/imusysclbt.bin")
    names = [*(f"angle_{a}" for a in "xyz"), *(f"velocity_{a}" for a in "xyz"), "t"]
    described = {"frame": {"fields": [{"name": n, "type": "f32"} for n in names]}}
    recording = read(path, layout=described)
    assert recording.n_samples == path.stat().st_size // 28
    wanted = np.fromfile(path, "<f4").reshape(-1, 7)
    assert np.array_equal(recording.values("velocity_z"), wanted[:, 5].astype(float))
    assert recording.rate == pytest.approx(100.0, rel=1e-3)
