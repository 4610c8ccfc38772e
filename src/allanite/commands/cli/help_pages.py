# SPDX-License-Identifier: BSD-3-Clause
"""What `--help` looks like: commands by what they are for, options by what they are about."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence

import click

from allanite.commands.option import BENCH, READING
from allanite.commands.registry import COMMANDS

__all__ = ["GROUPS", "GroupedCommands", "GroupedOptions", "summary_of"]

#: Commands of the program by their purpose, in the order in which one meets them. One that is declared and not named
#: here stands last in its `group`.
GROUPS: Mapping[str, tuple[str, ...]] = {
    "Look at a log": ("info", "allan", "spectrum", "serve"),
    "Characterize noise": (
        "characterize",
        "fit",
        "select",
        "variation",
        "environment",
        "common",
        "overbound",
    ),
    "Compare": ("compare", "in-motion", "diff", "datasheet", "fleet"),
    "Use a noise model": ("filter", "innovations", "simulate", "dead-reckon", "combine"),
    "Earth rate and north": ("plan", "earth-rate", "north", "align"),
    "Calibrate": ("calibrate", "rate-table"),
    "Record": ("record", "monitor", "recover", "compact"),
    "Exchange": ("convert", "export", "include-path", "report", "demo"),
}

#: Options that many commands share, by what they are about; those of a command alone come first.
_OWN, _READING, _OUTPUT = "Options", "Reading the log", "Output"
_HELP_OF_READING = {option.flag: option.help for option in (*READING, BENCH)}
_FLAGS_OF_OUTPUT = frozenset(
    {"--out", "--output", "--plot", "--force", "--json", "--si", "--details", "--quiet"}
)


def summary_of(command: click.Command) -> str:
    """The first sentence of a command's help, without its full stop."""
    return (command.help or "").partition("\n\n")[0].replace("\n", " ").strip().removesuffix(".")


class GroupedOptions(click.Command):
    """A command whose options stand under what they are about."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        panels: dict[str, list[tuple[str, str]]] = {_OWN: [], _READING: [], _OUTPUT: []}
        for parameter in self.get_params(ctx):
            if isinstance(parameter, click.Option) and (record := parameter.get_help_record(ctx)):
                panels[_panel_of(parameter)].append(record)
        alone = sum(map(bool, panels.values())) < 2
        for title, records in _filled(panels):
            with formatter.section(_OWN if alone else title):
                formatter.write_dl(records)


class GroupedCommands(GroupedOptions, click.Group):
    """A group whose commands stand under their purpose; those of a family in one list."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        super().format_options(ctx, formatter)
        self.format_commands(ctx, formatter)

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        groups = _groups() if ctx.parent is None else {"Commands": self.list_commands(ctx)}
        width = max((len(name) for names in groups.values() for name in names), default=0)
        for title, names in groups.items():
            rows = [
                (name.ljust(width), summary_of(command))
                for name in names
                if (command := self.get_command(ctx, name))
            ]
            if rows:
                with formatter.section(title):
                    formatter.write_dl(rows)


def _groups() -> Mapping[str, Sequence[str]]:
    listed = {name for names in GROUPS.values() for name in names}
    further = [command for command in COMMANDS.values() if command.name not in listed]
    return {
        title: (*names, *(c.name for c in further if c.group == title)) for title, names in GROUPS.items()
    }


def _panel_of(option: click.Option) -> str:
    if _FLAGS_OF_OUTPUT.intersection(option.opts):
        return _OUTPUT
    words = _HELP_OF_READING.get(option.opts[0])  # another command may have an option of this name for itself
    return _READING if words is not None and (option.help or "").startswith(words.removesuffix(".")) else _OWN


def _filled(
    panels: Mapping[str, Sequence[tuple[str, str]]],
) -> Iterator[tuple[str, Iterable[tuple[str, str]]]]:
    return ((title, records) for title, records in panels.items() if records)
