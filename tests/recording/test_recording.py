# SPDX-License-Identifier: BSD-3-Clause
"""Recordings: samples stay as written, units scale results, gaps keep their place."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError
from allanite.fitting.selection import select
from allanite.recording.records import ArrayColumn, Channel, Kind, Recording, Spliced, merge_spans


def test_rate_span_and_length_cannot_disagree() -> None:
    rec = Recording.from_rate(np.zeros(320), rate=32.0, unit="deg/s")
    assert (rec.duration, rec.dt, rec.n_samples) == (10.0, 1 / 32, 320)
    assert "320 samples at 32 Hz" in repr(rec)


@pytest.mark.parametrize("rate", [1e300, 1e-300, 1e100, 1e-30, 1.1e12, 9e-10])
def test_a_rate_of_no_sensor_is_refused(rate: float) -> None:
    with pytest.raises(InputError, match=r"between 1e-09 and 1e\+12 Hz"):
        Recording.from_rate(np.zeros(100), rate=rate, unit="deg/s")


@pytest.mark.parametrize("rate", [1e-9, 1e12])
def test_the_outermost_rates_go_all_the_way(rng: np.random.Generator, rate: float) -> None:
    rec = Recording.from_rate(1e-3 * rng.standard_normal(2000) + 0.1, rate=rate, unit="deg/s")
    n = next(e for e in al.fit(al.allan_curve(rec)).estimates if e.symbol == "N")
    assert n.value == pytest.approx(np.radians(1e-3) / np.sqrt(rate), rel=0.1)


@pytest.mark.parametrize("given", [np.zeros(1000), "x", 3, None, [1.0, 2.0]])
def test_what_is_no_recording_is_refused_with_the_way_to_make_one(given: object) -> None:
    for refuse in (al.fit, al.characterize, al.allan_curve, al.check, select):
        with pytest.raises(
            InputError, match=r"Recording, not .*al\.Recording\.from_rate\(y, rate=.*al\.read"
        ):
            refuse(given)


@pytest.mark.parametrize("given", [123, None, b"gyro.csv", [1.0, 2.0], np.zeros(3), [b"x"]])
def test_what_is_no_path_is_refused(given: object) -> None:
    with pytest.raises(InputError, match="read needs"):
        al.read(given)


@pytest.mark.parametrize(
    ("unit", "kind", "scale"),
    [
        ("deg/s", Kind.RATE, np.pi / 180),
        ("g", Kind.ACCELERATION, 9.80665),
        ("mV", Kind.VOLTAGE, 1e-3),
        ("LSB", Kind.COUNTS, 1.0),
        ("unknown", Kind.UNKNOWN, 1.0),
        ("", Kind.UNKNOWN, 1.0),
    ],
)
def test_kind_and_scale_follow_from_the_unit(unit: str, kind: Kind, scale: float) -> None:
    channel = Channel.of("x", unit)
    assert channel.kind is kind and channel.scale == pytest.approx(scale, rel=1e-12)
    assert Channel.from_json(channel.to_json()) == channel


def test_scale_factor_turns_volts_into_a_rate() -> None:
    channel = Channel.of("x", "V", scale_factor="24.0 mV/(deg/s)")
    assert channel.kind is Kind.RATE and channel.scale == pytest.approx(np.deg2rad(1 / 0.024), rel=1e-12)
    with pytest.raises(InputError, match="takes voltage"):
        Channel.of("x", "LSB", scale_factor="24.0 mV/(deg/s)")


def test_angles_are_not_rates() -> None:
    with pytest.raises(InputError, match="from_angle"):
        Recording.from_rate([0.0, 1.0, 2.0], rate=1.0, unit="deg")
    with pytest.raises(InputError, match="from_rate"):
        Recording.from_angle([0.0, 1.0, 2.0], rate=1.0, unit="deg/s")


def test_integers_and_maps_are_not_copied(tmp_path: Path) -> None:
    np.save(tmp_path / "x.npy", np.arange(1000, dtype=np.int16))
    mapped = np.load(tmp_path / "x.npy", mmap_mode="r")
    rec = Recording.from_rate(mapped, rate=1.0, unit="LSB")
    assert rec.columns[0].dtype == np.int16
    np.testing.assert_array_equal(rec.raw("signal", 10, 13), [10.0, 11.0, 12.0])


def test_large_integers_keep_their_last_digit() -> None:
    base = (1 << 62) + 12345
    rec = Recording.from_rate(np.array([base, base + 1, base + 5]), rate=1.0, unit="LSB")
    np.testing.assert_array_equal(rec.values("signal") - rec.values("signal")[0], [0.0, 1.0, 5.0])
    assert rec.origin("signal") == float(base)
    with pytest.raises(InputError, match="2\\*\\*53"):
        ArrayColumn(np.arange(-8, 9) * (1 << 58))


def test_overload_words_and_exclusions_read_as_missing() -> None:
    rec = Recording.from_rate([1.0, 9.91e37, np.inf, 4.0, 5.0, 6.0], rate=1.0, unit="V")
    np.testing.assert_array_equal(np.isnan(rec.values("signal")), [False, True, True, False, False, False])
    assert rec.raw("signal")[1] == 9.91e37
    out = rec.excluding({"signal": [[3, 4], [3, 5]]}, "stuck")
    np.testing.assert_array_equal(np.isnan(out.values("signal")), [False, True, True, True, True, False])
    assert out.history[-1] == {"step": "exclude", "reason": "stuck", "samples": {"signal": 2}}
    assert not np.isnan(rec.values("signal")[3])


def test_blocks_are_the_values_for_any_size() -> None:
    y = np.random.default_rng(0).standard_normal(1000)
    rec = Recording.from_rate(y, rate=1.0, unit="V").excluding({"signal": [[5, 300], [998, 1000]]}, "test")
    whole = rec.values("signal")
    for size in (1, 7, 256, 1000, 4096):
        joined = np.concatenate([block for _, block in rec.blocks("signal", size)])
        np.testing.assert_array_equal(joined, whole)


def test_a_window_moves_the_start() -> None:
    rec = Recording.from_rate(np.arange(100.0), rate=10.0, unit="V", start=1_000_000_000)
    part = rec.window(2.0, 5.0)
    np.testing.assert_array_equal(part.values("signal"), np.arange(20.0, 50.0))
    assert part.start == 3_000_000_000 and part.duration == 3.0
    for bad in ((5.0, 2.0), (0.0, 11.0), (-1.0, 5.0)):
        with pytest.raises(InputError, match="window"):
            rec.window(*bad)
    with pytest.raises(InputError, match=r"window from the start to 99\.0 s does not"):
        rec.window(None, 99.0)
    with pytest.raises(InputError, match=r"window from 99\.0 s to the end does not"):
        rec.window(99.0)


def test_spliced_samples_keep_their_place() -> None:
    column = Spliced(
        of=ArrayColumn(np.arange(6.0)), source=np.array([0, 2, 6]), grid=np.array([1, 10]), length=16
    )
    whole = column.read(0, 16)
    np.testing.assert_array_equal(np.flatnonzero(~np.isnan(whole)), [1, 2, 10, 11, 12, 13])
    np.testing.assert_array_equal(whole[[1, 2, 10, 13]], [0.0, 1.0, 2.0, 5.0])
    np.testing.assert_array_equal(column.read(11, 14), [3.0, 4.0, 5.0])


def test_select_and_unknown_names() -> None:
    rec = Recording.from_rate(np.zeros((50, 3)), rate=1.0, unit="g")
    assert rec.select("z", "x").names == ("z", "x")
    with pytest.raises(InputError, match="x, y, z"):
        rec["gyro"]
    with pytest.raises(InputError, match="2 names for 3 channels"):
        Recording.from_rate(np.zeros((50, 3)), rate=1.0, unit="g", names=["a", "b"])
    with pytest.raises(InputError, match="must differ"):
        Recording.from_rate(np.zeros((50, 2)), rate=1.0, unit="g", names=["a", "a"])


def test_sampling_is_checked() -> None:
    with pytest.raises(InputError, match="sampling must be"):
        Recording.from_rate([1.0, 2.0], rate=1.0, unit="V", sampling="both")  # type: ignore[arg-type]
    with pytest.raises(InputError, match="aperture"):
        Channel.of("x", "V", aperture=-1.0)


def test_merge_spans() -> None:
    got = merge_spans(np.array([[5, 9], [0, 3], [2, 4], [9, 10], [20, 20]]))
    assert got.tolist() == [[0, 4], [5, 9], [9, 10]] or got.tolist() == [[0, 4], [5, 10]]


def test_required_arguments_alone_are_enough() -> None:
    rec = al.Recording.from_rate([1.0, 2.0, 4.0], rate=1.0, unit="V")
    assert rec.channels[0].sampling == "mean" and rec.names == ("signal",)


@pytest.mark.skipif(not Path("/proc/self/status").exists(), reason="needs Linux's account of mapped pages")
def test_a_mapped_log_is_let_go_while_it_is_read(tmp_path: Path) -> None:
    """64 MB streamed from a file: the pages behind the reader do not stay in the process."""
    np.save(tmp_path / "x.npy", np.zeros(16_000_000, dtype=np.float32))
    rec = Recording.from_rate(np.load(tmp_path / "x.npy", mmap_mode="r"), rate=1.0, unit="V")

    def mapped_kb() -> int:
        status = Path("/proc/self/status").read_text()
        return int(status.split("RssFile:")[1].split()[0])

    before = mapped_kb()
    total = sum(len(block) for _, block in rec.blocks("signal"))
    assert total == 16_000_000
    assert mapped_kb() - before < 16_000
