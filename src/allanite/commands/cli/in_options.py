# SPDX-License-Identifier: BSD-3-Clause
"""Advice that the library gives in its own arguments, in the options of a command.

The library does not know who asks: it says "give correlation_time=". At the command line that is --correlation-time.
"""

from __future__ import annotations

import re

import click

from allanite.recording.channel_names import for_shell

__all__ = ["in_options"]

#: An argument with a word or number, or with nothing; not in parentheses, where it stands beside the option.
_ARGUMENT = re.compile(r"(?<![\w(-])([a-z_]+)=(?:'([^' ]*)'|(\d+(?:\.\d+)?))?(?=[\s;:,)]|\.(?:\s|$)|$)")


def in_options(words: str, command: click.Command | None) -> str:
    """A message with the arguments that it names as options of a command; other arguments stay.

    >>> @click.command()
    ... @click.option("--walk")
    ... def export(walk: str) -> None: ...
    >>> in_options("give walk='k-only', or B=", export)
    'give --walk k-only, or B='
    """
    options = _options_of(command)

    def option(argument: re.Match[str]) -> str:
        name, word, amount = argument.groups()
        of_command = options.get(name) or options.get(f"{name}s")
        if of_command is None or of_command in words:
            return argument[0]
        value = word or amount
        return f"{of_command} {for_shell(value)}" if value else of_command

    return _ARGUMENT.sub(option, words)


def _options_of(command: click.Command | None) -> dict[str, str]:
    """The long option of each argument, those of the commands in a group among them."""
    if command is None:
        return {}
    options: dict[str, str] = {}
    for within in getattr(command, "commands", {}).values():
        options |= _options_of(within)
    for parameter in command.params:
        long = [o for o in parameter.opts if o.startswith("--")]
        if parameter.name and long:
            options[parameter.name] = long[0]
    return options
