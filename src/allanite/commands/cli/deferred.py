# SPDX-License-Identifier: BSD-3-Clause
"""The commands by name, each made when it is first looked up: one that runs does not wait for the options of all."""

from __future__ import annotations

from collections.abc import Callable, Iterator, MutableMapping

import click

__all__ = ["DeferredCommands"]


class DeferredCommands(MutableMapping[str, click.Command]):
    """Commands of a group, made or yet to be made."""

    def __init__(self) -> None:
        self._commands: dict[str, click.Command | None] = {}
        self._makers: dict[str, Callable[[], click.Command]] = {}

    def defer(self, name: str, make: Callable[[], click.Command]) -> None:
        """Adds a command that `make` gives when it is asked for."""
        self._commands[name], self._makers[name] = None, make

    def __getitem__(self, name: str) -> click.Command:
        command = self._commands[name]
        if command is None:
            command = self._commands[name] = self._makers[name]()
        return command

    def __setitem__(self, name: str, command: click.Command) -> None:
        self._commands[name] = command

    def __delitem__(self, name: str) -> None:
        del self._commands[name]

    def __contains__(self, name: object) -> bool:
        return name in self._commands

    def __iter__(self) -> Iterator[str]:
        return iter(self._commands)

    def __len__(self) -> int:
        return len(self._commands)
