# SPDX-License-Identifier: BSD-3-Clause
"""`allanite record` from the bytes of a simulated instrument to the samples in a run, with all that happens to the
instrument and its link in between.

Every stored sample is compared with the one that was sent under its number.
"""

from __future__ import annotations

import json
import math
from functools import partial
from pathlib import Path

import numpy as np
import pytest

import allanite as al
from allanite.acquisition.instruments import Flag, hp3458a
from allanite.acquisition.instruments.hp3458a import HP3458A, driver
from allanite.acquisition.instruments.hp3458a.simulated_meter import MeterFault, SimulatedIdentity
from allanite.acquisition.instruments.serial_imu import Description
from allanite.acquisition.instruments.serial_imu.faults import ImuFault, noise
from allanite.acquisition.instruments.serial_imu.simulator import SimulatedImu
from allanite.errors import DataQualityError
from allanite.files.store import recover
from recorded_instruments import (
    IMU,
    SWIFT,
    assert_gaps_are_told,
    be_patient,
    keep_pace,
    lines_of,
    make_quick,
    meter,
    missing_in,
    number_of,
    only_run,
    plug_in,
    plug_in_port,
    record_meter,
    record_serial,
    sent_by,
    stored,
    volts,
)
from shell import Run
from virtual_imu import VirtualPort
from virtual_meter import LATE, REFUSED, VirtualClock, virtual_link, virtual_wire

DOORS = [("socket", "GPIB0::22::INSTR", 100), ("prologix", "prologix:///dev/ttyUSB0/22", 25)]
ASKED = {
    "start": [{"text": "GO"}],
    "identity": {"ask": {"text": "ID?"}, "answer": r"SN (?P<serial>\w+) ", "seconds": 60},
}


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch, tmp_path_factory: pytest.TempPathFactory) -> None:
    make_quick(monkeypatch, tmp_path_factory.mktemp("locks"))


# -- the normal course ---------------------------------------------------------------------------------------


@pytest.mark.parametrize("door", ["socket", "prologix"])
def test_a_meter_into_a_run_whose_curve_is_that_of_the_same_samples_in_a_file(
    door: str, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(hp3458a, "HP3458A", partial(HP3458A, speed=None))  # as fast as it is read
    seconds, scale = 60 if door == "socket" else 4, "24.0 mV/(deg/s)"
    with meter(door, speed=None) as simulator:
        done = run(
            *("record", "3458a", "--resource", simulator.resource, "--rate", 32, "--duration", seconds),
            *(
                "--scale",
                scale,
                "--scale-date",
                "2026-09-01",
                "--name",
                "SiRRS01",
                "--out",
                tmp_path / "runs",
                "--json",
            ),
        )
    assert done.code == 0, done.err
    document, n = json.loads(done.out), 32 * seconds
    assert (document["samples"], document["missing"], document["overloads"]) == (n, 0, 0)
    found = only_run(tmp_path / "runs")
    counter, values, flags = stored(found)
    assert np.array_equal(counter, np.arange(n)) and np.array_equal(values[:, 0], volts(counter))
    assert not flags.any() and found.status == "success"
    header = found.header
    assert header.aperture == pytest.approx(0.02) and header.scale_date == "2026-09-01"
    assert (
        header.instrument["serial"] == "CALNUM 104 simulated" and header.settings["aliasing_factor"] == 1.25
    )
    assert lines_of(found, "facts")[0]["temperature_c"] == 36.4
    stamps = found.survey().clocks
    assert np.diff(stamps[:, 1]) == pytest.approx(np.diff(stamps[:, 0]) * 1e9 / 32, abs=2)
    assert found.survey().rate is None  # these stamps were computed: they measure nothing
    np.save(tmp_path / "same.npy", volts(np.arange(n)))
    same = al.read(tmp_path / "same.npy", rate=32.0, unit="V", scale_factor=scale)
    one, other = al.allan_curve(al.read(found.folder)), al.allan_curve(same)
    assert np.array_equal(one.deviation, other.deviation) and np.array_equal(one.tau, other.tau)


def test_an_imu_into_a_run_whose_curve_is_that_of_the_same_samples_in_a_file(
    run: Run, tmp_path: Path
) -> None:
    described = Description.of(IMU)
    with SimulatedImu(described) as device:
        done = record_serial(run, device.port, tmp_path, 0.4)
    assert done.code == 0 and "Nothing is missing" in done.out, done.err
    found = only_run(tmp_path / "runs")
    counter, values, flags = stored(found)
    assert np.array_equal(counter, np.arange(400)) and not flags.any()
    np.testing.assert_allclose(values, sent_by(values, 400), atol=6e-5)
    np.savez(tmp_path / "same.npz", **{f"ch{i}": values[:, i] for i in range(6)})
    same = al.read(tmp_path / "same.npz", rate=1000.0, unit="deg/s", channels=["ch3"], variable="ch3")
    assert np.array_equal(
        al.allan_curve(al.read(found.folder, channels=["ch3"])).deviation, al.allan_curve(same).deviation
    )


# -- faults of readings (battery rows Q6 to Q8) ----------------------------------------------------------------


def test_q7_q8_readings_that_are_none_are_left_out_and_said(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    faults = [
        MeterFault(at=4, kind="overload"),
        MeterFault(at=8, kind="partial"),
        MeterFault(at=12, kind="garbage", data=b"\xff\x00#\r\n"),
        MeterFault(at=16, kind="delay", seconds=0.1),  # all of it comes afterwards
        MeterFault(at=41, kind="doubled"),
        MeterFault(at=44, kind="silence", seconds=0.3),
    ]
    monkeypatch.setattr(hp3458a, "HP3458A", partial(HP3458A, block=0.04))  # the usual lateness is soon known
    with virtual_wire(signal=volts, faults=faults) as wire:
        plug_in(lambda: wire, wire.clock, monkeypatch)
        done = record_meter(run, "GPIB0::22::INSTR", tmp_path, 50, 1.3)
    assert done.code == 3, done.err
    document = json.loads(done.out)
    found = only_run(tmp_path / "runs")
    counter, values, flags = stored(found)
    absent = [8, *range(44, 59)]
    assert counter.tolist() == [k for k in range(65) if k not in absent]
    value = flags & Flag.OVERLOAD == 0
    assert counter[~value].tolist() == [4] and np.isnan(values[~value]).all()
    assert np.array_equal(values[value, 0], volts(counter[value])), "each under its number, none twice"
    assert (document["samples"], document["missing"], document["overloads"]) == (49, 16, 1)
    assert_gaps_are_told(found)
    reasons = [line["reason"] for line in lines_of(found, "gap")]
    assert "rejected b'" in reasons[0] and "no reading within" in reasons[1]
    told = " ".join(line["text"] for line in lines_of(found, "remark"))
    assert "xff" in told and "came twice; kept once" in told
    assert {int(c) for c in counter[flags & Flag.RESYNC > 0]} >= {9, 59}


def test_q7_q8_a_bad_line_to_an_imu_leaves_no_wrong_sample(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    faults = [
        ImuFault(kind="garbage", at=310, size=40),
        ImuFault(kind="partial", at=330, size=11),
        ImuFault(kind="flipped", at=350, size=77),
        ImuFault(kind="doubled", at=370),
        ImuFault(kind="replayed", at=390, size=5),
        ImuFault(kind="lost", at=410, size=7),
        ImuFault(kind="overload", at=430),
        ImuFault(kind="pause", at=450, seconds=0.01),
    ]
    entries = IMU | {"rate": SWIFT, "start": [{"text": "GO"}]}  # it waits until somebody listens
    with SimulatedImu(Description.of(entries), faults=faults, speed=0.05) as device:
        keep_pace(monkeypatch, device)
        done = record_serial(run, device.port, tmp_path, 900 / SWIFT, "--json", entries=entries)
    assert done.code == 3, done.err
    found = only_run(tmp_path / "runs")
    counter, values, flags = stored(found)
    absent = {330, 350, *range(410, 417), *range(450, 650)}
    assert counter.tolist() == [k for k in range(900) if k not in absent]
    value = flags & Flag.OVERLOAD == 0
    assert counter[~value].tolist() == [430]
    np.testing.assert_allclose(values[value], noise(6)(0, 900)[counter[value]], atol=6e-5)
    assert json.loads(done.out)["missing"] == 209 == missing_in(found)
    assert_gaps_are_told(found)


# -- the link (battery row Q7) ---------------------------------------------------------------------------------


@pytest.mark.parametrize("away", [0.15, 2.0])
@pytest.mark.parametrize(("door", "resource", "rate"), DOORS)
def test_q7_the_link_is_lost_and_the_same_meter_comes_back(
    door: str,
    resource: str,
    rate: int,
    away: float,
    run: Run,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Within the planned duration, and behind it."""
    n, planned = round(0.2 * rate), round(0.9 * rate)
    faults = [MeterFault(at=n, kind="drop", seconds=away)]
    with virtual_link(door, signal=volts, faults=faults) as link:
        plug_in(link.connect, link.clock, monkeypatch)
        done = record_meter(run, resource, tmp_path, rate, 0.9)
        passed = (link.meter._origin - link.before_drop) * 1e-9 * rate  # from one arming to the other
    assert done.code == 3, done.err
    found = only_run(tmp_path / "runs")
    counter, values, flags = stored(found)
    assert np.array_equal(number_of(values[:, 0]), np.arange(len(counter))), "none twice, none stale"
    if away < 0.9:
        assert counter[n] == pytest.approx(passed, abs=0.5 + 3 * LATE * rate), "it went on by the clock"
        assert counter.tolist() == [*range(n), *range(counter[n], planned)]
        assert np.flatnonzero(flags).tolist() == [n] and flags[n] == Flag.RESYNC
    else:
        assert counter.tolist() == list(range(n)) and not flags.any()
    (gap,) = lines_of(found, "gap")
    assert (gap["counter"], gap["samples"]) == (n, planned - len(counter))
    assert "the link is gone" in gap["reason"] and gap["uncertainty"] < 0.5
    assert json.loads(done.out)["missing"] == gap["samples"]
    (back,) = lines_of(found, "reconnected")
    assert len(lines_of(found, "lost")) == 1 and back["attempt"] == 1 + math.ceil(away / REFUSED)
    assert len(lines_of(found, "closed")) == 1  # the same settings: one part


@pytest.mark.parametrize(("door", "resource", "rate"), DOORS)
def test_q7_a_link_that_is_lost_before_the_first_reading_costs_none(
    door: str, resource: str, rate: int, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A run begins with its first sample: it is whole, and says what went before."""
    with virtual_link(door, signal=volts, faults=[MeterFault(at=0, kind="drop", seconds=0.15)]) as link:
        plug_in(link.connect, link.clock, monkeypatch)
        done = record_meter(run, resource, tmp_path, rate, 0.9)
    assert done.code == 0 and "the link is lost" in done.err and "is back, at attempt 3" in done.err
    found = only_run(tmp_path / "runs")
    counter, values, flags = stored(found)
    assert np.array_equal(counter, np.arange(round(0.9 * rate))) and np.array_equal(
        values[:, 0], volts(counter)
    )
    assert np.flatnonzero(flags).tolist() == [0] and flags[0] == Flag.RESYNC
    assert not lines_of(found, "gap") and json.loads(done.out)["missing"] == 0
    assert len(lines_of(found, "lost")) == len(lines_of(found, "reconnected")) == 1


def test_q7_what_came_before_the_link_was_lost_is_stored_though_the_host_was_late(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It stands still from the arming until the link is gone."""
    with virtual_link("socket", signal=volts, faults=[MeterFault(at=20, kind="drop", seconds=0.05)]) as link:

        class Late(HP3458A):
            def start(self) -> None:
                super().start()
                link.clock.pass_by(0.5)

        monkeypatch.setattr(hp3458a, "HP3458A", Late)
        plug_in(link.connect, link.clock, monkeypatch)
        done = record_meter(run, "GPIB0::22::INSTR", tmp_path, 100, 2)
    assert done.code == 3, done.err
    found = only_run(tmp_path / "runs")
    counter, values, flags = stored(found)
    assert np.array_equal(number_of(values[:, 0]), np.arange(len(counter)))
    assert counter.tolist() == [*range(20), *range(counter[20], 200)]
    assert np.flatnonzero(flags).tolist() == [20] and flags[20] == Flag.RESYNC
    assert_gaps_are_told(found, "the link is gone")
    assert json.loads(done.out)["missing"] == counter[20] - 20 > 0


@pytest.mark.parametrize("door", ["socket", "prologix"])
@pytest.mark.parametrize("other", [None, SimulatedIdentity(calibrations=7, calibration="another")])
def test_q7_a_meter_comes_back_through_a_real_door(
    other: SimulatedIdentity | None, door: str, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same goes on, another ends the run. Its readings come as fast as they are read: the clock has no say."""
    monkeypatch.setattr(hp3458a, "HP3458A", partial(HP3458A, speed=None))
    monkeypatch.setattr(driver, "NEAR", 0.05)  # pyvisa-py takes the end of a socket for silence
    n, rate = 20, 100
    with meter(
        door, speed=None, faults=[MeterFault(at=n, kind="drop", seconds=0.05, identity=other)]
    ) as simulator:
        done = record_meter(run, simulator.resource, tmp_path, rate, "1h" if other else 0.9)
    found = only_run(tmp_path / "runs")
    counter, values, flags = stored(found)
    assert np.array_equal(number_of(values[:, 0]), np.arange(len(counter))), "none twice, none stale"
    assert_gaps_are_told(found, "the link is gone")
    assert len(lines_of(found, "lost")) == 1
    if other is None:
        assert done.code == 3, done.err
        assert counter.tolist() == [k for k in range(90) if k != n], "one at least fell into the absence"
        assert np.flatnonzero(flags).tolist() == [n] and flags[n] == Flag.RESYNC
        assert len(lines_of(found, "reconnected")) == len(lines_of(found, "closed")) == 1
        return
    assert done.code == 1 and not done.out
    assert "another instrument answers: Agilent/HP 3458A CALNUM 7 another in place of" in done.err
    assert "Start another recording" in done.err
    assert found.status == "fail" and "another instrument" in found.reason
    assert np.array_equal(counter, np.arange(n)) and recover(found.folder, None).kept == n


@pytest.mark.parametrize(("serial", "code"), [(None, 3), ("2", 1)], ids=["the same", "another"])
def test_q7_an_imu_is_unplugged_and_plugged_in(
    serial: str | None, code: int, run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    entries = IMU | ASKED | {"rate": SWIFT}
    faults = (ImuFault(kind="vanish", at=150, seconds=0.2, serial=serial),)  # 4000 samples
    with SimulatedImu(Description.of(entries), faults=faults, serial="1", speed=0.05) as device:
        keep_pace(monkeypatch, device)
        done = record_serial(run, device.port, tmp_path, 4400 / SWIFT, "--json", entries=entries)
    assert done.code == code, done.err
    found = only_run(tmp_path / "runs")
    counter, values, flags = stored(found)
    came = [*range(150), *(range(4150, 4400) if serial is None else ())]
    assert counter.tolist() == came
    np.testing.assert_allclose(values, noise(6)(0, 4400)[came], atol=6e-5)
    (gap,) = lines_of(found, "gap")
    assert gap["counter"] == 150 and "ttyIMU" in gap["reason"] and len(lines_of(found, "lost")) == 1
    if serial is None:
        assert gap["samples"] == 4000 and json.loads(done.out)["missing"] == 4000
        assert len(lines_of(found, "reconnected")) == 1 and np.flatnonzero(flags).tolist() == [150]
    else:
        assert "another instrument answers: X1 2 in place of X1 1" in done.err and found.status == "fail"
        assert 4000 <= gap["samples"] <= 4001, "the tail, by the clock: the last sample was sent just before"


def test_q6_silence_for_ever_ends_the_run_with_all_that_came(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    entries = IMU | {"start": [{"text": "GO"}]}
    port = VirtualPort(Description.of(entries), VirtualClock(), total=300)
    plug_in_port(port, monkeypatch)
    be_patient(monkeypatch, timeout=0.04, silences=3, reconnections=2)
    done = record_serial(run, "/dev/ttyIMU", tmp_path, "1h", "--json", entries=entries)
    assert done.code == 1 and "did not come back in 2 attempts" in done.err
    found = only_run(tmp_path / "runs")
    counter, values, _ = stored(found)
    assert found.status == "fail" and np.array_equal(counter, np.arange(300))
    np.testing.assert_allclose(values, noise(6)(0, 300), atol=6e-5)
    assert [line["number"] for line in lines_of(found, "silence")] == [1, 2, 3] * 3
    (tail,) = lines_of(found, "gap")
    assert tail["counter"] == 300 and tail["samples"] == pytest.approx(1000 * port.silent(), abs=10), (
        "the port is read every 10 ms"
    )
    assert 0.36 <= port.silent() <= 0.46, "nine silences of 40 ms, after what a block gathers in 100 ms"


# -- settings that change (battery row Q16) --------------------------------------------------------------------


def test_q16_other_settings_after_a_reconnection_are_another_part(
    run: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    faults = [MeterFault(at=10, kind="drop", seconds=0.05, mains_hz=60.0)]
    with virtual_link("socket", signal=volts, faults=faults) as link:
        plug_in(link.connect, link.clock, monkeypatch)
        done = record_meter(run, "GPIB0::22::INSTR", tmp_path, 40, 1.2, "--nplc", 1)
    assert done.code == 3, done.err
    found = only_run(tmp_path / "runs")
    (change,) = lines_of(found, "change")
    assert any("mains_hz: 50.0 → 60.0" in said for said in change["differences"])
    assert any(said.startswith("aperture: 0.02 → 0.016") for said in change["differences"])
    with pytest.raises(DataQualityError, match=r"settings change at 000002\.arrows"):
        al.read(found.folder)
    refused = run("info", found.folder)
    assert refused.code == 1 and "never merged" in refused.err and "--variable" in refused.err
    first, second = (al.read(found.folder, variable=part) for part in ("1", "2"))
    assert first.channels[0].aperture == pytest.approx(1 / 50)
    assert second.channels[0].aperture == pytest.approx(1 / 60)
    assert np.array_equal(first.values("voltage"), volts(np.arange(10)))
    counter, values, _ = stored(found, 2)
    assert counter[0] > 10 and np.array_equal(counter, np.arange(counter[0], 48))
    assert np.array_equal(number_of(values[:, 0]), 10 + np.arange(len(counter)))
