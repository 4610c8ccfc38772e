# SPDX-License-Identifier: BSD-3-Clause
"""Where the result of a command goes: a folder, a figure, the terminal or JSON; and its exit code."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import click

from allanite.commands.cli.options import force_option, json_option, print_json, typed
from allanite.commands.cli.program import LOSS

if TYPE_CHECKING:
    from pathlib import Path

    from allanite.commands.measurement import MeasurementResult

__all__ = ["Destination", "result_options"]


@dataclass(frozen=True, slots=True)
class Destination:
    """What `result_options` were given."""

    folder: str | None
    figure: str | None
    force: bool
    as_json: bool

    def deliver(
        self,
        name: str,
        make: Callable[..., MeasurementResult],
        show: Callable[..., None],
        *,
        tables: Collection[str] = (),
        log: str | None = None,
        save: Callable[[MeasurementResult], Path] | None = None,
        quiet: bool = False,
    ) -> int:
        """Refuse what is in the way, measure, write and show; the exit code.

        Parameters
        ----------
        name : str
            Of the document, without its suffix.
        make : callable
            The measurement: takes `progress` and `command`, and `source` where there is a log.
        show : callable
            Takes the document and the files that were written.
        tables : collection of str
            Files beside the document.
        log : str, optional
            As it was typed.
        save : callable, optional
            Writes one file more.
        quiet : bool
            The work is too short for a progress bar.
        """
        from allanite.commands.measurement import refuse_measurement, write_measurement
        from allanite.views import terminal

        refuse_measurement(self.folder, self.figure, name, tables, force=self.force)
        known: dict[str, Any] = {"command": typed()}
        if log is not None:
            known["source"] = "stdin" if log == "-" else None
        with terminal.progress(quiet=quiet or self.as_json) as advance:
            measured = make(progress=advance, **known)
        saved = [] if save is None else [save(measured)]
        done = write_measurement(measured, self.folder, self.figure, force=self.force)
        if self.as_json:
            print_json(measured.plain)
        else:
            show(measured.document, [*saved, *done.files])
        return LOSS if measured.lossy else 0


def result_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Where a result goes: the command gets it as `to`, a `Destination`."""

    @functools.wraps(command)
    def bundled(*, out: str | None, figure: str | None, force: bool, as_json: bool, **options: Any) -> Any:
        return command(to=Destination(out, figure, force, as_json), **options)

    options = [
        click.option("--out", type=click.Path(file_okay=False), help="Folder for report, JSON and tables."),
        click.option(
            "--plot", "figure", type=click.Path(dir_okay=False), help="Draw it: .pdf, .svg or .png."
        ),
    ]
    decorated = force_option(json_option(bundled))
    for option in reversed(options):
        decorated = option(decorated)
    return decorated
