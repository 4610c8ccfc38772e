# SPDX-License-Identifier: BSD-3-Clause
"""A run that is damaged, made one that is whole: what verifies goes into a new folder, what does not is named.

Of each segment the batches up to the first that does not verify are kept, and those behind the damage that verify
again. The original is never touched.
"""

from __future__ import annotations

import hashlib
import os
from bisect import bisect_right
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import asdict, replace
from itertools import groupby, islice
from operator import itemgetter
from pathlib import Path
from typing import Any

from allanite.errors import StorageError
from allanite.files.store.batch import Batch
from allanite.files.store.header import Header
from allanite.files.store.manifest import NAME
from allanite.files.store.message import END, Message, NoBatch, Opening, find_message, message_at, why_none
from allanite.files.store.run import Run, open_run
from allanite.files.store.segment import Segment, opening_of, segment_name, segment_numbers
from allanite.files.store.writing import LogStore
from allanite.lazy_dataclasses import dataclass

__all__ = ["Loss", "Recovery", "recover"]

Advance = Callable[[float], None]

#: Lines of the manifest that a new run writes for itself.
_OWN = frozenset({"run", "closed", "change", "end"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Loss:
    """Bytes of a run that hold nothing to be relied on.

    Attributes
    ----------
    file : str
    offset, size : int
        Place of the bytes in the file.
    rows : int or None
        Samples that are missing there by their counter, but for those noted as missing; None where nothing tells.
    why : str
    """

    file: str
    offset: int
    size: int
    rows: int | None
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Recovery:
    """What was found in a run, and what was not.

    Attributes
    ----------
    folder : Path
    out : Path or None
        Where it was written; None where nothing was.
    kept : int
        Samples.
    losses : tuple of Loss
    status : str
        How the run ended; see `Run`.
    """

    folder: Path
    out: Path | None
    kept: int
    losses: tuple[Loss, ...]
    status: str

    @property
    def lost(self) -> int:
        """Samples that are known to be missing."""
        return sum(loss.rows or 0 for loss in self.losses)

    @property
    def exit_code(self) -> int:
        """0 all there, 3 with loss, 1 nothing."""
        return (3 if self.losses else 0) if self.kept else 1

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "folder": str(self.folder),
            "out": None if self.out is None else str(self.out),
            "status": self.status,
            "kept": self.kept,
            "lost": self.lost,
            "losses": [asdict(loss) for loss in self.losses],
        }


def recover(
    folder: str | os.PathLike[str], out: str | os.PathLike[str] | None, *, progress: Advance | None = None
) -> Recovery:
    """Read what can be read of a run, and write it as a new one.

    Parameters
    ----------
    folder : path
    out : path or None
        Another folder, without a run; None only looks.
    progress : callable, optional
        Called with the fraction that is done.

    Raises
    ------
    InputError, FormatError
        There is no run.
    StorageError
        It is still being recorded; `out` holds a run; the disk refuses.

    Notes
    -----
    A batch that was being written when the writer died is a loss, although it was never acknowledged. Bytes of a batch
    that the disk refused are none where its samples are in the segment behind.
    """
    run = open_run(folder)
    if run.status == "recording":
        raise StorageError(
            f"{folder} is still being recorded: read it directly, or stop the recorder to recover it"
        )
    rescue, store = _Rescue(run), None
    with ExitStack() as stack:
        for batch, header in rescue.batches(progress or (lambda fraction: None)):
            if out is None:
                continue
            if store is None:
                store = stack.enter_context(LogStore.create(out, header))
            elif header != store.header:
                store.change(header)
            store.append(batch)
        if store is not None:
            _close(store, run, rescue.losses)
    return Recovery(
        folder=run.folder,
        out=None if store is None else store.folder,
        kept=rescue.kept,
        losses=tuple(rescue.losses),
        status=run.status,
    )


def _close(store: LogStore, run: Run, losses: Sequence[Loss]) -> None:
    """Hand on what the manifest says, and what was lost."""
    handed_on = (event for event in run.manifest if event["kind"] not in _OWN)
    for kind, events in groupby(handed_on, key=lambda event: str(event["kind"])):
        store.note_each(kind, list(events))
    if losses:
        store.note_each("loss", [asdict(loss) for loss in losses])
    store.note("recovered", run=run.folder.name, status=run.status, reason=run.reason)
    if run.status in ("success", "abort", "fail"):
        store.close(run.status, run.reason)  # type: ignore[arg-type]
    else:
        store.close("fail", "the recorder died; recovered")


class _Rescue:
    """One pass over the bytes of a run."""

    def __init__(self, run: Run) -> None:
        self.kept = 0
        self.losses: list[Loss] = []
        self._run = run
        self._counter: int | None = None
        self._closed: dict[str, Mapping[str, Any]] = {
            e["segment"]: e for e in run.manifest if e["kind"] == "closed"
        }
        self._open: list[Loss] = []  # not yet known how many samples they held
        self._gaps = sorted(
            (int(e["counter"]), int(e["counter"]) + int(e["samples"]))
            for e in run.manifest
            if e["kind"] == "gap" and "counter" in e and "samples" in e
        )

    def batches(self, progress: Advance) -> Iterator[tuple[Batch, Header]]:
        openings = _openings(self._run)
        names = {segment_name(n) for n in segment_numbers(self._run.folder)}
        everything = sorted(names | set(self._closed))
        for k, name in enumerate(everything):
            progress(k / len(everything))
            if self._counter is None and self._closed.get(name, {}).get("first") is not None:
                self._counter = self._closed[name]["first"] - 1
            if name not in names:
                self._lose(name, 0, self._closed[name]["bytes"], "the file is missing")
            else:
                segment = Segment.load(self._run.folder / name)
                for message in self._messages(segment, openings):
                    if message.number == 0:  # before it there was none in this file
                        self._open = [loss for loss in self._open if loss.file != name]
                    batch = message.batch().after(self._counter)
                    if batch is not None:
                        self._settle(batch.first)
                        self._counter = batch.last
                        self.kept += len(batch)
                        yield batch, message.opening.header
            if name in self._closed:
                self._settle_closed(self._closed[name])
                if name in names:
                    self._compare(segment, self._closed[name])
        self.losses += self._open
        self._lose_unwritten()
        if lines := self._run.damaged_lines:
            self.losses.append(
                Loss(file=NAME, offset=0, size=0, rows=0, why=f"{lines} damaged line(s) left out")
            )

    def _messages(self, segment: Segment, openings: Sequence[Opening]) -> Iterator[Message]:
        """The batches of a segment, those behind damage as well; what lies between them is lost."""
        data, opening, at = segment.data, segment.opening or openings[0], 0
        while at < len(data) and data[at : at + len(END) + 1] != END:
            message = message_at(data, at, opening)
            if isinstance(message, NoBatch):
                why = why_none(data, at, opening).why if segment.opening else segment.fault.why
                behind = _next_message(data, at, openings)
                start = behind[0] if behind else len(data)
                self._lose(segment.name, segment.offset + at, start - at, why or "bytes behind the end")
                if behind is None:
                    return
                message = behind[1]
                opening = message.opening
            at = message.end
            yield message

    def _lose(self, file: str, offset: int, size: int, why: str) -> None:
        if size:
            self._open.append(Loss(file=file, offset=offset, size=size, rows=None, why=why))

    def _settle(self, counter: int) -> None:
        """A batch follows: what its number leaves out was lost, but for what was noted as missing while recording."""
        missing = self._unnoted(self._counter + 1, counter) if self._counter is not None else None
        if missing != 0:
            for k, loss in enumerate(self._open):
                self.losses.append(loss if k else replace(loss, rows=missing))
        self._open.clear()

    def _unnoted(self, first: int, stop: int) -> int:
        """Samples from one number to before another that no line notes as missing."""
        noted, at = 0, first
        for begin, end in islice(self._gaps, bisect_right(self._gaps, first, key=itemgetter(1)), None):
            if begin >= stop:
                break
            noted += max(min(end, stop) - max(at, begin), 0)
            at = max(at, end)
        return max(stop - first, 0) - noted

    def _settle_closed(self, facts: Mapping[str, Any]) -> None:
        """The end of a segment of which the manifest says how it ended."""
        if facts["last"] is not None and (self._counter is None or self._counter < facts["last"]):
            if not self._open:
                self._lose(facts["segment"], 0, facts["bytes"], "its end is missing")
            self._settle(facts["last"] + 1)
            self._counter = facts["last"]
        else:
            self._open.clear()  # behind what was acknowledged

    def _lose_unwritten(self) -> None:
        """Samples that the disk took no more."""
        end = next((e for e in reversed(self._run.manifest) if e["kind"] == "end"), {})
        written = end.get("written")
        last = -1 if self._counter is None else self._counter
        if end.get("status") == "fail" and written is not None and last < written:
            why = f"they were not stored: {end['reason']}"
            self.losses.append(Loss(file=NAME, offset=0, size=0, rows=written - last, why=why))

    def _compare(self, segment: Segment, facts: Mapping[str, Any]) -> None:
        """Batches that all verify are lost all the same where the file is not the one that was closed."""
        if segment.opening is None or any(loss.file == segment.name for loss in self.losses):
            return
        size = facts["bytes"]
        data = (segment.opening.data + segment.data)[:size]
        # A damaged mark of the end touches no sample.
        forms = (data, data[: -len(END)] + END)
        if facts["sha256"] not in (hashlib.sha256(form).hexdigest() for form in forms):
            why = "it changed after it was closed: its batches are valid, but its SHA-256 differs"
            self.losses.append(Loss(file=segment.name, offset=0, size=size, rows=None, why=why))


def _next_message(data: bytes, at: int, openings: Sequence[Opening]) -> tuple[int, Message] | None:
    """The first batch behind a place that verifies under any of the openings, and where it begins."""
    hits = [hit for opening in openings if (hit := find_message(data, at, opening)) is not None]
    return min(hits, key=lambda hit: hit[0], default=None)


def _openings(run: Run) -> list[Opening]:
    """All openings of a run; each segment may do with that of another, or with what the manifest says."""
    openings = (opening_of(run.folder / segment_name(n)) for n in segment_numbers(run.folder))
    known = {opening.crc: opening for opening in openings if opening is not None}
    for event in run.manifest:
        if event["kind"] == "run":
            opening = Opening.of(Header.from_json(event["header"]), event["run"])
            known.setdefault(opening.crc, opening)
    return list(known.values())
