# SPDX-License-Identifier: BSD-3-Clause
"""The counter that a device puts into its frames: which are new, which are missing, which came twice.

A counter that goes on by one step is the normal course. A small step forward is a gap: some frames are missing. No
step is a doubled frame, which is not given out.

Everything else is held back until what follows tells what it was. Behind a far jump forward one frame is enough: where
that follows the jump, the device has lost much; where it follows the last frame before, the jump was a stray frame. A
jump back is an old frame, or a buffer of them that is sent once more: they are dropped when the counter comes back to
where it was. A device that began to count anew does not come back; after `OLD` frames it is believed, and none is lost.
"""

from __future__ import annotations

from typing import Generic, TypeVar

from allanite.acquisition.instruments.serial_imu.tally import Tally
from allanite.lazy_dataclasses import dataclass

__all__ = ["NEAR", "OLD", "PlacedFrame", "Sequence"]

#: Steps that still count as near, as long as they are less than a sixteenth of the modulus.
NEAR = 64
#: So many frames from a jump back on are none that were sent once more; more than a buffer of the system keeps.
OLD = 256

Piece = TypeVar("Piece")


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacedFrame(Generic[Piece]):
    """A frame and its place.

    Attributes
    ----------
    piece
        The frame.
    number : int
        Of its sample, counted from the first one; jumps where samples are missing.
    jumped : bool
        It does not follow the one before.
    far : bool
        By how much it jumped the counter does not tell for certain: the device may have begun anew, or was away.
    turned : int
        What the counter went forward, in samples less whole turns.
    """

    piece: Piece
    number: int
    jumped: bool = False
    far: bool = False
    turned: int = 1


class Sequence(Generic[Piece]):
    """Frames in the order of their counter.

    Parameters
    ----------
    modulus : int
        The counter begins anew at zero when it reaches this.
    step : int
        What it goes on by from sample to sample.
    most_old : int
        Old frames in a row that are held back at most.
    """

    def __init__(self, modulus: int, step: int = 1, most_old: int = OLD) -> None:
        self._modulus = modulus
        self._step = step
        self._near = max(1, min(NEAR, modulus // step // 16)) * step
        # a short counter jumps back in every long gap: hold few
        self._most_old = max(1, min(most_old, OLD, modulus // step // 64))
        self._last: int | None = None
        self._held: list[tuple[int, Piece]] = []
        self._number = 0
        self._is_cut = False

    @property
    def held(self) -> int:
        """Frames that wait for what follows."""
        return len(self._held)

    def cut(self) -> None:
        """The stream was interrupted: whatever comes next is new, for the port was emptied."""
        self._held.clear()
        self._is_cut = self._last is not None

    def admit(self, raw: int, piece: Piece, tally: Tally) -> list[PlacedFrame[Piece]]:
        """What can be given out now that a frame with this counter has come, in order."""
        if self._last is None:
            self._last = raw
            return [PlacedFrame(piece=piece, number=0)]
        if self._is_cut:
            self._is_cut = False
            return [self._jump(raw, piece, tally)]
        forward = (raw - self._last) % self._modulus
        if forward == 0 or (self._held and raw == self._held[-1][0]):
            tally.doubled += 1
            return []
        if self._is_near(forward):
            self._drop_held(tally)
            return [self._follow(raw, piece, tally)]
        if self._held and not self._is_near((raw - self._held[-1][0]) % self._modulus):
            self._drop_held(tally)
        self._held.append((raw, piece))
        if len(self._held) <= (self._most_old if self._is_back(self._held[0][0]) else 1):
            return []
        (first, *others), self._held = self._held, []
        return [self._jump(*first, tally), *(self._follow(*other, tally) for other in others)]

    def _is_near(self, forward: int) -> bool:
        # half a step more: a counter that is a clock comes a little late
        return 0 < forward <= self._near + self._step // 2

    def _is_back(self, raw: int) -> bool:
        return (raw - (self._last or 0)) % self._modulus > self._modulus // 2

    def _drop_held(self, tally: Tally) -> None:
        if self._held and self._is_back(self._held[0][0]):
            tally.stale += len(self._held)
        else:
            tally.stray += len(self._held)
        self._held.clear()

    def _samples(self, raw: int) -> int:
        assert self._last is not None  # noqa: S101 - for the type checker
        return max(1, round((raw - self._last) % self._modulus / self._step))

    def _follow(self, raw: int, piece: Piece, tally: Tally) -> PlacedFrame[Piece]:
        gone = self._samples(raw)
        self._last = raw
        self._number += gone
        if gone > 1:
            tally.jumps += 1
            tally.lost += gone - 1
        return PlacedFrame(piece=piece, number=self._number, jumped=gone > 1, turned=gone)

    def _jump(self, raw: int, piece: Piece, tally: Tally) -> PlacedFrame[Piece]:
        """The far jump that turned out to be one."""
        gone = self._samples(raw)
        restarted = self._is_back(raw)
        self._last = raw
        self._number += 1 if restarted else gone
        tally.jumps += 1
        if restarted:
            tally.restarts += 1
        else:
            tally.lost += gone - 1
        return PlacedFrame(piece=piece, number=self._number, jumped=True, far=True, turned=gone)
