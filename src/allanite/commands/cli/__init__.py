# SPDX-License-Identifier: BSD-3-Clause
"""The command line. Each command parses, calls the library, and shows what came of it.

Results go to stdout, everything else to stderr. `program.EXIT_CODES` says how a command ends. Heavy modules load inside
the commands, and a command is made when it is looked up, so that help and short commands are quick. The declared
commands come first, then those of `WRITTEN`; the order is that of the reference.
"""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import click

from allanite.commands.cli import declared
from allanite.commands.cli.options import ByChannel, Duration, Lags
from allanite.commands.cli.program import cli, defer, main

__all__ = ["WRITTEN", "ByChannel", "Duration", "Lags", "cli", "declared", "main"]

#: Commands that are written out, by their module.
WRITTEN: Mapping[str, tuple[str, ...]] = {
    "noise": ("info", "allan", "fit"),
    "files": ("simulate", "convert", "export", "include-path", "report"),
    "recording": ("record",),
    "monitor": ("monitor",),
    "recovery": ("recover", "compact"),
    "demo": ("demo",),
    "serve": ("serve",),
    "fleet": ("fleet",),
}


def _written(module: str, name: str) -> click.Command:
    from importlib import import_module

    command: click.Command = getattr(import_module(f"{__name__}.{module}"), name.replace("-", "_"))
    return command


for _module, _names in WRITTEN.items():
    for _name in _names:
        defer(_name, partial(_written, _module, _name))
