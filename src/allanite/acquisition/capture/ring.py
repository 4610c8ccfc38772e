# SPDX-License-Identifier: BSD-3-Clause
"""Between the thread that listens to the instrument and the one that writes: room for some seconds of samples.

A disk that stalls costs nothing while there is room. When there is none, the listener waits a moment, which the buffers
of the link bear, and then samples are dropped and counted: an instrument that is not listened to loses more.
"""

from __future__ import annotations

import threading
from collections import deque
from typing import Generic, TypeVar

__all__ = ["Ring"]

Item = TypeVar("Item")


class Ring(Generic[Item]):
    """A queue of bounded size.

    Parameters
    ----------
    room : int
        Samples that it holds.
    """

    def __init__(self, room: int) -> None:
        self._room = room
        self._held = 0
        self._items: deque[tuple[int, Item]] = deque()
        self._changed = threading.Condition()
        self._closed = False

    def put(self, item: Item, samples: int, wait: float = 0.0) -> bool:
        """Add an item that counts as so many samples; False, and nothing is added, where there is no room.

        An empty ring takes an item of any size; a full one may become empty within `wait` seconds. What counts as no
        sample always finds room, and a closed ring takes nothing.
        """
        with self._changed:
            self._changed.wait_for(lambda: self._closed or self._has_room(samples), wait)
            if self._closed or not self._has_room(samples):
                return False
            self._items.append((samples, item))
            self._held += samples
            self._changed.notify_all()
            return True

    def take(self, timeout: float) -> Item | None:
        """The oldest item, waiting for it at most so long; None if there is none."""
        with self._changed:
            if not self._items and not self._closed:
                self._changed.wait(timeout)
            if not self._items:
                return None
            samples, item = self._items.popleft()
            self._held -= samples
            self._changed.notify_all()
            return item

    def _has_room(self, samples: int) -> bool:
        return not (samples and self._held) or self._held + samples <= self._room

    def close(self) -> None:
        """No more items will come."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    @property
    def exhausted(self) -> bool:
        """Closed and empty."""
        with self._changed:
            return self._closed and not self._items
