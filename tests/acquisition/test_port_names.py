# SPDX-License-Identifier: BSD-3-Clause
"""Which names of ports are taken: what pyserial would do with the others must not happen, and nothing is opened."""

from __future__ import annotations

import os
import select
import socket
import stat
import threading
from contextlib import suppress
from pathlib import Path

import pytest

from allanite.acquisition.instruments import port_names
from allanite.acquisition.instruments.hp3458a.prologix import SerialLink
from allanite.acquisition.instruments.hp3458a.resources import device_of
from allanite.acquisition.instruments.serial_imu import Description, SerialImu
from allanite.acquisition.instruments.serial_imu.layout import PortSettings
from allanite.acquisition.instruments.serial_imu.port import SerialPort
from allanite.errors import FormatError, InputError, InstrumentError
from recorded_instruments import IMU, record_serial
from shell import Run

TRACE = "/tmp/trace"
FOREIGN = [
    f"spy:///dev/ttyUSB0?file={TRACE}",
    f"SPY:///dev/ttyUSB0?file={TRACE}",
    f" spy:///dev/ttyUSB0?file={TRACE}",
    f"\tspy:///dev/ttyUSB0?file={TRACE}",
    f"sp\ny:///dev/ttyUSB0?file={TRACE}",
    "alt:///dev/ttyUSB0?class=PosixPollSerial",
    "hwgrep://.*",
    "cp2110://0001",
    "file:///etc/passwd",
    ".evil://x",
    "://",
    "loop://?logging=debug",
    "socket://127.0.0.1:1?logging=debug",
    "rfc2217://127.0.0.1:1?logging=debug",
    "rfc2217://127.0.0.1:1?timeout=1&logging=debug",
    "socket://user@127.0.0.1:1",
    "socket://127.0.0.1",
    "socket://spy://127.0.0.1:1",
    "loop://x",
    "",
    "/dev/ttyUSB0\x1b[2J",
]


@pytest.mark.parametrize("name", FOREIGN)
def test_a_url_that_is_not_listed_is_refused_with_those_that_are(name: str) -> None:
    with pytest.raises(InputError) as refused:
        SerialImu(name, Description.of(IMU), connect=None)  # type: ignore[arg-type]
    assert (
        "://" not in name
        or not name.isprintable()
        or name != name.strip()
        or "socket://" in str(refused.value)
    )
    with pytest.raises(InstrumentError):
        SerialPort(name, PortSettings())


@pytest.mark.parametrize(
    ("name", "device"),
    [
        ("socket://127.0.0.1:4000", "tcp://127.0.0.1:4000"),
        ("SOCKET://Lab-7:4000/", "tcp://lab-7:4000"),
        ("socket://[::1]:4000", "tcp://[::1]:4000"),
        ("rfc2217://lab:4000?timeout=2.5&ign_set_control&poll_modem", "tcp://lab:4000"),
        ("loop://", ""),
        ("/dev/not-plugged-in", "/dev/not-plugged-in"),
    ],
)
def test_a_port_that_may_be_opened_and_what_locks_it(name: str, device: str) -> None:
    assert SerialImu(name, Description.of(IMU)).device == device


@pytest.fixture(params=["file", "folder", "pipe", "link to a file", "socket", "link to a disk"])
def no_port(request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    place = tmp_path / "port"
    if request.param == "file":
        place.write_bytes(b"kept")
    elif request.param == "folder":
        place.mkdir()
    elif request.param == "pipe":
        os.mkfifo(place)
    elif request.param == "link to a file":
        (tmp_path / "other").write_bytes(b"kept")
        place.symlink_to(tmp_path / "other")
    elif request.param == "socket":
        socket.socket(socket.AF_UNIX).bind(str(place))
    else:  # a disk needs the right to make one: what the system says of it is enough
        place.symlink_to(tmp_path / "disk")
        real = os.stat
        disk = os.stat_result((stat.S_IFBLK | 0o660, *[0] * 9))
        monkeypatch.setattr(
            port_names.os, "stat", lambda path, **how: disk if path == str(place) else real(path, **how)
        )
    return place


def test_what_is_no_port_is_refused_before_it_is_opened(
    no_port: Path, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    opened: list[object] = []
    real = os.open
    monkeypatch.setattr(
        os, "open", lambda path, *how, **where: opened.append(str(path)) or real(path, *how, **where)
    )
    done = record_serial(run, no_port, tmp_path, 1)
    assert done.code == 2 and "no serial port" in " ".join(done.err.split())
    meter = run(
        *(
            "record",
            "3458a",
            "--resource",
            f"prologix://{no_port}/22",
            "--rate",
            32,
            "--out",
            tmp_path / "runs",
        )
    )
    assert meter.code == 2 and "no serial port" in " ".join(meter.err.split())
    with pytest.raises(InputError, match="no serial port"):
        device_of(f"ASRL{no_port}::INSTR")
    with pytest.raises(InstrumentError, match="no serial port"):
        SerialLink(str(no_port))
    with pytest.raises(InstrumentError, match="no serial port"):
        SerialPort(str(no_port), PortSettings())
    assert str(no_port) not in opened and not (tmp_path / "runs").exists()


@pytest.mark.parametrize(
    "resource",
    [
        "ASRLspy:///dev/ttyUSB0?file=/x::INSTR",
        "ASRLloop://::INSTR",
        "ASRLhwgrep://.*::INSTR",
        "PRLGX-ASRL::/dev/ttyUSB0::INTFC",
        "PXI0::1::INSTR",
        "VICP::lab::INSTR",
        "GPIB0::22::INSTR\n",
        "GPIB0::22::INS TR",
    ],
)
def test_a_visa_resource_that_leads_to_no_meter_is_refused(resource: str) -> None:
    """pyvisa-py hands the port of ASRL to pyserial, with all of its URLs."""
    with pytest.raises(InputError, match="neither a VISA resource"):
        device_of(resource)


@pytest.mark.parametrize(
    "resource",
    [
        "GPIB0::22::INSTR",
        "gpib::22",
        "TCPIP::lab-7::5025::SOCKET",
        "TCPIP0::lab-7::gpib0,22::INSTR",
        "USB0::0x0957::0x0718::MY12::INSTR",
        "ASRL3::INSTR",
        "ASRL/dev/not-plugged-in::INSTR",
    ],
)
def test_a_visa_resource_with_a_meter_is_taken(resource: str) -> None:
    assert device_of(resource)


def test_bytes_come_through_a_socket() -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            link, _ = server.accept()
            with link, suppress(OSError):  # until the other side has gone
                while not select.select([link], [], [], 0.01)[0]:
                    link.sendall(b"0.25\r\n")  # what came before the port is open is dropped

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        lines = {
            "model": "X1",
            "rate": 100,
            "lines": {"columns": [{"name": "gz", "column": 0, "unit": "deg/s"}]},
        }
        device = SerialImu(f"socket://127.0.0.1:{server.getsockname()[1]}", Description.of(lines))
        device.open()
        device.start()
        assert set(device.read(60.0).values[:, 0]) == {0.25}
        device.close()


def test_what_a_description_may_ask_of_the_port_is_bounded() -> None:
    for wrong in (
        {"start": [{"text": "x" * 2000}]},
        {"start": [{"text": "x"}] * 100},
        {"stop": [{"hex": "00" * 2000}]},
        {"identity": {"ask": {"text": "ID?"}, "answer": "(?P<serial>" + "x" * 300 + ")"}},
        {"model": "x" * 300},
    ):
        with pytest.raises(FormatError):
            Description.of({**IMU, **wrong})
