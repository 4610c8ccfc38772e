# SPDX-License-Identifier: BSD-3-Clause
"""Instruments into runs: record."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from datetime import date
from typing import TYPE_CHECKING, Any

import click

from allanite.commands.cli.options import ByChannel, Duration, json_option, place_of, print_json, seed_option
from allanite.commands.cli.program import LOSS, cli, example_of
from allanite.errors import FormatError, InputError, LimitError

if TYPE_CHECKING:
    from allanite.acquisition.instruments import Instrument

__all__ = ["record"]


@cli.group(
    epilog=example_of("allanite record simulated --model study.json --rate 32 --duration 1h --out runs/")
)
def record() -> None:
    """Record from an instrument without losing a sample.

    The run is a folder under --out. It reads like any other log, finished or not. Ctrl-C ends it cleanly. Exit codes: 0
    complete, 3 samples missing, empty or doubtful, or at another rate than stated, 2 invalid option (checked before the
    instrument is used), 1 no instrument or no disk.
    """


def _positive(context: click.Context, option: click.Parameter, value: float | None) -> float | None:
    if value is not None and not 0 < value < float("inf"):
        raise click.BadParameter(
            "the duration must be positive and finite; leave it out to record until Ctrl-C"
        )
    return value


def _day(context: click.Context, option: click.Parameter, value: str | None) -> str | None:
    try:
        return None if value is None else date.fromisoformat(value).isoformat()
    except ValueError:
        raise click.BadParameter(f"{value!r} is not a date: write 2026-09-01") from None


def _run_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """What every run is told."""
    options = [
        click.option(
            "--duration",
            type=Duration(),
            callback=_positive,
            help="Length: 3600, 12h, 7d.  [default: until Ctrl-C]",
        ),
        click.option("--out", required=True, type=click.Path(file_okay=False), help="Folder for the runs."),
        click.option(
            "--name", default="", help="Name of the sensor.  [default: the model of the instrument]"
        ),
        click.option("--scale-date", callback=_day, help="Date of the scale factor: 2026-09-01."),
        click.option(
            "--unit-file",
            type=click.Path(dir_okay=False),
            metavar="NAME.service",
            help="Do not record; write a systemd unit that runs this command.",
        ),
    ]
    function = json_option(function)
    for option in reversed(options):
        function = option(function)
    return function


def _record(build: Callable[[], Instrument], as_json: bool, unit_file: str | None, **options: Any) -> int:
    from allanite.commands.capture import captured_document, record_to
    from allanite.commands.unit_file import write_unit
    from allanite.views.terminal.capture import journal, show_captured
    from allanite.views.terminal.console import progress

    try:
        instrument = build()  # a wrong option is found here, and trying again is of no use
        if unit_file is not None:
            click.echo(write_unit(unit_file, sys.argv[1:], options["out"]))
            return 0
    except (InputError, FormatError, LimitError) as error:
        raise click.UsageError(str(error)) from None
    with progress(quiet=as_json) as advance:
        captured = record_to(instrument, progress=advance, happened=journal(), **options)
    document = captured_document(captured)
    _tell(lambda: print_json(document) if as_json else show_captured(document))
    return 0 if captured.is_whole else LOSS


def _tell(show: Callable[[], None]) -> None:
    """The run is closed: a stdout that is full, closed or gone changes neither it nor the exit code."""
    try:
        show()
        if sys.stdout is not None:
            sys.stdout.flush()
    except OSError:
        sys.stdout = open(os.devnull, "w", encoding="utf-8")  # noqa: PTH123, SIM115 - nothing is left to be flushed


@record.command(
    "3458a",
    epilog=example_of(
        'allanite record 3458a --resource GPIB0::22::INSTR --rate 32 --scale "24.0 mV/(deg/s)" --out runs/'
    ),
)
@click.option(
    "--resource", required=True, help="GPIB0::22::INSTR, prologix://host:1234/22, TCPIP::host::5025::SOCKET."
)
@click.option("--rate", type=float, required=True, help="Readings per second.")
@click.option("--scale", help='Scale factor of the sensor: "24.0(2) mV/(deg/s)".')
@click.option(
    "--range", "range_volts", type=float, default=10.0, show_default=True, help="Measurement range in V."
)
@click.option("--nplc", type=float, help="Aperture in power-line cycles.  [default: 1 where it fits]")
@click.option("--aperture", type=Duration(), help="Aperture time, instead of --nplc: 31.2ms.")
@click.option("--autozero", is_flag=True, help="Take a zero reading before each reading; doubles the time.")
@_run_options
def agilent_3458a(
    resource: str, rate: float, scale: str | None, range_volts: float, nplc: float | None, aperture: float | None,
    autozero: bool, as_json: bool, **options: Any,
) -> int:  # fmt: skip
    """Record voltage from a 3458A multimeter (HP, Agilent, Keysight).

    Written from the manual and tested against a simulator, not yet on a real meter: see the first-light checklist.
    """
    from allanite.acquisition.instruments.hp3458a import HP3458A, MeterSettings

    def build() -> HP3458A:
        settings = MeterSettings(
            rate=rate, range_volts=range_volts, nplc=nplc, aperture=aperture, autozero=autozero
        )
        return HP3458A(resource, settings, scale_factor=scale)

    return _record(build, as_json, **options)


@record.command(
    "serial", epilog=example_of("allanite record serial --port /dev/ttyUSB0 --format my_imu.yaml --out runs/")
)
@click.option("--port", required=True, help="Serial port: /dev/ttyUSB0 or COM3.")
@click.option(
    "--format",
    "description",
    required=True,
    type=click.Path(exists=True, dir_okay=False),
    help="YAML file that describes the frames.",
)
@_run_options
def serial(port: str, description: str, as_json: bool, **options: Any) -> int:
    """Record an IMU over a serial port."""
    from allanite.acquisition.instruments.serial_imu import SerialImu

    return _record(lambda: SerialImu(port, description), as_json, **options)


@record.command(
    "simulated",
    epilog=example_of("allanite record simulated --model study.json --rate 32 --duration 1h --out runs/"),
)
@click.option("--model", required=True, help="A study, a model file, a data sheet, or words: 'N=0.3 deg/√h'.")
@click.option("--rate", type=float, help="Sample rate in Hz.  [default: that of the study]")
@click.option("--speed", type=float, default=1.0, show_default=True, help="Speed-up over real time.")
@seed_option(0)
@click.option("--unit", type=ByChannel(), help="Unit of the samples.  [default: SI]")
@_run_options
def simulated(
    model: str, rate: float | None, speed: float, seed: int, unit: Any, as_json: bool, **options: Any
) -> int:
    """Record a simulated sensor, to rehearse a long run."""
    from allanite.acquisition.instruments.simulated import SimulatedInstrument

    def build() -> SimulatedInstrument:
        return SimulatedInstrument.from_file(place_of(model), rate=rate, speed=speed, seed=seed, unit=unit)

    return _record(build, as_json, **options)
