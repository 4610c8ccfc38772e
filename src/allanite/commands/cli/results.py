# SPDX-License-Identifier: BSD-3-Clause
"""Where the result of a command goes: a folder, a figure, the terminal or JSON; and its exit code."""

from __future__ import annotations

import functools
from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from allanite.commands.cli.options import force_option, json_option, print_json, typed
from allanite.commands.cli.program import LOSS
from allanite.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from allanite.commands.declaration import Command
    from allanite.commands.measurement import MeasurementResult

__all__ = ["Destination", "output_option", "result_options", "results_in", "style_options"]


@dataclass(frozen=True, slots=True)
class Destination:
    """What `result_options` were given."""

    folder: str | None
    figure: str | None
    force: bool
    as_json: bool

    def by_default(self, folder: str, log: str) -> Destination:
        """With the folder of a command whose files go into one, where nobody says anything else."""
        if self.folder is not None or self.as_json or not folder:
            return self
        return replace(self, folder=folder.format(log="stdin" if log == "-" else Path(log).stem))

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
            Takes the document, the files that were written, and notes where there are any.
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
        from allanite.views.terminal.console import progress

        refuse_measurement(self.folder, self.figure, name, tables, force=self.force)
        known: dict[str, Any] = {"command": typed()}
        if log is not None:
            known["source"] = "stdin" if log == "-" else None
        with progress(quiet=quiet or self.as_json) as advance:
            measured = make(progress=advance, **known)
            if advance is not None and self.folder is not None:
                advance(1.0, "writing the files")
            saved = [] if save is None else [save(measured)]
            done = write_measurement(measured, self.folder, self.figure, force=self.force)
        if self.as_json:
            print_json(measured.plain)
        else:
            show(measured.document, [*saved, *done.files], *([done.notes] if done.notes else []))
        return LOSS if measured.lossy else measured.code


def result_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Where a result goes: the command gets it as `to`, a `Destination`."""
    return results_in("")(command)


def output_option(declared: Command) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Where the recording goes that a measurement leaves, or the models."""
    series = f"File for the {declared.series}: .parquet, .npz, .npy, .csv or .mat."
    return click.option(
        "-o",
        "--output",
        type=click.Path(dir_okay=False),
        help=series if declared.series else f"Output file for the {declared.models} (JSON).",
    )


def style_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """How much of a result is printed, and in which units: the command gets it as `style`, of a `TerminalStyle`."""

    @functools.wraps(command)
    def styled(*, si: bool, details: bool, quiet: bool, **options: Any) -> Any:
        return command(style={"si": si, "details": details, "quiet": quiet}, **options)

    made: Callable[..., Any] = styled
    for flag, words in (
        ("--quiet", "Print the names of the written files only."),
        ("--details", "Explain every finding, with its repair."),
        ("--si", "Print coefficients in SI units."),
    ):
        made = click.option(flag, is_flag=True, help=words)(made)
    return made


def results_in(folder: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """The same, with the folder that is taken where nobody names one."""

    def bundle(command: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(command)
        def bundled(
            *, out: str | None, figure: str | None, force: bool, as_json: bool, **options: Any
        ) -> Any:
            return command(to=Destination(out, figure, force, as_json), **options)

        default = f"  [default: {folder}]" if folder else ""
        options = [
            click.option(
                "--out",
                type=click.Path(file_okay=False),
                help=f"Output folder for report, JSON and tables.{default}",
            ),
            click.option(
                "--plot", "figure", type=click.Path(dir_okay=False), help="Save a figure: .pdf, .svg or .png."
            ),
        ]
        made = force_option(json_option(bundled))
        for option in reversed(options):
            made = option(made)
        return made

    return bundle
