# SPDX-License-Identifier: BSD-3-Clause
"""`allanite record` on a host that has one device for two recorders, a failing disk, clocks that are set, and signals.

Every stored sample is compared with the one that was sent under its number.
"""

from __future__ import annotations

import errno
import itertools
import json
import math
import os
import re
import signal
import subprocess
import sys
import time
import types
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import allanite as al
from allanite.acquisition.capture import HostClock, Patience, gathering, session, writer
from allanite.acquisition.capture.device_lock import locked_device
from allanite.acquisition.instruments import Block, hp3458a, serial_imu, simulated
from allanite.acquisition.instruments.hp3458a import HP3458A
from allanite.acquisition.instruments.hp3458a.simulated_meter import MeterFault
from allanite.acquisition.instruments.serial_imu import Description, SerialImu
from allanite.acquisition.instruments.serial_imu.simulator import SimulatedImu
from allanite.errors import InstrumentError
from allanite.files.store import Disk, writing
from recorded_instruments import (
    IMU,
    assert_gaps_are_told,
    lines_of,
    make_quick,
    meter,
    missing_in,
    number_of,
    only_run,
    plug_in,
    record_serial,
    sent_by,
    stored,
    volts,
)
from shell import Run
from virtual_meter import SECOND, VirtualClock, virtual_adapter, virtual_wire


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    make_quick(monkeypatch, tmp_path_factory.mktemp("locks"))


# -- one recorder for a device (battery row Q12) ---------------------------------------------------------------


@contextmanager
def another_process_that_holds(device: str, folder: Path) -> Iterator[int]:
    """Forked: nothing is imported anew, and it dies without tidying up."""
    here, there = os.pipe()
    child = os.fork()
    if not child:
        with locked_device(device) as lock:
            assert lock is not None
            lock.say(folder)
            os.write(there, b"!")
            signal.pause()
        os._exit(0)
    os.close(there)
    assert os.read(here, 1) == b"!"
    os.close(here)
    try:
        yield child
    finally:
        os.kill(child, signal.SIGKILL)
        os.waitpid(child, 0)


def test_q12_a_device_that_is_being_recorded_is_refused_before_anything_is_written(
    run: Run, tmp_path: Path
) -> None:
    with meter() as simulator:
        words = ("record", "3458a", "--resource", simulator.resource.replace("TCPIP", "TCPIP0"))
        words = (*words, "--rate", 100, "--duration", 0.1, "--out", tmp_path / "runs", "--json")
        port = simulator.resource.split("::")[2]
        with another_process_that_holds(f"tcp://127.0.0.1:{port}", tmp_path / "of another") as process:
            refused = run(*words)
        assert refused.code == 1
        assert (
            f"tcp://127.0.0.1:{port} is being recorded by process {process} into {tmp_path / 'of another'} since 20"
            in (refused.err)
        )
        assert not (tmp_path / "runs").exists() and not simulator.heard
        again = run(*words)  # that one died, without tidying up
        assert again.code == 0 and len(list((tmp_path / "runs").iterdir())) == 1


def test_q12_a_port_is_one_device_whatever_links_lead_to_it(run: Run, tmp_path: Path) -> None:
    with SimulatedImu(Description.of(IMU)) as device:
        (tmp_path / "by-id").symlink_to(os.path.realpath(device.port))
        with another_process_that_holds(os.path.realpath(device.port), tmp_path / "first"):
            refused = record_serial(run, tmp_path / "by-id", tmp_path, 0.1)
    assert refused.code == 1 and "is being recorded by process" in refused.err
    assert not (tmp_path / "runs").exists()


def test_q12_a_lock_ends_with_its_block_and_leaves_no_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from allanite.acquisition.capture import device_lock

    tmp_path.chmod(0o1777)
    monkeypatch.setattr(device_lock, "_SHARED", (tmp_path / "none", tmp_path))
    with locked_device("/dev/ttyX"):
        by_us = f"being recorded by process {os.getpid()} since"
        with pytest.raises(InstrumentError, match=by_us), locked_device("/dev/ttyX"):
            pass
        with locked_device("/dev/ttyY"), locked_device(""):
            assert len(list(tmp_path.iterdir())) == 2
    assert not list(tmp_path.iterdir())
    tmp_path.chmod(0o755)  # of one user alone: others would look elsewhere
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    assert device_lock._path_of("/dev/ttyX").parent != tmp_path
    (tmp_path / "blocked").write_text("")
    monkeypatch.setattr(device_lock, "_path_of", lambda device: tmp_path / "blocked" / "lock")
    with pytest.raises(InstrumentError, match=r"cannot be locked .* TMPDIR"), locked_device("/dev/ttyX"):
        pass


# -- the disk (battery rows Q3, Q5) ----------------------------------------------------------------------------


class Ill(Disk):
    """A disk that falls ill while samples come; `fault` is asked before each call, and told if it is for samples."""

    fault: Callable[[str, bool], None] = staticmethod(lambda call, samples: None)

    def write(self, descriptor: int, data: bytes) -> int:
        self.fault("write", is_segment(descriptor))
        return super().write(descriptor, data)

    def sync(self, descriptor: int) -> None:
        self.fault("sync", is_segment(descriptor))
        super().sync(descriptor)


def is_segment(descriptor: int) -> bool:
    return Path(f"/proc/self/fd/{descriptor}").readlink().suffix == ".arrows"


def recorded_on(
    fault: Callable[[str, bool], None],
    seconds: float,
    run: Run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> Any:
    """A block is what the pseudo-terminal holds at most, 146 samples: a batch has less than 250."""
    monkeypatch.setattr(Ill, "fault", staticmethod(fault))
    monkeypatch.setattr(writing, "Disk", Ill)
    monkeypatch.setattr(writing, "_SYNC_AFTER", 0.0)
    monkeypatch.setattr(gathering, "batch_seconds", lambda rate: 0.1)
    monkeypatch.setattr(serial_imu, "SerialImu", partial(SerialImu, gather=0.0))
    with SimulatedImu(Description.of(IMU)) as device:
        return record_serial(run, device.port, tmp_path, seconds, "--json")


def test_q3_a_disk_that_is_full_ends_the_run_at_once_and_nothing_acknowledged_is_lost(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = 0
    failed: list[float] = []

    def full(call: str, samples: bool) -> None:
        nonlocal written
        written += call == "write" and samples
        if call == "write" and written > 4:
            failed.append(time.process_time())
            raise OSError(errno.ENOSPC, "No space left on device")

    done = recorded_on(full, 60, run, tmp_path, monkeypatch)
    assert time.process_time() - failed[0] < 1.0  # and not at the end of the minute
    assert done.code == 1 and "No space left on device: make room" in done.err and not done.out
    safe = int(done.err.partition("everything up to sample ")[2].split()[0])
    counter, values, _ = stored(only_run(tmp_path / "runs"))
    assert counter[-1] >= safe > 0 and np.array_equal(counter, np.arange(len(counter)))
    np.testing.assert_allclose(values, sent_by(values, len(values)), atol=6e-5)


def test_q3_a_sync_that_fails_opens_a_new_segment_and_a_disk_that_stalls_costs_nothing(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    synced = 0

    def ill(call: str, samples: bool) -> None:
        nonlocal synced
        if call == "sync" and samples:
            synced += 1
            if synced == 2:
                raise OSError(errno.EIO, "Input/output error")
            if synced == 4:
                time.sleep(0.3)

    done = recorded_on(ill, 0.8, run, tmp_path, monkeypatch)
    assert done.code == 0, done.err
    found = only_run(tmp_path / "runs")
    counter, values, _ = stored(found)
    assert np.array_equal(counter, np.arange(800))
    np.testing.assert_allclose(values, sent_by(values, 800), atol=6e-5)
    closed = lines_of(found, "closed")
    assert "Input/output error" in closed[0]["error"] and len(closed) == 2 and synced > 4
    assert al.read(found.folder).n_samples == 800


def test_q5_a_file_system_that_fills_up(run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ticks = itertools.count(0.0, 0.1)  # every few batches are synced, whatever the clock says
    monkeypatch.setattr(writing, "time", types.SimpleNamespace(monotonic=ticks.__next__))
    monkeypatch.setattr(simulated, "_LARGEST", 500)  # samples of a batch
    place = tmp_path / "small"
    place.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", "size=400k", "tmpfs", str(place)]
    if os.geteuid() or subprocess.run(mount, capture_output=True, check=False).returncode:
        pytest.skip("a file system of 400 kB needs the right to mount one")
    words = (
        "record",
        "simulated",
        "--model",
        "N=0.3 deg/√h",
        "--rate",
        1000,
        "--speed",
        "inf",
        "--out",
        place,
    )
    try:
        done = run(*words, "--duration", "10min")
        assert done.code == 1
        assert "note: the run needs 15.5 MB, and 0.41 MB are free: it will end early" in done.err
        assert "No space left on device: make room, or record to another disk" in done.err
        safe = int(done.err.partition("everything up to sample ")[2].split()[0])
        found = only_run(place)
        counter, _, _ = stored(found)
        assert counter[-1] >= safe > 1000 and np.array_equal(counter, np.arange(len(counter)))
        assert found.status == "fail" and found.reason.startswith("No space left on device: make room")
        named = re.search(
            r"the (\d+) samples after it may be lost", done.err
        )  # none where the reserve took them
        lost = int(named[1]) if named else 0
        verdict = run("recover", "--dry-run", "--json", found.folder)
        document = json.loads(verdict.out)
        assert (document["kept"], document["lost"]) == (len(counter), safe + 1 + lost - len(counter))
        assert verdict.code == (3 if document["lost"] else 0)
        missing = al.read(found.folder).notes["source"]["missing"]
        assert sum(gap["samples"] for gap in missing) == document["lost"]
    finally:
        subprocess.run(["umount", str(place)], check=True)


# -- the host (battery rows Q9 to Q11) --------------------------------------------------------------------------


def test_q11_a_slow_host_behind_an_adapter_loses_readings_and_says_so(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with virtual_adapter(signal=volts) as (transport, clock):
        reads = itertools.count(1)

        class Late(HP3458A):
            def read(self, timeout: float) -> Block:
                if next(reads) == 4:
                    clock.pass_by(0.3)
                return super().read(timeout)

        monkeypatch.setattr(hp3458a, "HP3458A", Late)
        plug_in(lambda: transport, clock, monkeypatch)
        done = run(
            *("record", "3458a", "--resource", "prologix:///dev/ttyUSB0/22", "--rate", 40, "--duration", 1.0),
            *("--out", tmp_path / "runs", "--json"),
        )
    assert done.code == 3, done.err
    found = only_run(tmp_path / "runs")
    counter, values, _ = stored(found)
    number = number_of(values[:, 0])
    assert np.array_equal(counter, number)
    assert 8 <= missing_in(found) <= 14
    assert_gaps_are_told(found, "did not come")


class Told(HostClock):
    """The clocks of the host, moved as they are told, in a time that is only counted."""

    def __init__(self, clock: VirtualClock) -> None:
        self._clock = clock
        self.wall = self.slept = 0
        self.seen = (0, 0)

    def set(self, seconds: int) -> None:
        """Somebody sets the wall clock."""
        self.wall += seconds * SECOND

    def sleep(self, seconds: int) -> None:
        """The host sleeps."""
        self._clock.pass_by(seconds)
        self.slept += seconds * SECOND

    def now(self) -> int:
        return self._clock.ns

    def awake(self) -> int:
        self.seen = self.wall, self.slept  # nothing but a look at the clocks asks
        return self._clock.ns - self.slept

    def utc(self) -> int:
        return 1_800_000_000 * SECOND + self._clock.ns + self.wall


def test_q9_q10_the_wall_clock_is_set_and_the_host_sleeps(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer, "_LOOK", 0.05)
    # What the meter measures while the host sleeps goes nowhere.
    faults = [MeterFault(at=52, kind="lose", count=3000)]
    with virtual_wire(signal=volts, faults=faults) as wire:
        told = Told(wire.clock)
        events = {3: partial(told.set, 3600), 6: partial(told.set, -7200), 11: partial(told.sleep, 60)}
        reads = itertools.count(1)

        class Moved(HP3458A):
            def read(self, timeout: float) -> Block:
                number = next(reads)
                events.get(number, lambda: None)()
                if number - 2 in events:
                    wait_for(lambda: told.seen == (told.wall, told.slept))
                return super().read(timeout)

        monkeypatch.setattr(session, "HostClock", lambda: told)
        monkeypatch.setattr(hp3458a, "HP3458A", Moved)
        plug_in(lambda: wire, wire.clock, monkeypatch)
        done = run(
            *("record", "3458a", "--resource", "GPIB0::22::INSTR", "--rate", 50, "--duration", 62),
            *("--out", tmp_path / "runs", "--json"),
        )
    assert done.code == 3, done.err
    found = only_run(tmp_path / "runs")
    seen = [(line["what"], round(line["seconds"])) for line in lines_of(found, "clock")]
    assert seen == [("step", 3600), ("step", -7200), ("sleep", 60)]
    counter, values, _ = stored(found)
    awake = counter[: int(np.argmax(np.diff(counter))) + 1]
    assert np.array_equal(awake, np.arange(len(awake))) and 50 <= len(awake) <= 55
    assert np.array_equal(values[: len(awake), 0], volts(awake))
    assert (np.diff(number_of(values[len(awake) :, 0])) == 1).all()
    clock = np.concatenate([b.monotonic_ns for b in found.batches()])
    intervals = (
        np.diff(clock)[: len(awake) - 3] * 1e-9
    )  # the last two were made before it slept, and came after
    assert intervals == pytest.approx(0.02, abs=0.002)
    assert 59.5 < (clock[len(awake)] - clock[len(awake) - 3]) * 1e-9 < 61.5
    (gap,) = lines_of(found, "gap")
    assert gap["reason"].startswith("the host slept for 60 s; ")
    assert 15 < gap["samples"] - 3000 < 30, "it was asked for its settings before it was armed again"
    assert_gaps_are_told(found)


@pytest.mark.long
def test_q14_a_process_that_was_stopped_and_whose_terminal_is_closed(tmp_path: Path) -> None:
    import pty

    with meter() as simulator:
        words = [
            "record",
            "3458a",
            "--resource",
            simulator.resource,
            "--rate",
            "50",
            "--out",
            str(tmp_path / "runs"),
        ]
        child, terminal = pty.fork()
        if not child:
            os.execv(sys.executable, [sys.executable, "-m", "allanite", *words])
        wait_for(lambda: simulator.meter.index > 20)
        os.kill(child, signal.SIGSTOP)
        time.sleep(0.4)
        os.kill(child, signal.SIGCONT)
        wait_for(lambda: simulator.meter.index > 60)
        os.close(terminal)
        deadline = time.monotonic() + 60
        while not os.waitpid(child, os.WNOHANG)[0]:
            assert time.monotonic() < deadline, "it goes on without its terminal"
            time.sleep(0.02)
    found = only_run(tmp_path / "runs")
    assert (found.status, found.reason) == ("abort", "SIGHUP")
    counter, values, _ = stored(found)
    assert np.array_equal(counter, np.arange(len(counter))), "what the meter sent meanwhile was kept for us"
    assert np.array_equal(values[:, 0], volts(counter)) and len(counter) > 50
    assert not lines_of(found, "clock"), "a process that is stopped changes no clock"


def wait_for(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "it did not come so far"
        time.sleep(0.01)


# -- speed ------------------------------------------------------------------------------------------------------


def test_a_run_as_fast_as_it_is_read_drops_nothing(tmp_path: Path) -> None:
    from allanite.acquisition.capture import capture
    from allanite.acquisition.instruments.simulated import SimulatedInstrument
    from allanite.noise import NoiseModel, White

    sensor = SimulatedInstrument(NoiseModel.of(White(N=1e-4)), rate=100.0, speed=math.inf)
    done = capture(sensor, tmp_path / "run", duration=10_000.0, patience=Patience(full=60.0))
    assert (done.samples, done.missing, done.dropped) == (1_000_000, 0, 0)
