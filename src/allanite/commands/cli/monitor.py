# SPDX-License-Identifier: BSD-3-Clause
"""Runs while they grow: monitor."""

from __future__ import annotations

import time
from contextlib import suppress

import click

from allanite.commands.cli.options import Duration, json_option, print_json
from allanite.commands.cli.program import command

__all__ = ["monitor"]

#: Waits so many times as long as a look has cost, at least: two percent of one core at most.
_SPARING = 50.0


@command("allanite monitor runs/SiRRS01-03_US28_20261122T120000Z")
@click.argument("run", type=click.Path(exists=True, file_okay=False))
@click.option(
    "--every", type=Duration(), default=3.0, show_default=True, help="Shortest time between updates."
)
@click.option("--channel", help="Channel to plot.  [default: the first]")
@click.option("--once", is_flag=True, help="Show the state once and exit.")
@json_option
def monitor(run: str, every: float, channel: str | None, once: bool, as_json: bool) -> None:
    """Watch a recording: rate, gaps, disk space, Allan curve.

    RUN is the folder of a run, or a folder of runs; the one written most recently is shown. The monitor reads only new
    data, uses at most two percent of a core and does not disturb the recorder. It ends with the run or with Ctrl-C. A
    finished run is shown once.
    """
    from allanite.commands.monitor import RunWatch
    from allanite.views.terminal.console import progress
    from allanite.views.terminal.monitor import monitoring, show_monitor

    watch = RunWatch(run)
    watch.refuse_unknown(channel)
    with progress(quiet=as_json) as advance:
        state = watch.look(advance)
    if as_json:
        print_json({**state, "curves": watch.curves()})
    elif once:
        show_monitor(state, watch.curve(), channel)
    else:
        spent = 0.0
        with suppress(KeyboardInterrupt), monitoring(channel) as draw:
            draw(state, watch.curve())
            while state["status"] == "recording":
                time.sleep(max(every, _SPARING * spent))
                began = time.process_time()
                state = watch.look()
                draw(state, watch.curve())
                spent = time.process_time() - began
