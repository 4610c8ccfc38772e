# SPDX-License-Identifier: BSD-3-Clause
"""The server: a socket of this machine, the address with its token, and an orderly end."""

from __future__ import annotations

import errno
import os
import secrets
import socket
from collections.abc import Callable
from contextlib import suppress

from allanite.errors import InputError, StorageError
from allanite.page.settings import Settings, checked_settings

__all__ = ["address_of", "listening", "serve"]

_PATIENCE = 2  # [s] for answers that are under way when the server ends


def serve(
    folder: str | os.PathLike[str] = ".",
    *,
    port: int = 0,
    host: str | None = None,
    token: str | None = None,
    ready: Callable[[str], None] | None = None,
) -> None:
    """Serve a page over a folder, until SIGINT or SIGTERM.

    Parameters
    ----------
    port : int
        0: one that is free.
    host : str, optional
        Address to listen on; by default this machine alone can reach the page.
    token : str, optional
        Of your own; by default a new one. Needed with another address.
    ready : callable, optional
        Told the address to open, once it answers.

    Raises
    ------
    InputError
        No such folder; another address without a token; a port that is taken or not allowed.
    StorageError
        A folder that cannot be read, or no folder for prepared series.
    """
    import uvicorn

    from allanite.page.application import Application

    place, address, secret = checked_settings(folder, host=host, token=token)
    with listening(address, port) as bound:
        settings = Settings(
            folder=place,
            host=address,
            port=bound.getsockname()[1],
            token=secret or secrets.token_urlsafe(32),
        )
        try:
            settings.cache.mkdir(parents=True, exist_ok=True, mode=0o700)
        except OSError as error:
            raise StorageError(
                f"{settings.cache} cannot be made: {error.strerror}: set XDG_CACHE_HOME to a folder that can"
            ) from None
        told = ready or (lambda address: None)
        application = Application(settings, ready=lambda: told(address_of(settings)))
        config = uvicorn.Config(
            application.app,
            ws="none",
            http="h11",
            log_level="warning",
            access_log=False,  # it would hold the token
            server_header=False,
            proxy_headers=False,
            limit_concurrency=256,
            timeout_graceful_shutdown=_PATIENCE,
        )
        with suppress(KeyboardInterrupt):
            server = uvicorn.Server(config)
            application.ending = lambda: server.should_exit
            server.run(sockets=[bound])


def address_of(settings: Settings) -> str:
    """What is opened in a browser; it holds the token."""
    everywhere = settings.host in ("0.0.0.0", "::")  # noqa: S104 - what the user asked for, in words
    name = socket.gethostname() if everywhere else settings.host
    shown = f"[{name}]" if ":" in name else name
    return f"http://{shown}:{settings.port}/?token={settings.token}"


def listening(host: str, port: int) -> socket.socket:
    """A socket that listens.

    Raises
    ------
    InputError
        The port is taken, or not allowed; no such address.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    found = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    found.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
    # Head and body of an answer leave one by one: without this, the body waits 40 ms for the other side's word.
    found.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    try:
        found.bind((host, port))
        found.listen(128)
    except OSError as error:
        found.close()
        taken = error.errno == errno.EADDRINUSE
        hint = "leave --port out for one that is free" if taken else "choose another --host or --port"
        raise InputError(f"{host} port {port}: {error.strerror}: {hint}") from None
    return found
