# SPDX-License-Identifier: BSD-3-Clause
"""The server: a socket of this machine, the address with its token, and an orderly end."""

from __future__ import annotations

import errno
import os
import secrets
import socket
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from allanite.commands.page.settings import Settings, checked_settings, is_log
from allanite.errors import InputError, StorageError

if TYPE_CHECKING:
    import uvicorn

    from allanite.commands.page.application import Application

__all__ = ["address_of", "listening", "serve", "server_of"]

_QUEUE = 1024  # connections that wait to be accepted
_PATIENCE = 2  # [s] for answers that are under way when the server ends


def serve(
    folder: str | os.PathLike[str] = ".",
    *,
    port: int = 0,
    host: str | None = None,
    token: str | None = None,
    instruments: str | os.PathLike[str] | None = None,
    ready: Callable[[str], None] | None = None,
) -> None:
    """Serve a page over a folder, until SIGINT or SIGTERM.

    Parameters
    ----------
    folder : path
        Or a log in it, which the page opens first.
    port : int
        0: one that is free.
    host : str, optional
        Address to listen on; by default this machine alone can reach the page.
    token : str, optional
        Of your own; by default a new one. Needed with another address.
    instruments : path, optional
        YAML file that names instruments to record, besides those that this machine lists.
    ready : callable, optional
        Told the address to open, once it answers.

    Raises
    ------
    InputError
        No such folder; another address without a token; a port that is taken or not allowed; a wrong list of
        instruments, or one in a folder that the page writes to.
    StorageError
        A folder that cannot be read, or no folder for prepared series.
    """
    from allanite.commands.page.application import Application

    place, address, secret = checked_settings(folder, host=host, token=token)
    with listening(address, port) as bound:
        settings = Settings(
            folder=place,
            host=address,
            port=bound.getsockname()[1],
            token=secret or secrets.token_urlsafe(32),
            log=place / Path(folder).name if is_log(Path(folder)) else None,
        )
        try:
            settings.cache.mkdir(parents=True, exist_ok=True, mode=0o700)
        except OSError as error:
            raise StorageError(
                f"{settings.cache} cannot be made: {error.strerror}: set XDG_CACHE_HOME to a folder that can"
            ) from None
        if instruments is not None:
            from allanite.commands.page.instruments_file import read_instruments

            named = read_instruments(instruments, (settings.folder, settings.cache.resolve()))
            settings = replace(settings, instruments=named)
        on_ready = ready or (lambda address: None)
        application = Application(settings, ready=lambda: on_ready(address_of(settings)))
        with suppress(KeyboardInterrupt):
            server_of(application).run(sockets=[bound])


def server_of(application: Application) -> uvicorn.Server:
    """The server of an application; it is run with the socket that listens."""
    import uvicorn

    from allanite.commands.page.connections import BACKLOG, connections_within

    class Server(uvicorn.Server):
        async def startup(self, sockets: list[socket.socket] | None = None) -> None:
            await super().startup(sockets)
            for listener in sockets or ():
                listener.listen(
                    _QUEUE
                )  # uvicorn takes one number for this, and for what is accepted in one go

    server = Server(
        uvicorn.Config(
            application.app,
            loop="asyncio",
            ws="none",
            http=connections_within(application.settings.limits),
            log_level="error",  # what strangers send is no news
            access_log=False,  # it would hold the token
            server_header=False,
            proxy_headers=False,
            backlog=BACKLOG,
            timeout_graceful_shutdown=_PATIENCE,
        )
    )
    application.ending = lambda: server.should_exit
    return server


def address_of(settings: Settings) -> str:
    """What is opened in a browser; it holds the token."""
    everywhere = settings.host in ("0.0.0.0", "::")  # noqa: S104 - what the user asked for, in words
    name = socket.gethostname() if everywhere else settings.host
    shown = f"[{name}]" if ":" in name else name
    return f"http://{shown}:{settings.port}/?token={settings.token}{_view_of(settings)}"


def _view_of(settings: Settings) -> str:
    """The view that is opened first."""
    return "" if settings.log is None else f"#/recording/{settings.id_of(settings.log)}"


def listening(host: str, port: int) -> socket.socket:
    """A socket that listens.

    Raises
    ------
    InputError
        The port is taken, or not allowed; no such address.
    """
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    listener = socket.socket(family, socket.SOCK_STREAM, socket.IPPROTO_TCP)
    # To begin again on a port at once. On Windows that option would let another program take the port as well.
    option = getattr(socket, "SO_EXCLUSIVEADDRUSE", socket.SO_REUSEADDR)
    listener.setsockopt(socket.SOL_SOCKET, option, 1)
    # Head and body of an answer leave one by one: without this, the body waits 40 ms for the other side's word.
    listener.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    try:
        listener.bind((host, port))
        listener.listen(128)
    except OSError as error:
        listener.close()
        taken = error.errno == errno.EADDRINUSE
        hint = "leave --port out for one that is free" if taken else "choose another --host or --port"
        raise InputError(f"{host} port {port}: {error.strerror}: {hint}") from None
    return listener
