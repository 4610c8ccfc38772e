# SPDX-License-Identifier: BSD-3-Clause
"""An option that is given twice adds up or is refused; none wins silently."""

from __future__ import annotations

import random
from collections.abc import Iterator

import click
import pytest
from click.testing import CliRunner

from allanite.commands.cli import cli
from allanite.commands.cli.options import ByChannel, Duration, Names
from allanite.commands.cli.repeated import AddingCommand, Listed
from shell import program_context


def commands(group: click.Group, *path: str) -> Iterator[tuple[str, click.Command]]:
    for name, command in group.commands.items():
        yield " ".join((*path, name)), command
        if isinstance(command, click.Group):
            yield from commands(command, *path, name)


def parsed(command: click.Command, words: list[str]) -> dict[str, object]:
    return command.make_context(
        "x", list(words), parent=program_context()
    ).params  # which takes the words off the list


@pytest.fixture(scope="module")
def command() -> AddingCommand:
    options: list[click.Parameter] = [
        click.Option(["--unit"], type=ByChannel()),
        click.Option(["--channels"], type=Names()),
        click.Option(["--rate"], type=float, default=5.0),
        click.Option(["--from", "start"], type=Duration()),
        click.Option(["--accept"], multiple=True),
        click.Option(["--json"], is_flag=True),
    ]
    return AddingCommand("x", params=options)


def test_every_option_of_every_command_adds_up_or_refuses() -> None:
    plain = [
        f"{name} {option.opts[0]}"
        for name, one in commands(cli)
        for option in one.params
        if type(option) is click.Option
    ]
    assert plain == []


def test_mappings_add_up_however_they_are_cut(command: AddingCommand) -> None:
    for seed in range(200):
        rng = random.Random(seed)
        said = {f"c{k}": rng.choice(["deg/s", "24 mV/(deg/s)", "g"]) for k in range(rng.randrange(1, 6))}
        parts, words = [f"{key}={value}" for key, value in said.items()], list[str]()
        parts += rng.sample(parts, rng.randrange(len(parts)))  # the same twice is no contradiction
        while parts:
            n = rng.randrange(1, len(parts) + 1)
            words += ["--unit", ",".join(parts[:n])]
            parts = parts[n:]
        assert parsed(command, words)["unit"] == said
        key = rng.choice(list(said))
        with pytest.raises(click.BadParameter, match=f"{key}=.* and {key}=V: give it once"):
            parsed(command, [*words, "--unit", f"{key}=V"])


def test_lists_add_up(command: AddingCommand) -> None:
    got = parsed(command, ["--channels", "a,b", "--channels", "c", "--accept", "x", "--accept", "y"])
    assert (got["channels"], got["accept"]) == (["a", "b", "c"], ("x", "y"))


@pytest.mark.parametrize("words", ["--rate 1 --rate 2", "--from 1s --from 2s", "--unit V --unit mV"])
def test_single_values_are_given_once(words: str, command: AddingCommand) -> None:
    with pytest.raises(click.BadParameter, match="give it once"):
        parsed(command, words.split())


def test_the_same_value_twice_is_one(command: AddingCommand) -> None:
    got = parsed(command, ["--rate", "2", "--rate", "2", "--unit", "V", "--unit", "V", "--json", "--json"])
    assert (got["rate"], got["unit"], got["json"]) == (2.0, "V", True)
    assert parsed(command, [])["rate"] == 5.0


def test_the_command_line_says_so() -> None:
    found = CliRunner().invoke(cli, ["info", "nothing.csv", "--unit", "gyro=V", "--unit", "gyro=deg/s"])
    assert found.exit_code == 2
    assert "gyro=V and gyro=deg/s: give it once." in found.output


def test_every_mapping_says_that_it_is_one() -> None:
    kinds = {type(o.type) for _, one in commands(cli) for o in one.params if isinstance(o.type, Listed)}
    assert {k.__name__ for k in kinds if k.parts == "mapping"} == {
        "ByChannel",
        "Goals",
        "Initial",
        "PerLog",
        "Renamed",
    }
