# SPDX-License-Identifier: BSD-3-Clause
"""Positions that were recorded one by one: the options, and the files with their headings."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import click

from allanite.cli.options import Angle, Duration

__all__ = ["files_of", "headed_files_of", "position_options", "single_log"]


def position_options(what: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """One file for each position, and the time between them; `what` is said of the files."""
    options = [
        click.option("--positions", is_flag=True, help=f"One LOG for each position, {what}"),
        click.option(
            "--between",
            type=Duration(),
            default=60.0,
            show_default=True,
            help="From one LOG to the next with --positions, where they do not tell.",
        ),
    ]

    def decorated(command: Callable[..., Any]) -> Callable[..., Any]:
        for option in reversed(options):
            command = option(command)
        return command

    return decorated


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
            raise click.UsageError(f"{name} is there twice: each position is a file of its own")
    return list(logs)


def headed_files_of(logs: Sequence[str], example: str, *, needed: bool = True) -> dict[str, Any]:
    """The files of --positions with the heading of each [rad]; None of one without, where none is needed.

    Raises
    ------
    click.UsageError
        One without a heading that needs it, or there twice.
    """
    found: list[tuple[str, float | None]] = []
    for text in logs:
        name, _, heading = text.rpartition("=")
        if not name or (not needed and Path(text).exists()):
            if needed:
                raise click.UsageError(
                    f"{text!r} has no heading: write {example}, with degrees clockwise from the mark"
                )
            found.append((text, None))
        else:
            found.append((name, Angle().convert(heading, None, click.get_current_context())))
    files_of([name for name, _ in found])
    return dict(found)
