# SPDX-License-Identifier: BSD-3-Clause
"""The program: its group of commands, its exit codes, and the one place where errors end."""

from __future__ import annotations

import os
import re
import select
import sys
import warnings
from collections.abc import Callable, Sequence
from contextlib import suppress
from typing import Any

import click

from allanite import __version__
from allanite.commands.cli.deferred import DeferredCommands
from allanite.commands.cli.failures import FAILED, INTERNAL, failure
from allanite.commands.cli.help_pages import GroupedCommands, GroupedOptions
from allanite.commands.cli.in_options import in_options
from allanite.commands.cli.repeated import AddingCommand, AddingGroup
from allanite.errors import AllaniteError, DataQualityWarning
from allanite.plain_files.printable import Shielded, printable

__all__ = ["EXIT_CODES", "LOSS", "UNFIT", "cli", "command", "defer", "example_of", "family", "main"]

LOSS = 3
UNFIT = FAILED
"""Of `info`, for a log that `characterize` would refuse: the two agree, so a script can check first."""

#: Code -> what it means of every command, and what of some.
EXIT_CODES: dict[int, tuple[str, str]] = {
    0: ("done", "a reader of stdout that closes early (`allanite … | head -1`) is not an error"),
    FAILED: (
        "failed or refused, with the reason",
        "a log with a fatal finding that was not accepted is refused; `info` shows it, and ends with 1 as well",
    ),
    2: (
        "wrong usage",
        "an unknown command or option, or an invalid value; nothing was done",
    ),
    LOSS: (
        "done, but not with all of the data",
        "samples are missing, out of range, doubtful, lost or removed by a repair; rows were left out",
    ),
    INTERNAL: (
        "a defect in allanite",
        "the message names a report to send, with the command and the traceback",
    ),
    10: ("`fleet check`: the unit fails", "a coefficient lies above its limit"),
    11: (
        "`fleet check`: cannot tell",
        "the log is too short to decide; the result states how long one decides",
    ),
    130: ("interrupted (Ctrl-C)", "no file is left incomplete; `record` closes its run"),
}
#: What a command is also called.
_SPELLINGS = {"characterise": "characterize"}
_EXAMPLE = "\b\nExample:\n  {}"


def main(arguments: Sequence[str] | None = None) -> None:
    """Run the program and leave it with its exit code."""
    for name in ("stdout", "stderr"):
        stream = getattr(sys, name)
        if hasattr(stream, "reconfigure"):
            stream.reconfigure(errors="replace")  # a terminal without √ or µ shows a question mark
        if stream is not None:  # one that was closed when the program began
            setattr(sys, name, Shielded(stream))
    warnings.showwarning = _show_warning
    try:
        code = cli.main(arguments, prog_name="allanite", standalone_mode=False)
    except click.ClickException as error:
        error.message = printable(error.message)  # type: ignore[misc]  # Final in name only
        error.show()
        code = error.exit_code
    except (click.Abort, KeyboardInterrupt):
        click.echo("allanite: interrupted; no file was left incomplete", err=True)
        code = 130
    except Exception as error:  # noqa: BLE001 - the last net: no user meets a traceback
        code, words = failure(error)
        _say(words)
    _last_words()
    raise SystemExit(code if isinstance(code, int) else 0)


class _Command(AddingCommand, GroupedOptions):
    """A command: its options add up, and its help has them in groups."""


class _Program(AddingGroup, GroupedCommands):
    """The group of commands; a reader of stdout that has seen enough (``| head``) ends it without an error."""

    command_class = _Command

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        return super().get_command(ctx, _SPELLINGS.get(cmd_name, cmd_name))

    def make_context(self, *args: Any, **extra: Any) -> click.Context:
        try:
            return super().make_context(*args, **extra)
        except BrokenPipeError:  # of --help
            if not _reader_left():
                raise
            raise click.exceptions.Exit(0) from None

    def invoke(self, context: click.Context) -> Any:
        try:
            return super().invoke(context)
        except AllaniteError as error:
            command = self.commands.get(context.invoked_subcommand or "")
            error.args = (in_options(str(error), command),)
            raise
        except BrokenPipeError as error:
            if not _reader_left():  # it was the pipe or the connection of something else
                raise OSError(f"{error.filename or 'a connection'}: {error.strerror or error}") from error
            return 0


def _reader_left() -> bool:
    """Whether stdout is a pipe that nobody reads any more; what is still in it then goes nowhere."""
    try:
        sys.stdout.flush()
    except (BrokenPipeError, ValueError):
        pass
    else:
        if not _is_broken(sys.stdout):
            return False
    with suppress(OSError, ValueError, AttributeError):
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, sys.stdout.fileno())
        os.close(nowhere)
    return True


def _is_broken(stream: Any) -> bool:
    """Whether the other end of a stream is closed, as far as the system can tell."""
    if not hasattr(select, "poll"):  # Windows
        return True
    with suppress(OSError, ValueError, AttributeError):
        asked = select.poll()
        asked.register(stream.fileno(), 0)
        return any(event & (select.POLLERR | select.POLLHUP) for _, event in asked.poll(0))
    return False


def _last_words() -> None:
    """Write out what is left for stdout; a reader that has gone is no error."""
    with suppress(AttributeError, ValueError):  # stdout is none, or closed
        try:
            sys.stdout.flush()
        except BrokenPipeError:
            _reader_left()


def _show_warning(message: Warning | str, category: type[Warning], *where: Any, **_: Any) -> None:
    if issubclass(category, DataQualityWarning):
        _say(f"note: {message}")


def _say(words: str) -> None:
    """Lists have their lines set in; a line that begins anywhere else is in a name, and is nothing that we say."""
    click.echo("allanite: " + re.sub(r"\n(?!  )", r"\\n", words), err=True)


_COMMANDS = DeferredCommands()
#: Adds a command of `cli` that is made when it is first looked up.
defer = _COMMANDS.defer


@click.group(
    cls=_Program,
    commands=_COMMANDS,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog=_EXAMPLE.format("allanite characterize gyro.csv --unit deg/s"),
)
@click.option("-v", "--verbose", count=True, help="Report each step on stderr; -vv adds details.")
@click.version_option(__version__, prog_name="allanite")
def cli(verbose: int) -> None:
    """From a log of a sensor at rest to a noise model you can trust, a filter, and the Earth's rotation."""
    if verbose:
        _report_steps(details=verbose > 1)


def _report_steps(*, details: bool) -> None:
    """Show what the library logs, as long as the command runs; lines and a bar that moves would mix."""
    import logging

    from allanite.views.terminal.console import listen

    reports, shown = logging.getLogger("allanite"), logging.StreamHandler()
    shown.setFormatter(logging.Formatter("%(name)s: %(message)s"))
    level = reports.level
    reports.addHandler(shown)
    reports.setLevel(logging.DEBUG if details else logging.INFO)
    listen(lambda fraction, text="": None)

    @click.get_current_context().call_on_close
    def silent() -> None:
        reports.removeHandler(shown)
        reports.setLevel(level)
        listen(None)


def example_of(example: str) -> str:
    """The end of a command's help."""
    return _EXAMPLE.format(example)


def family(example: str, name: str | None = None) -> Callable[[Callable[..., Any]], click.Group]:
    """A command of `cli` that has further commands under its name; it runs where none of them is named."""
    return cli.group(
        name,
        epilog=_EXAMPLE.format(example),
        invoke_without_command=True,
        subcommand_metavar="[COMMAND]",
    )


def command(example: str, name: str | None = None) -> Callable[[Callable[..., Any]], click.Command]:
    """A command of `cli` whose help ends with an example."""
    return cli.command(name, epilog=_EXAMPLE.format(example))
