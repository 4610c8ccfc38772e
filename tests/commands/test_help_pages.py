# SPDX-License-Identifier: BSD-3-Clause
"""`--help`: every command once under its purpose, in one line; every option under what it is about."""

from __future__ import annotations

import re
from collections.abc import Iterator

import click
import pytest

from allanite.commands.cli import cli
from allanite.commands.cli.help_pages import GROUPS, summary_of
from shell import Run


def commands() -> Iterator[tuple[str, click.Command]]:
    for name, command in cli.commands.items():
        yield name, command
        if isinstance(command, click.Group):
            yield from ((f"{name} {sub}", each) for sub, each in command.commands.items())


def test_every_command_is_in_one_group() -> None:
    assert sorted(name for names in GROUPS.values() for name in names) == sorted(cli.commands)


@pytest.mark.parametrize(("name", "command"), list(commands()), ids=[name for name, _ in commands()])
def test_a_summary_is_a_short_instruction(name: str, command: click.Command) -> None:
    words = summary_of(command)
    assert re.match(r"[A-Z][a-z]*([^s,:]|ss) ", words) and not words.endswith(".")
    assert len(words) <= 62  # so that no line of 80 columns is broken


def test_no_line_of_the_help_is_broken_or_cut(run: Run) -> None:
    shown = run("--help").out
    for name, command in cli.commands.items():
        assert any(line.split(None, 1) == [name, summary_of(command)] for line in shown.splitlines()), name


@pytest.mark.parametrize("name", [name for name, _ in commands()])
def test_options_stand_under_what_they_are_about(name: str, run: Run) -> None:
    shown = run(*name.split(), "--help").out
    places = [shown.find(head) for head in ("\nOptions:", "\nReading the log:", "\nOutput:")]
    there = [place for place in places if place >= 0]
    assert there == sorted(there) and places[0] > 0
    reading, output = places[1], places[2]
    if "--delimiter" in shown:
        assert 0 < reading < shown.rfind("\n  --delimiter") < (output if output > 0 else len(shown))
    if "\n  --json  " in shown:
        assert 0 < output < shown.rfind("\n  --json")


def test_the_british_spelling_is_understood(run: Run) -> None:
    assert (
        run("characterise", "--help").out.replace("characterise", "characterize")
        == run("characterize", "--help").out
    )


@pytest.mark.parametrize(("name", "command"), list(commands()), ids=[name for name, _ in commands()])
def test_no_name_is_broken_at_its_hyphen(name: str, command: click.Command) -> None:
    """A docstring that was wrapped there shows `rate- table.json`."""
    assert not re.search(r"\w-\s+\w", command.help or "")
