# SPDX-License-Identifier: BSD-3-Clause
"""Commands of the 3458A (manual 03458-90014): settings -> lines to send, and how each setting reads back.

Pure functions; nothing here knows a wire. The language is older than SCPI: a command with `?` is a query, several
commands are chained with `;`, a word reads back as its number.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from typing import Literal

from allanite.errors import InputError, InstrumentError
from allanite.lazy_dataclasses import dataclass

__all__ = [
    "ARM",
    "CLEAR",
    "LONGEST_COUNT",
    "READING_BYTES",
    "REZERO",
    "STOP",
    "Format",
    "MeterSettings",
    "ReadBack",
    "aliasing_factor",
    "base_lines",
    "numbers_of",
    "read_backs",
    "refusals",
    "rounded_nplc",
    "trigger_lines",
]

Format = Literal["ASCII", "DINT"]

#: Readings that NRDGS counts at most: 6.07 days at 32 Hz.
LONGEST_COUNT = 16_777_215
#: Bytes of one reading on the wire: 15 characters and CR LF, or a big-endian 32-bit integer.
READING_BYTES: Mapping[Format, int] = {"ASCII": 17, "DINT": 4}
#: ASCII is safe on every adapter; above this rate [Hz] it is too many bytes.
ASCII_UP_TO = 200.0
#: Steps of TIMER and APER [s].
STEP = 1e-7
#: The converter needs so much of a period besides its aperture [s]; the reference leaves 50 us, untested on hardware.
OVERHEAD = 50e-6
#: The slower mains [Hz]: what fits there fits at 60 Hz too.
SLOW_MAINS = 50.0
RANGES = (0.1, 1.0, 10.0, 100.0, 1000.0)
SHORTEST_APERTURE, LONGEST_APERTURE = 500e-9, 1.0
LONGEST_TIMER = 6000.0
#: What LFREQ? [Hz], ISCALE? [V] and TEMP? [deg C] may answer; outside of it something else was read.
MAINS_HZ, SCALE, TEMPERATURE_C = (40.0, 450.0), (1e-15, 1000.0), (-40.0, 120.0)

CLEAR = ("TARM HOLD;TRIG HOLD", "RESET")
REZERO = "AZERO ONCE"
ARM = "TARM SGL,1"
STOP = "PRESET NORM;END ALWAYS"

#: Words of the language and the numbers that stand for them in an answer.
WORDS: Mapping[str, Mapping[str, float]] = {
    "TARM?": {"AUTO": 1, "EXT": 2, "SGL": 3, "HOLD": 4, "SYN": 5},
    "TRIG?": {"AUTO": 1, "EXT": 2, "SGL": 3, "HOLD": 4, "SYN": 5, "LEVEL": 7, "LINE": 8},
    "NRDGS?": {"AUTO": 1, "EXT": 2, "SYN": 5, "TIMER": 6, "LEVEL": 7, "LINE": 8},
    "OFORMAT?": {"ASCII": 1, "SINT": 2, "DINT": 3, "SREAL": 4, "DREAL": 5},
    "FUNC?": {"DCV": 1},
    "AZERO?": {"OFF": 0, "ON": 1, "ONCE": 2},
    "END?": {"OFF": 0, "ON": 1, "ALWAYS": 2},
    "MEM?": {"OFF": 0, "LIFO": 1, "FIFO": 2, "CONT": 3},
}
OFF_ON: Mapping[str, float] = {"OFF": 0, "ON": 1}


@dataclass(frozen=True, slots=True, kw_only=True)
class MeterSettings:
    """What the meter is asked to do: direct voltage at an even pace.

    Attributes
    ----------
    rate : float [Hz]
        Readings per second, paced by the TIMER of the meter.
    range_volts : float [V]
        Range, one of 0.1, 1, 10, 100, 1000; fixed, because a change of range is a change of the instrument.
    nplc : float, optional
        Aperture in periods of the mains, which are then suppressed. Neither this nor `aperture`: 1 where it fits
        into the period, else all of the period but 50 us.
    aperture : float, optional [s]
        500 ns to 1 s in steps of 100 ns.
    autozero : bool
        Zero reading before each reading, which takes twice the time.
    output : "ASCII" or "DINT", optional
        Format of the readings; by default ASCII up to 200 Hz.
    readings_per_arm : int
        Readings after which the meter is armed again, with a marked gap.

    Raises
    ------
    InputError
        A setting that the meter does not have, or an aperture that does not fit into the period.
    """

    rate: float
    range_volts: float = 10.0
    nplc: float | None = None
    aperture: float | None = None
    autozero: bool = False
    output: Format | None = None
    readings_per_arm: int = LONGEST_COUNT

    def __post_init__(self) -> None:
        if not (math.isfinite(self.rate) and 1 / LONGEST_TIMER <= self.rate <= 100_000):
            raise InputError(
                f"3458A: rate {self.rate!r} Hz; the meter paces from {1 / LONGEST_TIMER:.2g} to 100 000 Hz"
            )
        if self.range_volts not in RANGES:
            raise InputError(f"3458A: range {self.range_volts!r} V; take one of {RANGES}")
        if self.nplc is not None and self.aperture is not None:
            raise InputError("3458A: nplc and aperture are alternatives; give one of them")
        if self.nplc is not None and not 0 < self.nplc <= 1000:
            raise InputError(f"3458A: nplc {self.nplc!r}; more than 0, at most 1000")
        if self.aperture is not None and not SHORTEST_APERTURE <= self.aperture <= LONGEST_APERTURE:
            raise InputError(f"3458A: aperture {self.aperture!r} s; 500 ns to 1 s")
        if self.output not in (None, "ASCII", "DINT"):
            raise InputError(f"3458A: output {self.output!r}; take 'ASCII' or 'DINT'")
        if not 1 <= self.readings_per_arm <= LONGEST_COUNT:
            raise InputError(f"3458A: readings_per_arm {self.readings_per_arm}; 1 to {LONGEST_COUNT}")
        self._check_fit()

    def _check_fit(self) -> None:
        # The mains frequency is not known before the meter is asked; at 60 Hz the aperture is shorter than this.
        asked = self.aperture
        if asked is None:
            asked = rounded_nplc(self.nplc) / 60.0 if self.nplc is not None else SHORTEST_APERTURE
        needed = asked * (2 if self.autozero else 1)
        if needed > self.period:
            zero = " with a zero reading before each (autozero)" if self.autozero else ""
            raise InputError(
                f"3458A: an aperture of {asked * 1e3:.4g} ms{zero} does not fit into the period of "
                f"{self.period * 1e3:.4g} ms; lower the rate, shorten the aperture or switch autozero off"
            )

    @property
    def period(self) -> float:
        """TIMER [s], in the steps of the meter."""
        return round(1 / self.rate / STEP) * STEP

    @property
    def format(self) -> Format:
        """How readings travel."""
        return self.output or ("ASCII" if self.rate <= ASCII_UP_TO else "DINT")

    @property
    def integration(self) -> tuple[str, float]:
        """Command and number that set the aperture."""
        if self.nplc is not None:
            return "NPLC", self.nplc
        if self.aperture is not None:
            return "APER", round(self.aperture / STEP) * STEP
        room = self.period / (2 if self.autozero else 1) - OVERHEAD
        if room >= 1 / SLOW_MAINS:
            return "NPLC", 1.0
        # Below 100 us of period the overhead cannot be left; half of the period then.
        return "APER", max(math.floor(max(room, self.period / 4) / STEP) * STEP, SHORTEST_APERTURE)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadBack:
    """A query, the name its answer is stored under, and the numbers it must answer (None: stored only).

    `possible`: what no answer lies outside of. `is_setting` False: it changes by itself.
    """

    query: str
    name: str
    expected: tuple[float | None, ...] = (None,)
    tolerance: float = 1e-6
    possible: tuple[float, float] = (-math.inf, math.inf)
    is_setting: bool = True


def rounded_nplc(nplc: float) -> float:
    """What the meter makes of NPLC: 1 to 10 rounded up to whole numbers, above 10 to tens."""
    if nplc <= 1:
        return nplc
    return float(math.ceil(nplc)) if nplc <= 10 else float(math.ceil(nplc / 10) * 10)


def aliasing_factor(aperture: float, period: float) -> float:
    """Estimated N of white noise of a wide band over its true N: sqrt(Ts/Ta), at least 1."""
    return math.sqrt(max(period / aperture, 1.0))


def base_lines(settings: MeterSettings) -> tuple[str, ...]:
    """Everything between the clear and the verification, one chained line for each step of the sequence.

    INBUF ON stands before any TARM SGL, else the bus is held until the last reading. LFREQ LINE stands before NPLC,
    which is counted in periods of it.
    """
    command, number = settings.integration
    quiet = f"AZERO {'ON' if settings.autozero else 'OFF'};DELAY 0;MATH OFF;DISP OFF"
    return (
        "PRESET NORM;END ALWAYS;INBUF ON;TARM HOLD",
        f"LFREQ LINE;DCV {settings.range_volts:g};{command} {number:.9G};{quiet}",
        f"MEM OFF;OFORMAT {settings.format}",
        *trigger_lines(settings),
    )


def trigger_lines(settings: MeterSettings) -> tuple[str, ...]:
    """Pace and count; repeated before an arming that follows a device clear."""
    return (f"TRIG AUTO;TIMER {settings.period:.9G};NRDGS {settings.readings_per_arm},TIMER",)


def read_backs(settings: MeterSettings) -> tuple[ReadBack, ...]:
    """Every setting asked back, with what must come."""
    command, number = settings.integration
    integration = (
        ReadBack(query="APER?", name="aperture", expected=(number,), tolerance=1e-4)
        if command == "APER"
        else ReadBack(query="NPLC?", name="nplc", expected=(rounded_nplc(number),), tolerance=1e-4)
    )
    stored_only = "NPLC?" if command == "APER" else "APER?"
    return (
        ReadBack(query="END?", name="end", expected=(2,)),
        ReadBack(query="INBUF?", name="inbuf", expected=(1,)),
        ReadBack(query="TARM?", name="tarm", expected=(4,)),
        ReadBack(query="FUNC?", name="function", expected=(1, settings.range_volts)),
        integration,
        ReadBack(query=stored_only, name="nplc" if command == "APER" else "aperture", possible=(0.0, 1000.0)),
        ReadBack(query="AZERO?", name="autozero", expected=(float(settings.autozero),)),
        ReadBack(query="DELAY?", name="delay", expected=(0,)),
        ReadBack(query="MATH?", name="math", expected=(0,)),
        ReadBack(query="DISP?", name="display", expected=(0,)),
        ReadBack(query="LFREQ?", name="mains_hz", possible=MAINS_HZ),
        ReadBack(query="MEM?", name="memory", expected=(0,)),
        ReadBack(query="OFORMAT?", name="output", expected=(WORDS["OFORMAT?"][settings.format],)),
        ReadBack(query="TRIG?", name="trigger", expected=(1,)),
        ReadBack(query="TIMER?", name="timer", expected=(settings.period,), tolerance=1e-5),
        ReadBack(query="NRDGS?", name="readings", expected=(settings.readings_per_arm, 6)),
        ReadBack(query="ISCALE?", name="scale", possible=SCALE),
        ReadBack(query="TEMP?", name="temperature_c", possible=TEMPERATURE_C, is_setting=False),
    )


_NUMBER = re.compile(r"[+-]?(?:\d+\.?\d*|\.\d+)(?:E[+-]?\d+)?", re.IGNORECASE)


def numbers_of(query: str, answer: bytes) -> tuple[float, ...]:
    """Numbers of an answer; words are turned into theirs, a repeated heading is left out.

    Raises
    ------
    InstrumentError
        The answer is neither numbers nor known words.
    """
    words = {**OFF_ON, **WORDS.get(query, {})}
    text = answer.decode("ascii", "replace").strip().upper()
    heading = query.rstrip("?")
    numbers = []
    for part in text.replace(",", " ").split():
        if part == heading:
            continue
        if part in words:
            numbers.append(float(words[part]))
        elif _NUMBER.fullmatch(part) and math.isfinite(number := float(part)):
            numbers.append(number)
        else:
            raise InstrumentError(
                f"3458A: {query} answered {answer!r}, which is not a number; another device is using this "
                "line, or the answer was corrupted: clear the interface and try again"
            )
    if not numbers:
        raise InstrumentError(f"3458A: {query} gave an empty answer; clear the interface and try again")
    return tuple(numbers)


def refusals(readback: ReadBack, got: tuple[float, ...]) -> str:
    """Why the answer is not what was set; "" when it is."""
    wanted, (least, most) = readback.expected, readback.possible
    if any(not least <= have <= most for have in got):
        answers = ", ".join(f"{g:.9g}" for g in got)
        return f"{readback.query} answers {answers}, which is impossible: {least:g} to {most:g}"
    for want, have in zip(wanted, got, strict=False):
        # Times are compared in relative terms, zeros within half a step of the meter.
        if want is not None and abs(have - want) > max(readback.tolerance * abs(want), STEP / 2):
            return f"{readback.query} answers {', '.join(f'{g:.9g}' for g in got)} instead of {_show(wanted)}"
    if len(got) < len(wanted):
        return f"{readback.query} answers {len(got)} numbers instead of {len(wanted)}"
    return ""


def _show(wanted: tuple[float | None, ...]) -> str:
    return ", ".join("anything" if w is None else f"{w:.9g}" for w in wanted)
