# SPDX-License-Identifier: BSD-3-Clause
"""The experiment of the seed paper on a twin: demo."""

from __future__ import annotations

from pathlib import Path

import click

from allanite.commands.cli.options import Duration, force_option, json_option, print_json, seed_option
from allanite.commands.cli.program import command

__all__ = ["demo"]


@command("allanite demo --seed-paper --out demo")
@click.option(
    "--seed-paper", is_flag=True, help="Run the whole experiment: takes, Earth rate and all figures."
)
@click.option(
    "--out", default="demo", show_default=True, type=click.Path(file_okay=False), help="Output folder."
)
@seed_option(1)
@click.option(
    "--duration",
    type=Duration(),
    default="7d",
    show_default=True,
    help="Length of the record at rest, instead of a week.",
)
@force_option
@json_option
def demo(seed_paper: bool, out: str, seed: int, duration: float, force: bool, as_json: bool) -> None:
    """Repeat a published Earth-rate experiment on a simulated sensor.

    Simulates a week of the gyro, characterizes it and compares the result with the truth. --seed-paper adds the four
    takes of the paper, each estimator, the filter that is given the rate, and all thirteen figures as PDF and PNG.
    """
    from allanite.views.terminal.console import progress
    from allanite_seed_paper.demonstration import run_seed_paper, run_week
    from allanite_seed_paper.terminal import show_demonstration

    run = run_seed_paper if seed_paper else run_week
    with progress(quiet=as_json) as advance:
        done = run(out, seed=seed, duration=duration, force=force, progress=advance)
    if as_json:
        print_json(done.document)
        return
    show_demonstration(done.document, [Path(out) / "report.html"])
    if not seed_paper:
        click.echo("the whole experiment: allanite demo --seed-paper")
