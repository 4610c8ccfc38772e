# SPDX-License-Identifier: BSD-3-Clause
"""Instruments into runs: record; runs while they grow: monitor."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

from allanite.cli.options import ByChannel, Duration, json_option, place_of, print_json
from allanite.cli.program import LOSS, cli, command, example_of

if TYPE_CHECKING:
    from allanite.instruments import Instrument

__all__ = ["monitor", "record"]


@cli.group(
    epilog=example_of("allanite record simulated --model study.json --rate 32 --duration 1h --out runs/")
)
def record() -> None:
    """Record an instrument: every sample once, with its clock, and nothing that was acknowledged is ever lost.

    The run is a folder under --out. It is a log like any other, finished or still going. Ctrl-C ends it cleanly; exit
    code 3 says that samples are missing.
    """


def _run_options(function: Callable[..., Any]) -> Callable[..., Any]:
    """What every run is told."""
    options = [
        click.option("--duration", type=Duration(), help="Length: 3600, 12h, 7d.  [default: until Ctrl-C]"),
        click.option("--out", required=True, type=click.Path(file_okay=False), help="Folder of the runs."),
        click.option("--name", default="", help="Of the sensor.  [default: the model of the instrument]"),
        click.option("--scale-date", help="When the scale factor was determined: 2026-09-01."),
    ]
    function = json_option(function)
    for option in reversed(options):
        function = option(function)
    return function


def _record(instrument: Instrument, as_json: bool, **options: Any) -> int:
    from allanite import delivery, terminal

    with terminal.progress(quiet=as_json) as advance:
        found = delivery.record_to(instrument, progress=advance, **options)
    document = delivery.captured_document(found)
    if as_json:
        print_json(document)
    else:
        terminal.show_captured(document)
    return LOSS if found.missing else 0


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
@click.option("--scale", help='Of the sensor at the input: "24.0 mV/(deg/s)".')
@click.option("--range", "range_volts", type=float, default=10.0, show_default=True, help="Full scale [V].")
@click.option("--nplc", type=float, help="Aperture in periods of the mains.  [default: 1 where it fits]")
@click.option("--aperture", type=Duration(), help="In place of --nplc: 31.2ms.")
@click.option("--autozero", is_flag=True, help="A zero reading before each reading; takes twice the time.")
@_run_options
def agilent_3458a(
    resource: str, rate: float, scale: str | None, range_volts: float, nplc: float | None, aperture: float | None,
    autozero: bool, as_json: bool, **options: Any,
) -> int:  # fmt: skip
    """Record voltage with a 3458A multimeter of HP, Agilent or Keysight.

    Written after its manual and tested against a simulator, on no meter yet: see the first-light checklist.
    """
    from allanite.instruments.hp3458a import HP3458A, Settings

    settings = Settings(rate=rate, range_volts=range_volts, nplc=nplc, aperture=aperture, autozero=autozero)
    return _record(HP3458A(resource, settings, scale_factor=scale), as_json, **options)


@record.command(
    "serial", epilog=example_of("allanite record serial --port /dev/ttyUSB0 --format my_imu.yaml --out runs/")
)
@click.option("--port", required=True, help="/dev/ttyUSB0 or COM3.")
@click.option(
    "--format",
    "description",
    required=True,
    type=click.Path(exists=True, dir_okay=False),
    help="Its frames (YAML).",
)
@_run_options
def serial(port: str, description: str, as_json: bool, **options: Any) -> int:
    """Record an IMU that sends frames or lines over a serial port."""
    from allanite.instruments.serial_imu import SerialImu

    return _record(SerialImu(port, description), as_json, **options)


@record.command(
    "simulated",
    epilog=example_of("allanite record simulated --model study.json --rate 32 --duration 1h --out runs/"),
)
@click.option("--model", required=True, help="A study, a model file, a data sheet, or words: 'N=0.3 deg/√h'.")
@click.option("--rate", type=float, help="Samples per second.  [default: that of the study]")
@click.option("--speed", type=float, default=1.0, show_default=True, help="Times faster than time.")
@click.option("--seed", type=int, default=0, show_default=True, help="The same seed gives the same samples.")
@click.option("--unit", type=ByChannel(), help="Unit of the samples.  [default: SI]")
@_run_options
def simulated(
    model: str, rate: float | None, speed: float, seed: int, unit: Any, as_json: bool, **options: Any
) -> int:
    """Record a simulated sensor at rest: to try everything out before the week begins."""
    from allanite.instruments.simulated import SimulatedInstrument

    instrument = SimulatedInstrument.from_file(place_of(model), rate=rate, speed=speed, seed=seed, unit=unit)
    return _record(instrument, as_json, **options)


@command("allanite monitor runs/SiRRS01-03_US28_20261122T120000Z")
@click.argument("run", type=click.Path(exists=True, file_okay=False))
@click.option("--every", type=Duration(), default=2.0, show_default=True, help="Time between two looks.")
@click.option("--once", is_flag=True, help="Look once.")
@json_option
def monitor(run: str, every: float, once: bool, as_json: bool) -> None:
    """Watch a RUN while it is recorded: rate, gaps, last value, free disk, and the Allan curve so far.

    Reads only what has come since the last look, and disturbs the recorder in nothing. Ends with the run, or by Ctrl-C.
    """
    from allanite import delivery, terminal

    watch = delivery.RunWatch(run)
    if once or as_json:
        state, curve = watch.look(), watch.curve()
        if as_json:
            each = {} if curve is None else {n: curve[n].to_json() for n in curve.names}
            print_json({**state, "curves": each})
        else:
            terminal.show_monitor(state, curve)
        return
    with terminal.monitoring() as draw:
        state = watch.look()
        draw(state, watch.curve())
        while state["status"] == "recording":
            time.sleep(every)
            state = watch.look()
            draw(state, watch.curve())
