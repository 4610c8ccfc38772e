# SPDX-License-Identifier: BSD-3-Clause
"""The commands that are declared, on the command line."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from allanite.commands.cli.options import log_options, place_of, with_options
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, results_in, series_option, style_options
from allanite.commands.declaration import Command
from allanite.commands.registry import COMMANDS
from allanite.errors import InputError

if TYPE_CHECKING:
    from allanite.commands.measurement import MeasurementResult

__all__: list[str] = []


def _saved(measured: MeasurementResult, path: str, *, force: bool) -> Path:
    """Write the recording that a measurement leaves."""
    from allanite.files.recording_file import write_recording

    if measured.series is None:
        raise InputError(f"there is nothing to write to {path}")
    return write_recording(measured.series, path, force=force)


def _offered(declared: Command) -> None:
    """Put a command under the program."""

    several = declared.takes == "recordings"

    def run(
        log: str | tuple[str, ...],
        to: Destination,
        style: dict[str, bool] | None = None,
        output: str | None = None,
        **options: Any,
    ) -> int:
        from allanite.files.recording_file import refuse_recording
        from allanite.views.terminal import TerminalStyle, show_document

        shown = partial(show_document, style=TerminalStyle(**style or {}))
        given = {name: value for name, value in options.items() if value is not None}
        if refusal := declared.refusal(given):
            raise click.UsageError(refusal)
        if output is not None:
            refuse_recording(output, force=to.force)
        name = log if isinstance(log, str) else None
        return to.by_default(declared.folder, name or "").deliver(
            declared.stem,
            lambda **known: declared.measure(
                place_of(log) if isinstance(log, str) else [*map(place_of, log)], **known, **given
            ),
            shown,
            tables=declared.beside,
            log=name,
            save=None if output is None else partial(_saved, path=output, force=to.force),
        )

    run.__doc__ = f"{declared.summary}\n\n{declared.details}"
    folder = declared.folder.format(log="<log>")
    for bundle in (
        results_in(folder),
        *((style_options,) if declared.summarized else ()),
        *((series_option(declared.series),) if declared.series else ()),
        with_options(declared.options),
        log_options,
        (
            click.argument("log", nargs=-1, required=True, metavar="RECORD RECORD...")
            if several
            else click.argument("log")
        ),
    ):
        run = bundle(run)
    command(declared.example, declared.name)(run)


for _declared in COMMANDS.values():
    _offered(_declared)
