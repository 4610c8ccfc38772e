# SPDX-License-Identifier: BSD-3-Clause
"""What a run on disk holds and lacks: the numbers that `info`, `recover` and a recording that failed state."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.regular_file import file_sha256

if TYPE_CHECKING:
    from allanite.files.store import Loss, Recovery, Run

__all__ = ["RunAccount", "account_of", "account_of_recovery", "kept_in"]

_ENDED = {
    "recording": "it is still being recorded",
    "abort": "it was stopped",
    "fail": "it ended with a failure",
    "unfinished": "it was never closed: the recorder died, or this is a copy made while it ran",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class RunAccount:
    """What a run holds and lacks.

    Attributes
    ----------
    kept : int
        Samples that can be read.
    losses : tuple of Loss
        Bytes that hold nothing to be relied on; see `allanite.files.store.recover`.
    missing, gaps : int
        Samples that did not come, and in how many stretches, as noted while recording.
    remarks : int
        Of the instrument.
    status, reason : str
        How the run ended; see `allanite.files.store.Run`.
    """

    kept: int
    losses: tuple[Loss, ...]
    missing: int
    gaps: int
    remarks: int
    status: str
    reason: str

    @property
    def lost(self) -> int:
        """Samples that are known to be lost."""
        return sum(loss.rows or 0 for loss in self.losses)

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        facts = {
            name: getattr(self, name)
            for name in ("kept", "lost", "missing", "gaps", "remarks", "status", "reason")
        }
        return {**facts, "losses": [asdict(loss) for loss in self.losses]}

    def sentences(self) -> list[str]:
        """The same in words."""
        gap = "gap" if self.gaps == 1 else "gaps"
        missing = f"{self.missing} missing in {self.gaps} {gap}" if self.missing else "none missing"
        sentences = [f"{self.kept} samples stored, {missing}"]
        if self.status in _ENDED:
            sentences.append(_ENDED[self.status] + (f" ({self.reason})" if self.reason else ""))
        for loss in self.losses:
            rows = "samples not known" if loss.rows is None else f"{loss.rows} samples"
            sentences.append(
                f"lost: {rows}, {loss.file} from byte {loss.offset}, {loss.size} bytes: {loss.why}"
            )
        return sentences


def account_of(log: str | os.PathLike[str]) -> RunAccount | None:
    """What a run holds and lacks; None for any other log.

    A run that was closed in order, and whose files are those that were closed, is counted by its manifest. Any other
    one is looked through as `allanite.files.store.recover` does.

    Raises
    ------
    FormatError, StorageError
        Nothing of it can be read, or the disk refuses.
    """
    place = Path(log)
    if not place.is_dir():
        return None
    from allanite.files.readers.run import sniff
    from allanite.files.store import open_run, recover

    if not sniff(b"", place):
        return None
    run = open_run(place)
    if run.status == "recording" or _is_sound(run):
        return _account(run, kept_in(run))
    recovery = recover(place, None)
    return _account(run, recovery.kept, recovery.losses)


def account_of_recovery(recovery: Recovery) -> RunAccount:
    """The same of a run that was recovered."""
    from allanite.files.store import open_run

    return _account(open_run(recovery.folder), recovery.kept, recovery.losses)


def kept_in(run: Run) -> int:
    """Samples of a run that was just closed: those of its closed segments, and what can be read behind them."""
    from allanite.files.store import ReadPosition

    kept, number, counter = 0, 1, None
    for facts in _closed(run):
        if "error" in facts:
            break
        kept, number = kept + facts["rows"], number + 1
        counter = counter if facts["last"] is None else facts["last"]
    position = ReadPosition(segment=number, counter=counter)
    while True:
        batches, position = run.tail(replace(position, opening=None))  # of all parts
        if not batches:
            return kept
        kept += sum(map(len, batches))


def _account(run: Run, kept: int, losses: tuple[Loss, ...] = ()) -> RunAccount:
    gaps = [e for e in run.manifest if e["kind"] == "gap" and "samples" in e]
    return RunAccount(
        kept=kept,
        losses=losses,
        missing=sum(int(e["samples"]) for e in gaps),
        gaps=len(gaps),
        remarks=sum(int(e.get("more", 1)) for e in run.manifest if e["kind"] == "remark"),
        status=run.status,
        reason=run.reason,
    )


def _closed(run: Run) -> list[Mapping[str, Any]]:
    return sorted((e for e in run.manifest if e["kind"] == "closed"), key=lambda e: str(e["segment"]))


def _is_sound(run: Run) -> bool:
    """Closed in order, and every byte of it is as it was then."""
    end = next((e for e in reversed(run.manifest) if e["kind"] == "end"), None)
    if end is None or end.get("last") != end.get("written") or run.damaged_lines:
        return False
    closed = {str(e["segment"]): e for e in _closed(run)}
    there = {path.name for path in run.folder.glob("[0-9]*.arrows")}
    return there == closed.keys() and all(
        "error" not in facts and file_sha256(run.folder / name) == facts["sha256"]
        for name, facts in closed.items()
    )
