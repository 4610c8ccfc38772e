# SPDX-License-Identifier: BSD-3-Clause
"""The 3458A without a wire: commands, answers, the place of readings on the time grid."""

from __future__ import annotations

import numpy as np
import pytest

from allanite.acquisition.instruments import Block, Flag
from allanite.acquisition.instruments.hp3458a import commands
from allanite.acquisition.instruments.hp3458a.answers import parse_dint, parse_lines
from allanite.acquisition.instruments.hp3458a.commands import MeterSettings
from allanite.acquisition.instruments.hp3458a.pace import Pace
from allanite.acquisition.instruments.hp3458a.stream import Decoded, IntegerStream, LineStream
from allanite.errors import InputError, InstrumentError

PERIOD = 31_250_000  # ns at 32 Hz


def reading(volts: float) -> bytes:
    return b"%+.8E\r\n" % volts


# ---- commands --------------------------------------------------------------------------------------------------------


def test_the_sequence_of_the_reference():
    settings = MeterSettings(rate=32)
    assert commands.CLEAR == ("TARM HOLD;TRIG HOLD", "RESET")
    assert commands.base_lines(settings) == (
        "PRESET NORM;END ALWAYS;INBUF ON;TARM HOLD",
        "LFREQ LINE;DCV 10;NPLC 1;AZERO OFF;DELAY 0;MATH OFF;DISP OFF",
        "MEM OFF;OFORMAT ASCII",
        "TRIG AUTO;TIMER 0.03125;NRDGS 16777215,TIMER",
    )
    assert commands.ARM == "TARM SGL,1"
    assert commands.STOP == "PRESET NORM;END ALWAYS"


@pytest.mark.parametrize(
    "settings, command",
    [
        (MeterSettings(rate=32), ("NPLC", 1.0)),
        (MeterSettings(rate=32, aperture=31.2e-3), ("APER", 0.0312)),
        (MeterSettings(rate=32, nplc=0.5), ("NPLC", 0.5)),
        (MeterSettings(rate=100), ("APER", 0.00995)),
        (MeterSettings(rate=10, autozero=True), ("NPLC", 1.0)),
        (MeterSettings(rate=32, autozero=True), ("APER", 0.015575)),
        (MeterSettings(rate=20_000), ("APER", 12.5e-6)),
    ],
)
def test_the_aperture_fits_the_period(settings, command):
    name, number = settings.integration
    assert name == command[0] and number == pytest.approx(command[1], rel=1e-12)


def test_lines_at_a_low_rate_and_integers_above_200_hz():
    assert MeterSettings(rate=200).format == "ASCII"
    assert MeterSettings(rate=201).format == "DINT"
    assert MeterSettings(rate=32, output="DINT").format == "DINT"


def test_the_period_is_in_steps_of_the_meter():
    assert MeterSettings(rate=30).period == pytest.approx(0.0333333, abs=1e-12)


@pytest.mark.parametrize(
    "wrong, why",
    [
        ({"rate": 0.0}, "paces from"),
        ({"rate": float("nan")}, "paces from"),
        ({"rate": 32, "range_volts": 5.0}, "take one of"),
        ({"rate": 32, "nplc": 1, "aperture": 0.01}, "give one of them"),
        ({"rate": 32, "nplc": 0}, "more than 0"),
        ({"rate": 32, "aperture": 2.0}, "500 ns to 1 s"),
        ({"rate": 32, "output": "SINT"}, "'ASCII' or 'DINT'"),
        ({"rate": 32, "readings_per_arm": 2**24}, "1 to 16777215"),
        ({"rate": 32, "nplc": 2}, "does not fit"),
        ({"rate": 32, "nplc": 1, "autozero": True}, "switch autozero off"),
        ({"rate": 32, "aperture": 31.3e-3}, "does not fit"),
    ],
)
def test_settings_that_the_meter_does_not_have(wrong, why):
    with pytest.raises(InputError, match=why):
        MeterSettings(**wrong)


@pytest.mark.parametrize("nplc, rounded", [(0.3, 0.3), (1, 1), (1.2, 2), (9.5, 10), (11, 20), (100, 100)])
def test_nplc_is_rounded_up_as_the_meter_does(nplc, rounded):
    assert commands.rounded_nplc(nplc) == rounded


def test_the_factor_of_aperture_and_period():
    # Table 1.3 of the reference: NPLC 1 at 32 Hz.
    assert commands.aliasing_factor(0.02, 1 / 32) == pytest.approx(1.25)
    assert commands.aliasing_factor(1 / 60, 1 / 32) == pytest.approx(1.37, abs=0.005)
    assert commands.aliasing_factor(31.2e-3, 1 / 32) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize(
    "query, answer, numbers",
    [
        ("TIMER?", b" 3.125000000E-02\r\n", (0.03125,)),
        ("NRDGS?", b"16777215, 6\r\n", (16777215, 6)),
        ("NRDGS?", b"16777215,TIMER\r\n", (16777215, 6)),
        ("TARM?", b"HOLD\r\n", (4,)),
        ("AZERO?", b"AZERO OFF\r\n", (0,)),
        ("FUNC?", b"DCV, 10.00000E+00\r\n", (1, 10)),
    ],
)
def test_answers_in_numbers_and_in_words(query, answer, numbers):
    assert commands.numbers_of(query, answer) == numbers


@pytest.mark.parametrize("answer", [b"\r\n", b"\xff\xfe\r\n", b"+1.2+3\r\n", b"1E999\r\n", b"nan\r\n"])
def test_a_damaged_answer_is_refused(answer):
    with pytest.raises(InstrumentError, match="clear the interface"):
        commands.numbers_of("TIMER?", answer)


def test_a_setting_that_did_not_take_is_named():
    timer = next(r for r in commands.read_backs(MeterSettings(rate=32)) if r.name == "timer")
    assert commands.refusals(timer, (0.03125,)) == ""
    assert commands.refusals(timer, (1.0,)) == "TIMER? answers 1 instead of 0.03125"
    count = next(r for r in commands.read_backs(MeterSettings(rate=32)) if r.name == "readings")
    assert "1 numbers instead of 2" in commands.refusals(count, (16777215,))


@pytest.mark.parametrize(
    ("name", "impossible"),
    [("scale", 0.0), ("scale", -1.0), ("scale", 1e30), ("mains_hz", 1e38), ("aperture", 1e20)],
)
def test_a_setting_that_no_meter_has_is_refused(name, impossible):
    asked = next(r for r in commands.read_backs(MeterSettings(rate=32)) if r.name == name)
    assert "is impossible" in commands.refusals(asked, (impossible,))


# ---- answers ---------------------------------------------------------------------------------------------------------


def test_whole_lines_only():
    lines = parse_lines(reading(1.5) + reading(-2e-9) + b"+1.2345", 10.0)
    assert lines.values.tolist() == [1.5, -2e-9] and lines.rest == b"+1.2345"
    assert not lines.rejected and not lines.flags.any()


@pytest.mark.parametrize(
    "line",
    [
        b"+1.23",
        b"1.23456789E+00",  # its sign is lost: may have been a minus
        b"+.23456789E+00",
        b"+1.23456789E+0",
        b"+1.23+1.23456789E+00",
        b"+1.23456789E+00+1.23456789E+00",
        b"\x00\xff\x13",
        b"",
        b"nan",
        b"HP3458A",
    ],
)
def test_what_is_no_reading_is_set_aside_in_its_place(line):
    lines = parse_lines(reading(1.0) + line + b"\r\n" + reading(2.0), 10.0)
    assert lines.values.tolist() == [1.0, 2.0]
    assert lines.rejected == (line,) and lines.breaks == (1,)


@pytest.mark.parametrize(
    "line",
    [
        b"+1.00000000E+38",
        b" 1.00000000E+38",
        b"-1.00000000E+38",
        b"1E+38",
        b"9.9E37",
        b"-9.9E37",
        b"+9.91E+37",
        b"OVLD",
        b"-OL",
    ],
)
def test_overload_in_every_spelling_is_nan_with_its_flag(line):
    lines = parse_lines(reading(1.0) + line + b"\r\n", 10.0)
    assert np.isnan(lines.values[1]) and lines.flags.tolist() == [0, Flag.OVERLOAD]
    assert not lines.rejected


def test_a_line_without_end_does_not_grow_for_ever():
    lines = parse_lines(b"x" * 100, 10.0)
    assert lines.rest == b"" and lines.rejected == (b"x" * 100,)


@pytest.mark.parametrize("volts_of_range", commands.RANGES)
@pytest.mark.parametrize(
    ("output", "factor"),
    [
        *(("ASCII", factor) for factor in (1.3, -1.3, 1e3, -1e19, float("nan"), float("inf"))),
        *(("DINT", factor) for factor in (1.3, -1.3, 4.9)),
    ],
)
def test_no_reading_beyond_the_scale_of_its_range_is_given_in_any_format(volts_of_range, output, factor):
    """120 % of the range by the manual, 105 % of 1000 V; 1E+38 is what an overload is written as."""
    part = 1.05 if volts_of_range == 1000 else 1.2
    sent = [part * volts_of_range * x for x in (0.0, 1 - 1e-6, -1 + 1e-6, 0.3)] * 20
    bad = factor * volts_of_range
    if output == "ASCII":
        stream = LineStream(pace=Pace(period_ns=PERIOD, speed=None), range_volts=volts_of_range)
        line = reading(bad) if np.isfinite(bad) else b"%+f\r\n" % bad
        data = b"".join(map(reading, sent)) + line + b"".join(map(reading, sent))
    else:
        scale = 5 * volts_of_range / 2**31
        stream = IntegerStream(pace=Pace(period_ns=1e6, speed=None), scale=scale, range_volts=volts_of_range)
        data = np.round(np.array([*sent, bad, *sent]) / scale).astype(">i4").tobytes()
    stream.armed(10_000)
    got = stream.feed(data, 0, awaited=True)
    given = np.abs(got.values[~np.isnan(got.values)])
    assert len(given) and given.max() <= part * volts_of_range
    assert len(got.remarks) == 1
    if output == "ASCII" and not np.isinf(bad):
        assert "rejected b'" in got.remarks[0] and f"{volts_of_range:g} V range" in got.remarks[0]
        assert len(got.values) == 2 * len(sent) and got.counter[-1] == 2 * len(sent), "one is missing"
        assert got.flags[len(sent)] == Flag.RESYNC and not np.delete(got.flags, len(sent)).any()


@pytest.mark.parametrize("cut", range(1, 17))
def test_lines_cut_anywhere_give_the_same_readings(cut):
    stream = LineStream(pace=Pace(period_ns=PERIOD, speed=None), range_volts=10.0)
    stream.armed(100)
    data = b"".join(reading(k * 1e-3) for k in range(20))
    parts = [data[i : i + cut] for i in range(0, len(data), cut)]
    out = [stream.feed(part, 0, awaited=True) for part in parts]
    assert np.concatenate([d.values for d in out]).tolist() == pytest.approx([k * 1e-3 for k in range(20)])
    assert np.concatenate([d.counter for d in out]).tolist() == list(range(20))


def test_integers_are_big_endian_twos_complement():
    data = bytes.fromhex("00000001 fffffffe 0a0d0a0d".replace(" ", ""))
    values, flags, wrong = parse_dint(data, 1e-9, 1.0)
    assert values.tolist() == pytest.approx([1e-9, -2e-9, 0.168626701]) and not flags.any() and wrong is None


def test_integers_at_an_end_of_the_scale_are_overload():
    values, flags, wrong = parse_dint(bytes.fromhex("7fffffff80000000"), 1e-9, 1.0)
    assert np.isnan(values).all() and flags.tolist() == [Flag.OVERLOAD] * 2 and wrong is None


# ---- pace: everything at 32 Hz, in one made-up host time -----------------------------------------------------------


class Host:
    """Feeds a stream with blocks whose arrival times are given."""

    def __init__(self, stream, late_ns=2_000_000):
        self.stream, self.late = stream, late_ns
        stream.armed(10_000_000)

    def feed(self, first: int, last: int, *, data: bytes | None = None, at: int | None = None) -> Decoded:
        """Readings first ... last-1, there when the last of them is made."""
        data = b"".join(reading(k * 1e-3) for k in range(first, last)) if data is None else data
        return self.stream.feed(data, int((last if at is None else at) * PERIOD + self.late), awaited=True)


@pytest.fixture
def host():
    host = Host(LineStream(pace=Pace(period_ns=PERIOD), range_volts=10.0))
    for k in range(0, 60, 3):
        host.feed(k, k + 3)
    return host


def test_a_rejected_line_is_one_reading_missing(host):
    got = host.feed(60, 63, data=reading(60e-3) + b"+1.23\r\n" + reading(62e-3))
    assert got.values.tolist() == pytest.approx([60e-3, 62e-3])
    assert got.counter.tolist() == [60, 62]
    assert got.flags.tolist() == [0, Flag.RESYNC]
    assert got.remarks == ("rejected b'+1.23', which is not a reading of the 10 V range",)
    assert host.feed(63, 66).counter.tolist() == [63, 64, 65]


def test_garbage_between_lines_moves_no_reading(host):
    got = host.feed(60, 63, data=reading(60e-3) + b"\xff\x00\r\n" + reading(61e-3) + reading(62e-3))
    assert got.counter.tolist() == [60, 61, 62] and got.flags.tolist() == [0, Flag.RESYNC, 0]


def test_a_rejected_line_at_the_end_of_a_block_marks_the_next_one(host):
    got = host.feed(60, 63, data=reading(60e-3) + reading(61e-3) + b"+1.23\r\n")
    assert got.counter.tolist() == [60, 61]
    after = host.feed(63, 66)
    assert after.counter[-1] == 65 and after.flags[0] == Flag.RESYNC


def test_a_block_of_nothing_but_garbage(host):
    got = host.feed(60, 63, data=b"+1.2\r\n" * 3)
    assert len(got.values) == 0 and len(got.remarks) == 3
    after = host.feed(63, 66)
    assert after.counter.tolist() == [63, 64, 65] and after.flags.tolist() == [Flag.RESYNC, 0, 0]


def test_a_line_that_came_twice_is_kept_once(host):
    # Three lines are there when two readings have been made.
    got = host.feed(60, 63, data=reading(60e-3) + reading(60e-3) + reading(61e-3), at=62)
    assert got.values.tolist() == pytest.approx([60e-3, 61e-3]) and got.counter.tolist() == [60, 61]
    assert got.remarks == ("1 reading came twice; kept once",)
    assert host.feed(62, 65).counter.tolist() == [62, 63, 64]


def test_a_line_repeated_from_the_block_before_is_kept_once(host):
    got = host.feed(60, 63, data=reading(59e-3) + reading(60e-3) + reading(61e-3), at=62)
    assert got.values.tolist() == pytest.approx([60e-3, 61e-3]) and got.counter.tolist() == [60, 61]


def test_equal_readings_are_no_repetition(host):
    got = host.feed(60, 63, data=reading(60e-3) * 3)
    assert got.counter.tolist() == [60, 61, 62] and not got.remarks and not got.flags.any()


def test_too_many_readings_of_which_none_is_a_repetition_are_doubtful(host):
    got = host.feed(60, 63, at=62)
    assert len(got.values) == 3 and got.flags[0] == Flag.DOUBTFUL | Flag.RESYNC
    assert "undetermined which" in got.remarks[0]


def test_readings_lost_without_a_trace_are_seen_by_the_clock(host):
    said = []
    for k in range(60, 120, 3):
        got = host.feed(k, k + 3, at=k + 3 + 2)
        said += got.remarks
        last = got.counter[-1]
    assert len(said) == 1 and said[0].startswith("2 readings did not come")
    assert last == 119 + 2


def test_a_late_block_and_what_queued_behind_it_move_nothing(host):
    late = host.stream.feed(b"".join(reading(k * 1e-3) for k in range(60, 63)), 80 * PERIOD, awaited=False)
    assert late.counter.tolist() == [60, 61, 62] and not late.remarks
    for k in range(63, 120, 3):
        got = host.stream.feed(
            b"".join(reading(i * 1e-3) for i in range(k, k + 3)),
            max(80, k + 3) * PERIOD + 2_000_000,
            awaited=k > 80,
        )
        assert not got.remarks and got.counter.tolist() == [k, k + 1, k + 2]


@pytest.mark.long
def test_a_drifting_clock_of_the_meter_is_followed():
    # A hundredth of a percent: 23 readings in two hours.
    host = Host(LineStream(pace=Pace(period_ns=PERIOD), range_volts=1000.0))
    for k in range(0, 230_400, 90):
        got = host.feed(k, k + 90, at=(k + 90) * 1.0001)
        assert not got.remarks
    assert got.counter[-1] == 230_399


def test_a_long_silence_puts_the_stream_in_question(host):
    got = host.feed(60, 63, at=300)
    assert len(got.values) == 0 and not got.in_step and "switched off" in got.remarks[0]


def test_after_a_pause_the_clock_says_how_long_it_was(host):
    host.stream.interrupted()
    host.stream.armed(100)
    got = host.feed(60, 63, at=103)
    assert got.counter.tolist() == [100, 101, 102] and got.flags.tolist() == [Flag.RESYNC, 0, 0]
    assert host.stream.left == 97


def test_without_a_clock_everything_is_counted():
    stream = LineStream(pace=Pace(period_ns=PERIOD, speed=None), range_volts=10.0)
    stream.armed(10)
    stream.feed(reading(0.0) + b"garbage\r\n", 0, awaited=False)
    got = stream.feed(reading(2.0), 0, awaited=False)
    assert got.counter.tolist() == [2] and got.flags.tolist() == [Flag.RESYNC]
    stream.interrupted()
    stream.armed(10)
    assert stream.feed(reading(3.0), 0, awaited=False).counter.tolist() == [4]


# ---- integers in and out of step ----------------------------------------------------------------------------------


SIGNALS = {
    "noise around zero": (0, 300),
    "a quiet input": (0, 2),
    "an offset": (200_000_000, 5_000),
    "a negative offset": (-1_234_567, 40_000),
    "large noise": (0, 60_000_000),
}


def integers(name: str, count: int) -> bytes:
    level, sigma = SIGNALS[name]
    noise = np.random.default_rng(7).normal(0, sigma, count)
    return np.round(level + noise).astype(">i4").tobytes()


def integer_stream(count: int) -> IntegerStream:
    stream = IntegerStream(pace=Pace(period_ns=1e6, speed=None), scale=5 / 2**31, range_volts=1.0)
    stream.armed(count)
    return stream


def volts(data: bytes) -> np.ndarray:
    return np.frombuffer(data, ">i4", count=len(data) // 4) * (5 / 2**31)


@pytest.mark.parametrize("name", SIGNALS)
@pytest.mark.parametrize("cut", [3, 4, 64, 999])
def test_integers_cut_anywhere_give_the_same_readings(name, cut):
    stream, data = integer_stream(250), integers(name, 250)
    out = [stream.feed(data[i : i + cut], 0, awaited=True) for i in range(0, len(data), cut)]
    np.testing.assert_array_equal(np.concatenate([d.values for d in out]), volts(data))
    assert np.concatenate([d.counter for d in out]).tolist() == list(range(250))


def test_a_jump_of_the_signal_is_no_fault():
    data = (
        integers("noise around zero", 100) + integers("an offset", 100) + integers("a negative offset", 100)
    )
    stream = integer_stream(300)
    out = [stream.feed(data[i : i + 80], 0, awaited=True) for i in range(0, len(data), 80)]
    np.testing.assert_array_equal(np.concatenate([d.values for d in out]), volts(data))


@pytest.mark.parametrize("name", SIGNALS)
@pytest.mark.parametrize("block", [28, 80, 4000])
def test_no_wrong_value_after_a_byte_lost_or_added(name, block):
    data = integers(name, 300)
    for at in range(400, 464, 5):
        for damaged in (data[:at] + data[at + 1 :], data[:at] + b"\x55" + data[at:]):
            stream, given = integer_stream(10_000), []
            for i in range(0, len(damaged), block):
                got = stream.feed(damaged[i : i + block], 0, awaited=True)
                given += got.values.tolist()
                if not got.in_step:
                    break
            assert not got.in_step and "out of step" in got.remarks[0]
            assert given == volts(data)[: len(given)].tolist()
            assert len(given) > at // 4 - 27


def test_a_block_refuses_what_does_not_belong_together():
    with pytest.raises(InputError, match="do not match"):
        Block(values=np.zeros((3, 1)), flags=np.zeros(2, np.uint8))
    with pytest.raises(InputError, match="counters"):
        Block(values=np.zeros((3, 1)), flags=np.zeros(3, np.uint8), counter=np.zeros(2, np.int64))
