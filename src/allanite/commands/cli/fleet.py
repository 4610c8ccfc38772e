# SPDX-License-Identifier: BSD-3-Clause
"""Many logs: fleet run, fleet watch; the declared commands stand beside them."""

from __future__ import annotations

import re
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from typing import TYPE_CHECKING, Any

import click

from allanite.commands.characterize import CHARACTERIZE
from allanite.commands.cli.completion import complete_files
from allanite.commands.cli.declared import offer_below
from allanite.commands.cli.options import Duration, json_option, print_json, with_options
from allanite.commands.cli.program import LOSS, cli, example_of
from allanite.commands.option import READING
from allanite.plain_files.counted import plural

if TYPE_CHECKING:
    from allanite.commands.fleet.running import FleetRun

__all__ = ["fleet"]

_EXAMPLE = "allanite fleet run 'logs/**/*.csv' --pattern '{lot}/{unit}_{date}.csv' --out fleet"
_OF_STUDY = [o for o in CHARACTERIZE.options if o.python in ("accept", "temperature", "warm_up", "exclude")]
_SHOWN = 5  # failed logs that are named


class Size(click.ParamType[Any]):
    """An amount of memory: a number with MB, GB, MiB or GiB."""

    name = "size"
    _UNITS: dict[str, float] = {"MB": 1e6, "GB": 1e9, "MiB": 2.0**20, "GiB": 2.0**30}  # noqa: RUF012 - constant

    def convert(self, value: Any, param: click.Parameter | None, ctx: click.Context | None) -> float:
        match = re.fullmatch(r"(\d+(?:\.\d+)?)\s*(MB|GB|MiB|GiB)", str(value).strip())
        if match is None:
            self.fail(f"{value!r} is not an amount of memory: write 800MB or 2GiB", param, ctx)
        return float(match[1]) * self._UNITS[match[2]]


@cli.group("fleet", epilog=example_of(_EXAMPLE), subcommand_metavar="COMMAND")
def fleet() -> None:
    """Characterize many logs, and describe their population.

    `run` characterizes every log once, and resumes where it was interrupted. `watch` characterizes new logs as they
    arrive. `report` describes the population and names the units that stand out, `chart` shows whether a coefficient
    is in control, `check` tests one unit on the bench.
    """


def _workers(command: Callable[..., Any]) -> Callable[..., Any]:
    """Where logs are done."""
    for flag, text, more in (
        (
            "--workers",
            "Processes of this machine.  [default: one per processor]",
            {"type": click.IntRange(1)},
        ),
        (
            "--scheduler",
            "Dask scheduler whose workers characterize the logs: tcp://host:8786.",
            {"metavar": "ADDRESS"},
        ),
    ):
        command = click.option(flag, help=text, **more)(command)
    return command


@fleet.command("run", epilog=example_of(_EXAMPLE))
@click.argument("logs", metavar="GLOB...", nargs=-1, required=True, shell_complete=complete_files)
@click.option(
    "--pattern", help="Labels in the path of a log: '{lot}/{unit}_{date}_{temperature}C.bag'.", metavar="TEXT"
)
@click.option(
    "--metadata",
    type=click.Path(exists=True, dir_okay=False),
    help="CSV of labels, with a column unit or log.",
)
@click.option("--timeout", type=Duration(), default="1h", show_default=True, help="Time limit for one log.")
@click.option(
    "--memory",
    type=Size(),
    help="Memory limit for one log: 2GiB.  [default: 80 % of the machine, shared by its processors]",
)
@click.option(
    "--retries",
    type=click.IntRange(0),
    default=2,
    show_default=True,
    help="Further attempts if a worker is lost.",
)
@click.option("--keep", is_flag=True, help="Keep the study of every log in OUT/studies.")
@_workers
@with_options(_OF_STUDY)
@with_options(READING)
@click.option("--out", required=True, type=click.Path(file_okay=False), help="Folder of the fleet.")
@json_option
def run(
    logs: tuple[str, ...], as_json: bool, workers: int | None, scheduler: str | None, **options: Any
) -> int:
    """Characterize every log once, and write their table.

    A GLOB is quoted, so that ** reaches folders of any depth; an address like s3://bucket/*.csv is read by the workers.
    A log that fails is a row with its error. Interrupted runs go on with the same command.
    """
    from allanite.commands.fleet.running import fleet as characterized
    from allanite.views.terminal.console import progress

    with progress(quiet=as_json) as advance, _client(scheduler) as client:
        given = {name: value for name, value in options.items() if value is not None}
        done = characterized(logs, client=client, max_workers=workers, progress=advance, **given)
    return _shown(done, as_json=as_json)


@fleet.command("watch", epilog=example_of("allanite fleet watch fleet"))
@click.argument("folder", type=click.Path(exists=True, file_okay=False))
@click.option(
    "--every", type=Duration(), default="10s", show_default=True, help="Time between scans of the folder."
)
@click.option("--once", is_flag=True, help="Characterize the logs present now, then exit.")
@_workers
@json_option
def watch(
    folder: str, every: float, once: bool, workers: int | None, scheduler: str | None, as_json: bool
) -> int:
    """Characterize new and changed logs of a fleet as they come.

    Uses the settings of the last `fleet run` into FOLDER. A log is taken once it no longer changes. End it with Ctrl-C.
    """
    from allanite.commands.fleet import watching
    from allanite.views.terminal.console import progress

    code = 0
    with progress(quiet=as_json) as advance, _client(scheduler) as client:
        looks = watching.watch(
            folder, every=every, once=once, client=client, max_workers=workers, progress=advance
        )
        for done in looks:
            code = _shown(done, as_json=as_json)
    return code


def _client(scheduler: str | None) -> AbstractContextManager[Any]:
    """A client of a Dask scheduler."""
    if scheduler is None:
        return nullcontext()
    from allanite.commands.fleet.jobs import dask_client

    return dask_client(scheduler)


def _shown(done: FleetRun, *, as_json: bool) -> int:
    if as_json:
        print_json(
            {"table": str(done.path), "done": done.done, "kept": done.kept, "failed": list(done.failed)}
        )
    else:
        kept = f", {plural(done.kept, 'log')} unchanged" if done.kept else ""
        click.echo(f"{plural(done.done, 'log')} done{kept}")
        if done.failed:
            click.echo(f"{plural(len(done.failed), 'log')} failed; the column error says why:")
            for name, error in done.errors(_SHOWN).items():
                click.echo(f"  {name}: {error}")
            if len(done.failed) > _SHOWN:
                click.echo(f"  and {len(done.failed) - _SHOWN} more")
        click.echo(f"wrote {done.path}")
    return LOSS if done.failed else 0


offer_below(fleet)
