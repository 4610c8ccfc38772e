# SPDX-License-Identifier: BSD-3-Clause
"""What the library reports while it works: one logger for each room, silent until a program asks.

``logging.basicConfig(level=logging.INFO)`` shows what was read, found, fitted and written;
``logging.getLogger("allanite.files").setLevel(logging.DEBUG)`` adds the details of one room.
"""

from __future__ import annotations

import logging

__all__ = ["logger_of"]

logging.getLogger("allanite").addHandler(logging.NullHandler())


def logger_of(module: str) -> logging.Logger:
    """The logger of the room that a module is in.

    >>> logger_of("allanite.files.readers.text").name
    'allanite.files'
    """
    return logging.getLogger(".".join(module.split(".")[:2]))
