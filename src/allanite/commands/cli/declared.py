# SPDX-License-Identifier: BSD-3-Clause
"""The commands that are declared, on the command line."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from allanite.commands.cli.options import log_options, place_of, with_options
from allanite.commands.cli.positions import headed_files_of, position_option, single_log
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
        to: Destination, style: dict[str, bool] | None = None, output: str | None = None, **options: Any
    ) -> int:
        from allanite.files.recording_file import refuse_recording
        from allanite.views.terminal import TerminalStyle, show_document

        shown = partial(show_document, style=TerminalStyle(**style or {}))
        given = {name: value for name, value in options.items() if value is not None}
        log = _subject(declared, given)
        if refusal := declared.refusal({**given, "plot": to.figure}):
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
        *((position_option(declared.positions),) if declared.positions else ()),
        log_options,
        (
            click.argument(
                "logs", metavar="RECORD RECORD..." if several else "LOG...", nargs=-1, required=True
            )
            if several or declared.positions
            else click.argument("log")
        ),
    ):
        run = bundle(run)
    command(declared.example, declared.name)(run)


def _subject(declared: Command, given: dict[str, Any]) -> str | tuple[str, ...]:
    """The log among what was given, or several, as typed; of several positions the first, all of them with headings."""
    if not (logs := given.pop("logs", ())):
        return str(given.pop("log"))
    if not declared.positions:
        return tuple(logs)
    if not given.pop("positions", False):
        return single_log(logs, declared.headed)
    given["positions"] = headed_files_of(logs, declared.headed, needed=declared.headings_needed)
    return str(next(iter(given["positions"])))


for _declared in COMMANDS.values():
    _offered(_declared)
