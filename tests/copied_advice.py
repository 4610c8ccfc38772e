# SPDX-License-Identifier: BSD-3-Clause
"""What a message advises, as its reader copies it into a shell: options with their values, and whole commands."""

from __future__ import annotations

import re
import shlex
from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

import click

from allanite.commands.cli import cli
from allanite.recording.channel_names import for_shell

__all__ = ["CHOICES", "COMMANDS", "OPTIONS", "Way", "ways_in", "with_way"]


def commands() -> Iterator[tuple[str, click.Command]]:
    for name, command in cli.commands.items():
        yield name, command
        if isinstance(command, click.Group):
            yield from ((f"{name} {sub}", c) for sub, c in command.commands.items())


COMMANDS = dict(commands())
OPTIONS = {
    name: {o for p in c.params for o in (*p.opts, *p.secondary_opts)} | {"--help"}
    for name, c in COMMANDS.items()
}
CHOICES = {
    name: {o: set(p.type.choices) for p in c.params if isinstance(p.type, click.Choice) for o in p.opts}
    for name, c in COMMANDS.items()
}
FLAGS = {
    name: {o for p in c.params if isinstance(p, click.Option) and p.is_flag for o in p.opts}
    for name, c in COMMANDS.items()
}
_NAMES = "|".join(sorted(COMMANDS, key=len, reverse=True))
_COMMAND = re.compile(
    rf"`allanite (?P<ticked>(?:{_NAMES})\b[^`]*)`|'allanite (?P<quoted>(?:{_NAMES})\b[^']*)'"
    rf"|(?<![\w'`])allanite (?P<bare>(?:{_NAMES})\b(?:(?![;,.)](?:\s|$)| \().)*)"
)
_OPTION = re.compile(r"(?<![\w-])--[a-z][a-z-]*[a-z]")
_WORD = re.compile(r"""(?:'(?:[^']|'"'"')*'|"[^"]*"|[^\s;)'"])+""")


class Way(NamedTuple):
    """One way out: options to add to the command that was refused, or a command of its own."""

    key: str
    words: tuple[str, ...]
    command: bool = False


def ways_in(text: str, name: str, known: Mapping[str, str]) -> list[Way]:
    """The ways out that the refusal of a command offers.

    Parameters
    ----------
    text : str
    name : str
        Of the command that was refused: it knows which options are flags.
    known : mapping of str to str
        What the user adds: the value of an option that has none, or what follows a command, by the option or the
        command; the value of a placeholder (UNIT), by its word. "" leaves the option out of the command. An option
        whose value the message holds in one place and not in another: by both, with the value as well ("--time none").
    """
    found = []
    for match in _COMMAND.finditer(text):
        line = match["ticked"] or match["quoted"] or match["bare"]
        key = f"allanite {line.split(' --')[0].strip()}"
        key = next((k for k in known if k.startswith("allanite ") and key.startswith(k)), key)
        words = _split(_filled(line, known))
        found.append(Way(key, (*words, *shlex.split(known.get(key, ""))), command=True))
    return [*found, *_options(_COMMAND.sub(lambda m: " " * len(m[0]), text), name, known)]


def _options(text: str, name: str, known: Mapping[str, str]) -> list[Way]:
    ways: list[Way] = []
    end = -1
    for match in _OPTION.finditer(text):
        option, behind = match[0], match.end()
        value = _WORD.match(text, behind + 1) if text[behind : behind + 1] in (" ", "=") else None
        bare = "" if value is None else value[0] if len(value[0]) == 1 else value[0].rstrip(",.:")
        if option in known and f"{option} {bare}" not in known:
            words = [option, *shlex.split(known[option])] if known[option] else []
        elif option in FLAGS[name]:
            words = [option]
        else:
            assert bare, f"{option} has no value: {text!r}"
            behind += 1 + len(bare)
            words = [option, *_split(_filled(bare, known))]
            assert len(words) == 2, (option, bare)
        if ways and end == match.start() - 1 and text[end] == " " and words:
            ways[-1] = Way(ways[-1].key, (*ways[-1].words, *words))  # two options side by side are one way
        else:
            ways.append(Way(option, tuple(words)))
        end = behind
    return list(dict.fromkeys(ways))


def _split(line: str) -> list[str]:
    """The words of a line, of which a shell makes nothing else."""
    for word in _WORD.findall(line):
        assert word[0] in "'\"" or for_shell(word) == word or re.search(r"[a-z]='", word) or word == ",", (
            f"a shell reads {word} otherwise, in {line!r}"
        )
    return shlex.split(line)


def _filled(word: str, known: Mapping[str, str]) -> str:
    """A text with what the user knows in place of words like UNIT."""
    for place, value in known.items():
        if place.isupper() and not place.startswith("-"):
            word = re.sub(rf"(?<![A-Z\w-]){re.escape(place)}(?![A-Z\w])", value, word)
    return word


def with_way(line: list[str], way: Way, instead: Sequence[str] = ()) -> list[str]:
    """The command with the options of a way in place of its own, or without the option that is to be left out."""
    if way.command:
        return list(way.words)
    new = {way.key, *instead, *(word for word in way.words if _OPTION.fullmatch(word))}
    kept, skip = [], False
    flags = FLAGS.get(" ".join(line[:2]), FLAGS[line[0]])
    for k, word in enumerate(line):
        if skip:
            skip = False
        elif word in new:
            skip = word not in flags and k + 1 < len(line)
        else:
            kept.append(word)
    return [*kept, *way.words]
