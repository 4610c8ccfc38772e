# SPDX-License-Identifier: BSD-3-Clause
"""A run as a record: what is missing and why, how it was recorded, and runs before and after a power cut as one."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.acquisition.capture import capture
from allanite.acquisition.instruments.simulated import SimulatedInstrument
from allanite.errors import FormatError, InputError
from allanite.files.readers.run import read as read_table
from allanite.files.store import Flag, Header, LogStore, compact, open_run
from allanite.noise import NoiseModel, White
from allanite.recording.health.run import missing_because
from log_store_runs import HEADER, SECOND, batch_of, gaps_of, values_of, write_run
from shell import Run

METER = replace(
    HEADER,
    channels=(al.Channel.of("gyro", "V", scale_factor="24.0(2) mV/(deg/s)", aperture=0.02),),
    instrument={"maker": "Agilent/HP", "model": "3458A", "serial": "US28", "firmware": "9,2"},
    settings={"nplc": 1.0, "autozero": 0.0, "range": 10.0},
)


def write_with_gaps(folder: Path) -> Path:
    """60 stored, 40 + 24 missing, 32 stored, 8 missing, 32 stored."""
    with LogStore.create(folder, HEADER) as store:
        store.append(batch_of(0, 60))
        store.note("gap", counter=60, samples=40, reason="silent")
        store.note("gap", counter=100, samples=24, reason="no room")
        store.append(batch_of(124))
        overload = batch_of(164)
        flags = overload.flags.copy()
        flags[:3] = Flag.OVERLOAD
        values = overload.values.copy()
        values[:3, 0] = np.nan
        store.append(replace(overload, flags=flags, values=values))
    return folder


def write_meter(folder: Path, header: Header = METER, begun: float = 0.0, seconds: int = 40) -> Path:
    noise = np.random.default_rng(7)
    with LogStore.create(folder, header) as store:
        for k in range(seconds):
            batch = batch_of(32 * k)
            values = 0.01 + 2e-5 * noise.standard_normal((32, 1))
            store.append(replace(batch, values=values, utc_ns=batch.utc_ns + round(begun * SECOND)))
    return folder


# -- what is missing ----------------------------------------------------------------------------------------


def test_every_missing_sample_has_its_reason(tmp_path: Path) -> None:
    run = write_with_gaps(tmp_path / "run")
    compact(run, tmp_path / "run.parquet")
    for place in (run, tmp_path / "run.parquet"):
        record = al.read(place)
        missing = int(np.isnan(record.values("gyro_z")).sum())
        found = missing_because(record, missing)
        assert [(e["reason"], e["gaps"], e["samples"], e["first"], e["longest"]) for e in found] == [
            ("silent", 1, 40, 60, 40),
            ("no room", 1, 24, 100, 24),
            ("no reason was noted", 1, 8, 156, 8),
            ("no value: an overload, not a number, or left out because of a finding", None, 3, None, None),
        ]
        assert sum(e["samples"] for e in found) == missing == 75
    total = sum(count for _, count in gaps_of(run))
    assert total == 72


def test_a_part_of_a_run_has_the_gaps_of_that_part(tmp_path: Path) -> None:
    record = al.read(write_with_gaps(tmp_path / "run")).window(80 / 32, 160 / 32)
    found = {e["reason"]: (e["samples"], e["first"]) for e in missing_because(record)}
    assert found == {"silent": (20, 0), "no room": (24, 20), "no reason was noted": (4, 76)}
    again = record.window(30 / 32)
    assert {e["reason"]: e["samples"] for e in missing_because(again)} == {
        "no room": 14,
        "no reason was noted": 4,
    }
    assert missing_because(al.Recording.from_rate(np.zeros(5), rate=1.0, unit="V"), 3) == []


def test_what_is_missing_at_the_end_keeps_its_place(tmp_path: Path, run: Run) -> None:
    folder = tmp_path / "run"
    with LogStore.create(folder, HEADER) as store:
        store.append(batch_of(0, 60))
        store.note("gap", counter=60, samples=40, reason="the port is gone")
        store.note("gap", counter=110, samples=20, reason="stopped")
    done = run("compact", folder, "-o", tmp_path / "run.parquet")
    assert done.code == 0 and "MB of the run" in done.out and "wrote" in done.out
    for place in (folder, tmp_path / "run.parquet"):
        record = al.read(place)
        assert record.n_samples == 130 and np.isnan(record.values("gyro_z")[60:]).all()
        found = [(e["reason"], e["samples"], e["first"]) for e in missing_because(record, 70)]
        assert found == [("the port is gone", 40, 60), ("stopped", 20, 110), ("no reason was noted", 10, 100)]
        assert record.notes["source"]["gaps"] == 1
        told = run("info", place)
        assert told.code == 3 and "the port is gone" in told.out
    whole, before = al.read(folder).select("gyro_z"), al.read(folder).select("gyro_z").window(0.0, 60 / 32)
    curves = [al.allan_curve(record).deviation[:3] for record in (whole, before)]
    assert np.array_equal(*curves)  # bit for bit: what is missing behind it changes nothing


def test_the_end_of_a_part_is_not_that_of_the_run(tmp_path: Path) -> None:
    with LogStore.create(tmp_path / "run", HEADER) as store:
        store.append(batch_of(0))
        store.change(replace(HEADER, settings={**HEADER.settings, "range": 10.0}))
        store.append(batch_of(40))
        store.note("gap", counter=72, samples=8, reason="stopped")
    lengths = {part: al.read(tmp_path / "run", variable=part).n_samples for part in ("1", "2")}
    assert lengths == {"1": 32, "2": 40}


def test_samples_in_doubt_and_remarks_are_findings(tmp_path: Path, run: Run) -> None:
    folder = tmp_path / "run"
    with LogStore.create(folder, HEADER) as store:
        for first in (0, 32):
            batch = batch_of(first)
            flags = np.full(32, Flag.DOUBTFUL, dtype=np.uint8)
            flags[0] |= Flag.RESYNC
            store.append(replace(batch, flags=flags))
        store.note("remark", text="counter doubtful from here")
        store.note("remark", text="and 4 more remarks", more=4)
    compact(folder, tmp_path / "run.parquet")
    for place in (folder, tmp_path / "run.parquet"):
        codes = {f.code: f for f in al.check(al.read(place))}
        assert (
            codes["doubtful_samples"].count == 64 and "64 samples of 64" in codes["doubtful_samples"].message
        )
        assert "5 remarks" in codes["instrument_remarks"].message
        assert "noted 2 interruptions" in codes["instrument_remarks"].message
    with LogStore.create(tmp_path / "after", HEADER) as store:
        store.append(replace(batch_of(0), utc_ns=batch_of(0).utc_ns + 10 * SECOND))
    source = al.read([folder, tmp_path / "after"]).notes["source"]
    assert (source["samples"], source["remarks"], source["flagged"]["doubtful"]) == (96, 5, 64)
    clean = al.check(al.read(write_run(tmp_path / "clean", [0, 32])))
    assert not {f.code for f in clean} & {"doubtful_samples", "instrument_remarks"}


@pytest.mark.parametrize("packed", [False, True])
def test_a_value_that_changes_on_the_disk_after_the_run_was_opened_is_never_read(
    packed: bool, tmp_path: Path
) -> None:
    place = write_run(tmp_path / "run", range(0, 640, 32))
    whole = place / "000001.arrows"
    if packed:
        whole = compact(place, tmp_path / "run.parquet")
    record = al.read(whole if packed else place)
    data = whole.read_bytes()
    assert np.array_equal(record.values("gyro_z"), values_of(np.arange(640))[:, 0])
    wrong = 0
    for at in range(len(data) // 3, len(data) // 2, 173):
        whole.write_bytes(data[:at] + bytes([data[at] ^ 64]) + data[at + 1 :])
        again = replace(record)  # nothing of it is kept in memory
        again.columns[0].of._kept.clear()  # type: ignore[attr-defined]
        try:
            read = again.values("gyro_z")
        except FormatError:
            continue
        wrong += not np.array_equal(read, values_of(np.arange(640))[:, 0])
    assert wrong == 0
    whole.write_bytes(data[: len(data) // 2])
    record.columns[0].of._kept.clear()  # type: ignore[attr-defined]
    with pytest.raises(FormatError):
        record.values("gyro_z")


def test_a_segment_that_was_exchanged_is_not_packed(tmp_path: Path, run: Run) -> None:
    """Every batch of it verifies: the SHA-256 of the manifest tells."""
    folder = write_run(tmp_path / "run", [0, 32, 64])
    segment = folder / "000001.arrows"
    data = segment.read_bytes()
    mark = b"\xff\xff\xff\xff"
    starts = [at for at in range(0, len(data), 8) if data[at : at + 4] == mark]
    segment.write_bytes(data[: starts[-2]] + b"\xff\xff\xff\xff\x00\x00\x00\x00" + data[starts[-1] :])
    done = run("compact", folder)
    assert done.code == 1 and "recover" in done.err and not list(tmp_path.glob("*.parquet"))
    segment.write_bytes(data)
    assert run("compact", folder).code == 0 and (tmp_path / "run.parquet").exists()
    assert run("compact", folder).code == 1  # it is there
    assert run("compact", folder, "--force", "--json").code == 0


def test_info_says_who_how_and_why(tmp_path: Path, run: Run) -> None:
    folder = write_with_gaps(tmp_path / "run")
    done = run("info", folder)
    assert done.code == 3
    for words in (
        "none made up 12, firmware 1",
        "autozero off",
        "range 1",
        "2026-09-01",
        "silent",
        "no room",
    ):
        assert words in done.out, words
    assert "no_time_stamps" not in done.out  # a run has a counter
    document = json.loads(run("info", folder, "--json").out)
    assert [e["samples"] for e in document["missing_because"]] == [40, 24, 8, 3]
    assert document["history"][0]["settings"] == HEADER.settings


def test_the_plan_is_in_the_manifest(tmp_path: Path) -> None:
    sensor = SimulatedInstrument(NoiseModel.of(White(N=1e-4)), rate=50.0, speed=10_000.0)
    capture(sensor, tmp_path / "run", duration=10.0)
    (plan,) = [e for e in open_run(tmp_path / "run").manifest if e["kind"] == "plan"]
    assert (plan["seconds"], plan["samples"]) == (10.0, 500)


def test_a_clock_that_is_wrong_is_said(tmp_path: Path) -> None:
    for name, ppm in (("good", 20e-6), ("poor", 400e-6)):
        with LogStore.create(tmp_path / name, HEADER, rotate_bytes=4000) as store:
            for k in range(40):
                batch = batch_of(32 * k)
                late = 1e5 * np.sin(batch.counter[-1])  # 0.1 ms
                stamps = np.rint(batch.counter / 32 * 1e9 * (1 + ppm) + late).astype(np.int64)
                store.append(replace(batch, monotonic_ns=stamps))
        codes = {f.code: f for f in al.check(al.read(tmp_path / name))}
        assert ("clock_rate" in codes) is (name == "poor")
    assert "-399.9 ppm" in codes["clock_rate"].message and "the former is used" in codes["clock_rate"].message


# -- aperture, autozero, scale ------------------------------------------------------------------------------


def test_a_study_says_what_the_numbers_hold_besides_the_sensor(tmp_path: Path, run: Run) -> None:
    folder = write_meter(tmp_path / "run")
    done = run("characterize", folder, "--out", tmp_path / "out")
    assert "1.250 = √(0.03125 s/0.02 s) times smaller" in done.out and "No result was divided" in done.out
    assert "autozero_off" in done.out and "0.83 %" in done.out
    study = al.Study.load(tmp_path / "out" / "study.json")
    (channel,) = study.channels
    assert channel.aliasing is not None
    assert channel.aliasing.factor == pytest.approx(math.sqrt(0.03125 / 0.02))
    alone = al.characterize(
        al.Recording.from_rate(
            al.read(folder).values("gyro"), rate=32.0, unit="V", scale_factor="24.0 mV/(deg/s)", names="gyro"
        )
    )
    assert alone["gyro"].aliasing is None
    ours, plain = study.models["gyro"].estimate("N"), alone.models["gyro"].estimate("N")
    assert ours is not None and plain is not None
    assert ours.value == plain.value and ours.statistical == (plain.lower, plain.upper)
    page = (tmp_path / "out" / "report.html").read_text(encoding="utf-8")
    assert al.Study.from_json(study.to_json()).models["gyro"] == study.models["gyro"]
    for words in (
        "standard uncertainty of 0.83 %",
        "times smaller",
        "Agilent/HP 3458A US28",
        "autozero 0",
        "by statistics alone",
    ):
        assert words in page, words


def test_the_report_has_a_table_of_what_is_missing(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    noise = np.random.default_rng(7)
    with LogStore.create(folder, METER) as store:
        for first in (*range(0, 960, 32), *range(1000, 1960, 32)):
            if first == 1000:
                store.note("gap", counter=960, samples=40, reason="the port <disappeared>")
            store.append(replace(batch_of(first), values=0.01 + 2e-5 * noise.standard_normal((32, 1))))
    study = al.characterize(al.read(folder))
    (entry,) = study.to_json()["recording"]["missing_because"]
    assert (entry["reason"], entry["samples"]) == ("the port <disappeared>", 40)
    page = al.render(study, tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Missing samples and their reasons" in page and "the port &lt;disappeared&gt;" in page
    assert al.Study.from_json(study.to_json()).to_json() == study.to_json()


# -- two runs -----------------------------------------------------------------------------------------------


def test_runs_before_and_after_a_power_cut_are_one_log(tmp_path: Path) -> None:
    before = write_with_gaps(tmp_path / "before")
    with LogStore.create(tmp_path / "after", HEADER) as store:
        for first in (0, 32):
            batch = batch_of(first)
            store.append(replace(batch, utc_ns=batch.utc_ns + 10 * SECOND))
    whole = al.read([tmp_path / "after", before])
    assert (whole.rate, whole.n_samples) == (32.0, 320 + 64)
    values = whole.values("gyro_z")
    assert np.array_equal(values[320:], values_of(np.arange(64))[:, 0])
    assert np.array_equal(values[:60], values_of(np.arange(60))[:, 0])
    missing = int(np.isnan(whole.values("temperature")).sum())
    found = {e["reason"]: e["samples"] for e in missing_because(whole, missing)}
    assert found == {
        "before after was begun": 320 - 196,
        "silent": 40,
        "no room": 24,
        "no reason was noted": 8,
    }
    assert missing == sum(found.values())
    assert [s["run"] for s in whole.history if s["step"] == "record"] == ["before", "after"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"settings": {**METER.settings, "range": 1.0}}, "setting range 10.0 and 1.0"),
        ({"instrument": {**METER.instrument, "serial": "US29"}}, "serial 'US28' and 'US29'"),
        (
            {"channels": (al.Channel.of("gyro", "V", scale_factor="24.1 mV/(deg/s)", aperture=0.02),)},
            "channels",
        ),
        ({"rate": 16.0}, "32 Hz and 16 Hz"),
    ],
)
def test_what_is_not_one_log_is_refused(tmp_path: Path, change: dict[str, object], said: str) -> None:
    write_meter(tmp_path / "a", seconds=4)
    write_meter(tmp_path / "b", replace(METER, **change), begun=100.0, seconds=4)
    with pytest.raises(InputError, match=said):
        al.read([tmp_path / "a", tmp_path / "b"])


def test_runs_that_overlap_are_refused(tmp_path: Path) -> None:
    write_meter(tmp_path / "a", seconds=4)
    write_meter(tmp_path / "b", begun=3.0, seconds=4)
    with pytest.raises(InputError, match="a and b overlap in time by 1 s"):
        al.read([tmp_path / "a", tmp_path / "b"])


def test_gaps_without_a_note_and_notes_without_a_gap(tmp_path: Path) -> None:
    folder = write_run(tmp_path / "run", [0, 64])
    with (folder / "manifest.jsonl").open("a") as manifest:
        manifest.write('{"kind": "gap"}\n')  # damaged: its sum is missing
    from allanite.files.readers.table import Options

    table = read_table(folder, Options())
    assert table.source["missing"] == [{"position": 32, "samples": 32, "reason": ""}]
