# SPDX-License-Identifier: BSD-3-Clause
"""Who may ask: the one door in front of every route, and the headers of every answer.

A page on this machine is reached by every web site that is open in the same browser. Four things keep them out. The
Host header must name this server (a name that is bound to 127.0.0.1 by somebody's DNS does not). The Origin header, and
what the browser says of the site that asks, must be this page's. The cookie must be that of this start: it is given for
the token in the address that was printed. What changes anything needs a secret besides, which only the page can read.

Cookies know neither ports nor the difference between two servers of one machine; that is what the last is for.
"""

from __future__ import annotations

import ipaddress
import socket
from hmac import compare_digest
from http.cookies import CookieError, SimpleCookie
from urllib.parse import parse_qs

from starlette.datastructures import Headers, MutableHeaders
from starlette.responses import HTMLResponse, Response
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from allanite.commands.page.replies import refusal
from allanite.commands.page.settings import Settings

__all__ = ["CSRF", "POLICY", "Guard"]

CSRF = "x-csrf-token"
"""Header of every request that changes something."""

POLICY = (
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self'; "
    "font-src 'self'; connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'"
)
"""Of every answer."""

_HEADERS = {
    "content-security-policy": POLICY,
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=(), usb=(), serial=()",
}
_UPLOAD = "/api/upload"
_CLOSED = (
    "<!doctype html><html lang=en><meta charset=utf-8><title>allanite</title><h1>This page is closed</h1>"
    "<p>Open the address that <code>allanite serve</code> printed. Each start has a new one.</p>"
)


class Guard:
    """ASGI middleware."""

    def __init__(self, app: ASGIApp, settings: Settings) -> None:
        self._app, self._settings = app, settings
        self._names = _names_of(settings)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] == "lifespan":
            await self._app(scope, receive, send)
            return
        if scope["type"] != "http":  # no other kind is offered
            await send({"type": "websocket.close", "code": 1008})
            return
        headers = Headers(scope=scope)
        fresh = self._has_token(scope)
        refused = self._refused(scope, headers, fresh)

        if refused is None:  # `connections` keeps room for those who are known
            scope.setdefault("state", {})["known"] = True

        async def guarded(message: Message) -> None:
            if message["type"] == "http.response.start":
                self._dress(MutableHeaders(scope=message), fresh and refused is None)
            await send(message)

        await (refused or self._app)(scope, receive, guarded)

    # -- what is refused ------------------------------------------------------------------------------------

    def _refused(self, scope: Scope, headers: Headers, fresh: bool) -> Response | None:
        method = scope["method"]
        return (
            self._wrong_host(headers)
            or (None if method in ("GET", "HEAD", "POST") else refusal(405, f"{method} is not offered"))
            or self._foreign(scope, headers)
            or self._unknown(scope, headers, fresh)
            or (self._unchanged(scope, headers) if method == "POST" else None)
        )

    def _wrong_host(self, headers: Headers) -> Response | None:
        given = headers.getlist("host")
        if len(given) != 1 or not given[0]:
            return refusal(400, "a request names its host, once")
        return None if self._is_own(given[0]) else refusal(403, "this server does not have that name")

    def _is_own(self, host: str) -> bool:
        name, port = _split(host.lower())
        if port not in ((self._settings.port, None) if self._settings.port == 80 else (self._settings.port,)):
            return False
        return name in self._names or (self._settings.host in ("0.0.0.0", "::") and _is_address(name))  # noqa: S104 - compared, not bound

    def _foreign(self, scope: Scope, headers: Headers) -> Response | None:
        origins = headers.getlist("origin")
        if len(origins) > 1 or (origins and not self._is_own_origin(origins[0])):
            return refusal(403, "the request comes from another page")
        if scope["method"] == "POST" and not origins:
            return refusal(403, "the request does not state its origin")
        site = headers.get("sec-fetch-site", "none")
        arriving = scope["path"] == "/" and headers.get("sec-fetch-mode") == "navigate"
        if site not in ("none", "same-origin") and not arriving:
            return refusal(403, "the request comes from another page")
        return None

    def _is_own_origin(self, origin: str) -> bool:
        return origin.startswith("http://") and self._is_own(origin.removeprefix("http://"))

    def _unknown(self, scope: Scope, headers: Headers, fresh: bool) -> Response | None:
        if fresh or self._has_cookie(headers):
            return None
        if scope["path"] == "/":
            return HTMLResponse(_CLOSED, 401)
        return refusal(401, "no session: open the address that `allanite serve` printed")

    def _has_cookie(self, headers: Headers) -> bool:
        valid = False
        for line in headers.getlist("cookie"):
            try:
                jar = SimpleCookie(line)
            except CookieError:
                continue
            if self._settings.cookie in jar:
                given = jar[self._settings.cookie].value.encode()
                valid |= compare_digest(given, self._settings.session.encode())
        return valid

    def _has_token(self, scope: Scope) -> bool:
        if scope["type"] != "http" or scope["path"] != "/" or scope["method"] not in ("GET", "HEAD"):
            return False
        try:
            given = parse_qs(scope.get("query_string", b"").decode("ascii"), max_num_fields=8).get(
                "token", []
            )
        except ValueError:
            return False
        return len(given) == 1 and compare_digest(given[0].encode(), self._settings.token.encode())

    def _unchanged(self, scope: Scope, headers: Headers) -> Response | None:
        """Why a request may not change anything."""
        given = headers.getlist(CSRF)
        if len(given) != 1 or not compare_digest(given[0].encode(), self._settings.csrf.encode()):
            return refusal(403, "the request lacks the secret of this page: reload the page")
        kind = headers.get("content-type", "").split(";")[0].strip().lower()
        if scope["path"] == _UPLOAD:
            if kind.startswith("multipart/"):
                return refusal(400, "send the file itself, not a form of several parts")
            wanted = "application/octet-stream"
        else:
            wanted = "application/json"
        return None if kind == wanted else refusal(415, f"the request must be {wanted}")

    # -- what is added --------------------------------------------------------------------------------------

    def _dress(self, headers: MutableHeaders, fresh: bool) -> None:
        for name, value in _HEADERS.items():
            headers.setdefault(name, value)
        headers.setdefault("cache-control", "no-store")
        if fresh:
            cookie = f"{self._settings.cookie}={self._settings.session}; HttpOnly; SameSite=Strict; Path=/"
            headers.append("set-cookie", cookie)


def _names_of(settings: Settings) -> frozenset[str]:
    """By which a browser may call this server."""
    names = {"127.0.0.1", "localhost", "[::1]"}
    if not settings.local:
        host = settings.host
        names |= {f"[{host}]" if ":" in host else host.lower(), socket.gethostname().lower()}
    return frozenset(names)


def _split(host: str) -> tuple[str, int | None]:
    """Name and port; a port of -1 is none that a server has."""
    name, colon, port = host.rpartition(":")
    if not colon or host.endswith("]"):
        return host, None
    return name, int(port) if port.isascii() and port.isdigit() and len(port) < 6 else -1


def _is_address(name: str) -> bool:
    """Addresses are not names: nobody's DNS can point them elsewhere."""
    try:
        ipaddress.ip_address(name.removeprefix("[").removesuffix("]"))
    except ValueError:
        return False
    return True
