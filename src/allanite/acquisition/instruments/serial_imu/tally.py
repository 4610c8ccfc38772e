# SPDX-License-Identifier: BSD-3-Clause
"""What was dropped on the way from bytes to samples, counted."""

from __future__ import annotations

from dataclasses import astuple, fields, replace

from allanite.lazy_dataclasses import dataclass

__all__ = ["Tally"]


@dataclass(slots=True, kw_only=True)
class Tally:
    """Counts since the port was opened for the first time; none depends on how the stream was cut into pieces.

    Attributes
    ----------
    frames : int
        Frames or lines that became samples.
    skipped : int
        Bytes that belong to no frame: garbage, partial and damaged frames.
    failed : int
        Frames whose checksum is wrong, false headers among garbage included.
    unconfirmed : int
        Frames behind which the next one did not begin.
    unreadable, uneven : int
        Lines with cells that are no numbers, and with another number of cells than described.
    others : int
        Whole frames or lines of another kind.
    doubled, stale, stray : int
        Frames that came a second time; that are older than the last one; with an inconsistent counter.
    impossible : int
        Samples with a value beyond its limits.
    jumps, lost, restarts : int
        Places where the counter jumped, samples that are missing there, and those where nobody can tell how many.
    """

    frames: int = 0
    skipped: int = 0
    failed: int = 0
    unconfirmed: int = 0
    unreadable: int = 0
    uneven: int = 0
    others: int = 0
    doubled: int = 0
    stale: int = 0
    stray: int = 0
    impossible: int = 0
    jumps: int = 0
    lost: int = 0
    restarts: int = 0

    def copy(self) -> Tally:
        """The counts as they stand now."""
        return replace(self)

    def since(self, before: Tally) -> Tally:
        """What came in since."""
        now, then = astuple(self), astuple(before)
        names = [f.name for f in fields(self)]
        return Tally(**{name: a - b for name, a, b in zip(names, now, then, strict=True)})

    def sentences(self) -> tuple[str, ...]:
        """One sentence for each thing that went wrong; none in the normal course."""
        said_of_faults = []
        if self.skipped:
            said_of_faults.append(
                f"skipped {_many(self.skipped, 'byte')} outside complete frames{self._why()}"
            )
        if self.doubled:
            said_of_faults.append(f"dropped {_many(self.doubled, 'frame')} received twice")
        if self.stale:
            said_of_faults.append(f"dropped {_many(self.stale, 'frame')} older than the last one")
        if self.stray:
            said_of_faults.append(f"dropped {_many(self.stray, 'frame')} with an inconsistent counter")
        if self.impossible:
            said_of_faults.append(
                f"left out values beyond their limits in {_many(self.impossible, 'sample')}"
            )
        if self.restarts:
            said_of_faults.append(
                f"the counter jumped back {_many(self.restarts, 'time')} (a restart, or a wrap)"
            )
        if self.jumps > self.restarts:
            said_of_faults.append(
                f"the counter jumped {_many(self.jumps - self.restarts, 'time')}: "
                f"{_many(self.lost, 'sample')} missing"
            )
        return tuple(said_of_faults)

    def _why(self) -> str:
        reasons = [
            f"{number} with {what}"
            for number, what in (
                (self.failed, "a wrong checksum"),
                (self.unconfirmed, "no frame behind"),
                (self.unreadable, "unreadable cells"),
                (self.uneven, "another number of cells than described"),
            )
            if number
        ]
        return f" ({', '.join(reasons)})" if reasons else ""


def _many(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"
