# SPDX-License-Identifier: BSD-3-Clause
"""What a page is told when it starts, and its limits; all of them in one place, so that tests can make them small."""

from __future__ import annotations

import hashlib
import os
import secrets
from dataclasses import field
from pathlib import Path

from allanite.commands.page.attached import Named
from allanite.errors import InputError, StorageError
from allanite.lazy_dataclasses import dataclass

__all__ = ["LOOPBACK", "RESULTS", "Limits", "Settings", "cache_folder", "checked_settings", "is_log"]

RESULTS = "allanite-results"
"""Folder of results, in the one that is served."""

LOOPBACK = ("127.0.0.1", "::1")
_SHORTEST_TOKEN = 16


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """What a page lets happen.

    Attributes
    ----------
    upload : int [bytes]
        Of one dropped file.
    body : int [bytes]
        Of any other request.
    silence : float [s]
        Without a byte of an upload, after which it is broken off.
    grace : float [s]
    slowest : float [bytes/s]
        After `grace`, an upload that is slower on average is broken off.
    spare : int [bytes]
        An upload leaves at least so much of the disk free.
    workers, queue : int
        Jobs that run at a time, and that wait.
    kept : int
        Finished jobs that are remembered.
    files : int
        Recordings and documents that are listed.
    depth : int
        Folders below the one that is served.
    document : int [bytes]
        A result that is larger is not shown.
    cache : int [bytes]
        Prepared series on the disk.
    quick : float [s]
        An answer that somebody waits for (a figure, a plan) is given up after so long.
    ahead : bool
        Processes are started before there is work for them.
    look : float [s]
        Between two looks at a run that grows.
    watchers, captures : int
        Runs that are followed, and recorders that are started, at a time.
    listing : float [s]
        The machine's instruments are listed within this time, or not at all.
    waiting : int
        Answers of child processes that are waited for at a time; other requests have threads of their own.
    sockets, strangers, share : int
        Open connections; of these without a session; and of these from one other machine. See `connections`.
    head : float [s]
        For the head of a request, from the first moment on, and for the body of a request that was refused.
    request : float [s]
        For the body of a request that is no upload.
    streams : int
        Event streams at a time; one more ends the oldest.
    """

    upload: int = 8 << 30
    body: int = 1 << 20
    silence: float = 20.0
    grace: float = 20.0
    slowest: float = 4096.0
    spare: int = 256 << 20
    workers: int = 2
    queue: int = 64
    kept: int = 200
    files: int = 2000
    depth: int = 6
    document: int = 32 << 20
    cache: int = 20 << 30
    quick: float = 30.0
    ahead: bool = True
    look: float = 1.0
    watchers: int = 8
    captures: int = 8
    listing: float = 15.0
    waiting: int = 8
    sockets: int = 256
    strangers: int = 128
    share: int = 32
    head: float = 10.0
    request: float = 15.0
    streams: int = 32


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """A page that is served.

    Attributes
    ----------
    folder : Path
        The one root of all that is shown; absolute, links resolved.
    host : str
        Address that is listened on.
    port : int
        As it is bound.
    token : str
        Who has it may look.
    session, csrf : str
        Secrets of this start: of the cookie, and of requests that change something.
    cache : Path
        Of prepared series; may be removed at any time.
    instruments : tuple of Named
        Those of the administrator's file.
    log : Path or None
        The recording that is opened first; it is listed whatever it looks like.
    """

    folder: Path
    host: str = "127.0.0.1"
    port: int
    token: str = field(default_factory=lambda: secrets.token_urlsafe(32), repr=False)
    session: str = field(default_factory=lambda: secrets.token_urlsafe(32), repr=False)
    csrf: str = field(default_factory=lambda: secrets.token_urlsafe(32), repr=False)
    cache: Path = field(default_factory=lambda: cache_folder())
    limits: Limits = field(default_factory=Limits)
    instruments: tuple[Named, ...] = ()
    log: Path | None = None

    def id_of(self, path: Path) -> str:
        """The id under which a file is listed; the same one as long as the server runs."""
        key = self.session.encode()
        return hashlib.blake2b(os.fsencode(path), key=key[:64], digest_size=12).hexdigest()

    @property
    def cookie(self) -> str:
        """Its name: cookies do not know ports, and two pages on one machine must not take each other's."""
        return f"allanite-{self.port}"

    @property
    def local(self) -> bool:
        """Whether it listens on this machine alone."""
        return self.host in LOOPBACK

    @property
    def writable(self) -> bool:
        """Whether results can stay beside the recordings."""
        return os.access(self.folder, os.W_OK | os.X_OK)


def cache_folder() -> Path:
    """The user's folder for what can be made again."""
    named = os.environ.get("XDG_CACHE_HOME")
    return (Path(named) if named else Path.home() / ".cache") / "allanite"


def is_log(place: Path) -> bool:
    """Whether this is a recording, rather than a folder of them."""
    from allanite.commands.page.sniffing import recording_format

    return place.is_file() or (place.is_dir() and recording_format(place, b"") is not None)


def checked_settings(
    folder: str | os.PathLike[str], *, host: str | None, token: str | None
) -> tuple[Path, str, str | None]:
    """The folder, or that of a log, as an absolute path, the address and the token, if a page may be served with them.

    Raises
    ------
    InputError
        No such folder; another address than this machine's own without a token; a token that could be guessed.
    StorageError
        A folder that cannot be read.
    """
    place = Path(folder)
    if is_log(place):
        place = place.parent
    if not place.is_dir():
        raise InputError(f"no such folder: {place}: name the folder with your recordings")
    if not os.access(place, os.R_OK | os.X_OK):
        raise StorageError(f"{place} cannot be read: choose another folder, or change its permissions")
    address = "127.0.0.1" if host in (None, "localhost") else str(host)
    if address not in LOOPBACK and token is None:
        raise InputError(
            f"--host {address} admits other machines: pass your own --token as well (at least {_SHORTEST_TOKEN} "
            "characters). The connection is not encrypted. A tunnel is safer: "
            "ssh -L 8080:127.0.0.1:PORT this-machine"
        )
    if token is not None and (len(token) < _SHORTEST_TOKEN or not token.isascii() or not token.isprintable()):
        raise InputError(
            f"a token has at least {_SHORTEST_TOKEN} ASCII characters; a shorter one can be guessed"
        )
    return place.resolve(), address, token
