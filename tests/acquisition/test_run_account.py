# SPDX-License-Identifier: BSD-3-Clause
"""What `record` says at its end, what `info` says of the run and what `recover` says of it: the same numbers.

Whatever interrupts the run, and wherever: an instrument that is gone, a disk that is full or fails, Ctrl-C, a kill.
"""

from __future__ import annotations

import errno
import json
import os
import re
import shutil
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.acquisition.capture import gathering, writer
from allanite.acquisition.instruments import Block, Flag
from allanite.acquisition.instruments.simulated import SimulatedInstrument
from allanite.commands.run_account import account_of, kept_in
from allanite.errors import InstrumentError
from allanite.files.store import Batch, Disk, Header, LogStore, open_run, recover, writing
from allanite.views.terminal.capture import journal
from scripted_instrument import GONE, GYRO, PATIENT, QUICK, SAME, Scripted, Step, block
from shell import Done, Run

RECORD = ("record", "simulated", "--model", "N=0.3 deg/√h", "--rate", "100")


class Refusing(Disk):
    """Counts its calls, and fails from one of them on."""

    calls = 0
    fails_at: int | None = None
    kind = "write"
    code = errno.ENOSPC
    for_good = True

    def _asked(self, kind: str) -> None:
        if kind != Refusing.kind:
            return
        Refusing.calls += 1
        at = Refusing.fails_at
        if at is not None and (Refusing.calls >= at if Refusing.for_good else Refusing.calls == at):
            raise OSError(Refusing.code, os.strerror(Refusing.code))

    def write(self, descriptor: int, data: bytes) -> int:
        self._asked("write")
        return super().write(descriptor, data)

    def sync(self, descriptor: int) -> None:
        self._asked("sync")
        super().sync(descriptor)


def slowly(first: int, n: int = 10, **more: Any) -> Callable[[], Block]:
    def made() -> Block:
        time.sleep(0.002)  # so that batches are several
        return block(first, n, **more)

    return made


#: A run with all that there is: gaps, silence, a link made anew, samples without a value and in doubt, remarks.
SCRIPT: tuple[Step, ...] = (
    *(slowly(10 * k) for k in range(5)),
    slowly(60, 10, flags=Flag.OVERLOAD, remarks=("2 frames came twice",)),
    InstrumentError("the port is gone"),
    *(slowly(90 + 10 * k, remarks=("garbage",) if k % 2 else ()) for k in range(5)),
    slowly(140, 10, flags=Flag.DOUBTFUL),
    *(slowly(150 + 10 * k) for k in range(5)),
)


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gathering, "batch_seconds", lambda rate: 0.1)
    monkeypatch.setattr(writing, "_SYNC_AFTER", 0.0)
    monkeypatch.setattr(writer, "_REMARKS", 2)
    monkeypatch.setattr(writer, "_GRACE", 0.0)
    monkeypatch.setattr("allanite.acquisition.capture.session.Patience", lambda: QUICK)
    monkeypatch.setattr(Refusing, "calls", 0)
    monkeypatch.setattr(Refusing, "fails_at", None)


@pytest.fixture
def plug_in(monkeypatch: pytest.MonkeyPatch) -> Callable[[Scripted], None]:
    return lambda device: monkeypatch.setattr(SimulatedInstrument, "from_file", lambda *_, **__: device)


def recorded(run: Run, out: Path, seconds: str = "2") -> Done:
    return run(*RECORD, "--duration", seconds, "--out", out, "--json")


def assert_all_agree(run: Run, folder: Path, done: Done | None = None) -> dict[str, Any]:
    """The numbers of `info` and `recover`, in JSON and in words, and those of the recording itself."""
    there = json.loads((recovered := run("recover", "--dry-run", "--json", folder)).out)
    words = " ".join(run("recover", "--dry-run", folder).out.split())
    assert f"kept {there['kept']} samples" in words
    assert there["kept"] == kept_in(open_run(folder)) or there["losses"], "counted at the end of a recording"
    if there["kept"]:
        told = run("info", "--json", folder)
        facts = json.loads(told.out)
        assert facts["run"] == {k: v for k, v in there.items() if k not in ("folder", "out")}
        assert recovered.code == 0 or told.code in (1, 3), "what is lost is lost for both"
        said = " ".join(run("info", folder).out.split())
        assert f"{there['kept']} samples stored" in said
        assert not there["missing"] or f"{there['missing']} missing in {there['gaps']} gap" in said
        assert all(loss["why"] in said for loss in there["losses"])
    lines = [e for e in open_run(folder).manifest if e["kind"] == "remark"]
    assert there["remarks"] == sum(e.get("more", 1) for e in lines)
    if done is not None and done.code in (0, 3):
        end = json.loads(done.out)
        assert not there["losses"]
        assert done.code == (3 if end["missing"] or end["overloads"] or end["doubtful"] else 0)
        for mine, theirs in (
            ("samples", "kept"),
            ("missing", "missing"),
            ("gaps", "gaps"),
            ("remarks", "remarks"),
        ):
            assert end[mine] == there[theirs], mine
        assert end["remarks_noted"] == sum("more" not in e for e in lines)
        assert (end["status"], end["reason"]) == (there["status"], there["reason"])
    if done is not None and done.code == 1:
        said = re.search(r"(\d+) samples? kept in ", done.err)
        assert said, done.err
        assert int(said[1]) == there["kept"]
        assert "nothing was stored" not in done.err or not there["kept"]
    return there


def only(runs: Path) -> Path:
    (folder,) = runs.iterdir()
    return folder


def test_a_run_with_all_that_there_is(run: Run, tmp_path: Path, plug_in: Callable[[Scripted], None]) -> None:
    plug_in(Scripted(list(SCRIPT)))
    done = recorded(run, tmp_path)
    assert done.code == 3, done.err
    there = assert_all_agree(run, only(tmp_path), done)
    assert there["missing"] > 0 and there["kept"] + there["missing"] == 200 and there["remarks"] == 3


@pytest.mark.parametrize("at", [0, 1, 6, 11, len(SCRIPT)])
@pytest.mark.parametrize("what", ["gone", "silent", "another", "a fault"])
def test_an_instrument_that_is_gone(
    what: str,
    at: int,
    run: Run,
    tmp_path: Path,
    plug_in: Callable[[Scripted], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(
        "allanite.acquisition.capture.session.Patience", lambda: PATIENT if at in (0, 11) else QUICK
    )
    end: list[Step] = [InstrumentError("the port is gone")] if what != "silent" else []
    other = (SAME, *[type(SAME)(maker="Maker", model="M1", serial="8")] * 3)
    before = [step for step in SCRIPT[:at] if not isinstance(step, Exception)]
    plug_in(Scripted([*before, *end], {"gone": GONE, "another": other}.get(what, ())))
    done = recorded(run, tmp_path, "0.3" if at in (0, 11) else "2")
    assert done.code in (0, 1, 3)
    assert_all_agree(run, only(tmp_path), done)


@pytest.mark.parametrize(("kind", "code"), [("write", errno.ENOSPC), ("sync", errno.EIO)])
@pytest.mark.parametrize("for_good", [True, False])
def test_a_disk_that_fails_at_any_call(
    code: int, kind: str, for_good: bool, run: Run, tmp_path: Path, plug_in: Callable[[Scripted], None],
    monkeypatch: pytest.MonkeyPatch,
) -> None:  # fmt: skip
    monkeypatch.setattr(writing, "Disk", Refusing)
    for name, value in (("code", code), ("kind", kind), ("for_good", for_good)):
        monkeypatch.setattr(Refusing, name, value)
    endings = set()
    for at in (5, 8, 13, 14):
        Refusing.calls, Refusing.fails_at = 0, at
        plug_in(Scripted(list(SCRIPT)))
        runs = tmp_path / str(at)
        done = recorded(run, runs)
        endings.add(done.code)
        if done.code == 1 and "cannot start a run" in done.err:
            continue
        assert_all_agree(run, only(runs), done)
    assert (1 if for_good else 3) in endings


@pytest.mark.parametrize("at", [0, 3, 6, 9])
def test_ctrl_c(at: int, run: Run, tmp_path: Path, plug_in: Callable[[Scripted], None]) -> None:
    import signal

    def interrupted() -> Block:
        os.kill(os.getpid(), signal.SIGINT)
        return block(300)

    plug_in(Scripted([*SCRIPT[:at], interrupted]))
    done = recorded(run, tmp_path, "100")
    assert done.code in (0, 3)
    there = assert_all_agree(run, only(tmp_path), done)
    assert (there["status"], there["reason"]) == ("abort", "SIGINT")


def test_a_kill_at_any_byte(run: Run, tmp_path: Path) -> None:
    header = Header(channels=(GYRO,), rate=100.0)
    store = LogStore.create(tmp_path / "whole", header)
    for k in range(6):
        if k == 3:
            store.note("gap", counter=30, samples=10, reason="silent")
            continue
        counter = np.arange(10 * k, 10 * k + 10)
        store.append(
            Batch(
                counter=counter,
                monotonic_ns=counter * 10**7,
                values=np.zeros((10, 1)),
                flags=np.zeros(10, dtype=np.uint8),
                utc_ns=10**18 + int(counter[-1]) * 10**7,
            )
        )
    store._let_go()  # as the system does with the files of one that was killed
    segment = (tmp_path / "whole" / "000001.arrows").read_bytes()
    for i, size in enumerate(np.linspace(len(segment) // 3, len(segment), 9, dtype=int)):
        folder = tmp_path / f"cut{i}"
        shutil.copytree(tmp_path / "whole", folder)
        (folder / "000001.arrows").write_bytes(segment[:size])
        there = assert_all_agree(run, folder)
        assert there["status"] == "unfinished" and there["kept"] % 10 == 0


def test_info_knows_what_recover_knows_of_damage_of_any_kind(run: Run, tmp_path: Path) -> None:
    with LogStore.create(tmp_path / "whole", Header(channels=(GYRO,), rate=100.0)) as store:
        for k in range(12):
            counter = np.arange(10 * k, 10 * k + 10)
            store.append(
                Batch(
                    counter=counter,
                    monotonic_ns=counter * 10**7,
                    values=np.full((10, 1), float(k)),
                    flags=np.zeros(10, dtype=np.uint8),
                    utc_ns=10**18 + int(counter[-1]) * 10**7,
                )
            )
    assert_all_agree(run, tmp_path / "whole")
    data = (tmp_path / "whole" / "000001.arrows").read_bytes()
    manifest = (tmp_path / "whole" / "manifest.jsonl").read_bytes()
    damages: dict[str, tuple[bytes, bytes]] = {
        "a batch": (data[: len(data) // 2] + b"\x55" + data[len(data) // 2 + 1 :], manifest),
        "the end": (data[:-900], manifest),
        "bytes behind": (data + b"more", manifest),
        "a line": (data, manifest.replace(b'"closed"', b'"cLosed"')),
        "no end": (data, b"".join(manifest.splitlines(keepends=True)[:-1])),
        "no manifest": (data, b""),
    }
    for name, (segment, lines) in damages.items():
        folder = tmp_path / name
        folder.mkdir()
        (folder / "000001.arrows").write_bytes(segment)
        (folder / "manifest.jsonl").write_bytes(lines)
        there = assert_all_agree(run, folder)
        found, account = recover(folder, None), account_of(folder)
        assert account is not None and (account.kept, account.losses) == (found.kept, found.losses), name
        assert (there["kept"], there["lost"]) == (found.kept, found.lost)


def test_nothing_stored_is_said_of_nothing_only(
    run: Run, tmp_path: Path, plug_in: Callable[[Scripted], None], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A sync that fails for good: the samples are in the file, and nobody knows whether they are on the medium."""
    monkeypatch.setattr(writing, "Disk", Refusing)
    monkeypatch.setattr(Refusing, "kind", "sync")
    monkeypatch.setattr(Refusing, "code", errno.EIO)
    plug_in(Scripted([lambda: (setattr(Refusing, "fails_at", Refusing.calls + 1), block(0, 80))[1]]))
    done = recorded(run, tmp_path)
    assert done.code == 1 and "nothing was stored" not in done.err
    assert "no sample is confirmed on disk" in done.err and "80 samples kept in" in done.err
    assert_all_agree(run, only(tmp_path), done)


def test_lines_that_the_journal_left_out_are_counted_at_its_end(capsys: pytest.CaptureFixture[str]) -> None:
    tell = journal()
    assert tell is not None
    for _ in range(25):
        tell("remark", {"text": "garbage"})
    tell("ended", {})
    lines = capsys.readouterr().err.splitlines()
    assert lines == ["allanite: garbage"] * 10 + ["allanite: 15 more lines on a remark were left out"]


def test_remarks_without_a_line_are_said(
    run: Run, tmp_path: Path, plug_in: Callable[[Scripted], None]
) -> None:
    plug_in(Scripted([block(10 * k, remarks=("garbage",)) for k in range(10)]))
    done = run(*RECORD, "--duration", "1", "--out", tmp_path)
    assert "remarks 10, 2 of them in manifest.jsonl" in " ".join(done.out.split())
