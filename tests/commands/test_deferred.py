# SPDX-License-Identifier: BSD-3-Clause
"""A command is made when it is looked up, and once."""

from __future__ import annotations

import subprocess
import sys

import click
import pytest

from allanite.commands.cli import WRITTEN, cli
from allanite.commands.cli.deferred import DeferredCommands
from allanite.commands.registry import COMMANDS


def test_names_are_known_before_commands_are_made() -> None:
    made: list[str] = []

    def maker(name: str) -> click.Command:
        made.append(name)
        return click.Command(name)

    commands = DeferredCommands()
    for name in ("first", "second"):
        commands.defer(name, lambda name=name: maker(name))
    assert list(commands) == ["first", "second"] and len(commands) == 2
    assert "second" in commands and "third" not in commands
    assert made == []
    assert commands["second"] is commands.get("second")
    assert made == ["second"]
    with pytest.raises(KeyError):
        commands["third"]
    commands["first"] = own = click.Command("own")
    assert commands["first"] is own and made == ["second"]
    del commands["first"]
    assert list(commands) == ["second"]


def test_every_command_has_the_name_by_which_it_is_looked_up() -> None:
    written = [name for names in WRITTEN.values() for name in names]
    declared = [name for name in COMMANDS if " " not in name]
    assert [command.name for command in cli.commands.values()] == [*declared, *written]
    assert list(cli.commands) == [*declared, *written], "a module has a command that WRITTEN does not name"


@pytest.mark.parametrize("name", ["info", "characterize", "north"])
def test_the_command_that_runs_alone_is_made(name: str) -> None:
    code = (
        "import click\n"
        "made, begin = [], click.Command.__init__\n"
        "def noted(command, name, *others, **more):\n"
        "    made.append(name)\n"
        "    begin(command, name, *others, **more)\n"
        "click.Command.__init__ = noted\n"
        "from allanite.commands.cli import cli\n"
        f"command = cli.commands[{name!r}]\n"
        "below = getattr(command, 'commands', {})\n"
        "print(len([n for n in made if n not in below]), command.name)"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    count, made = done.stdout.split()
    assert made == name
    assert int(count) <= {"info": 4}.get(name, 2)  # the program, it, and those of its module
