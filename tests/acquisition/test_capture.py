# SPDX-License-Identifier: BSD-3-Clause
"""The capture: every sample once, under its number, whatever the instrument, the disk and the clocks do."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
import time
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import pytest

from allanite.acquisition.capture import (
    Captured,
    HostClock,
    Progress,
    Stop,
    capture,
    stopping_on_signals,
    writer,
)
from allanite.acquisition.capture.clock import ClockWatch
from allanite.acquisition.capture.listener import Listener
from allanite.acquisition.capture.numbering import BlockNumbering, Gap, Numbered
from allanite.acquisition.capture.ring import Ring
from allanite.acquisition.capture.space import Space, bytes_per_second, space_of
from allanite.acquisition.instruments import Block, Flag, Identity, InstrumentTimeout
from allanite.commands.monitor import RunWatch
from allanite.errors import DataQualityError, InputError, InstrumentError
from allanite.files.store import open_run
from scripted_instrument import GONE, PATIENT, QUICK, RATE, SAME, Scripted, Step, block


def recorded(
    script: list[Step],
    folder: Path,
    *,
    seconds: float | None = 1.0,
    identities: tuple[Identity | Exception, ...] = (),
    clock: HostClock | None = None,
) -> tuple[Captured, Scripted]:
    instrument = Scripted(script, identities)
    return capture(instrument, folder, duration=seconds, patience=QUICK, clock=clock), instrument


def stored(folder: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    batches = list(open_run(folder).batches())
    return (
        np.concatenate([b.counter for b in batches]),
        np.concatenate([b.values[:, 0] for b in batches]),
        np.concatenate([b.flags for b in batches]),
    )


# -- the normal course --------------------------------------------------------------------------------------


def test_every_sample_is_stored_once_under_its_number(tmp_path: Path) -> None:
    told: list[Progress] = []
    instrument = Scripted([block(i) for i in range(1000, 1250, 10)])
    done = capture(instrument, tmp_path / "run", duration=2.0, patience=QUICK, progress=told.append)
    counter, values, flags = stored(tmp_path / "run")
    assert counter.tolist() == list(range(200))  # the run counts from zero, and ends with its duration
    assert values.tolist() == list(range(1000, 1200))
    assert not flags.any()
    assert (done.samples, done.missing, done.gaps, done.dropped, done.status) == (200, 0, 0, 0, "success")
    assert told[-1].samples == 200 and told[-1].share == 1.0 and told[-1].values == (1199.0,)
    run = open_run(tmp_path / "run")
    assert run.status == "success"
    assert run.header.instrument["serial"] == "7" and run.header.aperture == 0.005
    assert instrument.calls[:2] == ["open", "start"] and instrument.calls[-2:] == ["stop", "close"]


def test_a_counter_of_the_instrument_tells_gaps(tmp_path: Path) -> None:
    done, _ = recorded(
        [block(0), block(15, remarks=("a frame with a wrong checksum",)), block(25, 80)], tmp_path / "run"
    )
    counter, values, _ = stored(tmp_path / "run")
    assert counter.tolist() == [*range(10), *range(15, 100)]
    assert values.tolist() == counter.tolist()
    assert (done.missing, done.gaps) == (5, 1)
    gap = next(e for e in open_run(tmp_path / "run").manifest if e["kind"] == "gap")
    assert (gap["counter"], gap["samples"]) == (10, 5) and "checksum" in gap["reason"]


# -- silence and links (battery rows Q6, Q7) ----------------------------------------------------------------


@pytest.mark.parametrize("silences", [1, 2])
def test_q6_short_silence_is_asked_again(silences: int, tmp_path: Path) -> None:
    quiet: list[Step] = [InstrumentTimeout("silent")] * silences
    # a clock that stands still: what follows a silence is numbered by the time that passed
    done, instrument = recorded([block(0), *quiet, block(10, 90)], tmp_path / "run", clock=Clock())
    counter, values, flags = stored(tmp_path / "run")
    assert values.tolist() == list(range(100))  # nothing twice
    assert flags[10] == Flag.RESYNC and counter[10] >= 10
    assert instrument.calls.count("open") == 1
    assert [e["kind"] for e in open_run(tmp_path / "run").manifest].count("silence") == silences
    assert done.status == "success"


def test_q6_long_silence_makes_the_link_anew(tmp_path: Path) -> None:
    quiet: list[Step] = [InstrumentTimeout("silent")] * 10
    _, instrument = recorded([block(0), *quiet, block(0, 200)], tmp_path / "run")
    events = [e["kind"] for e in open_run(tmp_path / "run").manifest]
    assert (events.count("silence"), events.count("reconnected")) == (10, 3)
    assert instrument.calls.count("open") >= 4
    _, values, flags = stored(tmp_path / "run")
    assert values[:10].tolist() == list(range(10)) and flags[10] == Flag.RESYNC


def test_q6_silence_for_ever_ends_with_an_error_and_a_readable_run(tmp_path: Path) -> None:
    gone: tuple[Identity | Exception, ...] = (SAME, *[InstrumentError("no such port")] * 10)
    with pytest.raises(InstrumentError, match="did not come back in 3 attempts: no such port"):
        recorded([block(0)], tmp_path / "run", identities=gone)
    run = open_run(tmp_path / "run")
    assert run.status == "fail"
    assert stored(tmp_path / "run")[1].tolist() == list(range(10))


def test_q7_unplugged_and_back(tmp_path: Path) -> None:
    script: list[Step] = [block(0), InstrumentError("the port is gone"), block(0, 95)]
    identities: tuple[Identity | Exception, ...] = (SAME, InstrumentError("no such port"), SAME)
    done, _ = recorded(script, tmp_path / "run", identities=identities, clock=Clock())
    counter, values, flags = stored(tmp_path / "run")
    assert values[10] == 0.0 and flags[10] == Flag.RESYNC and counter[10] >= 10
    events = open_run(tmp_path / "run").manifest
    assert [e["kind"] for e in events if e["kind"] in ("lost", "reconnected")] == ["lost", "reconnected"]
    assert done.samples == len(counter)


def test_q7_another_serial_number_is_another_recording(tmp_path: Path) -> None:
    other = Identity(maker="Maker", model="M1", serial="8")
    with pytest.raises(
        InstrumentError, match="another instrument answers: Maker M1 8 in place of Maker M1 7"
    ):
        recorded(
            [block(0), InstrumentError("gone"), block(10)], tmp_path / "run", identities=(SAME, other, other)
        )
    assert stored(tmp_path / "run")[1].tolist() == list(range(10))
    assert open_run(tmp_path / "run").status == "fail"


def test_q7_an_answer_that_was_damaged_once_is_asked_for_again(tmp_path: Path) -> None:
    garbled = Identity(maker="Maker", model="M1", serial="\xf7")
    script: list[Step] = [block(0), InstrumentError("gone"), block(10, 90)]
    done, _ = recorded(script, tmp_path / "run", identities=(SAME, garbled, SAME), clock=Clock())
    assert (done.samples, done.status) == (100, "success")


def test_q6_an_instrument_that_opens_and_brings_nothing_is_given_up(tmp_path: Path) -> None:
    with pytest.raises(InstrumentError, match="did not come back in 3 attempts: nothing came"):
        recorded([block(0)], tmp_path / "run", seconds=1000.0)
    run = open_run(tmp_path / "run")
    assert run.status == "fail" and stored(tmp_path / "run")[1].tolist() == list(range(10))
    *_, tail = (e for e in run.manifest if e["kind"] == "gap")
    assert tail["counter"] == 10 and tail["samples"] > 3 and "nothing came" in tail["reason"]


@pytest.mark.parametrize("identities", [GONE, ()], ids=["gone", "silent"])
def test_a_run_whose_instrument_is_gone_ends_with_its_duration(
    identities: tuple[Identity | Exception, ...], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer, "_GRACE", 0.0)
    script: list[Step] = [block(0, 20), InstrumentError("the port is gone")]
    instrument = Scripted(script, identities)
    done = capture(instrument, tmp_path / "run", duration=0.5, patience=PATIENT)
    assert (done.samples, done.missing, done.gaps, done.status) == (20, 30, 1, "success")
    assert done.reason in ("the port is gone", "nothing came in 10 ms", "no such port")
    run = open_run(tmp_path / "run")
    assert (run.status, run.reason) == ("success", done.reason)
    (gap,) = (e for e in run.manifest if e["kind"] == "gap")
    assert (gap["counter"], gap["samples"]) == (20, 30)
    assert run.recording().n_samples == 50


def test_a_run_without_any_sample_ends_with_its_duration_and_is_a_failure(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(writer, "_GRACE", 0.0)
    with pytest.raises(InstrumentError, match="no sample came in the planned duration: nothing came"):
        capture(Scripted([]), tmp_path / "run", duration=0.3, patience=PATIENT)
    run = open_run(tmp_path / "run")
    assert run.status == "fail" and "no sample came" in run.reason
    assert [(e["counter"], e["samples"]) for e in run.manifest if e["kind"] == "gap"] == [(0, 30)]


def test_a_driver_that_fails_in_an_unforeseen_way_is_no_success(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError):
        recorded([block(0), ZeroDivisionError("a fault of the driver")], tmp_path / "run")
    run = open_run(tmp_path / "run")
    assert (run.status, run.reason) == ("fail", "ZeroDivisionError: a fault of the driver")
    assert stored(tmp_path / "run")[1].tolist() == list(range(10))


def test_an_instrument_that_does_not_answer_leaves_no_run(tmp_path: Path) -> None:
    with pytest.raises(InstrumentError, match="no such port"):
        recorded([], tmp_path / "run", identities=(InstrumentError("no such port"),))
    assert not (tmp_path / "run").exists()
    with pytest.raises(InputError, match="positive"):
        recorded([], tmp_path / "run", seconds=0.0)


# -- numbers ------------------------------------------------------------------------------------------------


def test_without_a_counter_the_clock_says_what_is_missing_after_an_interruption() -> None:
    numbering, second = BlockNumbering(RATE), 10**9
    first = numbering.take(block(0, counter=False), 5 * second)
    assert first.counter.tolist() == list(range(10))
    assert first.monotonic_ns[-1] - first.monotonic_ns[0] == 9 * second // 100
    even = numbering.take(block(0, counter=False), int(5.3 * second))  # late, but nothing was interrupted
    assert even.counter[0] == 10 and not even.gaps
    numbering.interrupt("silent")
    late = numbering.take(block(0, counter=False), int(8.3 * second))
    assert late.counter[-1] == 19 + 300
    assert (late.gaps[0].counter, late.gaps[0].samples, late.gaps[0].reason) == (20, 290, "silent")
    assert late.flags[0] == Flag.RESYNC


def test_a_pause_inside_a_block_is_a_gap_there() -> None:
    numbering = BlockNumbering(RATE)
    numbering.take(block(0, counter=False), 10**9)
    marks = np.zeros(10, dtype=np.uint8)
    marks[4] = Flag.RESYNC
    paused = Block(values=np.zeros((10, 1)), flags=marks, remarks=("the counter of the meter was set anew",))
    found = numbering.take(paused, 10**9 + 3 * 10**9)
    assert found.counter.tolist() == [10, 11, 12, 13, *range(304, 310)]
    assert found.gaps[0].samples == 290 and "anew" in found.gaps[0].reason


def test_a_counter_that_begins_anew_goes_on_by_the_clock() -> None:
    numbering = BlockNumbering(RATE)
    numbering.take(block(500), 10**9)
    numbering.interrupt("reconnected")
    found = numbering.take(block(0), 2 * 10**9)
    assert found.counter[-1] == 9 + 100 and found.gaps[0].samples == 90


def test_nothing_goes_back() -> None:
    numbering = BlockNumbering(RATE)
    numbering.take(block(0), 10**9)
    numbering.interrupt("silent")
    found = numbering.take(block(0), 10**9 + 1)  # the clock says that hardly any time has passed
    assert found.counter[0] == 10


def test_a_counter_that_goes_on_is_believed_after_a_silence_whatever_the_clock_says() -> None:
    numbering = BlockNumbering(RATE)
    numbering.take(block(500), 10**9)
    numbering.interrupt("silent")
    found = numbering.take(block(533), 10**9 + 345 * 10**6)  # late by 12 ms: 34 or 35 by the clock
    assert found.counter.tolist() == list(range(33, 43))
    assert (found.gaps[0].counter, found.gaps[0].samples) == (10, 23) and found.flags[0] == Flag.RESYNC


def test_a_counter_that_goes_back_unasked_is_marked() -> None:
    numbering = BlockNumbering(RATE)
    numbering.take(block(500), 10**9)
    found = numbering.take(block(0), 10**9 + 10**8)
    assert found.counter.tolist() == list(range(10, 20)) and found.flags[0] == Flag.RESYNC


def test_the_reason_of_a_gap_may_have_come_before_it_without_a_sample() -> None:
    numbering = BlockNumbering(RATE)
    numbering.take(block(0), 10**9)
    nothing = Block(values=np.zeros((0, 1)), flags=np.zeros(0, dtype=np.uint8), remarks=("a", "b", "c", "d"))
    assert len(numbering.take(nothing, 10**9)) == 0
    found = numbering.take(block(15), 2 * 10**9)
    assert found.gaps[0].reason == "a; b; c; and 1 more"


def test_the_reason_of_a_gap_may_have_come_at_the_end_of_the_block_before_it() -> None:
    numbering = BlockNumbering(RATE)
    numbering.take(block(0, remarks=("skipped 17 bytes",)), 10**9)
    assert numbering.take(block(15), 2 * 10**9).gaps[0].reason == "skipped 17 bytes"
    again = numbering.take(block(30), 3 * 10**9).gaps[0].reason
    assert "for no reason that the instrument reported" in again  # a remark explains one gap


def test_a_gap_over_the_end_of_the_run_counts_up_to_the_end(tmp_path: Path) -> None:
    done, _ = recorded([block(0, 80), block(120, 30, remarks=("lost",))], tmp_path / "run")
    assert (done.samples, done.missing, done.gaps, done.status) == (80, 20, 1, "success")
    gap = next(e for e in open_run(tmp_path / "run").manifest if e["kind"] == "gap")
    assert (gap["counter"], gap["samples"], gap["reason"]) == (80, 20, "lost")


def test_what_is_odd_is_counted_by_one_definition(tmp_path: Path) -> None:
    odd = {2: Flag.OVERLOAD, 5: Flag.MISSING, 6: Flag.DOUBTFUL | Flag.RESYNC, 7: Flag.DOUBTFUL}
    done, _ = recorded([block(10 * i, flags=odd.get(i, 0)) for i in range(10)], tmp_path / "run")
    assert (done.overloads, done.doubtful, done.resyncs) == (2, 2, 1)
    watched = RunWatch(tmp_path / "run").look()
    assert (watched["overloads"], watched["doubtful"], watched["resyncs"]) == (2, 2, 1)


# -- how sure a gap is --------------------------------------------------------------------------------------


def test_a_gap_that_a_clock_has_told_says_how_sure_it_is(tmp_path: Path) -> None:
    told = Block(
        values=np.zeros((90, 1)),
        flags=np.zeros(90, dtype=np.uint8),
        counter=np.arange(16, 106),
        gap_uncertainty=0.29,
        remarks=("armed again",),
    )
    recorded([block(0), told], tmp_path / "run")
    (gap,) = (e for e in open_run(tmp_path / "run").manifest if e["kind"] == "gap")
    assert (gap["samples"], gap["uncertainty"]) == (6, 0.29)
    recorded([block(0), block(16, 90)], tmp_path / "counted")
    (counted,) = (e for e in open_run(tmp_path / "counted").manifest if e["kind"] == "gap")
    assert "uncertainty" not in counted


@pytest.mark.parametrize("off", [-0.01, 0.0, 0.01])
def test_a_sensor_whose_clock_is_off_leaves_a_gap_at_its_own_rate(
    off: float, rng: np.random.Generator
) -> None:
    numbering, own = BlockNumbering(RATE), RATE * (1 + off)
    for k in range(1, 500):
        numbering.take(block(0, counter=False), 10**12 + round(10 * k / own * 1e9 + 1e6 * rng.random()))
    numbering.interrupt("silent")
    away = 3600.0
    found = numbering.take(block(0, counter=False), 10**12 + round((4990 / own + away) * 1e9))
    (gap,) = found.gaps
    assert gap.uncertainty is not None and gap.uncertainty < 15  # 360 by the nominal rate
    assert gap.samples == pytest.approx(away * own - 10, abs=3 * gap.uncertainty)


def test_without_a_rate_of_its_own_a_gap_is_as_sure_as_an_oscillator() -> None:
    numbering = BlockNumbering(RATE)
    numbering.take(block(0, counter=False), 10**12)
    numbering.interrupt("silent")
    (gap,) = numbering.take(block(0, counter=False), 10**12 + 3600 * 10**9).gaps
    assert gap.samples == 360_000 - 10 and gap.uncertainty == pytest.approx(3600, rel=1e-3)


def test_remarks_without_end_are_counted_and_not_written_down(tmp_path: Path) -> None:
    script: list[Step] = [block(10 * i, remarks=("garbage",)) for i in range(50)]
    done, _ = recorded(script, tmp_path / "run", seconds=5.0)
    told = [e for e in open_run(tmp_path / "run").manifest if e["kind"] == "remark"]
    assert len(told) == 21 and sum(e.get("more", 1) for e in told) == done.remarks == 50


def test_q16_other_settings_begin_another_part(tmp_path: Path) -> None:
    class Turned(Scripted):
        """Its range is another one after the link was made anew."""

        @property
        def settings(self) -> Mapping[str, object]:
            return {"aperture": 0.005, "range": 10 if self.calls.count("open") == 1 else 1}

    instrument = Turned([block(0), InstrumentError("gone"), block(10, 90)])
    done = capture(instrument, tmp_path / "run", duration=1.0, patience=QUICK)
    run = open_run(tmp_path / "run")
    (change,) = (e for e in run.manifest if e["kind"] == "change")
    assert change["differences"] == ["settings.range: 10 → 1"] and done.samples == 100
    with pytest.raises(DataQualityError, match="never merged"):
        run.recording()
    assert [run.recording(part).n_samples for part in (1, 2)] == [10, 90]


def test_a_rate_that_changes_leaves_the_planned_time_as_it_is(tmp_path: Path) -> None:
    class Slower(Scripted):
        """Half as fast after the link was made anew."""

        @property
        def rate(self) -> float:
            return RATE if self.calls.count("open") == 1 else RATE / 2

    instrument = Slower([block(0, 50), InstrumentError("gone"), block(50, 50)])
    done = capture(instrument, tmp_path / "run", duration=1.0, patience=QUICK)
    run = open_run(tmp_path / "run")
    assert done.samples == 75 and [run.recording(p).duration for p in (1, 2)] == [0.5, 0.5]
    plans = [(e["seconds"], e["samples"]) for e in run.manifest if e["kind"] == "plan"]
    assert plans == [(1.0, 100), (1.0, 75)]


# -- clocks (battery rows Q9, Q10) --------------------------------------------------------------------------


class Clock(HostClock):
    """Clocks that do as they are told."""

    def __init__(self) -> None:
        self.time, self.slept, self.wall = 10**12, 0, 10**18

    def now(self) -> int:
        return self.time + self.slept

    def awake(self) -> int:
        return self.time

    def utc(self) -> int:
        return self.wall + self.time + self.slept


@pytest.mark.parametrize("hour", [3600, -3600])
def test_q9_a_wall_clock_that_is_set_changes_no_interval(hour: int) -> None:
    clock = Clock()
    watch, numbering = ClockWatch(clock), BlockNumbering(RATE)
    before = numbering.take(block(0), clock.now())
    clock.time += 10**8
    clock.wall += hour * 10**9
    after = numbering.take(block(10), clock.now())
    assert after.monotonic_ns[0] - before.monotonic_ns[0] == 10**8
    (event,) = watch.look()
    assert (event.what, event.seconds) == ("step", pytest.approx(hour))
    assert watch.look() == []


def set_clocks(folder: Path) -> list[float]:
    return [round(e["seconds"]) for e in open_run(folder).manifest if e["kind"] == "clock"]


@pytest.mark.parametrize("fails", [False, True])
def test_q9_a_step_in_a_run_shorter_than_a_look_is_written_down(fails: bool, tmp_path: Path) -> None:
    class Real(HostClock):
        wall = 0

        def utc(self) -> int:
            return super().utc() + self.wall

    clock = Real()

    def after_the_clock_was_set() -> Block:
        clock.wall += 3600 * 10**9
        return block(10)

    script: list[Step] = [block(0), after_the_clock_was_set]
    script.append(ZeroDivisionError("a fault of the driver") if fails else block(20, 80))
    with contextlib.suppress(ZeroDivisionError):
        capture(Scripted(script), tmp_path / "run", duration=1.0, patience=QUICK, clock=clock)
    assert open_run(tmp_path / "run").status == ("fail" if fails else "success")
    assert set_clocks(tmp_path / "run") == [3600]


def test_q9_two_steps_that_undo_each_other_within_a_minute_are_written_down(tmp_path: Path) -> None:
    clock, seen = Clock(), threading.Event()

    def step(seconds: int, number: int) -> Callable[[], Block]:
        def set_it() -> Block:
            clock.wall += seconds * 10**9
            clock.time += 2 * 10**9
            assert seen.wait(10)
            seen.clear()
            return block(number)

        return set_it

    script: list[Step] = [block(0), step(3600, 10), step(-3600, 20), block(30, 70)]
    capture(
        Scripted(script),
        tmp_path / "run",
        duration=1.0,
        patience=QUICK,
        clock=clock,
        happened=lambda kind, facts: seen.set() if kind == "clock" else None,
    )
    assert set_clocks(tmp_path / "run") == [3600, -3600]


def test_q10_a_host_that_sleeps_leaves_a_gap_as_long() -> None:
    clock = Clock()
    watch, numbering = ClockWatch(clock), BlockNumbering(RATE)
    numbering.take(block(0, counter=False), clock.now())
    clock.slept += 60 * 10**9
    numbering.interrupt("nothing came in 2 s")
    found = numbering.take(block(0, counter=False), clock.now())
    assert found.gaps[0].samples == 6000 - 10
    assert [e.what for e in watch.look()] == ["sleep"]


# -- back pressure (battery row Q11) ------------------------------------------------------------------------


def test_q11_a_writer_that_stalls_loses_nothing_while_there_is_room_and_counts_the_rest() -> None:
    instrument = Scripted([block(10 * i) for i in range(20)])
    listener = Listener(instrument, SAME, room=100, patience=QUICK)
    listener.start()
    assert instrument.over.wait(60)  # nobody takes anything
    taken = []
    lost: list[Gap] = []
    listener.stop()
    listener.join()
    while not listener.ring.exhausted:
        item = listener.ring.take(0.01)
        taken += [item] if isinstance(item, Numbered) else []
        lost += [item] if isinstance(item, Gap) else []
    assert np.concatenate([t.counter for t in taken]).tolist() == list(range(100))
    assert [(gap.counter, gap.samples, gap.dropped) for gap in lost][:1] == [(100, 100, 100)]


def test_q11_dropped_samples_are_a_gap_before_the_next() -> None:
    go, waits = threading.Event(), threading.Event()

    def last() -> Block:
        waits.set()  # what came before has been handed on
        go.wait(60)
        return block(30)

    instrument = Scripted([block(0), block(10), block(20), last])
    listener = Listener(instrument, SAME, room=10, patience=QUICK)
    listener.start()
    assert waits.wait(60)
    first = listener.ring.take(60.0)
    go.set()
    second = listener.ring.take(60.0)
    listener.stop()
    listener.join()
    assert isinstance(first, Numbered) and isinstance(second, Numbered)
    assert second.counter[0] == 30
    (gap,) = second.gaps
    assert (gap.counter, gap.samples) == (10, 20) and "too slow" in gap.reason


def test_q11_what_was_dropped_at_the_end_is_told_too() -> None:
    instrument = Scripted([block(0), block(10)])
    listener = Listener(instrument, SAME, room=10, patience=QUICK)
    listener.start()
    assert instrument.over.wait(60)
    listener.stop()
    listener.join()
    items = []
    while not listener.ring.exhausted:
        items.append(listener.ring.take(0.01))
    gaps = [item for item in items if isinstance(item, Gap)]
    assert [(g.counter, g.samples, g.dropped) for g in gaps][:1] == [(10, 10, 10)]


def test_a_ring_always_has_room_for_what_is_no_sample() -> None:
    ring: Ring[int] = Ring(3)
    assert ring.put(1, 10) and ring.put(2, 0) and not ring.put(3, 1)
    ring.close()
    assert not ring.put(4, 0)


def test_a_ring_gives_what_it_took_in_its_order() -> None:
    ring: Ring[int] = Ring(3)
    assert [ring.put(i, 1) for i in range(4)] == [True, True, True, False]
    ring.close()
    assert [ring.take(0.01) for _ in range(4)] == [0, 1, 2, None]
    assert ring.exhausted


def test_a_ring_takes_one_item_of_any_size_and_waits_for_room() -> None:
    ring: Ring[int] = Ring(3)
    assert ring.put(1, 1000)
    assert not ring.put(2, 1, 0.01)
    threading.Timer(0.05, ring.take, (0.0,)).start()
    assert ring.put(2, 1, 5.0)


# -- the end (battery row Q14), and room on the disk (Q5) -----------------------------------------------------


@pytest.mark.parametrize("name", ["SIGINT", "SIGTERM", "SIGHUP"])
def test_q14_a_signal_ends_the_run_with_its_name(name: str, tmp_path: Path) -> None:
    number = getattr(signal, name)
    instrument = Scripted([block(10 * i) for i in range(1000)], wait=0.001)
    before = signal.getsignal(number)
    sent: list[Progress] = []

    def send(state: Progress) -> None:
        if not sent:  # a second SIGINT would interrupt at once
            os.kill(os.getpid(), number)
        sent.append(state)

    with stopping_on_signals() as stop:
        done = capture(
            instrument,
            tmp_path / "run",
            patience=QUICK,
            stop=stop,
            progress=send,
        )
    assert signal.getsignal(number) is before
    assert (done.status, done.reason) == ("abort", name)
    run = open_run(tmp_path / "run")
    assert run.status == "abort"
    counter, values, _ = stored(tmp_path / "run")
    assert len(counter) == done.samples > 0 and values.tolist() == list(range(len(counter)))


def test_q14_a_slow_instrument_is_not_waited_for(tmp_path: Path) -> None:
    class Slow(Scripted):
        """A sample each twenty seconds."""

        @property
        def rate(self) -> float:
            return 0.05

    spent = []
    for i in range(3):  # the quickest: the host may be busy
        stop = Stop()
        threading.Timer(0.1, stop.ask, ("SIGINT",)).start()
        began = time.monotonic()
        done = capture(Slow([block(0, 2)]), tmp_path / f"run{i}", stop=stop)
        spent.append(time.monotonic() - began)
        assert (done.status, done.samples) == ("abort", 2)
    assert min(spent) < 2.0
    run = open_run(tmp_path / "run0")
    assert not [e for e in run.manifest if e["kind"] in ("silence", "gap", "lost")]


def test_a_stop_of_the_caller_counts_once() -> None:
    stop = Stop()
    assert not stop.asked
    stop.ask("enough")
    stop.ask("more")
    assert stop.asked and stop.reason == "enough"


@pytest.mark.parametrize(
    "needed, free, enough", [(100.0, 200, True), (100.0, 199, False), (100.0, 99, False)]
)
def test_q5_room_is_twice_what_a_run_needs(needed: float, free: int, enough: bool) -> None:
    room = Space(needed=needed, free=free, seconds=10.0)
    assert room.enough is enough and bool(room.warning) is not enough
    assert ("will end early" in room.warning) is (free < needed)


def test_q5_room_is_told_before_the_start(tmp_path: Path) -> None:
    week = 7 * 86400.0
    space = space_of(tmp_path / "not" / "yet", 32.0, 1, week)
    assert space.needed == pytest.approx(week * bytes_per_second(32.0, 1))
    assert 500e6 < space.needed < 1000e6  # measured: some 750 MB a week
    assert space.enough == (space.free > 2 * space.needed)
    assert space_of(tmp_path, 1e9, 100, week).enough is False
    assert space_of(tmp_path, 32.0, 1, None).enough
