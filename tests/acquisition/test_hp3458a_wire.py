# SPDX-License-Identifier: BSD-3-Clause
"""The conversation with the 3458A as bytes on the wire, in both directions: the normal course and each fault."""

from __future__ import annotations

import itertools
import re
import sys
import time
import types
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from allanite.acquisition.instruments import Block, Flag, Identity, Instrument, InstrumentTimeout
from allanite.acquisition.instruments.hp3458a import HP3458A, MeterSettings, conversation, driver, prologix
from allanite.acquisition.instruments.hp3458a.prologix import PrologixTransport, escaped
from allanite.acquisition.instruments.hp3458a.simulated_meter import (
    MeterFault,
    SimulatedIdentity,
    SimulatedMeter,
    counting,
)
from allanite.acquisition.instruments.hp3458a.simulator import MeterSimulator
from allanite.acquisition.instruments.hp3458a.transports import Transport, open_transport
from allanite.errors import InputError, InstrumentError
from virtual_meter import SECOND, virtual_adapter, virtual_link, virtual_wire

QUERIES = [
    "END?",
    "INBUF?",
    "TARM?",
    "FUNC?",
    "APER?",
    "NPLC?",
    "AZERO?",
    "DELAY?",
    "MATH?",
    "DISP?",
    "LFREQ?",
    "MEM?",
    "OFORMAT?",
    "TRIG?",
    "TIMER?",
    "NRDGS?",
    "ISCALE?",
    "TEMP?",
]


#: A read that waits longer failed: no host is that busy [s].
PATIENT = 60.0


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PYVISA_LIBRARY", "@py")  # else it looks for the makers' libraries each time
    monkeypatch.setattr(conversation, "QUIET", 0.02)
    monkeypatch.setattr(prologix, "READ_TIMEOUT_MS", 30)
    monkeypatch.setattr(prologix, "MARGIN", 0.03)


@contextmanager
def meter(
    settings: MeterSettings, *, door: str = "socket", speed: float | None = 1.0, **simulated
) -> Iterator:
    """A simulator and a driver that is not yet open."""
    with MeterSimulator(SimulatedMeter(speed=speed, **simulated), door) as simulator:
        instrument = HP3458A(simulator.resource, settings, speed=speed)
        try:
            yield simulator, instrument
        finally:
            instrument.close()


def joined(blocks: list[Block]) -> tuple[np.ndarray, np.ndarray, np.ndarray, tuple[str, ...]]:
    return (
        np.concatenate([b.values[:, 0] for b in blocks]),
        np.concatenate([b.counter for b in blocks]),
        np.concatenate([b.flags for b in blocks]),
        sum((b.remarks for b in blocks), ()),
    )


def read_until(instrument: HP3458A, counter: int) -> list[Block]:
    """Blocks until a reading with this number came."""
    blocks: list[Block] = []
    while not (blocks and len(blocks[-1]) and blocks[-1].counter[-1] >= counter):
        blocks.append(instrument.read(PATIENT))
    return blocks


def arrived(simulator: MeterSimulator, end: bytes) -> None:
    """Wait until these bytes were heard last."""
    deadline = time.monotonic() + PATIENT
    while not simulator.heard.endswith(end) and time.monotonic() < deadline:
        time.sleep(0.002)


def started(transport: Transport, settings: MeterSettings) -> HP3458A:
    """A driver of this transport whose meter measures."""
    instrument = HP3458A(lambda: transport, settings)
    instrument.open()
    instrument.start()
    return instrument


def opened_again(instrument: HP3458A) -> Identity:
    """Who answers when the meter is back."""
    deadline = time.monotonic() + PATIENT
    while True:
        try:
            return instrument.open()
        except InstrumentError:
            if time.monotonic() > deadline:
                raise
            time.sleep(0.01)


def open_files() -> int:
    return sum(1 for _ in Path("/proc/self/fd").iterdir())


def microvolts(values: np.ndarray) -> list[int]:
    """Numbers of the readings, which the simulator sends as microvolts; -1 for NaN."""
    return [-1 if np.isnan(v) else round(v * 1e6) for v in values]


# ---- the normal course -----------------------------------------------------------------------------------------------


def test_every_byte_of_the_normal_course_through_pyvisa():
    with meter(MeterSettings(rate=100, nplc=0.25, readings_per_arm=1000), speed=None) as (
        simulator,
        instrument,
    ):
        identity = instrument.open()
        instrument.start()
        blocks = read_until(instrument, 19)
        instrument.stop()
        arrived(simulator, b"PRESET NORM;END ALWAYS\n")
        heard = bytes(simulator.heard)
    number = int(heard.partition(b"NRDGS ")[2].partition(b",")[0])
    agreed = [f"NRDGS {number},AUTO", "NRDGS?", "TRIG AUTO;TIMER 0.01;NRDGS 1000,TIMER"]
    setting = [
        "TARM HOLD;TRIG HOLD",
        "RESET",
        "PRESET NORM;END ALWAYS;INBUF ON;TARM HOLD",
        *agreed,
        *["ID?", "REV?", "CALNUM?", "CALSTR?", "ERR?"],
        "LFREQ LINE;DCV 10;NPLC 0.25;AZERO OFF;DELAY 0;MATH OFF;DISP OFF",
        "MEM OFF;OFORMAT ASCII",
        "TRIG AUTO;TIMER 0.01;NRDGS 1000,TIMER",
        "ERRSTR?",
        *(q for q in QUERIES if q not in ("APER?", "NPLC?")),
        "TARM SGL,1",
    ]
    at = setting.index("AZERO?")
    setting[at:at] = ["NPLC?", "APER?"]  # what was set first, what follows from it after
    stop = ["TARM HOLD;TRIG HOLD", "PRESET NORM;END ALWAYS"]
    assert heard == (
        b"\x03"
        + "".join(f"{line}\n" for line in setting).encode()
        + b"\x03"
        + "".join(f"{line}\n" for line in stop).encode()
    )
    said = bytes(simulator.said)
    assert said.startswith(
        b"%d,1\r\n" % number + b'HP3458A\r\n9,2\r\n104\r\n"simulated"\r\n0\r\n0,"NO ERROR"\r\n2\r\n1\r\n4\r\n'
    )
    assert b"\r\n36.4\r\n+0.00000000E+00\r\n+1.00000000E-06\r\n+2.00000000E-06\r\n" in said
    assert (identity.model, identity.serial, identity.firmware) == ("3458A", "CALNUM 104 simulated", "9,2")
    values, counter, flags, remarks = joined(blocks)
    assert microvolts(values) == counter.tolist() == list(range(len(values)))
    assert not flags.any() and not remarks


def test_what_was_set_is_stored_as_read_back():
    with meter(MeterSettings(rate=32)) as (_, instrument):
        assert isinstance(instrument, Instrument)
        instrument.open()
    stored = instrument.settings
    assert stored["aperture"] == pytest.approx(0.02) and stored["nplc"] == 1.0
    assert stored["period"] == 0.03125 and stored["aliasing_factor"] == pytest.approx(1.25)
    assert stored["autozero"] == 0.0 and stored["mains_hz"] == 50.0
    assert "temperature_c" not in stored  # it is no setting: a fact of the first block
    assert stored["function"] == (1.0, 10.0) and stored["readings"] == (16777215.0, 6.0)
    assert "TRIG AUTO;TIMER 0.03125;NRDGS 16777215,TIMER" in stored["sent"]
    assert instrument.rate == 32.0
    assert (
        instrument.channels[0].aperture == pytest.approx(0.02) and instrument.channels[0].sampling == "mean"
    )


@pytest.mark.parametrize("door", ["prologix", "prologix-serial"])
def test_integers_of_every_byte_pass_the_adapter(door):
    # Line ends, ESC and + among them; each reading is one message.
    scale = float(f"{5 * 10 / 2**31:.9E}")
    special = np.array(
        [0x0A0D1B2B, 0x0B0A0A0A, 0x0D0D0D0D, 0x1B1B1B1B, 0x002B2B0A, 0x0000000A], dtype=np.int64
    )

    def signal(index):
        return special[index % len(special)] * scale

    with meter(MeterSettings(rate=400, readings_per_arm=40), door=door, speed=None, signal=signal) as (
        sim,
        instrument,
    ):
        instrument.open()
        instrument.start()
        values, counter, flags, remarks = joined(read_until(instrument, 39))
        after_arming = sim.heard.partition(b"TARM SGL,1\n")[2]
        assert after_arming.startswith(b"++read eoi\n" * 40), "one read for each reading"
    np.testing.assert_array_equal(np.round(values / scale), special[np.arange(40) % 6])
    assert counter.tolist() == list(range(40)) and not flags.any() and not remarks


def test_the_adapter_is_set_up_and_what_it_would_swallow_is_escaped():
    assert escaped(b"a\rb\nc\x1bd+e") == b"a\x1b\rb\x1b\nc\x1b\x1bd\x1b+e"
    with MeterSimulator(SimulatedMeter(), "prologix") as simulator:
        link = open_transport(simulator.resource)
        link.write(b"ID?")
        assert link.read_line(1.0) == b"HP3458A\r\n"
        link.write(b"++addr 5")  # a message, not an order
        link.clear()
        link.close()
        arrived(simulator, b"++clr\n")
        heard = bytes(simulator.heard)
    assert heard == (
        b"\n++ver\n++ver\n++savecfg 0\n++mode 1\n++auto 0\n++addr 22\n++eos 2\n++eoi 1\n++eot_enable 0\n"
        b"++read_tmo_ms 30\nID?\n++read eoi\n\x1b+\x1b+addr 5\n++clr\n"
    )
    assert simulator.meter.executed == ["ID?", "++ADDR 5"]


def test_an_ar488_is_not_told_to_save_its_settings():
    with MeterSimulator(
        SimulatedMeter(), "prologix", version=b"AR488 GPIB controller, ver. 0.51.29"
    ) as simulator:
        open_transport(simulator.resource).close()
        arrived(simulator, b"++read_tmo_ms 30\n")
    assert b"savecfg" not in simulator.heard and b"++mode 1" in simulator.heard


def test_the_meter_is_armed_again_before_its_counter_ends():
    with meter(MeterSettings(rate=400, readings_per_arm=50), speed=None) as (simulator, instrument):
        instrument.open()
        instrument.start()
        blocks = read_until(instrument, 60)
    values, counter, flags, remarks = joined(blocks)
    assert counter[:53].tolist() == [*range(50), 51, 52, 53], "one reading at least is gone in the pause"
    assert microvolts(values[:53]) == list(range(53))
    assert flags[50] == Flag.RESYNC and not np.delete(flags, 50).any()
    assert len(remarks) == 1 and "counter of 50 readings was full" in remarks[0]
    assert [b.facts for b in blocks if b.facts] == [{"temperature_c": 36.4}] * 2
    conversation = bytes(simulator.heard)
    again = "AZERO ONCE\nNRDGS [0-9]{7},AUTO\nNRDGS[?]\nTRIG AUTO;TIMER 0.0025;NRDGS 50,TIMER\n"
    again += "".join(f"{q[:-1]}[?]\n" for q in QUERIES) + "TARM SGL,1\n"
    assert len(re.findall(again.encode(), conversation)) == 1


def test_a_meter_left_measuring_by_another_program_is_stopped_first():
    with meter(MeterSettings(rate=200), door="prologix") as (simulator, instrument):
        instrument.open()
        instrument.start()
        instrument.read(PATIENT)
        instrument.close()
        other = HP3458A(simulator.resource, MeterSettings(rate=100))
        other.open()
        assert not simulator.meter.measuring
        other.start()
        assert len(other.read(PATIENT)) and other.settings["timer"] == 0.01
        other.close()


# ---- faults of readings ----------------------------------------------------------------------------------------------


# In a time that is only counted: what is missing is told by the clock, and a busy host must not have a say in a test.


FAULTS = [
    MeterFault(at=5, kind="overload"),
    MeterFault(at=12, kind="partial"),
    MeterFault(at=18, kind="garbage", data=b"\xff\x00#\r\n"),
    MeterFault(at=30, kind="delay", seconds=0.15),  # all of it comes afterwards, and nothing is to be said
    MeterFault(at=63, kind="doubled"),
]


def assert_faults_were_said(said: bytes) -> None:
    assert b"+1.00000000E+38\r\n" in said and b"\r\n+1.20\r\n" in said and b"\r\n\xff\x00#\r\n" in said
    assert said.count(b"+6.30000000E-05\r\n") == 2


def test_faults_of_readings_are_rejected_counted_and_marked():
    with virtual_wire(signal=counting, faults=FAULTS) as wire:
        values, counter, flags, remarks = joined(read_until(started(wire, MeterSettings(rate=50)), 65))
        assert_faults_were_said(bytes(wire.said))
    expected = [k for k in range(len(counter) + 1) if k != 12]
    assert counter.tolist() == expected
    assert microvolts(values) == [-1 if k == 5 else k for k in expected]
    assert flags[5] == Flag.OVERLOAD
    assert flags[12] == Flag.RESYNC, "the reading after the one cut off"
    assert flags[17] == Flag.RESYNC, "the reading after garbage"
    assert np.count_nonzero(flags) == 3
    assert remarks == (
        "rejected b'+1.20', which is not a reading of the 10 V range",
        "rejected b'\\xff\\x00#', which is not a reading of the 10 V range",
        "1 reading came twice; kept once",
    )


def test_silence_is_a_timeout_each_time_and_no_reading_is_repeated():
    faults = [MeterFault(at=30, kind="silence", seconds=0.4)]
    with virtual_wire(signal=counting, faults=faults) as wire:
        instrument = started(wire, MeterSettings(rate=100))
        blocks, silences = [], 0
        while silences < 2 or len(blocks) < 6:
            try:
                blocks.append(instrument.read(0.05))
            except InstrumentTimeout:
                silences += 1
    values, counter, flags, remarks = joined(blocks)
    numbers = microvolts(values)
    assert len(set(numbers)) == len(numbers) and numbers == sorted(numbers)
    assert numbers[29:31] == [29, 70]
    assert counter.tolist() == numbers, "the clock says how many were lost"
    assert remarks == ("40 readings did not come while it was silent",)
    assert flags[30] == Flag.RESYNC and np.count_nonzero(flags) == 1


def test_faults_of_readings_come_through_a_socket():
    """As fast as they are read: without a clock a rejected line counts as a reading, and one that came twice as two."""
    with meter(MeterSettings(rate=50), speed=None, faults=FAULTS) as (simulator, instrument):
        instrument.open()
        instrument.start()
        values, counter, flags, remarks = joined(read_until(instrument, 70))
    assert_faults_were_said(bytes(simulator.said))
    sent = [*range(64), *range(63, len(counter) + 1)]
    assert microvolts(values) == [-1 if k == 5 else k for k in sent if k != 12][: len(values)]
    assert counter.tolist() == [k for k in range(len(counter) + 2) if k not in (12, 18)]
    assert {int(k): int(flags[k]) for k in np.flatnonzero(flags)} == {
        5: Flag.OVERLOAD,
        12: Flag.RESYNC,
        17: Flag.RESYNC,
    }
    assert remarks == (
        "rejected b'+1.20', which is not a reading of the 10 V range",
        "rejected b'\\xff\\x00#', which is not a reading of the 10 V range",
    )


def test_a_busy_host_that_stands_still_again_and_again_loses_count_of_nothing():
    with virtual_wire(signal=counting) as wire:
        wire.late = 5e-3  # a quarter of a period on average, and more than half of one in one read of seven
        instrument = started(wire, MeterSettings(rate=50))
        blocks = [instrument.read(1.0) for _ in range(12)]
        for _ in range(100):
            wire.clock.pass_by(0.4)
            blocks += [instrument.read(1.0) for _ in range(3)]
    values, counter, flags, remarks = joined(blocks)
    assert counter.tolist() == microvolts(values) == list(range(len(counter)))
    assert not flags.any() and not remarks


def test_a_slow_host_behind_an_adapter_loses_readings_and_the_counter_says_so():
    with virtual_adapter() as (transport, clock):
        instrument = started(transport, MeterSettings(rate=100))
        blocks = [instrument.read(1.0) for _ in range(2)]
        clock.pass_by(0.6)
        blocks += [instrument.read(1.0) for _ in range(3)]
    values, counter, _, remarks = joined(blocks)
    numbers = microvolts(values)
    assert counter.tolist() == numbers
    assert np.count_nonzero(np.diff(numbers) > 1) == 1 and np.diff(numbers).max() > 55
    assert sum("did not come" in r for r in remarks) == 1


def test_who_interrupts_is_heard_while_a_slow_reading_is_waited_for():
    with virtual_wire(signal=counting) as wire:
        instrument = started(wire, MeterSettings(rate=0.05))
        began, read = wire.clock.ns, wire.read_bytes

        def interrupted(*arguments, **named):
            if wire.clock.ns - began >= 3 * SECOND:
                instrument.interrupt()
            return read(*arguments, **named)

        instrument._link = types.SimpleNamespace(read_bytes=interrupted, close=wire.close)
        with pytest.raises(InstrumentTimeout):
            instrument.read(40.0)
        with pytest.raises(InstrumentTimeout):
            instrument.read(40.0)
        assert 3.0 <= (wire.clock.ns - began) / SECOND < 3.0 + 3 * driver.SLICE


def test_a_byte_lost_on_the_way_brings_the_meter_to_rest_and_starts_it_anew():
    faults = [MeterFault(at=60, kind="lose_byte")]
    with meter(MeterSettings(rate=500), door="prologix-serial", speed=None, faults=faults) as (
        simulator,
        instrument,
    ):
        instrument.open()
        instrument.start()
        blocks = []
        while not any("armed again" in r for b in blocks for r in b.remarks):
            blocks.append(instrument.read(PATIENT))
        blocks.append(instrument.read(PATIENT))
        conversation = bytes(simulator.heard)
    values, counter, flags, remarks = joined(blocks)
    numbers = microvolts(values)
    resumed = int(np.flatnonzero(flags)[0])
    assert numbers[:resumed] == list(range(resumed)) and 30 < resumed <= 60
    assert numbers[resumed] > 60 and np.all(np.diff(numbers[resumed:]) == 1), "each once"
    assert flags[resumed] == Flag.RESYNC and counter[resumed] == counter[resumed - 1] + 2
    assert len(remarks) == 2 and "out of step" in remarks[0]
    assert b"++clr\nTARM HOLD;TRIG HOLD\n" in conversation.partition(b"TARM SGL,1\n")[2]


# ---- faults of the link ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("door", ["socket", "prologix"])
def test_the_link_breaks_and_another_meter_comes_back(door, monkeypatch):
    monkeypatch.setattr(driver, "NEAR", 0.05)  # pyvisa-py takes the end of a socket for silence
    other = SimulatedIdentity(calibrations=7, calibration="another")
    faults = [MeterFault(at=30, kind="drop", seconds=0.05, identity=other)]
    with meter(MeterSettings(rate=200), door=door, speed=None, faults=faults) as (_, instrument):
        before = instrument.open()
        instrument.start()
        blocks = []
        with pytest.raises(InstrumentError, match="link is gone"):  # noqa: PT012
            while True:
                blocks.append(instrument.read(PATIENT))
        instrument.close()
        after = opened_again(instrument)
        assert before.serial != after.serial == "CALNUM 7 another"
        instrument.start()
        blocks.append(instrument.read(PATIENT))
    values, counter, flags, _ = joined(blocks)
    assert microvolts(values) == list(range(len(counter)))
    assert counter.tolist() == [k for k in range(len(counter) + 1) if k != 30]
    assert flags[30] == Flag.RESYNC and np.count_nonzero(flags) == 1


@pytest.mark.parametrize("late_at", range(4))
@pytest.mark.parametrize("rate", [25, 100, 200])
def test_what_came_before_the_link_broke_is_given_however_late_the_host_is(rate, late_at):
    with virtual_link("socket", faults=[MeterFault(at=30, kind="drop")]) as link:
        instrument = started(link.connect(), MeterSettings(rate=rate))
        blocks = []
        with pytest.raises(InstrumentError, match="link is gone"):  # noqa: PT012
            for number in itertools.count():
                if number == late_at:
                    link.clock.pass_by(1.0)
                blocks.append(instrument.read(0.2))
    values, counter, _, remarks = joined(blocks)
    assert microvolts(values) == counter.tolist() == list(range(30)) and not remarks


def test_a_meter_that_lost_its_settings_is_not_started_again():
    with meter(MeterSettings(rate=100)) as (simulator, instrument):
        instrument.open()
        instrument.start()
        instrument.read(PATIENT)
        instrument.stop()
        simulator.meter.power_on()
        with pytest.raises(InstrumentError, match=r"settings did not take: .*AZERO"):
            instrument.start()


def test_stop_and_close_of_a_dead_link_raise_nothing():
    with meter(MeterSettings(rate=100), faults=[MeterFault(at=5, kind="drop", seconds=9)]) as (_, instrument):
        instrument.open()
        instrument.start()
        with pytest.raises(InstrumentError):  # noqa: PT012
            while True:
                instrument.read(0.2)
        instrument.stop()
        instrument.close()
        instrument.close()


@pytest.mark.parametrize(
    "fault, why",
    [
        (
            MeterFault(at="ID?", kind="answer", data=b"HP3478A\r\n"),
            "this is not a 3458A: ID[?] answers 'HP3478A'",
        ),
        (MeterFault(at="ID?", kind="answer"), "ID[?] got b'' and no end of line"),
        (MeterFault(at="ID?", kind="answer", data=b"HP34"), "ID[?] got b'HP34'"),
        (MeterFault(at="ERRSTR?", kind="answer", data=b'104,"TRIGGER TOO FAST"\r\n'), "TRIGGER TOO FAST"),
        (MeterFault(at="TIMER?", kind="answer", data=b"1.0\r\n"), "TIMER[?] answers 1 instead of 0.01"),
        (MeterFault(at="APER?", kind="answer", data=b"\xff\xff\r\n"), "clear the interface"),
    ],
)
def test_opening_refuses_what_is_not_as_it_must_be(fault, why):
    with virtual_wire(faults=[fault]) as wire, pytest.raises(InstrumentError, match=why):
        HP3458A(lambda: wire, MeterSettings(rate=100)).open()


def test_an_impossible_temperature_is_left_out_and_said():
    wrong = MeterFault(at="TEMP?", kind="answer", data=b" 1.00000000E+38\r\n")
    with virtual_wire(signal=counting, faults=[wrong]) as wire:
        first = started(wire, MeterSettings(rate=50)).read(1.0)
    assert first.facts == {}
    assert first.remarks == ("TEMP? answers 1e+38, which is impossible: -40 to 120; left out",)


@pytest.mark.parametrize("bad", [1e20, -13.0, 1e37])
def test_a_reading_beyond_the_scale_is_missing_and_said(bad):
    def signal(index):
        return np.where(index == 20, bad, counting(index))

    with virtual_wire(signal=signal) as wire:
        values, counter, flags, remarks = joined(read_until(started(wire, MeterSettings(rate=50)), 40))
    expected = [k for k in range(counter[-1] + 1) if k != 20]
    assert counter.tolist() == microvolts(values) == expected
    assert remarks == (f"rejected b'{bad:+.8E}', which is not a reading of the 10 V range",)
    assert np.flatnonzero(flags).tolist() == [20] and flags[20] == Flag.RESYNC


def test_an_old_meter_without_calstr_opens():
    with virtual_wire(identity=SimulatedIdentity(calibration="")) as wire:
        assert HP3458A(lambda: wire, MeterSettings(rate=100)).open().serial == "CALNUM 104"


# ---- resources -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("wrong", ["/dev/ttyUSB0", "prologix://host", "prologix://host/31", "nonsense"])
def test_what_is_no_resource_is_refused(wrong):
    with pytest.raises(InputError, match="prologix://"):
        open_transport(wrong)


@pytest.mark.parametrize(
    "nobody", ["TCPIP::127.0.0.1::1::SOCKET", "prologix://127.0.0.1:1/22", "prologix:///dev/no-such-port/22"]
)
def test_nobody_there(nobody):
    with pytest.raises(InstrumentError, match=r"127\.0\.0\.1|no-such-port"):
        HP3458A(nobody, MeterSettings(rate=32)).open()


@pytest.mark.parametrize(
    "package, resource", [("pyvisa", "GPIB0::22::INSTR"), ("serial", "prologix:///dev/ttyUSB0/22")]
)
def test_a_missing_extra_is_named_with_its_command(package, resource, monkeypatch):
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(InstrumentError, match=r'pip install "allanite\[instruments\]"'):
        open_transport(resource)


def test_an_adapter_that_does_not_answer():
    class Dead:
        def send(self, data): ...

        def receive(self, limit, timeout):
            return b""

        def close(self):
            self.closed = True

    link = Dead()
    with pytest.raises(InstrumentError, match=r"no answer to \+\+ver"):
        _without_waiting(PrologixTransport, link)
    assert link.closed


def _without_waiting(kind, link):
    wait, prologix.BOOT_WAIT = prologix.BOOT_WAIT, 0.001
    try:
        return kind(link, 22)
    finally:
        prologix.BOOT_WAIT = wait


def test_reading_before_the_start_is_refused():
    with pytest.raises(InputError, match="read before start"):
        HP3458A("GPIB0::22::INSTR", MeterSettings(rate=32)).read(1.0)


# ---- a week, a sample of it ------------------------------------------------------------------------------------------


def test_two_hundred_thousand_readings_as_fast_as_they_come():
    with meter(MeterSettings(rate=2000, readings_per_arm=150_001), speed=None) as (_, instrument):
        instrument.open()
        instrument.start()
        files = open_files()
        n, expected = 0, 0
        while n < 200_000:
            block = instrument.read(PATIENT)
            numbers = np.round(block.values[:, 0] * 1e6).astype(int)
            assert numbers.tolist() == list(range(n, n + len(numbers)))
            expected += 1 if block.flags.any() else 0
            n += len(numbers)
        assert expected == 1 and block.counter[-1] == n, "one reading lost at the new arming"
        assert open_files() == files
