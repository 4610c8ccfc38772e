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
    "-o", "--output", type=click.Path(file_okay=False), help="Output folder.  [default: RUN-recovered]"
)
@click.option("--dry-run", is_flag=True, help="Report only; write nothing.")
@json_option
def recover(run: str, output: str | None, dry_run: bool, as_json: bool) -> int:
    """Recover what can be read from a damaged recording.

    RUN is the folder of an interrupted or damaged recording; it is not changed. Reports what was lost. Exit codes: 0
    complete, 3 with loss, 1 nothing recovered.
    """
    from allanite.commands.recovery import recovery_document, recovery_of
    from allanite.views.terminal.console import progress
    from allanite.views.terminal.recovery import show_recovery

    with progress(quiet=as_json) as advance:
        recovery = recovery_of(run, output, dry_run=dry_run, progress=advance)
    document = recovery_document(recovery)
    if as_json:
        print_json(document)
    else:
        show_recovery(document)
    return recovery.exit_code


@command("allanite compact runs/gyro_SN12_20260901T120000Z -o gyro.parquet")
@click.argument("run", type=click.Path(exists=True, file_okay=False))
@click.option("-o", "--output", type=click.Path(dir_okay=False), help="Output file.  [default: RUN.parquet]")
@click.option("--variable", type=int, help="Part of a run whose settings changed, counted from 1.")
@force_option
@json_option
def compact(run: str, output: str | None, variable: int | None, force: bool, as_json: bool) -> None:
    """Compress a finished recording into one Parquet file.

    The file is about half as large at 32 Hz and reads like the run itself. It keeps everything: samples with their
    numbers, clocks and flags, settings and notes. Every segment is checked against its SHA-256, and the file is read
    back and compared; the run is kept. Recover a damaged run first. To write the samples alone, use `allanite convert`.
    """
    from allanite.commands.recovery import compaction_of
    from allanite.views.terminal.recovery import show_compaction

    done = compaction_of(run, output, part=variable, force=force)
    if as_json:
        print_json(done)
    else:
        show_compaction(done)
