# SPDX-License-Identifier: BSD-3-Clause
"""Segments as they are read: batch by batch as far as they verify, or from where somebody has read before."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import field, replace
from pathlib import Path
from typing import BinaryIO, Final

from allanite.errors import DataQualityError, FormatError, StorageError
from allanite.files.store.batch import Batch
from allanite.files.store.message import (
    LONGEST_METADATA,
    Message,
    NoBatch,
    Opening,
    find_message,
    holds_batch,
    message_at,
    samples,
    why_none,
)
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.limits import SEGMENTS, refuse_more
from allanite.plain_files.regular_file import open_regular

__all__ = ["ReadPosition", "Segment", "opening_of", "read_on", "segment_name", "segment_numbers"]

_NAME: Final = re.compile(r"(\d{6,18})\.arrows", re.ASCII)


def segment_name(number: int) -> str:
    """File name of a segment, from 1."""
    return f"{number:06d}.arrows"


def segment_numbers(folder: Path) -> list[int]:
    """Numbers of the segments in a folder, in order."""
    numbers = [match[1] for path in folder.iterdir() if (match := _NAME.fullmatch(path.name))]
    refuse_more(len(numbers), SEGMENTS, "segments", str(folder), "Move some of them into another folder")
    return sorted(int(number) for number in numbers)


@dataclass(frozen=True, slots=True, kw_only=True)
class Segment:
    """A segment, or the rest of one, in memory.

    Attributes
    ----------
    name : str
    opening : Opening or None
        None where it cannot be read.
    data : bytes
        From byte `offset` on.
    offset : int
    fault : NoBatch
        Why the opening cannot be read.
    """

    name: str
    opening: Opening | None
    data: bytes
    offset: int
    fault: NoBatch = field(default_factory=NoBatch)

    @classmethod
    def load(cls, path: Path, offset: int = 0) -> Segment:
        """Read a segment from a byte on; what was before is not looked at, but for the opening.

        Raises
        ------
        StorageError
            The disk refuses.
        """
        try:
            with open_regular(path) as file:
                opening, fault = _opening(file)
                offset = max(offset, len(opening.data) if opening else 0)
                file.seek(offset)
                data = file.read()
        except OSError as error:
            raise StorageError(
                f"{path} cannot be read: {error.strerror or error}; copy the run elsewhere"
            ) from None
        if fault.torn and holds_batch(data):  # an opening is on the medium before there are any
            fault = replace(fault, torn=False)
        return cls(name=path.name, opening=opening, data=data, offset=offset, fault=fault)

    def messages(self, at: int = 0) -> Iterator[Message]:
        """The batches that verify, up to the first that does not; `end` counts from the beginning of the file."""
        if self.opening is None:
            return
        while isinstance(message := message_at(self.data, at, self.opening, self.offset), Message):
            at = message.end - self.offset
            yield message

    def stretches(self) -> list[tuple[int, Message]]:
        """Batches that verify one behind the other: where in `data` each stretch begins, and its last batch.

        A batch that does not verify ends a stretch if there are others behind it that do; else it is not yet written.
        """
        whole: list[tuple[int, Message]] = []
        at = 0
        while self.opening is not None:
            last = None
            for last in self.messages(at):  # noqa: B007 - verified one after another, decoded at once
                pass
            if last is not None:
                whole.append((at, last))
            end = last.end - self.offset if last is not None else at
            behind = find_message(self.data, end + 8, self.opening)
            if behind is None:
                break
            at = behind[0]
        return whole

    def samples(self, last: Message, at: int = 0) -> Batch:
        """All samples from a place in `data` up to a batch that verifies, and all between do, as one batch."""
        return samples(self.data[at : last.end - self.offset], last.opening, last.utc_ns)

    def why_ended(self, at: int) -> NoBatch:
        """Why the batches end at this byte of the file."""
        if self.opening is None:
            return self.fault
        return why_none(self.data, at - self.offset, self.opening)


def opening_of(path: Path) -> Opening | None:
    """The opening of a segment; None where it cannot be read."""
    with open_regular(path) as file:
        return _opening(file)[0]


def _opening(file: BinaryIO) -> tuple[Opening | None, NoBatch]:
    head = file.read(8)
    head += file.read(min(int.from_bytes(head[4:], "little"), LONGEST_METADATA))
    try:
        return Opening.read(head), NoBatch()
    except FormatError as error:
        torn = len(head) < 8 or len(head) < 8 + int.from_bytes(head[4:8], "little")
        return None, NoBatch(why=str(error), torn=torn) if head else NoBatch()


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadPosition:
    """How far somebody has read who follows a run.

    Attributes
    ----------
    segment, offset : int
        Number of the segment, and the byte where its next batch begins.
    counter : int or None
        The last sample read.
    opening : int or None
        CRC-32 of the opening under which it was read.
    """

    segment: int = 1
    offset: int = 0
    counter: int | None = None
    opening: int | None = None


def read_on(folder: Path, position: ReadPosition) -> tuple[list[Batch], ReadPosition]:
    """The samples behind a position, those of one segment as one batch, and the position behind them.

    A batch that is cut or does not verify is "not yet": it is waited for, until there is a whole one behind it, or a
    next segment.

    Raises
    ------
    DataQualityError
        The settings have changed.
    StorageError
        The disk refuses.
    """
    # Looked for first: once there is a next one, nothing is added to this one.
    later = [n for n in segment_numbers(folder) if n > position.segment]
    for following in (*later, None):
        path = folder / segment_name(position.segment)
        batches: list[Batch] = []
        if path.exists():
            batches, position = _rest(Segment.load(path, position.offset), position)
        if following is not None:
            position = replace(position, segment=following, offset=0)
        if batches:
            break
    return batches, position


def _rest(segment: Segment, position: ReadPosition) -> tuple[list[Batch], ReadPosition]:
    stretches = segment.stretches()
    if not stretches:
        return [], position
    end = stretches[-1][1]
    if position.opening not in (None, end.opening.crc):
        raise DataQualityError(
            f"the settings change at {segment.name}: what follows is another part of the run, to be followed from "
            f"ReadPosition(segment={position.segment})"
        )
    batches = []
    for at, last in stretches:
        batch = segment.samples(last, at).after(position.counter)
        if batch is not None:
            position = replace(position, counter=batch.last)
            batches.append(batch)
    return batches, replace(position, offset=end.end, opening=end.opening.crc)
