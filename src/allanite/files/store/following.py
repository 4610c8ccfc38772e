# SPDX-License-Identifier: BSD-3-Clause
"""A run followed while it grows, across its segments and its parts: each time only what has come since the last."""

from __future__ import annotations

from dataclasses import field, replace
from pathlib import Path

from allanite.files.store.batch import Batch
from allanite.files.store.header import Header
from allanite.files.store.segment import ReadPosition, opening_of, read_on, segment_name, segment_numbers
from allanite.lazy_dataclasses import dataclass

__all__ = ["RunFollower"]


@dataclass(slots=True)
class RunFollower:
    """Follows a run.

    Parameters
    ----------
    folder : Path
    header : Header
        That of the first part.

    Attributes
    ----------
    part : int
        Of the samples that came last, from 1: where the settings change, the next one begins.
    header : Header
        Of that part.
    """

    folder: Path
    header: Header
    part: int = 1
    _position: ReadPosition = field(init=False)

    def __post_init__(self) -> None:
        self._position = ReadPosition(segment=min(segment_numbers(self.folder), default=1))

    def take(self) -> list[Batch]:
        """The samples that have come, those of one segment as one batch; none where there is nothing new.

        To be called until it gives none. All that it gives at a time is of one part: look at `part` and `header`.

        Raises
        ------
        StorageError
            The disk refuses.
        """
        before = self._position.opening
        batches, position = read_on(self.folder, replace(self._position, opening=None))
        if position.opening is None:  # nothing new
            self._position = replace(position, opening=before)
            return batches
        self._position = position
        if before not in (None, position.opening):
            self.part += 1
        if before != position.opening:
            self.header = self._header()
        return batches

    @property
    def share(self) -> float:
        """Of the segments that are there, those that were looked at."""
        last = max(segment_numbers(self.folder), default=1)
        return min(self._position.segment / last, 1.0)

    def _header(self) -> Header:
        """That of the segment that was read last, or of one before it if that is only just open."""
        for number in sorted(segment_numbers(self.folder), reverse=True):
            if number <= self._position.segment:
                opening = opening_of(self.folder / segment_name(number))
                if opening is not None and opening.crc == self._position.opening:
                    return opening.header
        return self.header
