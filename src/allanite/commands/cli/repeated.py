# SPDX-License-Identifier: BSD-3-Clause
"""Options that are given more than once: lists and mappings add up, anything else must say the same each time.

``--unit gyro=deg/s --unit acc=g`` is ``--unit gyro=deg/s,acc=g``. Without this, the last one would win silently.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, ClassVar, Literal

import click

__all__ = ["AddingCommand", "AddingGroup", "Listed"]


class Listed(click.ParamType[Any]):
    """A kind of option that takes several parts with commas between them: a list, or a mapping of name=value."""

    parts: ClassVar[Literal["list", "mapping"]] = "list"


class _Adding(click.Option):
    """An option that gathers all that is said."""

    def add_to_parser(self, parser: Any, ctx: click.Context) -> None:
        if self.multiple or self.count or self.is_flag:
            super().add_to_parser(parser, ctx)
            return
        self.multiple = True  # of the parser alone: one value comes out
        try:
            super().add_to_parser(parser, ctx)
        finally:
            self.multiple = False

    def type_cast_value(self, ctx: click.Context, value: Any) -> Any:
        gathered = isinstance(value, list) and not (self.multiple or self.count or self.is_flag)
        return super().type_cast_value(ctx, self._one(value, ctx) if gathered else value)

    def _one(self, given: list[Any], ctx: click.Context) -> Any:
        """One value out of those that were given."""
        if isinstance(self.type, Listed):
            parts = [part for text in given for part in (text.split(",") if "=" in text else [text])]
            if self.type.parts == "mapping":
                parts = list(dict.fromkeys(part.strip() for part in parts))
                self._refuse_contradictions(parts, ctx)
            return ",".join(parts)
        if any(value != given[0] for value in given):
            raise self._twice(given, ctx)
        return given[0]

    def _refuse_contradictions(self, parts: Iterable[str], ctx: click.Context) -> None:
        """One value for each name; what stands without a name is one value for all."""
        first: dict[str, str] = {}
        for part in parts:
            name = part.partition("=")[0].strip().casefold() if "=" in part else ""
            if first.setdefault(name, part) != part:
                raise self._twice((first[name], part), ctx)

    def _twice(self, given: Iterable[Any], ctx: click.Context) -> click.BadParameter:
        values = " and ".join(dict.fromkeys(str(value) for value in given))
        return click.BadParameter(f"given as {values}: give it once.", ctx=ctx, param=self)


def _adding(option: click.Parameter) -> click.Parameter:
    if type(option) is not click.Option:
        return option
    made = _Adding.__new__(_Adding)
    vars(made).update(vars(option))
    return made


class AddingCommand(click.Command):
    """A command whose options add up."""

    def __init__(self, *args: Any, **kwargs: Any) -> None:
        super().__init__(*args, **kwargs)
        self.params = [_adding(parameter) for parameter in self.params]


class AddingGroup(AddingCommand, click.Group):
    """A group of such commands."""

    command_class = AddingCommand
    group_class = type
