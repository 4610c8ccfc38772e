# SPDX-License-Identifier: BSD-3-Clause
"""record: a run from the command line, a log like any other."""

from __future__ import annotations

import contextlib
import io
import json
import shutil
import sys
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest
from click.testing import CliRunner, Result

import allanite as al
from allanite.acquisition.capture.space import bytes_per_second, space_of
from allanite.acquisition.instruments import Flag, InstrumentTimeout
from allanite.acquisition.instruments.simulated import SimulatedInstrument
from allanite.commands.capture import new_folder
from allanite.commands.cli import cli
from allanite.errors import InstrumentError, StorageError
from allanite.files.store import open_run
from allanite.views.terminal.capture import journal, show_captured
from scripted_instrument import PATIENT, QUICK, Scripted, block
from shell import Run


def invoke(*arguments: str) -> Result:
    return CliRunner().invoke(cli, arguments, standalone_mode=False)


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    runs = tmp_path_factory.mktemp("runs")
    words = (
        "record",
        "simulated",
        "--model",
        "N=0.3 deg/√h, K=20 deg/h/√h",
        "--rate",
        "32",
        "--speed",
        "20000",
    )
    done = invoke(
        *words, "--duration", "20min", "--unit", "deg/s", "--out", str(runs), "--name", "Gyro 1", "--json"
    )
    assert done.return_value == 0, done.output
    document = json.loads(done.stdout)
    assert (document["samples"], document["missing"], document["status"]) == (38_400, 0, "success")
    (made,) = runs.iterdir()
    assert made == Path(document["folder"]) and made.name.startswith("Gyro-1_0_")
    return made


def test_a_run_is_a_log_with_the_samples_of_the_simulation(folder: Path) -> None:
    record = al.read(folder)
    assert (record.n_samples, record.rate) == (38_400, 32.0)
    curve = al.allan_curve(record)
    same = al.allan_curve(al.Recording.from_rate(record.values(record.names[0]), rate=32.0, unit="deg/s"))
    assert np.array_equal(curve.deviation, same.deviation)  # bit for bit: a run and an array


METER = ("record", "3458a", "--resource", "GPIB0::22::INSTR", "--rate", "32")
SIMULATED = ("record", "simulated", "--model", "N=0.3 deg/√h", "--rate", "32")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("record", "simulated", "--model", "N=0.3 deg/√h"), "give one [Hz]"),
        ((*SIMULATED, "--duration", "0"), "must be positive and finite"),
        ((*SIMULATED, "--duration", "nan"), "not a time span"),
        ((*SIMULATED, "--duration", "1e999d"), "must be positive and finite"),
        ((*SIMULATED, "--speed", "0"), "speed must be"),
        ((*SIMULATED, "--scale-date", "yesterday"), "'yesterday' is not a date: write 2026-09-01"),
        (("record", "simulated", "--model", "nothing.json", "--rate", "32"), "nothing.json"),
        ((*METER[:-1], "nan"), "rate"),
        ((*METER, "--scale", "24 foo"), "foo"),
        ((*METER, "--nplc", "1", "--aperture", "20ms"), "give one of them"),
        ((*METER[:3], "foo", *METER[4:]), "'foo' is neither a VISA resource"),
        ((*METER[:3], "prologix://lab/31", *METER[4:]), "0 to 30"),
        (("record", "serial", "--port", "/dev/ttyUSB0", "--format", "wrong.yaml"), "wrong.yaml"),
    ],
)
@pytest.mark.parametrize("unit", [False, True])
def test_a_wrong_option_is_wrong_usage_before_anything_is_touched(
    words: tuple[str, ...], said: str, unit: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, run: Run
) -> None:
    """Exit code 2: the one after which a unit does not begin again; and no unit is written for it."""
    monkeypatch.chdir(tmp_path)
    Path("wrong.yaml").write_text("model: X1\nrate: -1\n")
    done = run(*words, "--out", "runs", *(["--unit-file", "gyro.service"] if unit else []))
    assert done.code == 2 and said in " ".join(done.err.split())
    assert [path.name for path in tmp_path.iterdir()] == ["wrong.yaml"]


def test_recorders_that_begin_in_the_same_second_have_a_folder_each(tmp_path: Path) -> None:
    made = [new_folder(tmp_path / "runs", "a_20261122T000000Z").name for _ in range(3)]
    assert made == ["a_20261122T000000Z", "a_20261122T000000Z-2", "a_20261122T000000Z-3"]
    (tmp_path / "file").write_text("")
    with pytest.raises(StorageError):
        new_folder(tmp_path / "file", "a")


# -- who looks, and who cannot ------------------------------------------------------------------------------


class Device(Scripted):
    """Goes away and comes back, repeats a frame, and has samples without a value and in doubt."""

    def __init__(self) -> None:
        script = [
            block(0, 40),
            InstrumentTimeout("nothing came in 10 ms"),
            InstrumentError("the port is gone"),
            block(60, 20, flags=Flag.DOUBTFUL, remarks=("2 frames came twice",)),
            block(80, 20, flags=Flag.OVERLOAD),
        ]
        super().__init__(script)


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> None:
    """What `record simulated` records."""
    monkeypatch.setattr(SimulatedInstrument, "from_file", lambda *_, **__: Device())
    monkeypatch.setattr("allanite.acquisition.capture.session.Patience", lambda: QUICK)


@pytest.mark.usefixtures("device")
def test_what_happens_is_told_where_nobody_looks(tmp_path: Path, run: Run) -> None:
    done = run(*SIMULATED, "--duration", "1s", "--out", tmp_path)
    assert done.code == 3
    (folder,) = tmp_path.iterdir()
    assert done.err.splitlines() == [
        f"allanite: recording Maker M1 7 into {folder}",
        "allanite: the instrument is silent: nothing came in 10 ms",
        "allanite: the link is lost, and restored: the port is gone",
        "allanite: the instrument is back, at attempt 1",
        "allanite: 2 frames came twice",
        "allanite: 20 samples are missing from number 40 on: nothing came in 10 ms",
    ]
    assert "20 samples are missing, 1 has no value and 1 is doubtful." in done.out
    assert "remarks          1, in manifest.jsonl" in done.out


@pytest.mark.parametrize(("samples", "code"), [(20, 3), (0, 1)])
def test_a_run_whose_instrument_is_gone_ends_on_time_with_words(
    samples: int, code: int, tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("allanite.acquisition.capture.writer._GRACE", 0.0)
    script = [block(0, samples)] if samples else []
    monkeypatch.setattr(SimulatedInstrument, "from_file", lambda *_, **__: Scripted(script))
    monkeypatch.setattr("allanite.acquisition.capture.session.Patience", lambda: PATIENT)
    done = run(*SIMULATED, "--duration", "0.4", "--out", tmp_path)
    assert done.code == code, done.err
    if samples:
        said = " ".join(done.out.split())
        assert said.startswith(
            "20 samples are missing. No more samples came before the planned end: nothing came in 10"
        )
    else:
        assert "no sample came in the planned duration" in done.err


def test_the_journal_is_no_flood(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    now = 0.0
    monkeypatch.setattr(time, "monotonic", lambda: now)
    tell = journal()
    assert tell is not None
    for second in range(3600):
        now = float(second)
        tell("remark", {"text": "garbage"})
        if second % 60 == 0:
            tell("disk", {"text": "little room"})
    lines = capsys.readouterr().err.splitlines()
    assert lines.count("allanite: garbage") == 60 and lines.count("allanite: little room") == 1
    assert lines.count("allanite: 590 more lines like the next one were left out") == 5 and len(lines) == 66
    tell("pressure", {"hPa": 1013})
    tell("clock", {"what": "step", "seconds": -3600.0, "text": "the wall clock was set by -3600 s"})
    tell("going", {"samples": 7, "missing": 0, "share": 0.5})
    assert capsys.readouterr().err.splitlines() == [
        "allanite: hPa 1013",
        "allanite: the wall clock was set by -3600 s; no interval is affected",
        "allanite: 7 samples, 0 missing, 50.0 % of the planned duration",
    ]


@pytest.mark.usefixtures("device")
@pytest.mark.parametrize("stream", ["closed", "full"])
@pytest.mark.parametrize("name", ["stdout", "stderr"])
def test_a_run_that_was_closed_well_does_not_fail_for_want_of_a_listener(
    name: str, stream: str, tmp_path: Path, run: Run, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In a unit, exit code 1 would record the whole duration once more."""
    for extra in ((), ("--json",)):
        full = None if stream == "closed" else io.TextIOWrapper(io.FileIO("/dev/full", "w"))
        monkeypatch.setattr(sys, name, full)
        assert run(*SIMULATED, "--duration", "1s", "--out", tmp_path / "runs", *extra).code == 3
        monkeypatch.undo()
        monkeypatch.setattr(SimulatedInstrument, "from_file", lambda *_, **__: Device())
        monkeypatch.setattr("allanite.acquisition.capture.session.Patience", lambda: QUICK)
        with contextlib.suppress(OSError):
            if full is not None:
                full.close()
    assert {open_run(folder).status for folder in (tmp_path / "runs").iterdir()} == {"success"}


def test_the_verdict_names_all_that_is_wrong(capsys: pytest.CaptureFixture[str]) -> None:
    document = {
        "missing": 0, "overloads": 0, "doubtful": 0, "remarks": 0, "gaps": 0, "dropped": 0, "samples": 9,
        "rate": 200.0, "rate_measured": None,
        "status": "success", "reason": "", "folder": "x", "instrument": {"maker": "", "model": "M", "serial": ""},
    }  # fmt: skip
    for change, said in (
        ({}, "Nothing is missing."),
        ({"overloads": 3}, "Nothing is missing, but 3 samples have no value."),
        (
            {"overloads": 3, "doubtful": 2},
            "Nothing is missing, but 3 samples have no value and 2 are doubtful.",
        ),
        ({"missing": 4, "doubtful": 2}, "4 samples are missing and 2 are doubtful."),
        ({"missing": 1}, "1 sample is missing."),
        ({"samples": 0}, "No sample was recorded."),
        ({"missing": 1, "samples": 0}, "1 sample is missing."),
        ({"rate_measured": 100.0}, "Nothing is missing, but the rate is not the stated one."),
        ({"missing": 1, "rate_measured": 100.0}, "1 sample is missing and the rate is not the stated one."),
    ):
        show_captured({**document, **change})
        assert capsys.readouterr().out.splitlines()[0] == said


def test_a_run_without_an_end_is_warned_of_a_small_disk(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    free = 1e6
    monkeypatch.setattr(shutil, "disk_usage", lambda _: SimpleNamespace(free=free))
    space = space_of(tmp_path, 32.0, 1, None)
    assert not space.enough and "1 MB are free, enough for 0.222 h" in space.warning
    assert "it will end early" in space_of(tmp_path, 32.0, 1, 86_400.0).warning
    free = bytes_per_second(32.0, 1) * 86_400 * 1.5
    assert "and only" in space_of(tmp_path, 32.0, 1, 86_400.0).warning
    assert space_of(tmp_path, 32.0, 1, None).warning == space_of(tmp_path, 32.0, 1, 3600.0).warning == ""
