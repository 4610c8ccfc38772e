# SPDX-License-Identifier: BSD-3-Clause
"""Server-sent events: streams of named words of JSON, with a sign of life while there is nothing to say."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from typing import Any

from starlette.responses import StreamingResponse

__all__ = ["Streams"]

Json = Mapping[str, Any]

_EVERY = 0.2  # [s] between two looks
_ALIVE = 15.0  # [s] between two signs of life
_SOON, _LATER = 1, 15  # [s] until a browser comes back to a stream that broke off, and to one that made room


class Streams:
    """The open streams. One more than `most` ends the oldest, whose browser is told to come back later: streams that
    nobody reads give way, and a page that is looked at misses nothing.
    """

    def __init__(self, most: int) -> None:
        self._most = most
        self._open: dict[object, None] = {}  # the oldest first

    def stream(
        self,
        news: Callable[[], Iterable[tuple[str, Any]]],
        *,
        over: Callable[[], bool],
        leave: Callable[[], None] | None = None,
    ) -> StreamingResponse:
        """Events as they come.

        Parameters
        ----------
        news : callable
            Gives (name, data) of what is new since it was asked.
        over : callable
            Whether nothing more will come.
        leave : callable, optional
            Told when nobody listens any more.
        """
        return StreamingResponse(
            self._events(news, over, leave),
            media_type="text/event-stream",
            headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"},
        )

    async def _events(
        self,
        news: Callable[[], Iterable[tuple[str, Any]]],
        over: Callable[[], bool],
        leave: Callable[[], None] | None,
    ) -> AsyncIterator[bytes]:
        stream = object()
        while len(self._open) >= self._most:
            del self._open[next(iter(self._open))]
        self._open[stream] = None
        last_sent = time.monotonic()
        try:
            yield f"retry: {_SOON * 1000}\n\n".encode()
            while stream in self._open:
                last = over()  # asked first: what comes meanwhile is still told
                for name, data in news():
                    yield f"event: {name}\ndata: {json.dumps(data, separators=(',', ':'))}\n\n".encode()
                    last_sent = time.monotonic()
                if last:
                    return
                if time.monotonic() - last_sent > _ALIVE:
                    last_sent = time.monotonic()
                    yield b": alive\n\n"
                await asyncio.sleep(_EVERY)
            yield f"retry: {_LATER * 1000}\n\n".encode()
        finally:
            self._open.pop(stream, None)
            if leave is not None:
                leave()
