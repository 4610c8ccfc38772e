# SPDX-License-Identifier: BSD-3-Clause
"""Simulated instruments that tell by the value of a reading which one it is, and what a run of them holds."""

from __future__ import annotations

import json
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from allanite.acquisition.capture import Patience, device_lock, listener, session, writer
from allanite.acquisition.instruments import serial_imu
from allanite.acquisition.instruments.hp3458a import conversation, driver, prologix
from allanite.acquisition.instruments.hp3458a.simulated_meter import SimulatedMeter
from allanite.acquisition.instruments.hp3458a.simulator import MeterSimulator
from allanite.acquisition.instruments.hp3458a.transports import Transport
from allanite.acquisition.instruments.serial_imu import SerialImu
from allanite.acquisition.instruments.serial_imu import driver as imu_driver
from allanite.acquisition.instruments.serial_imu.faults import Vanish, Wait, noise
from allanite.acquisition.instruments.serial_imu.port import SerialPort
from allanite.acquisition.instruments.serial_imu.simulator import SimulatedImu
from allanite.files.store import Run as StoredRun
from allanite.files.store import open_run
from shell import Done, Run
from virtual_imu import VirtualPort, follow
from virtual_meter import VirtualClock

_TABLE = np.array([float(b"%+.8E" % v) for v in np.random.default_rng(3).normal(0.0, 0.01, 1 << 15)])
IMU: dict[str, Any] = {
    "model": "X1",
    "rate": 1000,
    "frame": {
        "header": "A5 5A",
        "length": 28,
        "counter": {"at": 2, "type": "u16"},
        "fields": [
            {
                "name": f"ch{i}",
                "at": 4 + 3 * i,
                "type": "i24",
                "unit": "deg/s",
                "scale": 1e-4,
                "overload": [-8388608],
            }
            for i in range(6)
        ],
        "checksum": {"kind": "crc32", "from": 2},
    },
}


def volts(index: np.ndarray) -> np.ndarray:
    """Reading by number, as the meter writes it."""
    return _TABLE[index % len(_TABLE)]


def number_of(values: np.ndarray) -> np.ndarray:
    """Inverse of `volts`, for runs shorter than its table; a value that was never sent has no number."""
    order = np.argsort(_TABLE)
    found = order[np.clip(np.searchsorted(_TABLE[order], values), 0, len(order) - 1)]
    assert np.array_equal(_TABLE[found], values), "a value that was never sent"
    return found


def record_meter(run: Run, resource: str, folder: Path, rate: float, seconds: object, *words: object) -> Done:
    """`allanite record 3458a` from this resource into `folder`/runs."""
    return run(
        *("record", "3458a", "--resource", resource, "--rate", rate, "--duration", seconds),
        *("--out", folder / "runs", "--json", *words),
    )


def record_serial(
    run: Run,
    port: str | Path,
    folder: Path,
    seconds: object,
    *words: object,
    entries: Mapping[str, Any] = IMU,
) -> Done:
    """`allanite record serial` from this port into `folder`/runs."""
    described = folder / "imu.yaml"
    described.write_text(json.dumps(entries))
    return run(
        *("record", "serial", "--port", port, "--format", described),
        *("--duration", seconds, "--out", folder / "runs", *words),
    )


#: A rate [Hz] at which what waits in a pseudo-terminal is shorter than the delays that a driver puts up with.
SWIFT = 20_000


def keep_pace(
    monkeypatch: pytest.MonkeyPatch,
    device: SimulatedImu,
    rate: float = SWIFT,
    back: threading.Event | None = None,
) -> None:
    """The clock of the host goes by what the device has sent: a busy host has no say in where a sample belongs.

    The device pauses, or goes away, once all that it has sent was read; where `back` is given, until that is set.
    """
    second = 1_000_000_000
    for module in (imu_driver, listener):
        monkeypatch.setattr(module, "host_ns", lambda: second + round(device.sent / rate * second))
    read, send, be_away = SerialPort.read, device._send, device._be_away
    sent, heard, taken = 0, 0, 0  # bytes; taken ones have their time

    def counted(port: SerialPort, timeout: float) -> bytes:
        nonlocal heard, taken
        taken = heard
        data = read(port, timeout)
        heard += len(data)
        return data

    def counting(payload: bytes) -> bool:
        nonlocal sent
        sent += len(payload)
        return send(payload)

    def wait_until(condition: Callable[[], bool]) -> None:
        while not condition() and not device._ending.wait(0.001):
            pass

    def in_time(absence: Wait | Vanish) -> None:
        wait_until(lambda: taken >= sent)
        device.sent += round(absence.seconds * rate)
        if back is not None:
            device._pull_out()
            wait_until(back.is_set)
        be_away(absence)

    monkeypatch.setattr(SerialPort, "read", counted)
    monkeypatch.setattr(device, "_send", counting)
    monkeypatch.setattr(device, "_be_away", in_time)


def plug_in(connect: Callable[[], Transport], clock: VirtualClock, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever 3458A is opened is the one that this connects to, in a time that is only counted."""
    monkeypatch.setattr(driver, "open_transport", lambda resource: connect())
    monkeypatch.setattr(listener, "host_ns", clock.now)
    be_patient(monkeypatch, timeout=0.15)


def plug_in_port(port: VirtualPort, monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever port is opened is this one, in a time that is only counted."""
    monkeypatch.setattr(serial_imu, "SerialImu", partial(SerialImu, connect=port))
    monkeypatch.setattr(listener, "host_ns", port.clock.now)
    follow(port.clock, monkeypatch)


def be_patient(monkeypatch: pytest.MonkeyPatch, **patience: Any) -> None:
    """How long the recorder bears silence; it makes a link anew without a pause."""
    monkeypatch.setattr(
        session, "Patience", partial(Patience, **{"pause": 0.0, "longest_pause": 0.0, **patience})
    )


@contextmanager
def meter(door: str = "socket", speed: float | None = 1.0, **simulated: Any) -> Iterator[MeterSimulator]:
    with MeterSimulator(SimulatedMeter(signal=volts, speed=speed, **simulated), door) as simulator:
        yield simulator


def stored(run: StoredRun, part: int | None = None) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Numbers, values and flags."""
    batches = list(run.batches(part))
    return (
        np.concatenate([b.counter for b in batches]),
        np.concatenate([b.values for b in batches]),
        np.concatenate([b.flags for b in batches]),
    )


def only_run(runs: Path) -> StoredRun:
    (folder,) = runs.iterdir()
    return open_run(folder)


def lines_of(run: StoredRun, kind: str) -> list[Mapping[str, Any]]:
    return [line for line in run.manifest if line["kind"] == kind]


def missing_in(run: StoredRun) -> int:
    return sum(line["samples"] for line in lines_of(run, "gap"))


def assert_gaps_are_told(run: StoredRun, reason: str = "") -> None:
    """The jumps of the counter are the gaps of the manifest, each with its reason."""
    counter, _, _ = stored(run)
    before = np.concatenate([[-1], counter[:-1]])
    jumps = [(int(b) + 1, int(a - b - 1)) for b, a in zip(before, counter, strict=True) if a - b > 1]
    told = [
        (line["counter"], line["samples"]) for line in lines_of(run, "gap") if line["counter"] <= counter[-1]
    ]
    assert told == jumps
    assert all(line["reason"] and reason in line["reason"] for line in lines_of(run, "gap"))


def sent_by(values: np.ndarray, n: int) -> np.ndarray:
    """What the simulated IMU sent from the first of these samples on."""
    source = noise(6)(0, n + 5000)  # it sends before anybody listens
    first = next(i for i in range(5000) if np.allclose(source[i], values[0], atol=6e-5))
    return source[first : first + n]


def make_quick(monkeypatch: pytest.MonkeyPatch, locks: Path) -> None:
    """Waits of the drivers cut short; locks of devices in a folder of the test's own.

    Pseudo-terminals change their numbers when they vanish: another test at the same time may get that of ours.
    """
    locks.chmod(0o1777)
    monkeypatch.setattr(device_lock, "_SHARED", (locks,))
    monkeypatch.setenv("PYVISA_LIBRARY", "@py")  # else it looks for the makers' libraries each time
    monkeypatch.setattr(conversation, "QUIET", 0.02)
    monkeypatch.setattr(prologix, "READ_TIMEOUT_MS", 30)
    monkeypatch.setattr(prologix, "MARGIN", 0.03)
    monkeypatch.setattr(writer, "_GRACE", 60.0)  # a busy host makes a link anew when the end has long passed
    # A busy host is no silent instrument: a test of silence counts its time, or has a timeout of its own.
    be_patient(monkeypatch, timeout=60.0, reconnections=10_000, pause=0.02, longest_pause=0.02)
