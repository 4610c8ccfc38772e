# SPDX-License-Identifier: BSD-3-Clause
"""The program called as a shell would, in the process of the test: the type of what the fixture `run` gives."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import click

from allanite.commands.cli import cli

__all__ = ["Done", "Run", "program_context"]


class Done(NamedTuple):
    """What a shell sees of a program that ended."""

    code: int
    out: str
    err: str


Run = Callable[..., Done]


def program_context() -> click.Context:
    """Parent of a context of a command: the command keeps the help option that its first context gives it."""
    return click.Context(cli, **cli.context_settings)
