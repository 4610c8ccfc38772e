# SPDX-License-Identifier: BSD-3-Clause
"""The program: its group of commands, its exit codes, and the one place where errors end."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Callable, Sequence
from typing import Any

import click

from allanite import __version__
from allanite.cli.failures import failure
from allanite.cli.repeated import AddingGroup
from allanite.errors import DataQualityWarning
from allanite.printable import Shielded, printable

__all__ = ["LOSS", "cli", "command", "example_of", "family", "main"]

LOSS = 3
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
    except BrokenPipeError:  # the reader of a pipe has seen enough
        sys.stderr.close()
        code = 0
    except (click.Abort, KeyboardInterrupt):
        click.echo("allanite: interrupted; no file was left half written", err=True)
        code = 130
    except Exception as error:  # noqa: BLE001 - the last net: no user meets a traceback
        code, words = failure(error)
        _say(words)
    raise SystemExit(code if isinstance(code, int) else 0)


def _show_warning(message: Warning | str, category: type[Warning], *where: Any, **_: Any) -> None:
    if issubclass(category, DataQualityWarning):
        _say(f"note: {message}")


def _say(words: str) -> None:
    """Lists have their lines set in; a line that begins anywhere else is in a name, and is nothing that we say."""
    click.echo("allanite: " + re.sub(r"\n(?!  )", r"\\n", words), err=True)


@click.group(
    cls=AddingGroup,
    context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100},
    epilog=_EXAMPLE.format("allanite characterize gyro.csv --unit deg/s"),
)
@click.version_option(__version__, prog_name="allanite")
def cli() -> None:
    """From a log of a sensor at rest to a noise model you can trust, a filter, and the Earth's rotation."""


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
