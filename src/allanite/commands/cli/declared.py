# SPDX-License-Identifier: BSD-3-Clause
"""The commands that are declared, on the command line."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from allanite.commands.cli.completion import complete_files
from allanite.commands.cli.options import log_options, place_of, with_options
from allanite.commands.cli.positions import files_of, headed_files_of, position_option, single_log
from allanite.commands.cli.program import command, defer, example_of, family
from allanite.commands.cli.results import Destination, output_option, results_in, style_options
from allanite.commands.declaration import Command
from allanite.commands.registry import COMMANDS
from allanite.errors import InputError

if TYPE_CHECKING:
    from allanite.commands.measurement import MeasurementResult
    from allanite.study.result_document import Reportable

__all__ = ["offer_below"]

Bundle = Callable[[Callable[..., Any]], Callable[..., Any]]

#: Commands that have further ones below their name.
_FAMILIES: dict[str, click.Group] = {}


def _saved(measured: MeasurementResult, path: str, *, force: bool) -> Path:
    """Write the recording, or the models, that a measurement leaves."""
    from allanite.files.recording_file import write_recording
    from allanite.study.model_file import save_models

    if measured.models is not None:
        return save_models(measured.models, path, force=force)
    if measured.series is None:
        raise InputError(f"there is nothing to write to {path}")
    return write_recording(measured.series, path, force=force)


def _shown(
    style: dict[str, bool], document: Reportable, files: Sequence[object], *notes: Sequence[str]
) -> None:
    """Print a result; what prints it is loaded only then."""
    from allanite.views.terminal.page import show_document
    from allanite.views.terminal.style import TerminalStyle

    show_document(document, files, *notes, style=TerminalStyle(**style))


def _refused(declared: Command, path: str, *, force: bool) -> None:
    """Refuse, before the work is done, a file that cannot be written."""
    from allanite.files.recording_file import refuse_recording
    from allanite.plain_files.atomic_file import refuse_existing

    if declared.series:
        refuse_recording(path, force=force)
    else:
        refuse_existing(Path(path), force=force)


def _offered(declared: Command) -> click.Command:
    """Put a command under the program, or below the one that it belongs to."""

    def run(
        to: Destination, style: dict[str, bool] | None = None, output: str | None = None, **options: Any
    ) -> int:
        if click.get_current_context().invoked_subcommand is not None:
            return 0
        given = {name: value for name, value in options.items() if value is not None}
        _refuse_missing(declared, given)
        subject = _subject(declared, given)
        log = given.get("log") if declared.takes == "sheet" else subject
        if refusal := declared.refusal({**given, "plot": to.figure}):
            raise click.UsageError(refusal)
        if output is not None:
            _refused(declared, output, force=to.force)
        name = log if isinstance(log, str) else None
        _placed(declared, given)
        places = place_of(subject) if isinstance(subject, str) else [*map(place_of, subject)]
        return to.by_default(declared.folder, name or "").deliver(
            declared.stem,
            lambda **known: declared.measure(places, **known, **given),
            partial(_shown, style or {}),
            tables=declared.beside,
            log=name,
            save=None if output is None else partial(_saved, path=output, force=to.force),
            quiet=declared.brief,
        )

    run.__doc__ = f"{declared.summary}\n\n{declared.details}"
    above, _, name = declared.name.rpartition(" ")
    is_family = any(other.startswith(f"{declared.name} ") for other in COMMANDS)
    folder = declared.folder.format(log="<log>")
    for bundle in (
        results_in(folder),
        *((style_options,) if declared.summarized else ()),
        *((output_option(declared),) if declared.series or declared.models else ()),
        with_options(declared.options, asked_later=is_family),
        *((position_option(declared.positions),) if declared.positions else ()),
        *_of_subject(declared),
    ):
        run = bundle(run)
    if is_family:
        return family(declared.example, name)(run)
    if above:
        return _FAMILIES[above].command(name, epilog=example_of(declared.example))(run)
    return command(declared.example, name)(run)


def _of_subject(declared: Command) -> tuple[Bundle, ...]:
    """The argument, and how a log is read; none of a command that takes models."""
    reading = (log_options,) if declared.reads else ()
    if declared.takes == "model":
        return reading
    if declared.takes == "pair":
        return tuple(click.argument(name, shell_complete=complete_files) for name in ("second", "first"))
    if declared.takes == "fleet":
        return (click.argument("fleet", type=click.Path(exists=True)),)
    if declared.takes in ("study", "sheet"):
        file = click.Path(exists=True, dir_okay=False, allow_dash=declared.takes == "study")
        return *reading, click.argument(declared.takes, type=file)
    several = declared.takes == "recordings"
    if not (several or declared.positions):
        return *reading, click.argument("log", shell_complete=complete_files)
    metavar = declared.logs or ("RECORD RECORD..." if several else "LOG...")
    return *reading, click.argument(
        "logs", metavar=metavar, nargs=-1, required=True, shell_complete=complete_files
    )


def _refuse_missing(declared: Command, given: dict[str, Any]) -> None:
    """What is required, and was not given: a command with others below its name cannot ask for it before."""
    for option in declared.options:
        if option.required and option.python not in given:
            context = click.get_current_context()
            raise click.MissingParameter(param_hint=f"'{option.flag}'", param_type="option", ctx=context)


def _subject(declared: Command, given: dict[str, Any]) -> str | tuple[str, ...]:
    """The log among what was given, or several, as typed; of several positions the first, all of them with headings.

    A command of models has none.
    """
    if declared.takes == "model":
        return ()
    if declared.takes == "pair":
        return given.pop("first"), given.pop("second")
    if not (logs := given.pop("logs", ())):
        return str(given.pop(declared.takes if declared.takes in ("study", "sheet", "fleet") else "log"))
    if not declared.positions:
        return tuple(logs)
    if not given.pop("positions", False):
        return single_log(logs, declared.headed)
    headed = declared.headings != "none"
    given["positions"] = (
        headed_files_of(logs, declared.headed, needed=declared.headings == "needed")
        if headed
        else files_of(logs)
    )
    return str(next(iter(given["positions"])))


def _placed(declared: Command, given: dict[str, Any]) -> None:
    """Files that options name become places; a model does where there is no log that stdin may hold."""
    files = ("log", "study", *(("model", "models") if declared.takes == "model" else ()))
    for option in declared.options:
        if option.type in files and (value := given.get(option.python)):
            given[option.python] = place_of(value) if isinstance(value, str) else [*map(place_of, value)]


def offer_below(group: click.Group) -> None:
    """Put the declared commands that belong to a group of another module below it."""
    _FAMILIES[str(group.name)] = group
    for declared in COMMANDS.values():
        if declared.name.startswith(f"{group.name} "):
            _offered(declared)


def _whole(declared: Command) -> click.Command:
    """A command of the program, with those below its name."""
    offered = _offered(declared)
    if isinstance(offered, click.Group):
        offer_below(offered)
    return offered


for _declared in COMMANDS.values():
    if " " not in _declared.name:
        defer(_declared.name, partial(_whole, _declared))
