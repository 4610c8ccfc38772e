# SPDX-License-Identifier: BSD-3-Clause
"""A run as it is read: finished, broken off, or still going; nobody who reads disturbs the writer."""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterator, Sequence
from dataclasses import field
from pathlib import Path

import numpy as np

from allanite.errors import DataQualityError, FormatError, InputError
from allanite.files.store.batch import Batch
from allanite.files.store.header import Header
from allanite.files.store.manifest import Line, is_locked, read_manifest
from allanite.files.store.message import END, Message, NoBatch
from allanite.files.store.rows import SegmentRows
from allanite.files.store.segment import ReadPosition, Segment, read_on, segment_name, segment_numbers
from allanite.files.store.survey import Piece, RunSurvey
from allanite.lazy_dataclasses import dataclass
from allanite.recording.channel_names import for_shell
from allanite.recording.records import Recording

__all__ = ["Run", "noted_end", "open_run"]

#: Batches of a segment whose clocks are kept: every second one goes when there are so many.
_MARKS = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Run:
    """A run on disk.

    Attributes
    ----------
    folder : Path
    header : Header
        That of the first part.
    manifest : tuple of dict
        Its lines that verify: `kind`, both clocks, and facts.
    damaged_lines : int
        Those that do not.
    status : str
        "recording", "success", "abort", "fail", or "unfinished": the writer died.
    reason : str
        What the end was noted with.
    """

    folder: Path
    header: Header
    manifest: tuple[Line, ...] = field(repr=False)
    damaged_lines: int
    status: str
    reason: str

    def batches(self, part: int | None = None) -> Iterator[Batch]:
        """The batches that verify, in order; of each segment those before the first that does not.

        Parameters
        ----------
        part : int, optional
            From 1, where the settings have changed in mid-run.

        Raises
        ------
        DataQualityError
            The settings have changed, and no part is named.
        """
        counter = None
        for segment in self._segments(part):
            for message in segment.messages():
                batch = message.batch().after(counter)
                if batch is not None:
                    counter = batch.last
                    yield batch

    def tail(self, position: ReadPosition | None = None) -> tuple[list[Batch], ReadPosition]:
        """The samples that have come behind a position, and the position behind them; see `read_on`.

        Those of one segment, as one batch: who follows a run calls it until nothing comes, then waits.
        """
        return read_on(
            self.folder, position or ReadPosition(segment=min(segment_numbers(self.folder), default=1))
        )

    def survey(self, part: int | None = None) -> RunSurvey:
        """One pass over all batches; see `batches` for the part.

        Raises
        ------
        DataQualityError
            No samples; or the settings have changed, and no part is named.
        """
        closed = {e["segment"]: e["bytes"] for e in self.manifest if e["kind"] == "closed"}
        pieces: list[Piece] = []
        faults: dict[str, str] = {}
        header, counter, stop = self.header, None, NoBatch()
        for segment in self._segments(part):
            piece, end = _look_through(segment, self.folder, counter)
            stop = segment.why_ended(end)
            if segment.name in closed:
                # What stands behind the bytes that count was not acknowledged, and is in the next segment.
                whole = end >= closed[segment.name] - len(END)
                stop = NoBatch() if whole else NoBatch(why=stop.why or "its end is missing")
            if stop.why:
                faults[segment.name] = stop.why
            if piece is not None:
                header = segment.opening.header if segment.opening else header
                counter = int(piece.begins[-1] + piece.counts[-1]) - 1
                pieces.append(piece)
        if stop.torn:  # still being written, or what the writer did not live to finish: never acknowledged
            faults.popitem()
        gone = set(closed) - set(map(segment_name, segment_numbers(self.folder)))
        faults |= dict.fromkeys(sorted(gone), "the file is missing")
        last = segment.name if pieces else ""
        changes = (e["segment"] for e in self.manifest if e["kind"] == "change" and "segment" in e)
        more = any(name > last for name in changes)  # what is missing behind this part is in the next one
        if not pieces:
            listed_faults = "".join(f"; {name}: {why}" for name, why in faults.items())
            way = f"allanite recover --dry-run {for_shell(str(self.folder))}"
            hint = f"; to see what can still be read: {way}" if faults else ""
            raise DataQualityError(f"{self.folder}: no samples in this run yet{listed_faults}{hint}")
        return RunSurvey.of(
            header, pieces, faults, torn=stop.torn, end=0 if more else noted_end(self.manifest)
        )

    def recording(self, part: int | None = None) -> Recording:
        """The samples on an even grid by their counter, at the nominal rate; gaps are NaN.

        Every batch is verified once, here; the samples are read when they are asked for.

        Raises
        ------
        DataQualityError
            No samples; or the settings have changed, and no part is named.
        """
        return self.survey(part).recording(self.folder.name, self.status)

    def _segments(self, part: int | None) -> Iterator[Segment]:
        """The segments of a part; those of which nothing verifies belong to the part before them."""
        number, before = 1, None
        for name in map(segment_name, segment_numbers(self.folder)):
            segment = Segment.load(self.folder / name)
            if segment.opening is not None and next(segment.messages(), None) is not None:
                if before is not None and segment.opening.crc != before.crc:
                    number += 1
                    if part is None:
                        changed = "; ".join(before.header.differences(segment.opening.header))
                        raise DataQualityError(
                            f"{self.folder}: the settings change at {name} ({changed}). Such samples are "
                            "never merged; read one part of the run: --variable 1 or --variable 2 "
                            "(part=1 in Python), and so on"
                        )
                before = segment.opening
            if part in (None, number):
                yield segment
        if part is not None and not 1 <= part <= number:
            raise InputError(f"{self.folder} has {number} part(s); there is no part {part}")


def open_run(folder: str | os.PathLike[str]) -> Run:
    """A run to read, whatever has become of it.

    Parameters
    ----------
    folder : path
        As it was given to `LogStore.create`.

    Raises
    ------
    InputError
        No such folder.
    FormatError
        It holds no run, or nothing of it can be read.
    """
    place = Path(folder)
    if not place.is_dir():
        raise InputError(f"no such folder: {place}")
    numbers = segment_numbers(place)
    manifest, damaged = read_manifest(place)
    if not (numbers or manifest or damaged):
        raise FormatError(f"{place} contains no run: it has neither manifest.jsonl nor 000001.arrows")
    end = next((e for e in reversed(manifest) if e["kind"] == "end"), None)
    status = str(end["status"]) if end else "recording" if manifest and is_locked(place) else "unfinished"
    return Run(
        folder=place,
        header=_header(place, numbers, manifest),
        manifest=manifest,
        damaged_lines=damaged,
        status=status,
        reason=str(end["reason"]) if end else "",
    )


def _header(folder: Path, numbers: list[int], manifest: tuple[Line, ...]) -> Header:
    """That of the first segment that verifies; else the one in the manifest, or in an opening that does not."""
    last = None
    for number in numbers:
        segment = Segment.load(folder / segment_name(number))
        if segment.opening is not None:
            last = segment.opening.header
            if next(segment.messages(), None) is not None:
                return last
    first = next((e for e in manifest if e["kind"] == "run"), None)
    if first is not None:
        return Header.from_json(first["header"])
    if last is None:
        raise FormatError(f"{folder}: neither the manifest nor any segment of this run can be read")
    return last


def noted_end(manifest: Sequence[Line]) -> int:
    """Number behind the last sample that is noted as missing; 0 where none is."""
    gaps = (e for e in manifest if e["kind"] == "gap" and "counter" in e and "samples" in e)
    return max((int(e["counter"]) + int(e["samples"]) for e in gaps), default=0)


def _look_through(segment: Segment, folder: Path, counter: int | None) -> tuple[Piece | None, int]:
    """The samples of a segment behind a number, and the byte where its batches end."""
    marks, last = _marks(segment)
    if last is None:
        return None, segment.offset
    end, whole = last.end, segment.samples(last)
    numbers = whole.counter
    if not bool(np.all(numbers[1:] > numbers[:-1])):
        raise FormatError(f"{segment.name}: the counter runs backward; this was not written by allanite")
    skip = 0 if counter is None else int(np.searchsorted(numbers, counter, side="right"))
    if skip == numbers.size:
        return None, end
    crc = zlib.crc32(segment.data[: end - segment.offset], zlib.crc32(last.opening.data))
    rows = SegmentRows(path=folder / segment.name, size=end, crc=crc, skip=skip, count=numbers.size - skip)
    clocks = [(b.last, int(b.monotonic_ns[-1]), b.utc_ns) for b in (m.batch() for m in marks)]
    return Piece.of(rows, numbers[skip:], whole.flags[skip:], np.array(clocks, dtype=np.int64)), end


def _marks(segment: Segment) -> tuple[list[Message], Message | None]:
    """Batches evenly over a segment, the first and the last among them, for their clocks; and the last."""
    marks: list[Message] = []
    every, last = 1, None
    for k, last in enumerate(segment.messages()):
        if k % every == 0:
            marks.append(last)
        if len(marks) >= _MARKS:
            marks, every = marks[::2], 2 * every
    if last is not None and marks[-1] is not last:
        marks.append(last)
    return marks, last
