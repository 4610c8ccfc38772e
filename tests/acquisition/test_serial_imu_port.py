# SPDX-License-Identifier: BSD-3-Clause
"""A described device on a port: the conversation on the wire, and a device on a pseudo-terminal that misbehaves."""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from allanite.acquisition.capture.numbering import BlockNumbering
from allanite.acquisition.instruments import Block, Flag, Instrument, InstrumentTimeout
from allanite.acquisition.instruments.serial_imu import Description, SerialImu, driver
from allanite.acquisition.instruments.serial_imu.encoding import Encoder
from allanite.acquisition.instruments.serial_imu.faults import ImuFault, noise
from allanite.acquisition.instruments.serial_imu.layout import PortSettings
from allanite.acquisition.instruments.serial_imu.simulator import SimulatedImu
from allanite.errors import InputError, InstrumentError
from recorded_instruments import SWIFT, keep_pace
from virtual_imu import VirtualPort, follow
from virtual_meter import SECOND, VirtualClock

FRAME: dict[str, Any] = {
    "header": "A5 5A",
    "length": 28,
    "counter": {"at": 2, "type": "u16"},
    "fields": [
        {"name": f"ch{i}", "at": 4 + 3 * i, "type": "i24", "unit": "deg/s", "scale": 1e-4} for i in range(6)
    ],
    "checksum": {"kind": "crc32", "from": 2},
}


def imu(rate: float = 1000.0, *, frame: dict[str, Any] | None = None, **others: Any) -> Description:
    return Description.of({"model": "X1", "rate": rate, "frame": {**FRAME, **(frame or {})}, **others})


class Wire:
    """A port that plays what was written down, and keeps what was sent."""

    def __init__(self, *script: bytes | Exception) -> None:
        self.script, self.sent, self.closed = list(script), b"", 0

    def __call__(self, name: str, settings: PortSettings) -> Wire:
        self.opened = name, settings.baud
        return self

    def read(self, timeout: float) -> bytes:
        if not self.script:
            time.sleep(min(timeout, 0.01))
            return b""
        said = self.script.pop(0)
        if isinstance(said, Exception):
            raise said
        return said

    def write(self, payload: bytes) -> None:
        self.sent += payload

    def close(self) -> None:
        self.closed += 1

    def usb_serial_number(self) -> str:
        return "USB7"


def frames(described: Description, first: int, count: int) -> bytes:
    encoder, values = Encoder(described), noise(len(described.channels))(first, count)
    return b"".join(encoder.encode(first + i, row) for i, row in enumerate(values))


def collect(device: SerialImu, enough: Callable[[list[Block]], bool], seconds: float = 60.0) -> list[Block]:
    """Blocks until there are enough; silence and a port that is gone are borne as the capture does."""
    blocks: list[Block] = []
    deadline = time.monotonic() + seconds
    while not enough(blocks) and time.monotonic() < deadline:
        try:
            blocks.append(device.read(0.1))
        except InstrumentTimeout:
            continue
        except InstrumentError:
            device.close()
            while time.monotonic() < deadline:
                try:
                    device.open()
                    device.start()
                    break
                except InstrumentError:
                    time.sleep(0.02)
    return blocks


def read_to_the_end(device: SerialImu, blocks: list[Block]) -> None:
    while True:
        blocks.append(device.read(10.0))


def samples(blocks: list[Block]) -> int:
    return sum(len(block) for block in blocks)


def assert_true(blocks: list[Block], described: Description, until: int) -> np.ndarray:
    """Every value is that of its number; returns the numbers, of which the first is that of the source."""
    values = np.concatenate([b.values for b in blocks])
    counter = np.concatenate([b.counter for b in blocks if b.counter is not None])
    source = noise(len(described.channels))(0, until)
    offset = next(i for i in range(until) if np.allclose(source[i], values[0], atol=6e-5))
    counter = counter + offset
    assert (np.diff(counter) > 0).all()
    np.testing.assert_allclose(values, source[counter], atol=6e-5)
    return counter


# -- the conversation ----------------------------------------------------------------------------------------


def test_the_conversation_of_a_normal_course() -> None:
    described = imu(
        maker="M",
        port={"baud": 460_800},
        start=[{"text": "GO\r\n"}],
        stop=[{"hex": "1B 00"}],
        identity={"ask": {"text": "ID?\r\n"}, "answer": r"SN (?P<serial>\w+) FW (?P<firmware>\S+)"},
    )
    wire = Wire(frames(described, 0, 1), b"SN 00", b"12 FW 1.3\r\n", frames(described, 0, 2), b"")
    device = SerialImu("/dev/ttyX", described, gather=0.0, connect=wire)
    assert isinstance(device, Instrument)
    identity = device.open()
    assert (identity.maker, identity.model, identity.serial, identity.firmware) == ("M", "X1", "0012", "1.3")
    device.start()
    block = device.read(1.0)
    assert block.counter is not None and block.counter.tolist() == [0, 1] and block.remarks == ()
    device.stop()
    device.close()
    device.close()
    assert wire.sent == b"ID?\r\nGO\r\n\x1b\x00" and wire.closed == 1 and not wire.script[1:]
    assert wire.opened == ("/dev/ttyX", 460_800)
    assert device.settings["line"] == described.port.model_dump()
    assert Description.of(device.settings["description"]) == described  # type: ignore[arg-type]


def test_no_answer_is_an_error_and_gives_the_port_back() -> None:
    question = {"ask": {"text": "ID?"}, "answer": r"SN (?P<serial>\w+)", "seconds": 0.05}
    wire = Wire(b"hello")
    with pytest.raises(InstrumentError, match=r"no answer .* 115200 baud"):
        SerialImu("/dev/ttyX", imu(identity=question), connect=wire).open()
    assert wire.closed == 1


def test_without_a_question_the_adapter_says_who_it_is() -> None:
    assert SerialImu("p", imu(), connect=Wire()).open().serial == "USB7"
    assert SerialImu("p", imu(serial="12"), connect=Wire()).open().serial == "12"


def test_silence_and_garbage_are_two_kinds_of_timeout() -> None:
    device = SerialImu("p", imu(), connect=Wire())
    with pytest.raises(InstrumentError, match="not open"):
        device.read(0.1)
    device.open()
    with pytest.raises(InstrumentTimeout, match=r"no data within 0\.05 s"):
        device.read(0.05)
    device = SerialImu("p", imu(), connect=Wire(b"\xa5\x5a" * 100))
    device.open()
    with pytest.raises(InstrumentTimeout, match=r"200 bytes arrived .* wrong checksum.* and the baud rate"):
        device.read(0.05)


def test_frames_that_wait_for_proof_are_not_blamed_on_the_description() -> None:
    described = imu(100.0)
    wire = Wire(frames(described, 500, 10))
    device = SerialImu("p", described, gather=0.0, connect=wire)
    device.open()
    device.read(0.1)
    wire.script = [frames(described, 0, 40)]
    with pytest.raises(
        InstrumentTimeout, match="the counter jumped back, and 40 frames wait for proof that the"
    ):
        device.read(0.05)


def test_lines_with_another_number_of_cells_are_named() -> None:
    """A separator at the end of each line makes one cell more. The first line may be half of one."""
    columns = [{"name": "v", "column": 0, "unit": "V"}]
    for cells, ends in ((1, True), (2, False)):
        lines = {"separator": ";", "decimal": ",", "cells": cells, "columns": columns}
        described = Description.of({"model": "T", "rate": 50, "lines": lines})
        device = SerialImu("p", described, gather=0.0, connect=Wire(b"1,5;\r\n2,5;\r\n3,5;\r\n"))
        device.open()
        if not ends:
            assert device.read(0.05).values[:, 0].tolist()[-2:] == [2.5, 3.5]
            continue
        with pytest.raises(InstrumentTimeout, match="2 with another number of cells than described"):
            device.read(0.05)


def test_who_interrupts_is_heard_while_a_sample_is_waited_for(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = VirtualClock()
    follow(clock, monkeypatch)
    device = SerialImu("ttyX", imu(), connect=VirtualPort(imu(), clock, total=0))
    device.open()
    device.start()
    device.interrupt()
    began = clock.ns
    with pytest.raises(InstrumentTimeout):
        device.read(40.0)
    assert (clock.ns - began) / SECOND == pytest.approx(driver._SLICE)
    device.start()
    with pytest.raises(InstrumentTimeout, match=r"within 40 s"):
        device.read(40.0)
    assert (clock.ns - began) / SECOND == pytest.approx(driver._SLICE + 40.0)


def test_what_went_wrong_is_said_once() -> None:
    described = imu()
    sent = frames(described, 0, 2)
    device = SerialImu(
        "p", described, gather=0.0, connect=Wire(sent + b"???" + sent[28:], frames(described, 4, 1), b"")
    )
    device.open()
    first = device.read(0.1)
    assert first.remarks == (
        "skipped 3 bytes outside complete frames",
        "dropped 1 frame received twice",
    )
    second = device.read(0.1)
    assert second.remarks == ("the counter jumped 1 time: 2 samples missing",)
    assert second.flags.tolist() == [Flag.RESYNC]


def test_half_a_frame_is_given_up_when_the_rest_does_not_come(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("allanite.acquisition.instruments.serial_imu.driver._PATIENCE", (20, 0.1))
    described = imu(frame={"counter": {"at": 2, "type": "u8"}})
    sent = frames(described, 0, 3)
    wire = Wire(sent[:40])
    device = SerialImu("p", described, gather=0.0, connect=wire)
    device.open()
    assert len(device.read(0.1)) == 1
    with pytest.raises(InstrumentTimeout):
        device.read(0.2)
    wire.script = [sent[56:]]
    block = device.read(0.1)
    assert len(block) == 1 and block.flags.tolist() == [Flag.RESYNC] and "12 bytes" in block.remarks[0]


@pytest.mark.parametrize(("modulus", "away"), [(256, 700), (65_536, 700), (256, 100), (256, 512)])
def test_the_clock_tells_how_often_the_counter_turned(
    modulus: int, away: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    described = imu(1000.0, frame={"counter": {"at": 2, "type": "u16", "modulus": modulus}})
    wire = Wire(frames(described, 0, 10))
    now = [0]
    monkeypatch.setattr("allanite.acquisition.instruments.serial_imu.driver.host_ns", lambda: now[0])
    device = SerialImu("p", described, gather=0.0, connect=wire)
    device.open()
    assert device.read(0.1).counter is not None
    now[0] += away * 1_000_000 + 3_000_000  # the host is three milliseconds late
    wire.script = [frames(described, 10 + away, 6)]
    block = device.read(0.1)
    assert block.counter is not None
    assert block.counter.tolist() == list(range(10 + away, 16 + away))
    assert block.flags.tolist() == [Flag.RESYNC, 0, 0, 0, 0, 0]
    back = away % modulus > modulus // 2
    jumped = "the counter jumped back 1 time (a restart, or a wrap)"
    assert block.remarks == (jumped if back else f"the counter jumped 1 time: {away} samples missing",)


@pytest.mark.parametrize("kept", [0.0, 0.5, 1.0])
@pytest.mark.parametrize("seed", range(5))
def test_without_a_counter_a_silence_is_a_gap_by_the_clock(
    seed: int, kept: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Any rate, silence and late host; of what the silence held the link keeps nothing, a half or all."""
    draw = np.random.default_rng([seed, round(2 * kept)])
    rate, silence = float(draw.choice([50.0, 100.0, 400.0])), float(draw.uniform(0.7, 1.95))
    own = rate * (1 + draw.uniform(-0.005, 0.005))  # of the device, which is not quite the nominal one
    described = imu(rate, frame={"counter": None, "length": 28})
    monkeypatch.setattr("allanite.acquisition.instruments.serial_imu.driver._BURST", 0.0)
    now = [0]
    monkeypatch.setattr("allanite.acquisition.instruments.serial_imu.driver.host_ns", lambda: now[0])
    wire = Wire()
    device, numbering = SerialImu("p", described, gather=0.0, connect=wire), BlockNumbering(rate)
    device.open()
    missed, gaps, at, number = 0, [], 0.0, 0
    for k in range(24):
        size = max(round(0.1 * rate), 1)
        if k == 16:
            lost = round(silence * own)
            missed = lost - round(kept * lost)
            size += lost
        number += size
        at = number / own
        wire.script = [frames(described, 0, size - (missed if k == 16 else 0))]
        now[0] = 10**12 + round((at + 0.003 * draw.random()) * 1e9)
        block = device.read(0.01)
        gaps += numbering.take(block, block.received_ns).gaps
    if not missed:
        assert gaps == []
        return
    (gap,) = gaps
    assert gap.uncertainty is not None and gap.uncertainty < 0.02 * rate + 2
    assert gap.samples == pytest.approx(missed, abs=4 * gap.uncertainty)
    assert gap.counter == 16 * max(round(0.1 * rate), 1)
    assert "without a counter" in gap.reason


def test_the_clock_tells_how_long_a_device_was_away_that_began_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    described = imu(100.0)
    wire = Wire(frames(described, 40_000, 10))
    now = [0]
    monkeypatch.setattr("allanite.acquisition.instruments.serial_imu.driver.host_ns", lambda: now[0])
    device = SerialImu("p", described, gather=0.0, connect=wire)
    device.open()
    device.read(0.1)
    device.close()
    now[0] += 5_000_000_000
    wire.script = [frames(described, 0, 3)]
    device.open()
    block = device.read(0.1)
    assert block.counter is not None and block.counter.tolist() == [507, 508, 509]  # the third came at 5 s
    assert block.flags.tolist() == [Flag.RESYNC, 0, 0]


def test_a_late_host_moves_no_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    described = imu(1000.0)
    wire = Wire(frames(described, 0, 10))
    now = [0]
    monkeypatch.setattr("allanite.acquisition.instruments.serial_imu.driver.host_ns", lambda: now[0])
    device = SerialImu("p", described, gather=0.0, connect=wire)
    device.open()
    device.read(0.1)
    now[0] += 2_000_000_000  # two seconds late, and only a short gap: the rest waits in the adapter
    wire.script = [frames(described, 12, 3)]
    block = device.read(0.1)
    assert block.counter is not None and block.counter.tolist() == [12, 13, 14]


# -- a device on a pseudo-terminal ---------------------------------------------------------------------------


def test_a_device_on_a_pseudo_terminal_is_read_without_loss() -> None:
    described = imu(2000.0, start=[{"text": "GO"}], stop=[{"text": "HALT"}])
    with SimulatedImu(described, total=1000) as device:
        sensor = SerialImu(device.port, described)
        sensor.open()
        with pytest.raises(InstrumentTimeout):
            sensor.read(0.05)
        sensor.start()
        blocks = collect(sensor, lambda found: samples(found) >= 1000)
        sensor.stop()
        sensor.close()
    assert assert_true(blocks, described, 1000).tolist() == list(range(1000))
    assert sensor.tally.frames == 1000 and sensor.tally.skipped == 0
    assert all(block.remarks == () for block in blocks)


def test_a_device_that_does_everything_wrong_gives_no_wrong_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    described = imu(SWIFT, start=[{"text": "GO"}])
    faults = (
        ImuFault(kind="garbage", at=100, size=300),
        ImuFault(kind="partial", at=200, size=11),
        ImuFault(kind="doubled", at=300),
        ImuFault(kind="replayed", at=400, size=8),
        ImuFault(kind="flipped", at=500, size=99),
        ImuFault(kind="lost", at=600, size=20),
        ImuFault(kind="pause", at=800, seconds=0.01),
    )
    with SimulatedImu(described, faults=faults, total=1600, speed=0.1) as device:
        keep_pace(monkeypatch, device)
        sensor = SerialImu(device.port, described)
        sensor.open()
        sensor.start()
        blocks = collect(sensor, lambda found: samples(found) >= 1600 - 2 - 20 - 200)
        sensor.close()
    counter = assert_true(blocks, described, 1600)
    assert sorted(set(range(1600)) - set(counter.tolist())) == [200, 500, *range(600, 620), *range(800, 1000)]
    assert (sensor.tally.doubled, sensor.tally.stale) == (
        2,
        7,
    )  # of eight replayed, the last one was the last
    assert sensor.tally.lost == 222


def test_a_device_that_disappears_and_comes_back_goes_on_with_its_count(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    described = imu(
        SWIFT,
        start=[{"text": "GO"}],
        identity={"ask": {"text": "ID?"}, "answer": r"SN (?P<serial>\w+) ", "seconds": 60},
    )
    faults = (ImuFault(kind="vanish", at=150, seconds=0.2, serial="2"),)  # 4000 samples
    back = threading.Event()
    with SimulatedImu(described, faults=faults, total=4400, serial="1", speed=0.05) as device:
        keep_pace(monkeypatch, device, back=back)
        sensor = SerialImu(device.port, described, gather=0.02)
        assert sensor.open().serial == "1"
        sensor.start()
        before = [sensor.read(10.0)]
        with pytest.raises(InstrumentError, match="ttyIMU disappeared"):
            read_to_the_end(sensor, before)
        sensor.close()
        with pytest.raises(InstrumentError, match="cannot be opened"):
            sensor.open()
        back.set()
        after = collect(sensor, lambda found: samples(found) >= 250)
        assert sensor.open().serial == "2"
        sensor.close()
    counter = assert_true(before + after, described, 4400)
    assert counter.tolist() == [*range(150), *range(4150, 4400)]
    flags = np.concatenate([block.flags for block in after])
    assert flags[0] == Flag.RESYNC and not flags[1:].any()


def test_a_second_program_is_refused() -> None:
    described = imu(100.0)
    with SimulatedImu(described) as device:
        first = SerialImu(device.port, described)
        first.open()
        with pytest.raises(InstrumentError, match="cannot be opened"):
            SerialImu(device.port, described).open()
        first.close()


def test_no_port() -> None:
    with pytest.raises(InstrumentError, match=r"/dev/ttyNONE cannot be opened: .*Is the device connected"):
        SerialImu("/dev/ttyNONE", imu()).open()
    with pytest.raises(InputError, match="speed"):
        SimulatedImu(imu(), speed=0.0)


def test_as_fast_as_it_is_read() -> None:
    described = imu(1000.0, start=[{"text": "GO"}])
    with SimulatedImu(described, speed=math.inf, total=3000) as device:
        sensor = SerialImu(device.port, described)
        sensor.open()
        sensor.start()
        blocks = collect(sensor, lambda found: samples(found) >= 3000)
        sensor.close()
    assert assert_true(blocks, described, 3000).tolist() == list(range(3000))
