# SPDX-License-Identifier: BSD-3-Clause
"""A 3458A as a state machine: bytes of commands in, bytes of answers and readings out, misbehaving when asked to.

Written from the manual and the reference, not from an instrument. It knows the commands that the driver uses; every
other one raises its error register, as a misspelt command would. Its time is the host's times `speed`; without a speed
each reading is due at once, and a week passes as fast as it is read.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from allanite.acquisition.instruments import host_ns
from allanite.acquisition.instruments.hp3458a.commands import OFF_ON, WORDS, rounded_nplc
from allanite.lazy_dataclasses import dataclass

__all__ = ["MeterFault", "SimulatedIdentity", "SimulatedMeter", "counting"]

Signal = Callable[[NDArray[np.int64]], NDArray[np.float64]]
Kind = Literal[
    "overload", "partial", "doubled", "garbage", "lose", "lose_byte", "silence", "delay", "drop", "answer"
]
#: Settings at power-on; PRESET NORM differs in the trigger.
POWER_ON: dict[str, tuple[float, ...]] = {
    "END": (0,),
    "INBUF": (0,),
    "TARM": (1,),
    "TRIG": (1,),
    "FUNC": (1, 10.0),
    "AZERO": (1,),
    "DELAY": (0,),
    "MATH": (0, 0),
    "DISP": (1,),
    "MEM": (0,),
    "OFORMAT": (1,),
    "TIMER": (1.0,),
    "NRDGS": (1, 1),
}
POWER_ON_NPLC = 10.0
DINT_SPAN = 5.0  # of the range


@dataclass(frozen=True, slots=True, kw_only=True)
class SimulatedIdentity:
    """What the meter says of itself; `calibration` "" is an old one that does not know CALSTR?."""

    model: str = "HP3458A"
    firmware: str = "9,2"
    calibrations: int = 104
    calibration: str = "simulated"


@dataclass(frozen=True, slots=True, kw_only=True)
class MeterFault:
    """One misbehaviour.

    Attributes
    ----------
    at : int or str
        Reading number since power-on, or a query such as "ID?".
    kind : str
        Of a reading: "overload", "partial" (the line ends after five characters), "doubled", "garbage" (`data` before
        it), "lose", "lose_byte". Of the link: "silence" (for `seconds`; what is due meanwhile is lost), "delay" (it
        comes afterwards), "drop" (the link breaks, the meter comes back at power-on after `seconds`, as `identity`
        if given and at other mains if `mains_hz` is given). Of a query: "answer" (`data` instead of the answer).
    count : int
        Readings lost.
    """

    at: int | str
    kind: Kind
    seconds: float = 0.0
    data: bytes = b""
    count: int = 1
    identity: SimulatedIdentity | None = None
    mains_hz: float | None = None


def counting(index: NDArray[np.int64]) -> NDArray[np.float64]:
    """Volts that tell the number of their reading: one microvolt each, from zero again after a million."""
    return ((index % 1_000_000) * 1e-6).astype(np.float64)


class SimulatedMeter:
    """The meter without any wire.

    Parameters
    ----------
    signal : callable
        Voltage of readings by their number since power-on.
    faults : sequence of MeterFault
        Faults to simulate.
    speed : float or None
        The meter's time against the host's; None: every reading is due at once.
    mains_hz : float
        Mains frequency.
    """

    def __init__(
        self,
        *,
        signal: Signal = counting,
        faults: Sequence[MeterFault] = (),
        speed: float | None = 1.0,
        identity: SimulatedIdentity | None = None,
        mains_hz: float = 50.0,
    ) -> None:
        self.identity = identity or SimulatedIdentity()
        self.executed: list[str] = []
        self.dropped: MeterFault | None = None
        self.index = 0  # readings made since power-on
        self._signal, self._speed, self._mains = signal, speed, mains_hz
        self._faults = sorted((f for f in faults if isinstance(f.at, int)), key=lambda f: int(f.at))
        self._on_query = {f.at: f for f in faults if isinstance(f.at, str)}
        self._silent_until = 0
        self.power_on()

    def come_back(self, fault: MeterFault) -> None:
        """Switched on again after a "drop"."""
        self.identity = fault.identity or self.identity
        self._mains = fault.mains_hz or self._mains
        self.power_on()

    def power_on(self) -> None:
        """As after the mains switch."""
        self._state = {name: tuple(value) for name, value in POWER_ON.items()}
        self._aperture = POWER_ON_NPLC / self._mains
        self._errors: list[str] = []
        self._input: deque[str] = deque()
        self._output: deque[bytes] = deque()
        self._partial = b""
        self._left = self._done = 0
        self._origin = 0
        self.dropped = None

    # ---- commands ------------------------------------------------------------------------------------------------

    def receive(self, data: bytes) -> None:
        """Bytes from the bus; whole lines are carried out, or wait until the readings end."""
        *lines, self._partial = (self._partial + data).split(b"\n")
        for line in lines:
            self._input.extend(part.strip().upper() for part in line.decode("ascii", "replace").split(";"))
        self._work()

    def clear(self) -> None:
        """Device clear: readings end, both buffers are emptied, settings stay."""
        self._left = 0
        self._input.clear()
        self._output.clear()
        self._partial = b""

    @property
    def measuring(self) -> bool:
        """Readings of an arming are still to come."""
        return self._left > 0

    def _work(self) -> None:
        while self._input and not self.measuring:
            command = self._input.popleft()
            if command:
                self.executed.append(command)
                self._answer(command) if command.endswith("?") else self._obey(command)

    def _obey(self, command: str) -> None:
        name, _, rest = command.partition(" ")
        arguments = [part.strip() for part in rest.split(",") if part.strip()]
        special: dict[str, Callable[[], None]] = {
            "RESET": self.power_on_settings,
            "PRESET": self._preset,
            "NPLC": lambda: self._set_aperture(rounded_nplc(float(rest)) / self._mains),
            "APER": lambda: self._set_aperture(round(float(rest), 7)),
            "LFREQ": lambda: None,  # the mains are what they are
            "DCV": lambda: self._set_range(float(rest)),
        }
        try:
            if name in special:
                special[name]()
            elif name in self._state and arguments:
                self._state[name] = self._numbers(name, arguments)
                self._after(name)
            else:
                self._errors.append("COMMAND NOT KNOWN")
        except (ValueError, KeyError):
            self._errors.append("PARAMETER NOT KNOWN")

    def _numbers(self, name: str, arguments: list[str]) -> tuple[float, ...]:
        words = {**OFF_ON, **WORDS.get(f"{name}?", {})}
        return tuple(words[a] if a in words else float(a) for a in arguments)

    def _after(self, name: str) -> None:
        """What follows from a setting just made."""
        number = self._state[name][0]
        if name == "MATH":
            self._state["MATH"] = (number, 0)
        elif name == "AZERO" and number == 2:
            self._state["AZERO"] = (0,)
        elif name == "TARM" and number == 3:
            self._left, self._done = int(self._state["NRDGS"][0]), 0
            self._origin = host_ns()
            self._state["TARM"] = (4,)

    def _preset(self) -> None:
        self._state = {name: tuple(value) for name, value in POWER_ON.items()} | {"TRIG": (5,)}
        self._aperture = 1 / self._mains

    def power_on_settings(self) -> None:
        """RESET."""
        self._state = {name: tuple(value) for name, value in POWER_ON.items()}
        self._aperture = POWER_ON_NPLC / self._mains

    def _set_range(self, volts: float) -> None:
        self._state["FUNC"] = (1, volts)

    def _set_aperture(self, seconds: float) -> None:
        self._aperture = seconds

    def _answer(self, query: str) -> None:
        fault = self._on_query.pop(query, None)
        if fault is not None and fault.kind == "answer":
            if fault.data:
                self._output.append(fault.data)
            return
        answer = self._said(query)
        if answer is None:
            self._errors.append("COMMAND NOT KNOWN")
        else:
            self._output.append(answer.encode() + b"\r\n")

    def _said(self, query: str) -> str | None:
        name = query[:-1]
        answers = {
            "ID": self.identity.model,
            "REV": self.identity.firmware,
            "CALNUM": str(self.identity.calibrations),
            "TEMP": "36.4",
            "LFREQ": f"{self._mains:.9E}",
            "APER": f"{self._aperture:.9E}",
            "NPLC": f"{self._aperture * self._mains:.9E}",
            "ISCALE": f"{self._scale:.9E}",
        }
        if name in ("ERR", "ERRSTR"):
            errors, self._errors = self._errors, []
            if name == "ERR":
                return str(len(errors))
            return f'{100 + len(errors[0])},"{errors[0]}"' if errors else '0,"NO ERROR"'
        if name == "CALSTR":
            return f'"{self.identity.calibration}"' if self.identity.calibration else None
        if name in answers:
            return answers[name]
        if name in self._state:
            return ",".join(str(int(v)) if v == int(v) else f"{v:.9E}" for v in self._state[name])
        return None

    # ---- readings ------------------------------------------------------------------------------------------------

    @property
    def _scale(self) -> float:
        # Rounded as the answer to ISCALE? is, so that both sides mean the same number.
        return (
            float(f"{DINT_SPAN * self._state['FUNC'][1] / 2**31:.9E}")
            if self._state["OFORMAT"][0] == 3
            else 1.0
        )

    def message(self) -> bytes:
        """The next message on the bus: an answer or one reading; empty when there is none yet."""
        return self._next(1)

    def take(self, limit: int) -> bytes:
        """All messages that are due, up to about `limit` bytes."""
        out = bytearray()
        while len(out) < limit and (part := self._next(max((limit - len(out)) // 4, 1))):
            out += part
        return bytes(out)

    def lose_due(self, keep: int) -> int:
        """A host that reads too slowly: of the readings that are due, only the newest `keep` are still there."""
        lost = 0 if self._speed is None else max(self._due() - keep, 0)
        self._skip(lost)
        return lost

    def _next(self, readings: int) -> bytes:
        if host_ns() < self._silent_until or self.dropped:
            return b""
        if self._output:
            return self._output.popleft()
        n = min(self._due(), readings)
        out = self._readings(n) if n > 0 else b""
        self._work()
        return out

    def _due(self) -> int:
        if self._speed is None or not self._left:
            return self._left
        passed = (host_ns() - self._origin) * 1e-9 * self._speed
        return min(int(passed / self._state["TIMER"][0]) - self._done, self._left)

    def _readings(self, n: int) -> bytes:
        fault = self._faults[0] if self._faults else None
        if fault is None or int(fault.at) >= self.index + n:
            return self._encode(n)
        if int(fault.at) > self.index:
            return self._encode(int(fault.at) - self.index)
        return self._misbehave(self._faults.pop(0))

    def _encode(self, n: int) -> bytes:
        volts = self._signal(np.arange(self.index, self.index + n, dtype=np.int64))
        self._skip(n)
        if self._state["OFORMAT"][0] == 3:
            raw = np.where(
                np.abs(volts) >= 1e38, np.copysign(2**31 - 1, volts), np.round(volts / self._scale)
            )
            return bytes(raw.astype(">i4").tobytes())
        return b"".join(b"%+.8E\r\n" % v for v in volts.tolist())

    def _skip(self, n: int) -> None:
        self.index += n
        self._done += n
        self._left -= n

    def _misbehave(self, fault: MeterFault) -> bytes:
        if fault.kind == "overload":
            plain, self._signal = self._signal, lambda index: np.full(len(index), 1e38)
            out = self._encode(1)
            self._signal = plain
            return out
        if fault.kind == "lose":
            self._skip(min(fault.count, self._left))
            return self._next(1)
        if fault.kind in ("silence", "delay"):
            self._silent_until = host_ns() + round(fault.seconds * 1e9)
            if fault.kind == "silence" and self._speed is not None:
                lost = fault.seconds * self._speed / self._state["TIMER"][0]
                self._skip(min(round(lost), self._left))
            return b""
        if fault.kind == "drop":
            self.dropped = fault
            return b""
        reading = self._encode(1)
        return {
            "partial": reading[:5] + b"\r\n",
            "doubled": reading + reading,
            "garbage": fault.data + reading,
            "lose_byte": reading[1:],
        }[fault.kind]
