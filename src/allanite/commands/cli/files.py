# SPDX-License-Identifier: BSD-3-Clause
"""From one file to another: simulate, convert, export, report; where the C++ headers are."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.completion import complete_consumers, complete_files
from allanite.commands.cli.options import (
    ByChannel,
    Duration,
    Names,
    Share,
    force_option,
    log_options,
    place_of,
    seed_option,
)
from allanite.commands.cli.program import LOSS, command

__all__ = ["convert", "export", "include_path", "report", "simulate"]


@command("allanite simulate study.json --duration 7d --seed 1 -o twin.parquet")
@click.argument("model", shell_complete=complete_files)
@click.option(
    "-o",
    "--output",
    required=True,
    type=click.Path(dir_okay=False),
    help="Output file: .parquet, .npz, .npy, .csv or .mat.",
)
@click.option("--rate", type=float, help="Sample rate in Hz.  [default: that of the study]")
@click.option("--duration", type=Duration(), required=True, help="Length: 3600, 12h, 7d.")
@seed_option(0)
@click.option("--sampling", type=click.Choice(["mean", "point"]), default="mean", show_default=True)
@click.option("--unit", type=ByChannel(), help="Unit of the written samples.  [default: SI]")
@force_option
def simulate(
    model: str,
    output: str,
    rate: float | None,
    duration: float,
    seed: int,
    sampling: Any,
    unit: Any,
    force: bool,
) -> None:
    """Simulate a sensor at rest from a noise model.

    MODEL is a study, output of `fit --json`, or text: 'N=0.3 deg/√h, B=5 deg/h, K=5 deg/h/√h'. With T=240s, B is that
    of a Gauss-Markov term.
    """
    from allanite.commands.curves import simulate_to
    from allanite.views.terminal.console import progress

    with progress() as advance:
        written = simulate_to(
            place_of(model), output, rate=rate, duration=duration, seed=seed, sampling=sampling, unit=unit,
            force=force, progress=advance,
        )  # fmt: skip
    click.echo(written)


@command("allanite convert imu.csv imu.parquet --unit gyro=deg/s,acc=g")
@click.argument("log", shell_complete=complete_files)
@click.argument("output", type=click.Path(dir_okay=False))
@log_options
@force_option
def convert(log: str, output: str, force: bool, **options: Any) -> int:
    """Convert a log to Parquet, NPZ, NPY, CSV or MAT.

    Parquet keeps rate, units, sampling and history; missing samples become nulls.
    """
    from allanite.commands.recordings import has_gaps, read_part
    from allanite.files import recording_file
    from allanite.views.terminal.console import progress

    recording = read_part(place_of(log), **options)
    with progress() as advance:
        path = recording_file.write_recording(recording, output, force=force, progress=advance)
    click.echo(recording_file.summary(recording, path))
    return LOSS if has_gaps(recording) else 0


def _list_consumers(context: click.Context, _: click.Parameter, wanted: bool) -> None:
    """Say which there are, and leave."""
    if not wanted or context.resilient_parsing:
        return
    from allanite.views.terminal.exporting import show_consumers

    show_consumers()
    context.exit()


@command("allanite export kalibr results/study.json -o imu.yaml")
@click.option(
    "--list",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_list_consumers,
    help="List the formats, their input and what they contain.",
)
@click.argument("consumer", shell_complete=complete_consumers)
@click.argument("file", type=click.Path(exists=True, dir_okay=False, allow_dash=True))
@click.option("-o", "--output", help="Output file, or folder for several files.  [default: stdout]")
@click.option("--walk", help="Treatment of flicker: upper-bound, k-only or horizon=<seconds>.")
@click.option("--axes", help="Value for three axes: worst, rms, or each where the format allows.")
@click.option("--inflate", type=float, help="Factor applied to all values, and noted in the file.")
@click.option(
    "--correlation-time",
    type=Duration(),
    help="Correlation time of the Gauss-Markov term that replaces flicker.",
)
@click.option("--gyroscope", type=Names(), help="Gyroscope channels: gx,gy,gz.  [default: all]")
@click.option("--accelerometer", type=Names(), help="Accelerometer channels.  [default: all]")
@click.option("--digits", type=int, help="Digits after the decimal point.  [default: 6]")
@click.option("--rostopic", help="Topic of the IMU.  [kalibr, openvins; default: that of the log]")
@click.option("--part", help="Name of the part in the JSON file.  [matlab; default: allanite]")
@click.option("--channel", help="Channel to export, for formats with one axis.  [cpp; default: the worst]")
@click.option(
    "--filter-rate",
    type=float,
    help="Update rate of the filter or simulator in Hz.  [cpp, px4, ardupilot, formats with per-sample values; "
    "default: its own, or the log's]",
)
@click.option(
    "--scalar", type=click.Choice(["float", "double"]), help="Floating-point type of the filter.  [cpp]"
)
@click.option(
    "--flicker",
    type=click.Choice(["sum", "single"]),
    help="States that model flicker: several, or one.  [cpp]",
)
@click.option("--horizon", type=Duration(), help="Time over which the flicker model must hold.  [cpp]")
@click.option(
    "--model", type=click.Path(exists=True, dir_okay=False), help="Study with the noise.  [openvins]"
)
@click.option(
    "--intrinsics",
    type=click.Choice(["kalibr", "rpng"]),
    help="Convention of the intrinsic matrices.  [openvins]",
)
@click.option("--rate", type=float, help="Sample rate of the log in Hz, if FILE does not contain it.")
@click.option(
    "--overbound", type=Share(), help="Export a bound that lies above the sensor with this probability: 95%."
)
@click.option(
    "--bound-until",
    type=Duration(),
    help="Longest averaging time the bound covers.  [default: the longest lag fitted]",
)
@force_option
def export(consumer: str, file: str, output: str | None, force: bool, **options: Any) -> None:
    """Export a noise model to Kalibr, PX4, GTSAM, C++ and others.

    FILE is a study, a data sheet, the noise file of another program (imu.yaml), or a calibration. `allanite export
    --list` shows the formats and their input. openvins takes either kind, or a calibration with --model for the noise.
    Several files go into the folder -o.
    """
    from allanite.commands.exporting import export_of

    target = None if output in (None, "-") else output
    text = export_of(consumer, place_of(file), target, force=force, **options)
    click.echo(text if target is None else target, nl=target is not None)


@command("allanite include-path")
def include_path() -> None:
    """Print the folder of the C++ headers, for a compiler's -I.

    For a program that includes <allanite/online_allan.hpp> or another kernel of this package. The header of `export
    cpp` needs none of them.
    """
    from allanite.exporters import cpp

    click.echo(cpp.include_path())


@command("allanite report result/earth-rate.json -o report.html")
@click.argument("file", type=click.Path(exists=True, dir_okay=False, allow_dash=True))
@click.option("-o", "--output", default="report.html", show_default=True, type=click.Path(dir_okay=False))
@force_option
def report(file: str, output: str, force: bool) -> None:
    """Rebuild a report from saved results.

    FILE is a study or the JSON of any other command.
    """
    from allanite.views.report import render_file

    click.echo(render_file(place_of(file), output, force=force))
