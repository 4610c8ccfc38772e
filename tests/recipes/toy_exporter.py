# SPDX-License-Identifier: BSD-3-Clause
"""Names of channels, for a toy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

__all__ = ["FILE_NAME", "NAME", "SUMMARY", "TAKES", "write"]

NAME = "toy"
FILE_NAME = "toy.txt"
SUMMARY = "toy: the names of the channels"
TAKES = "study"


def write(document: Mapping[str, Any], *, greeting: str = "hello") -> str:
    """The text of the file."""
    return "\n".join([greeting, *(channel["name"] for channel in document["channels"]), ""])
