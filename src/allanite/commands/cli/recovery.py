# SPDX-License-Identifier: BSD-3-Clause
"""Recorded runs afterwards: what can be read and what was lost, and a finished one in less space: recover, compact."""

from __future__ import annotations

import click

from allanite.commands.cli.options import force_option, json_option, print_json
from allanite.commands.cli.program import command

__all__ = ["compact", "recover"]


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
    from allanite.commands.recovery import recovery_document, recovery_of
    from allanite.views import terminal

    with terminal.progress(quiet=as_json) as advance:
        recovery = recovery_of(run, output, dry_run=dry_run, progress=advance)
    document = recovery_document(recovery)
    if as_json:
        print_json(document)
    else:
        terminal.show_recovery(document)
    return recovery.exit_code


@command("allanite compact runs/gyro_SN12_20260901T120000Z -o gyro.parquet")
@click.argument("run", type=click.Path(exists=True, file_okay=False))
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="New file.  [default: RUN.parquet]")
@click.option("--variable", type=int, help="Part of a run whose settings changed, from 1.")
@force_option
@json_option
def compact(run: str, output: str | None, variable: int | None, force: bool, as_json: bool) -> None:
    """Write a finished RUN as one Parquet file, about half as large at 32 Hz: a log like the run itself.

    Nothing is left out: samples with their numbers, clocks and flags, settings, and all that was noted. Every segment
    is checked against its SHA-256, the file is read back and compared, and the run stays where it is. A damaged run is
    to be recovered first. (`allanite convert` writes the samples alone.)
    """
    from allanite.commands.recovery import compaction_of
    from allanite.views import terminal

    done = compaction_of(run, output, part=variable, force=force)
    if as_json:
        print_json(done)
    else:
        terminal.show_compaction(done)
