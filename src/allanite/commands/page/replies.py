# SPDX-License-Identifier: BSD-3-Clause
"""Answers: plain data as JSON, refusals with a code and a sentence, files to be saved."""

from __future__ import annotations

import asyncio
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import quote

from starlette.requests import ClientDisconnect, Request
from starlette.responses import FileResponse, Response

from allanite.errors import AllaniteError
from allanite.plain_files import json_values as plain_data

__all__ = ["Refused", "body_of", "download", "plain", "refusal"]

#: Of refusals, by their status.
_CODES = {
    400: "bad_request", 401: "unauthorized", 403: "forbidden", 404: "not_found", 405: "method_not_allowed",
    408: "too_slow", 409: "not_now", 413: "too_large", 415: "unsupported_media_type", 429: "too_many",
    500: "failed", 503: "busy", 507: "disk_full",
}  # fmt: skip


class Refused(AllaniteError):
    """A request that is answered with a status and a sentence."""

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = status


def plain(data: Any, status: int = 200, headers: Mapping[str, str] | None = None) -> Response:
    """Plain data as JSON; NaN and infinity, which JSON does not have, as null."""
    try:
        text = json.dumps(data, ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    except ValueError:
        text = json.dumps(plain_data.plain(data), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    return Response(
        text.encode("utf-8", "replace"), status, {**(headers or {})}, media_type="application/json"
    )


def refusal(status: int, message: str) -> Response:
    """Why not, and what to do."""
    return plain({"error": {"code": _CODES.get(status, "failed"), "message": message}}, status)


def download(path: Path, name: str) -> Response:
    """A file to be saved, never to be shown: a report brings its own scripts, which are not this page's."""
    safe = "".join(c if (c.isalnum() and c.isascii()) or c in "._-" else "_" for c in name) or "file"
    return FileResponse(
        path,
        media_type="application/octet-stream",
        headers={
            "Content-Disposition": f"attachment; filename=\"{safe}\"; filename*=UTF-8''{quote(name, safe='')}",
            "Content-Security-Policy": "sandbox; default-src 'none'",
            "Cache-Control": "no-store",
        },
    )


async def body_of(request: Request, *, most: int, seconds: float) -> dict[str, Any]:
    """The JSON object of a request.

    Raises
    ------
    Refused
        Not JSON, no object, longer than `most` bytes, or not there within `seconds`.
    """
    data = bytearray()
    try:
        async with asyncio.timeout(seconds):
            async for chunk in request.stream():
                data += chunk
                if len(data) > most:
                    raise Refused(413, f"a request has at most {most} bytes")
    except TimeoutError:
        raise Refused(408, f"the request was incomplete after {seconds:g} s") from None
    except ClientDisconnect:
        raise Refused(400, "the request was interrupted") from None
    try:
        body = json.loads(bytes(data) or b"{}")
    except (ValueError, RecursionError):
        raise Refused(400, "the request is no JSON") from None
    if not isinstance(body, dict):
        raise Refused(400, "the request is not a JSON object")
    return body
