# SPDX-License-Identifier: BSD-3-Clause
"""Names of serial ports: which of them may be opened, decided before anything is.

pyserial also takes URLs. Their handlers write files (``spy``), search the machine (``hwgrep``) or wrap another port
(``alt``), so the ones that may be named are listed here. A path must lead to a character device, as a pseudo-terminal
is one.

References
----------
.. [1] pyserial 3.5, "URL Handlers", https://pyserial.readthedocs.io/en/latest/url_handlers.html
"""

from __future__ import annotations

import os
import re
import stat
from typing import Final

__all__ = ["network_device", "refusal_of_path", "refusal_of_port"]

_OPTION: Final = r"(?:ign_set_control|poll_modem|timeout=\d+(?:\.\d+)?)"
_PLACE: Final = r"(?P<host>\[[0-9A-Fa-f:.]+\]|[A-Za-z0-9._-]+):(?P<port>\d{1,5})/?"
#: The URLs that are accepted. The option `logging`, which all of them have, would change the whole process.
_URLS: Final = tuple(
    re.compile(url, re.ASCII)
    for url in (
        rf"(?i:socket)://{_PLACE}",
        rf"(?i:rfc2217)://{_PLACE}(?:\?{_OPTION}(?:&{_OPTION})*)?",
        r"(?i:loop)://",
    )
)
_WINDOWS: Final = re.compile(r"(?:\\\\\.\\)?COM\d{1,3}", re.IGNORECASE | re.ASCII)
#: What else a path may lead to.
_KINDS: Final = (
    (stat.S_ISREG, "a file"),
    (stat.S_ISDIR, "a folder"),
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISBLK, "a disk"),
    (stat.S_ISSOCK, "a socket"),
)


def refusal_of_port(name: str) -> str:
    """Why a name must not be opened as a serial port; "" where it may.

    A port that is not there is none of them: it may be plugged in.

    Examples
    --------
    >>> refusal_of_port("socket://127.0.0.1:4000")
    ''
    >>> refusal_of_port("spy:///dev/ttyUSB0?file=/tmp/bytes")[:29]
    "port 'spy:///dev/ttyUSB0?file"
    """
    if not name.isprintable() or name != name.strip() or not name:
        return f"port {name!r}: remove leading and trailing blanks and control characters"
    if "://" not in name:
        return refusal_of_path(name)
    if any(pattern.fullmatch(name) for pattern in _URLS):
        return ""
    return (
        f"port {name!r}: other than ports, only socket://HOST:PORT, rfc2217://HOST:PORT (options: timeout=SECONDS, "
        "ign_set_control, poll_modem) and loop:// are accepted"
    )


def refusal_of_path(name: str) -> str:
    """As `refusal_of_port`, of a port that cannot be a URL."""
    if os.name == "nt":
        return "" if _WINDOWS.fullmatch(name) else f"port {name!r}: name a port like COM3"
    try:
        mode = os.stat(name).st_mode  # noqa: PTH116 - follows links: what they lead to would be opened
    except (OSError, ValueError):
        return ""  # opening it says why
    if stat.S_ISCHR(mode):
        return ""
    what = next((kind for is_kind, kind in _KINDS if is_kind(mode)), "something else")
    return f"port {name!r} is {what} and no serial port: name a device like /dev/ttyUSB0; nothing was opened"


def network_device(name: str) -> str | None:
    """What two programs must not use at a time where a name is a URL: "" for none; None where it is no URL.

    >>> network_device("SOCKET://Lab:4000"), network_device("loop://"), network_device("/dev/ttyUSB0")
    ('tcp://lab:4000', '', None)
    """
    for pattern in _URLS:
        if match := pattern.fullmatch(name):
            place = match.groupdict()
            return f"tcp://{place['host'].lower()}:{place['port']}" if place else ""
    return None
