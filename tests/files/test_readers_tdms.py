# SPDX-License-Identifier: BSD-3-Clause
"""LabVIEW TDMS files: written by npTDMS, and byte by byte where it writes no such thing."""

from __future__ import annotations

import importlib.util
import io
import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.errors import InputError
from allanite.files.readers import read, tdms
from allanite.files.readers.tdms_starts import starts_of
from allanite.recording.records import Kind
from hostile_files import inline, mutations, outcomes, tally

nptdms = pytest.importorskip("nptdms", reason="the extra allanite[labview] is not installed")

RNG = np.random.default_rng(8)
RATES = RNG.normal(size=(3000, 2))
WAVE = {"wf_increment": 0.01, "wf_start_offset": 0.0}


@pytest.fixture(autouse=True)
def _in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """The child's function without the child: the sandbox has tests of its own, and the samples go through it."""
    monkeypatch.setattr(tdms, "run", inline)


def write(
    folder: Path, channels: list[tuple[str, str, Any, dict[str, Any]]], groups: dict[str, Any] | None = None
) -> Path:
    path = folder / "log.tdms"
    objects = [nptdms.GroupObject(name, properties=p) for name, p in (groups or {}).items()]
    objects += [nptdms.ChannelObject(g, c, samples, properties=p) for g, c, samples, p in channels]
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(objects)
    return path


@pytest.mark.parametrize(
    ("key", "value", "counts"), [("scale", 0.004, 250), ("gain", 131.0, 131), ("scale_factor", 0.5, 2)]
)
def test_a_scaling_in_other_words_leaves_counts_and_its_advice_scales_them(
    tmp_path: Path, key: str, value: float, counts: int
) -> None:
    raw = np.arange(-1500, 1500, dtype="i2")
    wave = {**WAVE, "unit_string": "deg/s", key: value}
    path = write(tmp_path, [("IMU", "gyro x", raw, wave), ("IMU", "gyro y", RATES[:, 1], wave)])
    recording = read(path)
    assert [c.unit for c in recording.channels] == ["LSB", "deg/s"]
    (said,) = recording.notes["source"]["guesses"]
    assert said.startswith(f"gyro x: {key} {value:g} not applied: read as counts")
    factor = said.partition('--scale-factor "')[2].rstrip('"')
    assert factor == f"{counts:g} LSB/(deg/s)"
    scaled = read(path, channels=["gyro_x"], scale_factor=factor)
    assert np.allclose(scaled.scaled("gyro_x"), np.radians(raw / counts))


def test_channels_of_a_group(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    start = np.datetime64("2026-03-01T12:00:00.250000")
    wave = {**WAVE, "wf_start_time": start, "wf_start_offset": 0.5}
    path = write(
        tmp_path,
        [
            ("IMU", "gyro x", RATES[:, 0], {**wave, "unit_string": "deg/s"}),
            ("IMU", "gyro y", RATES[:, 1].astype("f4"), {**wave, "unit_string": "deg/s"}),
            ("IMU", "counts", np.arange(3000, dtype="i2"), {**wave, "unit_string": "LSB"}),
            ("IMU", "note", ["a", "b"], {}),
            ("IMU", "short", np.zeros(30), wave),
            ("Weather", "pressure", np.zeros(300), {"wf_increment": 0.1}),
        ],
    )
    monkeypatch.setattr(tdms, "_PIECE", 700)
    recording = read(path)
    assert recording.names == ("gyro_x", "gyro_y", "counts")
    assert [(c.unit, c.kind) for c in recording.channels] == [
        ("deg/s", Kind.RATE), ("deg/s", Kind.RATE), ("LSB", Kind.COUNTS),
    ]  # fmt: skip
    assert (recording.rate, recording.n_samples) == (100.0, 3000)
    assert [str(c.dtype) for c in recording.columns] == ["float64", "float32", "int16"]
    assert np.array_equal(recording.values("gyro_x"), RATES[:, 0])
    assert np.array_equal(recording.values("gyro_y"), RATES[:, 1].astype("f4").astype(float))
    assert recording.start == int(start.astype("datetime64[ns]").astype(int)) + 500_000_000
    said = recording.notes["source"]["guesses"]
    assert any("short (30 samples)" in g for g in said) and any("Weather" in g for g in said)
    assert read(path, variable="Weather").rate == 10.0
    assert read(path, variable="IMU/gyro y").names == ("gyro_y",)
    assert read(path, variable="gyro y").names == ("gyro_y",)
    with pytest.raises(InputError, match=r"no group 'Sun'.*IMU \(3000 rows, 100 Hz: gyro x"):
        read(path, variable="Sun")


def test_time_channels_come_before_the_increment(tmp_path: Path) -> None:
    stamps = np.datetime64("2026-03-01T00:00:00") + (np.arange(3000) * 5000).astype("timedelta64[us]")
    path = write(tmp_path, [("g", "Time", stamps, {}), ("g", "rate (deg/h)", RATES[:, 0], {})])
    recording = read(path)
    assert (recording.rate, recording.names) == (200.0, ("rate",))
    assert recording.channels[0].unit == "deg/h"
    assert recording.start == int(stamps[0].astype("datetime64[ns]").astype(int))
    seconds = write(tmp_path, [("g", "Time (s)", np.arange(3000) * 0.02, {}), ("g", "V", RATES[:, 0], {})])
    assert read(seconds).rate == pytest.approx(50.0, rel=1e-12)


def test_without_time_the_rate_is_asked_for(tmp_path: Path) -> None:
    path = write(tmp_path, [("g", "a", RATES[:, 0], {})])
    with pytest.raises(InputError, match="--rate"):
        read(path)
    assert read(path, rate=7.0).rate == 7.0
    mixed = write(tmp_path, [("g", "a", RATES[:, 0], WAVE), ("g", "b", RATES[:, 1], {"wf_increment": 0.02})])
    with pytest.raises(InputError, match=r"different rates.*a 100 Hz, b 50 Hz"):
        read(mixed)
    assert read(mixed, variable="g/b").rate == 50.0


def test_copies_at_lower_rates_are_not_read_unasked(tmp_path: Path) -> None:
    path = write(
        tmp_path,
        [("copy", "line", np.zeros(5000), {"wf_increment": 0.001}), ("all", "line", np.ones(1000), WAVE)],
        {"copy": {"DecimationLevel": 1}, "all": {"DecimationLevel": 0}},
    )
    assert read(path).notes["source"]["group"] == "all"
    assert read(path, variable="copy").n_samples == 5000


def test_scaling_is_applied(tmp_path: Path) -> None:
    raw = np.arange(-500, 500, dtype="i2")
    scaling = {"NI_Number_Of_Scales": 1, "NI_Scale[0]_Scale_Type": "Linear", "NI_Scale[0]_Linear_Slope": 0.25}
    scaling |= {"NI_Scale[0]_Linear_Y_Intercept": 3.0, "NI_Scale[0]_Linear_Input_Source": 0xFFFFFFFF}
    path = write(
        tmp_path, [("g", "a", raw, {**WAVE, **scaling, "NI_Scaling_Status": "unscaled", "unit_string": "V"})]
    )
    assert np.array_equal(read(path).values("a"), raw * 0.25 + 3.0)


def big_endian(samples: np.ndarray, declared: int | None = None) -> bytes:
    """One segment of one float64 channel with wf_increment, most significant byte first, by hand."""

    def text(word: str) -> bytes:
        return struct.pack(">I", len(word)) + word.encode()

    n = len(samples) if declared is None else declared
    meta = struct.pack(">I", 1) + text("/'g'/'a'") + struct.pack(">IIIQ", 20, 10, 1, n)
    meta += struct.pack(">I", 1) + text("wf_increment") + struct.pack(">Id", 10, 0.5)
    raw = samples.astype(">f8").tobytes()
    contents = 2 | 4 | 8 | 64  # metadata, new list of objects, raw data, big-endian
    return (
        b"TDSm"
        + struct.pack("<I", contents)
        + struct.pack(">IQQ", 4713, len(meta) + len(raw), len(meta))
        + meta
        + raw
    )


def test_most_significant_byte_first(tmp_path: Path) -> None:
    path = tmp_path / "b.tdms"
    path.write_bytes(big_endian(RATES[:100, 0]))
    recording = read(path)
    assert recording.rate == 2.0
    assert np.array_equal(recording.values("a"), RATES[:100, 0])


def test_files_that_promise_too_much_or_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "b.tdms"
    path.write_bytes(big_endian(RATES[:100, 0], declared=10**12))
    recording = read(path)
    assert np.array_equal(recording.values("a"), RATES[:100, 0])
    assert any(
        "100 samples are there, 1000000000000 were declared" in g
        for g in recording.notes["source"]["guesses"]
    )
    sound = write(tmp_path, [("IMU", "x", RATES[:, 0], WAVE), ("IMU", "y", RATES[:, 1], WAVE)])
    path.write_bytes(sound.read_bytes()[:-8000])  # channels follow one another: the second one is short
    assert (read(path).names, read(path).n_samples) == (("x", "y"), 2000)
    with pytest.raises(InputError, match="no group of an inertial sensor"):
        read(write(tmp_path, [("g", "words", ["a", "b"], {})]))
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r'pip install "allanite\[labview\]"'):
        read(path)


def test_damaged_files_harm_nothing(tmp_path: Path) -> None:
    sound = write(
        tmp_path, [("IMU", "x", RATES[:200, 0], WAVE), ("IMU", "y", RATES[:200, 1].astype("f4"), WAVE)]
    )
    contents = [*mutations(sound.read_bytes(), 45), *mutations(big_endian(RATES[:50, 0]), 15)]
    files = []
    for i, mutant in enumerate(contents):
        files.append(tmp_path / f"{i}.tdms")
        files[-1].write_bytes(mutant)
    found = tally(outcomes(sound, files))
    assert set(found) <= {"read", "refused", "signal 24"}, found
    assert found["refused"] > 5 and found["read"] > 5


# -- real files --------------------------------------------------------------------------------------------


def test_real_files(real_data: Callable[[str], Path]) -> None:
    folder = real_data("formats_misc")
    raw = read(folder / "raw1.tdms")
    assert (len(raw.names), raw.n_samples, raw.channels[0].unit) == (7, 2000, "Volts")
    assert raw.values(raw.names[0])[0] == pytest.approx(-0.18402661, abs=5e-9)
    assert raw.rate == 50_000.0
    big = read(folder / "big_endian.tdms")
    assert (big.rate, big.n_samples, big.start, len(big.names)) == (1000.0, 3500, None, 2)
    assert np.ptp(big.values("Phase_sweep")) > 0.5
    line = read(folder / "Digital_Input.tdms")
    assert (line.rate, line.n_samples) == (2000.0, 20_000)
    assert set(np.unique(line.values(line.names[0]))) == {0.0, 1.0}
    assert str(line.columns[0].dtype) == "uint8"
    assert sum("Decimated" in c for c in line.notes["source"]["contents"]) == 2


# -- several acquisitions in one file ----------------------------------------------------------------------

T0 = np.datetime64("2026-03-01T12:00:00.250000")


def acquisitions(path: Path, lengths: list[int], starts: list[float | None], step: float, kind: str) -> Any:
    """A segment for each length, two channels and a text; the start is set where it is given [s after T0]."""
    samples = RNG.normal(size=(sum(lengths), 2)).astype(kind)
    with nptdms.TdmsWriter(path) as writer:
        at = 0
        for length, start in zip(lengths, starts, strict=True):
            wave: dict[str, Any] = {"wf_increment": step, "unit_string": "deg/s"}
            if start is not None:
                wave["wf_start_time"] = T0 + np.timedelta64(round(start * 1e6), "us")
            block = samples[at : at + length]
            writer.write_segment(
                [
                    nptdms.ChannelObject("IMU", name, np.ascontiguousarray(block[:, k]), properties=wave)
                    for k, name in enumerate(("gyro x", "gyro y"))
                ]
                + [nptdms.ChannelObject("IMU", "note", ["é" * at, "b"], properties={"by": "me", "on": True})]
            )
            at += length
    return samples


@pytest.mark.parametrize("kind", ["f8", "f4", "i2"])
@pytest.mark.parametrize(
    ("lengths", "pauses"),
    [([300, 200, 100], [20.0, 0.5]), ([50, 400], [3600.0]), ([40, 1, 70, 90], [0.0, 2.0, 0.0])],
)
def test_a_pause_between_acquisitions_is_a_gap(
    tmp_path: Path, lengths: list[int], pauses: list[float], kind: str
) -> None:
    step = 0.01
    begins = np.concatenate(([0.0], np.cumsum(np.array(lengths[:-1]) * step + pauses)))
    samples = acquisitions(tmp_path / "log.tdms", lengths, [float(b) for b in begins], step, kind)
    recording = read(tmp_path / "log.tdms")
    assert recording.start == pytest.approx(int(T0.astype("datetime64[ns]").astype(np.int64)), abs=1000)
    expected = np.full(recording.n_samples, np.nan)
    for begin, length, end in zip(begins, lengths, np.cumsum(lengths), strict=True):
        place = round(begin / step)
        expected[place : place + length] = samples[end - length : end, 1]
    assert np.array_equal(recording.values("gyro_y"), expected, equal_nan=True)
    assert "acquisitions" in recording.notes["source"]["guesses"][-1]


@pytest.mark.parametrize(
    "starts",
    [
        [0.0, 2.0, 5.0],  # each block from the end of the one before
        [0.0, 2.003, 4.996],  # stamped by the clock of the computer
        [0.0, 0.0, 0.0],  # the start written again
        [0.0, None, None],
    ],
)
def test_blocks_of_one_acquisition_are_not_torn_apart(tmp_path: Path, starts: list[float | None]) -> None:
    samples = acquisitions(tmp_path / "log.tdms", [200, 300, 100], starts, 0.01, "f8")
    recording = read(tmp_path / "log.tdms")
    assert recording.rate == 100.0
    assert recording.start == int(T0.astype("datetime64[ns]").astype(np.int64))
    assert np.array_equal(recording.values("gyro_x"), samples[:, 0])


def daqmx_segment(order: str, moment: float, rows: int, chunks: int) -> bytes:
    """Two channels of 16 bits in one buffer, with the start time that an acquisition logs."""

    def text(words: str) -> bytes:
        return struct.pack(order + "I", len(words)) + words.encode()

    whole = int(moment)
    stamp = (int((moment - whole) * 2**64), whole + 2_082_844_800)
    objects = b""
    for k in range(2):
        objects += text(f"/'g'/'c{k}'") + struct.pack(order + "IIIQ", 0x1269, 0xFFFFFFFF, 1, rows)
        objects += struct.pack(order + "IIIIII", 1, 3, 0, 2 * k, 0, 0) + struct.pack(order + "II", 1, 4)
        objects += (
            struct.pack(order + "I", 3) + text("unit_string") + struct.pack(order + "I", 0x20) + text("deg/s")
        )
        objects += text("wf_increment") + struct.pack(order + "Id", 10, 0.01)
        objects += text("wf_start_time") + struct.pack(order + "I", 0x44)
        objects += struct.pack("<Qq", *stamp) if order == "<" else struct.pack(">qQ", *stamp[::-1])
    objects = struct.pack(order + "I", 2) + objects
    toc = 0b1000_1110 | (0b100_0000 if order == ">" else 0)
    raw = bytes(4 * rows * chunks)
    lead = (
        b"TDSm"
        + struct.pack("<I", toc)
        + struct.pack(order + "IQQ", 4713, len(objects) + len(raw), len(objects))
    )
    return lead + objects + raw


@pytest.mark.parametrize("order", ["<", ">"])
def test_the_starts_of_acquisitions_by_daqmx(order: str) -> None:
    moments = (1_772_366_400.25, 1_772_366_500.75)
    content = daqmx_segment(order, moments[0], 30, 3) + daqmx_segment(order, moments[1], 50, 1)
    for channel in ("/'g'/'c0'", "/'g'/'c1'"):
        starts = starts_of(io.BytesIO(content), len(content), channel)
        assert [sample for _, sample in starts] == [0, 90]
        assert [moment for moment, _ in starts] == [round(moment * 1e6) * 1000 for moment in moments]
    assert starts_of(io.BytesIO(content[:100]), 100, channel) == []


@pytest.mark.parametrize("where", ["channel", "group", "file"])
@pytest.mark.parametrize("stated", [{"SampleRate": 50.0}, {"fs_Hz": 50}, {"dt": 0.02}])
def test_a_rate_of_other_properties_counts_without_an_increment(
    tmp_path: Path, where: str, stated: dict[str, Any]
) -> None:
    levels = {"file": {}, "group": {}, "channel": {"unit_string": "deg/s"}}
    levels[where] |= stated
    with nptdms.TdmsWriter(tmp_path / "log.tdms") as writer:
        writer.write_segment(
            [
                nptdms.RootObject(levels["file"]),
                nptdms.GroupObject("g", levels["group"]),
                nptdms.ChannelObject("g", "gyro", RATES[:, 0], properties=levels["channel"]),
            ]
        )
    recording = read(tmp_path / "log.tdms")
    assert recording.rate == 50.0 and next(iter(stated)) in recording.notes["timebase"]["source"]
