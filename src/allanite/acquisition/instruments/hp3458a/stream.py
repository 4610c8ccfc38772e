# SPDX-License-Identifier: BSD-3-Clause
"""The stream of the 3458A between two armings: bytes in -> numbered samples out, with what is wrong said.

Two forms, lines and integers, with the same face: `feed` takes bytes and gives what has become certain, `interrupted`
says that the next bytes come after a break.
"""

from __future__ import annotations

from dataclasses import field
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from allanite.acquisition.instruments import Flag
from allanite.acquisition.instruments.hp3458a.answers import LONGEST_LINE, parse_dint, parse_lines
from allanite.acquisition.instruments.hp3458a.byte_step import NINE, ByteStep
from allanite.acquisition.instruments.hp3458a.pace import Pace
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural

__all__ = ["Decoded", "IntegerStream", "LineStream", "Stream"]

STALLED = "it resumed after a long silence, perhaps switched off and on; left out until it was queried"
SILENT = "{} did not come while it was silent"
LOST = "{} did not come, by the clock; the loss may lie up to a second before this block"


@dataclass(frozen=True, slots=True, kw_only=True)
class Decoded:
    """Samples that became certain: values [V], flags and counter of shape (n,).

    `in_step` False: what follows cannot be read any more, and the meter must be armed again. `uncertainty`: see
    `allanite.acquisition.instruments.Block.gap_uncertainty`.
    """

    values: NDArray[np.float64]
    flags: NDArray[np.uint8]
    counter: NDArray[np.int64]
    remarks: tuple[str, ...] = ()
    in_step: bool = True
    uncertainty: float | None = None


class Stream(Protocol):
    """What the driver asks of either form."""

    #: Bytes of one reading, and of one message of the meter (None: up to a line feed).
    width: int
    message: int | None

    @property
    def left(self) -> int:
        """Readings that this arming still owes, lost ones not counted."""
        ...

    @property
    def begun(self) -> int:
        """Bytes of a reading whose end has not come."""
        ...

    def feed(self, data: bytes, now: int, *, awaited: bool, silent: bool = False) -> Decoded:
        """Take bytes that were there at `now` [ns of the meter's time]; `awaited`, `silent`: see `Pace.place`."""
        ...

    def armed(self, readings: int) -> None:
        """The meter was armed for so many; what was not whole is gone."""
        ...

    def interrupted(self) -> None:
        """The next reading follows a break of unknown length."""
        ...


@dataclass(slots=True, kw_only=True)
class _Arming:
    """What both forms keep: the place on the grid, the readings owed, and whether a break lies behind."""

    pace: Pace
    left: int = 0
    resync: bool = False
    rest: bytes = field(default=b"", repr=False)

    def armed(self, readings: int) -> None:
        self.left, self.rest = readings, b""

    def interrupted(self) -> None:
        self.pace.pause()
        self.resync = True

    def number(
        self, values: NDArray[np.float64], flags: NDArray[np.uint8], missing: int, breaks: list[int]
    ) -> tuple[NDArray[np.uint8], NDArray[np.int64]]:
        """Flags and counter of samples with `missing` readings lost at the `breaks` (places among them)."""
        n = len(values)
        flags = flags.copy()
        counter = self.pace.count + np.arange(n, dtype=np.int64)
        if n and self.resync:
            breaks = [0, *breaks]
            self.resync = False
        elif missing and not breaks:
            breaks = [0]
        for place, share in zip(breaks, _shares(missing, len(breaks)), strict=True):
            counter[place:] += share
            if place < n:
                flags[place] |= Flag.RESYNC
            else:
                self.resync = True
        self.pace.advance(n, missing)
        return flags, counter


def _shares(missing: int, breaks: int) -> list[int]:
    """One lost reading for each break as far as they go; the last gets the rest, of which the clock alone knows."""
    shares = []
    for i in range(breaks):
        share = missing if i == breaks - 1 else min(1, missing)
        shares.append(share)
        missing -= share
    return shares


@dataclass(slots=True, kw_only=True)
class LineStream(_Arming):
    """ASCII.

    Attributes
    ----------
    range_volts : float [V]
    """

    range_volts: float
    width: int = 17
    message: int | None = None
    _rejected: int = 0  # lines since the last good reading
    _last: float = float("nan")

    @property
    def begun(self) -> int:
        return len(self.rest)

    def feed(self, data: bytes, now: int, *, awaited: bool, silent: bool = False) -> Decoded:
        lines = parse_lines(self.rest + data, self.range_volts)
        self.rest = lines.rest
        remarks = [
            f"rejected {line[:LONGEST_LINE]!r}, which is not a reading of the {self.range_volts:g} V range"
            for line in lines.rejected
        ]
        values, flags = lines.values, lines.flags
        breaks = [0] * self._rejected + list(lines.breaks)
        self._rejected = 0
        if not len(values):
            self._rejected = len(breaks)
            return _nothing(remarks)
        after_break = self.resync
        # The start of another line says that its reading has been made too.
        made = len(values) + bool(self.rest)
        twins = np.flatnonzero(np.diff(values, prepend=self._last) == 0)
        placed = self.pace.place(
            made, now, rejected=len(breaks), awaited=awaited, silent=silent, twins=len(twins)
        )
        if placed.stalled:
            return _nothing([*remarks, STALLED], in_step=False)
        if placed.surplus:
            values, flags = self._without(twins, values, flags, placed.surplus, remarks)
        if placed.missing and not (breaks or after_break):
            remarks.append((SILENT if silent else LOST).format(plural(placed.missing, "reading")))
            flags[0] |= 0 if silent else Flag.DOUBTFUL
        self.left -= len(values) + (0 if after_break else placed.missing)
        self._last = float(values[-1]) if len(values) else self._last
        flags, counter = self.number(values, flags, placed.missing, breaks)
        return Decoded(
            values=values,
            flags=flags,
            counter=counter,
            remarks=tuple(remarks),
            uncertainty=placed.uncertainty,
        )

    def _without(
        self,
        twins: NDArray[np.intp],
        values: NDArray[np.float64],
        flags: NDArray[np.uint8],
        surplus: int,
        remarks: list[str],
    ) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
        """Take out lines that came twice: the clock says how many there are, equality which."""
        if len(twins) != surplus:
            remarks.append(
                f"{plural(surplus, 'reading')} more than the clock allows, undetermined which; "
                "counter doubtful from here"
            )
            flags[0] |= Flag.DOUBTFUL | Flag.RESYNC
            self.pace.rebase()
            return values, flags
        remarks.append(f"{plural(surplus, 'reading')} came twice; kept once")
        keep = np.ones(len(values), dtype=bool)
        keep[twins] = False
        return values[keep], flags[keep]


@dataclass(slots=True, kw_only=True)
class IntegerStream(_Arming):
    """DINT.

    Attributes
    ----------
    scale : float [V]
        Of one step (ISCALE?).
    range_volts : float [V]
    """

    scale: float
    range_volts: float
    width: int = 4
    message: int | None = 4
    _step: ByteStep = field(default_factory=ByteStep)

    @property
    def begun(self) -> int:
        return len(self.rest) % 4

    def feed(self, data: bytes, now: int, *, awaited: bool, silent: bool = False) -> Decoded:
        held = len(self.rest) // 4
        stream = self.rest + data
        values, flags, wrong = parse_dint(stream, self.scale, self.range_volts)
        whole = len(values)
        after_break = self.resync
        placed = self.pace.place(whole, now, awaited=awaited, silent=silent) if whole else None
        if placed and placed.stalled:
            return _nothing([STALLED], in_step=False)
        missing = placed.missing if placed else 0
        self.left -= whole - held + (0 if after_break else missing)
        remarks: list[str] = []
        given, in_step = self._certain(stream, whole, wrong)
        if not in_step:
            remarks.append("bytes out of step (some were lost or added); uncertain readings were left out")
        self.rest = stream[4 * given :]
        values, flags = values[:given], flags[:given]
        if placed and placed.surplus:
            self.pace.rebase()
            remarks.append(
                f"{plural(placed.surplus, 'reading')} more than the clock allows; counter doubtful from here"
            )
            flags[:1] |= Flag.DOUBTFUL
        if missing and not after_break:
            remarks.append((SILENT if silent else LOST).format(plural(missing, "reading")))
            flags[:1] |= 0 if silent else Flag.DOUBTFUL
        flags, counter = self.number(values, flags, missing, [])
        return Decoded(
            values=values,
            flags=flags,
            counter=counter,
            remarks=tuple(remarks),
            in_step=in_step,
            uncertainty=placed.uncertainty if placed else None,
        )

    def armed(self, readings: int) -> None:
        _Arming.armed(self, readings)
        self._step = ByteStep()

    def _certain(self, stream: bytes, whole: int, wrong: int | None) -> tuple[int, bool]:
        """How many readings may be given, and whether the bytes are in step as far as one can see."""
        given, in_step = self._step.certain(stream)
        if wrong is not None:
            return max(min(given, wrong - NINE), 0), False
        # The last readings of a count need no proof: had bytes been lost, it would not be complete.
        return (whole if in_step and self.left <= 0 else given), in_step


def _nothing(remarks: list[str], *, in_step: bool = True) -> Decoded:
    return Decoded(
        values=np.empty(0),
        flags=np.empty(0, dtype=np.uint8),
        counter=np.empty(0, dtype=np.int64),
        remarks=tuple(remarks),
        in_step=in_step,
    )
