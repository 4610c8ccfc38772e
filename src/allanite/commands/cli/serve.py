# SPDX-License-Identifier: BSD-3-Clause
"""A page to look at: serve."""

from __future__ import annotations

import click

from allanite.commands.cli.program import command

__all__ = ["serve"]


@command("allanite serve recordings/")
@click.argument("folder", default=".", metavar="[FOLDER|LOG]", type=click.Path(exists=True))
@click.option("--port", type=click.IntRange(0, 65535), default=0, help="TCP port. [default: a free one]")
@click.option("--host", help="Address to listen on; requires --token.  [default: this machine only]")
@click.option(
    "--token", envvar="ALLANITE_TOKEN", show_envvar=True, help="Access token.  [default: a new one]"
)
@click.option(
    "--instruments",
    type=click.Path(exists=True, dir_okay=False),
    metavar="FILE",
    help="YAML file of more instruments to offer for recording.",
)
@click.option("--no-browser", is_flag=True, help="Print the address without opening a browser.")
def serve(
    folder: str, port: int, host: str | None, token: str | None, instruments: str | None, no_browser: bool
) -> None:
    """Open a local web page over a folder of logs and results.

    With a LOG the page serves its folder and opens that log. Only this machine can reach the page, and only with the
    token in the printed address. Results go to allanite-results in the folder, dropped files to allanite-dropped, runs
    to allanite-runs. Ctrl-C stops the server; recorders started from the page continue.
    """
    from allanite.commands import page

    def ready(address: str) -> None:
        click.echo(address)
        if not no_browser:
            click.launch(address)

    page.serve(folder, port=port, host=host, token=token, instruments=instruments, ready=ready)
