# SPDX-License-Identifier: BSD-3-Clause
"""The command line. Each command parses, calls the library, and shows what came of it.

Results go to stdout, everything else to stderr. `program.EXIT_CODES` says how a command ends. Heavy modules load inside
the commands, so that help is quick. One module for each family of commands; importing it is what registers them.
"""

# The order of the imports is that of the commands in the reference.
# isort: off
from allanite.commands.cli import declared
from allanite.commands.cli import noise
from allanite.commands.cli import files
from allanite.commands.cli import recording
from allanite.commands.cli import monitor
from allanite.commands.cli import recovery
from allanite.commands.cli import demo
from allanite.commands.cli import serve
from allanite.commands.cli import fleet

# isort: on
from allanite.commands.cli.options import ByChannel, Duration, Lags
from allanite.commands.cli.program import cli, main

__all__ = [
    "ByChannel",
    "Duration",
    "Lags",
    "cli",
    "declared",
    "demo",
    "files",
    "fleet",
    "main",
    "monitor",
    "noise",
    "recording",
    "recovery",
    "serve",
]
