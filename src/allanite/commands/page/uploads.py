# SPDX-License-Identifier: BSD-3-Clause
"""Dropped files: from the request to the disk piece by piece, with a cap, a clock, and a name that is made here."""

from __future__ import annotations

import asyncio
import errno
import re
import secrets
import shutil
import time
from collections.abc import AsyncIterator
from pathlib import Path
from typing import BinaryIO
from urllib.parse import unquote

from starlette.concurrency import run_in_threadpool
from starlette.requests import ClientDisconnect, Request

from allanite.commands.page.bounds import own_folder
from allanite.commands.page.replies import Refused
from allanite.commands.page.settings import Limits, Settings

__all__ = ["DROPPED", "name_for", "receive"]

DROPPED = "allanite-dropped"
"""Folder of dropped files, in the one that is served."""


async def receive(request: Request, settings: Settings) -> Path:
    """Take the body of a request into a new file; nothing stays of one that is refused.

    Raises
    ------
    Refused
        408 too slow, 413 too large, 400 empty or broken off, 507 the disk is full, 409 the folder is read-only.
    """
    limits = settings.limits
    announced = _length(request, limits)
    if not settings.writable:
        raise Refused(409, "the folder is read-only: copy the file into it yourself, and reload")
    _room(settings.folder, announced, limits)
    folder = own_folder(settings, DROPPED)
    target = folder / name_for(request.headers.get("x-file-name", ""))
    made = folder / f".{secrets.token_hex(8)}.part"
    try:
        with made.open("xb") as file:
            size = await _pour(request, file, limits)
        if not size:
            raise Refused(400, "the file is empty")
        if announced is not None and size != announced:
            raise Refused(400, f"{size} bytes arrived, but {announced} were announced")
        made.rename(target)
    except OSError as error:
        full = error.errno in (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
        raise Refused(507 if full else 409, f"the file cannot be stored: {error.strerror or error}") from None
    except ClientDisconnect:
        raise Refused(400, "the upload was interrupted") from None
    finally:
        made.unlink(missing_ok=True)
    return target


def name_for(given: str) -> str:
    """A name of letters, digits and .-_ alone, unlike any other; only its looks come from the one that was given."""
    last = re.split(r"[/\\]", unquote(given, errors="replace")[:500])[-1]
    stem, *suffixes = re.sub(r"[^A-Za-z0-9._-]+", "-", last).strip(".-_").split(".")
    ends = "".join(f".{s[:12]}" for s in suffixes[-2:] if s)
    return f"{stem[:60].strip('-') or 'file'}-{secrets.token_hex(3)}{ends}"


def _length(request: Request, limits: Limits) -> int | None:
    """Bytes that are announced."""
    text = request.headers.get("content-length")
    if text is None:
        return None
    if not (text.isascii() and text.isdigit()):
        raise Refused(400, "Content-Length is no number")
    if int(text) > limits.upload:
        raise _too_large(limits)
    return int(text)


def _room(folder: Path, size: int | None, limits: Limits) -> None:
    if shutil.disk_usage(folder).free < (size or 0) + limits.spare:
        raise Refused(507, "the disk is full: make room, or serve a folder on another disk")


async def _pour(request: Request, file: BinaryIO, limits: Limits) -> int:
    """Write what comes, as it comes; the number of bytes."""
    size, began = 0, time.monotonic()
    pieces = aiter(request.stream())
    while (piece := await _next(pieces, limits)) is not None:
        size += len(piece)
        if size > limits.upload:
            raise _too_large(limits)
        spent = time.monotonic() - began
        if spent > limits.grace and size / spent < limits.slowest:
            raise Refused(408, f"the upload is too slow: {size / spent:.0f} bytes a second")
        await run_in_threadpool(file.write, piece)
    await run_in_threadpool(file.flush)
    return size


async def _next(pieces: AsyncIterator[bytes], limits: Limits) -> bytes | None:
    try:
        return await asyncio.wait_for(anext(pieces), limits.silence)
    except StopAsyncIteration:
        return None
    except TimeoutError:
        raise Refused(408, f"no data for {limits.silence:g} s") from None


def _too_large(limits: Limits) -> Refused:
    return Refused(
        413, f"a dropped file has at most {limits.upload >> 20} MiB: copy it into the folder instead"
    )
