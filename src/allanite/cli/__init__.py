# SPDX-License-Identifier: BSD-3-Clause
"""The command line. Each command parses, calls the library, and shows what came of it.

Results go to stdout, everything else to stderr. `program.EXIT_CODES` says how a command ends. Heavy modules load inside
the commands, so that help is quick. One module for each family of commands; importing it is what registers them.
"""

# The order of the imports is that of the commands in the reference.
# isort: off
from allanite.cli import noise
from allanite.cli import selection
from allanite.cli import comparison
from allanite.cli import spectrum
from allanite.cli import files
from allanite.cli import filtering
from allanite.cli import earth
from allanite.cli import position_plan
from allanite.cli import dead_reckoning
from allanite.cli import rate_table
from allanite.cli import calibration
from allanite.cli import alignment
from allanite.cli import redundancy
from allanite.cli import separation
from allanite.cli import variation
from allanite.cli import environment
from allanite.cli import datasheet
from allanite.cli import difference
from allanite.cli import recording
from allanite.cli import monitor
from allanite.cli import recovery
from allanite.cli import demo
from allanite.cli import serve

# isort: on
from allanite.cli.options import STATISTICS, ByChannel, Duration, Lags
from allanite.cli.program import cli, main

__all__ = [
    "STATISTICS",
    "ByChannel",
    "Duration",
    "Lags",
    "alignment",
    "calibration",
    "cli",
    "comparison",
    "datasheet",
    "dead_reckoning",
    "demo",
    "difference",
    "earth",
    "environment",
    "files",
    "filtering",
    "main",
    "monitor",
    "noise",
    "position_plan",
    "rate_table",
    "recording",
    "recovery",
    "redundancy",
    "selection",
    "separation",
    "serve",
    "spectrum",
    "variation",
]
