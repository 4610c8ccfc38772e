# SPDX-License-Identifier: BSD-3-Clause
"""Recordings into files and back, and files that are whole or absent."""

from __future__ import annotations

import csv
import os
import re
import stat
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.errors import InputError, StorageError
from allanite.files.recording_file import FORMATS, summary, write_recording
from allanite.plain_files.atomic_file import fresh, make_folder, refuse_existing


@pytest.fixture
def recording(rng: np.random.Generator) -> al.Recording:
    samples = rng.normal(0, 0.01, (3000, 2))
    samples[1000:1200, 1] = np.nan
    return al.Recording.from_rate(
        samples,
        rate=32.0,
        unit="deg/s",
        names=["gyro_x", "gyro_y"],
        sampling="point",
        start=1_700_000_000_000_000_000,
    )


def test_parquet_keeps_everything(recording: al.Recording, tmp_path: Path) -> None:
    path = write_recording(recording, tmp_path / "r.parquet")
    back = al.read(path)
    assert (back.rate, back.start, back.channels) == (recording.rate, recording.start, recording.channels)
    for name in recording.names:
        np.testing.assert_array_equal(back.values(name), recording.values(name))


def test_csv_keeps_samples_units_and_rate(recording: al.Recording, tmp_path: Path) -> None:
    path = write_recording(recording, tmp_path / "r.csv")
    back = al.read(path, sampling="point")
    assert back.rate == pytest.approx(32.0, rel=1e-8)
    assert [c.unit for c in back.channels] == ["deg/s", "deg/s"]
    for name in recording.names:
        np.testing.assert_array_equal(back.values(name), recording.values(name))


def test_npy_keeps_samples_and_the_summary_says_what_it_does_not(
    recording: al.Recording, tmp_path: Path
) -> None:
    path = write_recording(recording, tmp_path / "r.npy")
    np.testing.assert_array_equal(np.load(path)[:, 1], recording.values("gyro_y"))
    assert summary(recording, path).endswith("(read it with --rate 32 --unit deg/s --sampling point)")
    alone = recording.select("gyro_x")
    assert np.load(write_recording(alone, tmp_path / "one.npy")).shape == (3000,)


@pytest.mark.parametrize("suffix", FORMATS)
def test_samples_through_a_scale_factor_keep_their_meaning(
    suffix: str, rng: np.random.Generator, tmp_path: Path
) -> None:
    volts = 2.5 + rng.normal(0, 1e-3, (500, 1))
    volts[7], volts[8] = np.nan, 9.9e37
    recording = al.Recording.from_rate(
        volts, rate=32.0, unit="V", names="gyro_z", scale_factor="24.0 mV/(deg/s)"
    )
    path = write_recording(recording, tmp_path / f"r{suffix}")
    options = {} if suffix != ".npy" else {"rate": 32.0, "unit": "rad/s"}
    back = al.read(path, **options)
    channel = back.channels[0]
    assert channel.kind == "rate"
    assert channel.unit == ("V" if suffix == ".parquet" else "rad/s")
    np.testing.assert_allclose(
        back.values(back.names[0]) * channel.scale,
        recording.values("gyro_z") * recording["gyro_z"].scale,
        rtol=1e-15,
    )
    said = summary(recording, path)
    assert ("gyro_z through its scale factor in rad/s" in said) is (suffix != ".parquet")
    assert ("--unit rad/s" in said) is (suffix == ".npy")


@pytest.mark.parametrize(("suffix", "digits"), [(".parquet", 0), (".npz", 0), (".mat", 0), (".csv", 9)])
def test_samples_come_back_to_the_last_digit(
    suffix: str, digits: int, rng: np.random.Generator, tmp_path: Path
) -> None:
    """Every float64 there is, from the smallest to the largest, missing ones, and rates that are no round number."""
    samples = rng.integers(0, 2**64, size=(2000, 3), dtype=np.uint64).view(np.float64)
    samples[~np.isfinite(samples) | (np.abs(samples) > 9e37)] = np.nan
    samples[0] = [5e-324, -0.0, 0.1]
    names = ["gyro_x", "gyro_y", "acc_z"]
    for rate in (1000.0, 100.06023414, 1 / 3):
        recording = al.Recording.from_rate(samples, rate=rate, unit="deg/s", names=names)
        back = al.read(write_recording(recording, tmp_path / f"r{suffix}", force=True))
        assert (
            back.rate == rate
            if digits == 0
            else back.rate == pytest.approx(rate, abs=rate**2 * 10.0**-digits)
        )
        assert back.names == recording.names
        assert [c.unit for c in back.channels] == ["deg/s"] * 3
        for name in names:
            assert np.array_equal(
                back.values(name).view(np.uint64)[~np.isnan(back.values(name))],
                recording.values(name).view(np.uint64)[~np.isnan(recording.values(name))],
            )
            assert np.array_equal(np.isnan(back.values(name)), np.isnan(recording.values(name)))


@pytest.mark.parametrize("suffix", [".parquet", ".npz"])
@pytest.mark.parametrize("dtype", ["int16", "uint32", "int64", "uint64"])
def test_whole_numbers_keep_type_and_value(suffix: str, dtype: str, tmp_path: Path) -> None:
    top = int(np.iinfo(dtype).max) - 1003
    whole = np.array([top + k for k in range(1000)], dtype=dtype)
    recording = al.Recording.from_rate(whole, rate=10.0, unit="LSB", names="raw")
    back = al.read(write_recording(recording, tmp_path / f"r{suffix}"))
    assert back.columns[0].dtype == np.dtype(dtype)
    origin = int(back.origin("raw"))
    assert [int(v) + origin for v in back.values("raw")] == [int(v) for v in whole]


@pytest.mark.parametrize("suffix", FORMATS)
def test_integers_far_from_zero_survive(suffix: str, tmp_path: Path) -> None:
    base = 1 << 60
    whole = np.arange(base, base + 400, dtype=np.int64)
    recording = al.Recording.from_rate(whole, rate=10.0, unit="LSB")
    path = write_recording(recording, tmp_path / f"r{suffix}")
    back = al.read(path, rate=None if suffix != ".npy" else 10.0, unit="LSB")
    steps = np.diff(back.values(back.names[0]))
    assert np.all(steps == 1) if suffix == ".parquet" else np.all(np.abs(steps) <= 256)


def named(*names: str) -> al.Recording:
    samples = np.random.default_rng(3).normal(0, 0.01, (300, len(names)))
    return al.Recording.from_rate(samples, rate=32.0, unit="rad/s", names=names)


@pytest.mark.parametrize("suffix", [s for s in FORMATS if s != ".npy"])
def test_names_that_begin_like_a_formula_are_text_and_come_back(suffix: str, tmp_path: Path) -> None:
    recording = named("=1+1", "+gyro", "-gyro", "@sum", "a,b", 'c"d')
    back = al.read(write_recording(recording, tmp_path / f"r{suffix}"))
    assert (back.names, back.rate) == (recording.names, pytest.approx(32.0, rel=1e-8))
    np.testing.assert_array_equal(back.values("@sum"), recording.values("@sum"))
    if suffix == ".csv":
        with (tmp_path / "r.csv").open(newline="") as file:
            heads, first = next(rows := csv.reader(file)), next(rows)
        assert heads[1:5] == [f"'{name} [rad/s]" for name in recording.names[:4]]
        assert [float(cell) for cell in first[1:]] == [recording.values(n)[0] for n in recording.names]


@pytest.mark.parametrize("suffix", FORMATS)
@pytest.mark.parametrize("name", ["a\nb", "a\0b", "\tx", "a\u2028b"])
def test_a_name_that_no_file_gives_back_is_refused(name: str, suffix: str, tmp_path: Path) -> None:
    recording, path = named(name, "gyro_y"), tmp_path / f"r{suffix}"
    if suffix == ".npy":  # holds no names
        assert np.load(write_recording(recording, path)).shape == (300, 2)
        return
    with pytest.raises(InputError, match=f"the name of channel {re.escape(repr(name))} .*another name"):
        write_recording(recording, path)
    assert list(tmp_path.iterdir()) == []


def test_a_channel_does_not_hide_the_rate_of_an_archive(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="channel 'fs'"):
        write_recording(named("fs"), tmp_path / "r.npz")


@pytest.mark.long
def test_blocks_are_written_in_their_order(tmp_path: Path) -> None:
    recording = al.Recording.from_rate(
        np.arange(100_000.0), rate=1.0, unit="V"
    )  # more than a block of the CSV writer
    for suffix in FORMATS:
        back = al.read(write_recording(recording, tmp_path / f"r{suffix}"), rate=1.0, unit="V")
        np.testing.assert_array_equal(back.values(back.names[0]), np.arange(100_000.0))


def test_progress_ends_at_one(recording: al.Recording, tmp_path: Path) -> None:
    for suffix in FORMATS:
        seen: list[float] = []
        write_recording(recording, tmp_path / f"p{suffix}", progress=seen.append)
        assert seen[-1] == pytest.approx(1.0)
        assert seen == sorted(seen)


def test_other_suffixes_and_existing_files_are_refused(recording: al.Recording, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"\.parquet, \.npy, \.csv"):
        write_recording(recording, tmp_path / "r.xlsx")
    path = write_recording(recording, tmp_path / "r.csv")
    with pytest.raises(StorageError, match="--force"):
        write_recording(recording, path)
    assert write_recording(recording, path, force=True) == path


def write(path: Path, text: str, *, force: bool = False, fail: bool = False) -> None:
    with fresh(path, force=force) as place:
        assert place.suffix == path.suffix
        place.write_text(text)
        if fail:
            raise RuntimeError("in the middle")


def test_a_file_is_whole_or_absent(tmp_path: Path) -> None:
    target = tmp_path / "whole.txt"
    with pytest.raises(RuntimeError):
        write(target, "half", fail=True)
    assert list(tmp_path.iterdir()) == []
    write(target, "old")
    with pytest.raises(RuntimeError):
        write(target, "half", force=True, fail=True)
    assert target.read_text() == "old"
    write(target, "new", force=True)
    assert target.read_text() == "new"
    assert list(tmp_path.iterdir()) == [target]


@pytest.mark.parametrize("name", ["n" * 300, "a\0b"])
def test_a_name_that_no_file_can_have_is_said(name: str, tmp_path: Path) -> None:
    place = tmp_path / name
    for force in (False, True):
        with (
            pytest.raises(StorageError, match=r"cannot write .*choose another name"),
            fresh(place, force=force),
        ):
            pass
        with pytest.raises(StorageError, match=r"cannot write .*choose another name"):
            refuse_existing(place, force=force)
    with pytest.raises(StorageError, match=r"cannot make the folder .*choose another name"):
        make_folder(place)


def test_a_new_file_has_the_rights_that_the_user_gives_new_files(tmp_path: Path) -> None:
    mask = os.umask(0o027)
    try:
        with fresh(tmp_path / "a") as place:
            place.write_text("")
    finally:
        os.umask(mask)
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o640


def test_a_file_in_the_place_of_a_folder_is_named(tmp_path: Path) -> None:
    (tmp_path / "x").write_text("")
    with pytest.raises(StorageError, match="x"):
        make_folder(tmp_path / "x")
