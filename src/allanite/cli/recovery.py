# SPDX-License-Identifier: BSD-3-Clause
"""What can be read of a recorded run, and what was lost: recover."""

from __future__ import annotations

import click

from allanite.cli.options import json_option, print_json
from allanite.cli.program import command

__all__ = ["recover"]


@command("allanite recover runs/gyro_SN12_20260901T120000Z")
@click.argument("run", type=click.Path(exists=True, file_okay=False))
@click.option(
    "-o", "--output", type=click.Path(file_okay=False), help="New folder.  [default: RUN-recovered]"
)
@click.option("--dry-run", is_flag=True, help="Only look; write nothing.")
@json_option
def recover(run: str, output: str | None, dry_run: bool, as_json: bool) -> int:
    """Write what can be read of a RUN into a new folder, and say what was lost.

    RUN is the folder of a recording that broke off or was damaged; it is never changed. Exit codes: 0 all is there, 3
    with loss, 1 nothing.
    """
    from allanite import delivery, terminal

    with terminal.progress(quiet=as_json) as advance:
        found = delivery.recovery_of(run, output, dry_run=dry_run, progress=advance)
    if as_json:
        print_json(found.to_json())
    else:
        terminal.show_recovery(found.to_json())
    return found.exit_code
