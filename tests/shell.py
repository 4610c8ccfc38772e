# SPDX-License-Identifier: BSD-3-Clause
"""The program called as a shell would, in the process of the test: the type of what the fixture `run` gives."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

__all__ = ["Done", "Run"]


class Done(NamedTuple):
    """What a shell sees of a program that ended."""

    code: int
    out: str
    err: str


Run = Callable[..., Done]
