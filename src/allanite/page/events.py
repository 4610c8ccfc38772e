# SPDX-License-Identifier: BSD-3-Clause
"""Server-sent events: a stream of named words of JSON, with a sign of life while there is nothing to say."""

from __future__ import annotations

import asyncio
import json
import time
from collections.abc import AsyncIterator, Callable, Iterable, Mapping
from typing import Any

from starlette.responses import StreamingResponse

__all__ = ["stream"]

Json = Mapping[str, Any]

_EVERY = 0.2  # [s] between two looks
_ALIVE = 15.0  # [s] between two signs of life


def stream(
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

    async def events() -> AsyncIterator[bytes]:
        said = time.monotonic()
        try:
            yield b"retry: 1000\n\n"
            while True:
                last = over()  # asked first: what comes meanwhile is still told
                for name, data in news():
                    yield f"event: {name}\ndata: {json.dumps(data, separators=(',', ':'))}\n\n".encode()
                    said = time.monotonic()
                if last:
                    return
                if time.monotonic() - said > _ALIVE:
                    said = time.monotonic()
                    yield b": alive\n\n"
                await asyncio.sleep(_EVERY)
        finally:
            if leave is not None:
                leave()

    return StreamingResponse(
        events(),
        media_type="text/event-stream",
        headers={"Cache-Control": "no-store", "X-Accel-Buffering": "no"},
    )
