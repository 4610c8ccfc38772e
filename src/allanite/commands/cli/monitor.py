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
    "--every", type=Duration(), default=3.0, show_default=True, help="Time between two looks, at least."
)
@click.option("--channel", help="Whose curve is drawn.  [default: the first]")
@click.option("--once", is_flag=True, help="Look once.")
@json_option
def monitor(run: str, every: float, channel: str | None, once: bool, as_json: bool) -> None:
    """Watch a RUN while it is recorded: rate, gaps and why, last values, free disk, time left, the Allan curve so far.

    RUN is the folder of a run, or one with several, of which the one is shown that was written to last.

    Reads only what has come since the last look, takes two percent of a core at most, and disturbs the recorder in
    nothing. Ends with the run, or by Ctrl-C.
    A run that has ended is shown once.
    """
    from allanite.commands.monitor import RunWatch
    from allanite.views import terminal

    watch = RunWatch(run)
    watch.refuse_unknown(channel)
    with terminal.progress(quiet=as_json) as advance:
        state = watch.look(advance)
    if as_json:
        print_json({**state, "curves": watch.curves()})
    elif once:
        terminal.show_monitor(state, watch.curve(), channel)
    else:
        spent = 0.0
        with suppress(KeyboardInterrupt), terminal.monitoring(channel) as draw:
            draw(state, watch.curve())
            while state["status"] == "recording":
                time.sleep(max(every, _SPARING * spent))
                began = time.process_time()
                state = watch.look()
                draw(state, watch.curve())
                spent = time.process_time() - began
