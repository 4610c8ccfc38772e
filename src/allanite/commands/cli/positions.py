# SPDX-License-Identifier: BSD-3-Clause
"""Positions that were recorded one by one: the options, and the files with their headings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from allanite.commands.cli.options import Angle

__all__ = ["files_of", "headed_files_of", "position_option", "single_log"]


def position_option(what: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """One file for each position; `what` is said of the files."""
    return click.option("--positions", is_flag=True, help=f"One LOG per position, {what}")


def single_log(logs: Sequence[str], example: str) -> str:
    """The only one.

    Raises
    ------
    click.UsageError
        There are several.
    """
    if len(logs) > 1:
        raise click.UsageError(f"several LOGs are for --positions, one for each: {example}")
    return logs[0]


def files_of(logs: Sequence[str]) -> list[str]:
    """The files of --positions.

    Raises
    ------
    click.UsageError
        One is there twice.
    """
    for name in logs:
        if logs.count(name) > 1:
            raise click.UsageError(f"{name} is given twice: each position needs its own file")
    return list(logs)


def headed_files_of(logs: Sequence[str], example: str, *, needed: bool = True) -> dict[str, Any]:
    """The files of --positions with the heading of each [rad]; None of one without, where none is needed.

    Raises
    ------
    click.UsageError
        One without a heading that needs it, or there twice.
    """
    headed: list[tuple[str, float | None]] = []
    for text in logs:
        name, _, heading = text.rpartition("=")
        if not name or (not needed and Path(text).exists()):
            if needed:
                raise click.UsageError(
                    f"{text!r} has no heading: write {example}, with degrees clockwise from the mark"
                )
            headed.append((text, None))
        else:
            headed.append((name, Angle().convert(heading, None, click.get_current_context())))
    files_of([name for name, _ in headed])
    return dict(headed)
