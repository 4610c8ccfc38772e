# SPDX-License-Identifier: BSD-3-Clause
"""From one file to another: simulate, convert, export, report."""

from __future__ import annotations

from typing import Any

import click

from allanite.cli.options import ByChannel, Duration, Share, force_option, log_options, place_of
from allanite.cli.program import LOSS, command

__all__ = ["convert", "export", "report", "simulate"]


@command("allanite simulate study.json --duration 7d --seed 1 -o twin.parquet")
@click.argument("model")
@click.option(
    "-o", "--output", required=True, type=click.Path(dir_okay=False), help=".parquet, .npy or .csv."
)
@click.option("--rate", type=float, help="Samples per second.  [default: that of the study]")
@click.option("--duration", type=Duration(), required=True, help="Length: 3600, 12h, 7d.")
@click.option("--seed", type=int, default=0, show_default=True, help="The same seed gives the same samples.")
@click.option("--sampling", type=click.Choice(["mean", "point"]), default="mean", show_default=True)
@click.option("--unit", type=ByChannel(), help="Unit to write the samples in.  [default: SI]")
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
    """Make a record of a sensor at rest from a MODEL.

    MODEL is a study, what `fit --json` printed, or words: 'N=0.3 deg/√h, B=5 deg/h, K=5 deg/h/√h'. With T=240s, B is
    that of a Gauss-Markov term.
    """
    from allanite import delivery, terminal

    with terminal.progress() as advance:
        written = delivery.simulate_to(
            place_of(model), output, rate=rate, duration=duration, seed=seed, sampling=sampling, unit=unit,
            force=force, progress=advance,
        )  # fmt: skip
    click.echo(written)


@command("allanite convert imu.csv imu.parquet --unit gyro=deg/s,acc=g")
@click.argument("log")
@click.argument("output", type=click.Path(dir_okay=False))
@log_options
@force_option
def convert(log: str, output: str, force: bool, **options: Any) -> int:
    """Write any LOG that can be read as OUTPUT (.parquet, .npy or .csv).

    Parquet keeps rate, units, sampling and history; missing samples become nulls.
    """
    from allanite import delivery, recording_file, terminal

    recording = delivery.read_part(place_of(log), **options)
    with terminal.progress() as advance:
        path = recording_file.write_recording(recording, output, force=force, progress=advance)
    click.echo(recording_file.summary(recording, path))
    return LOSS if delivery.has_gaps(recording) else 0


@command("allanite export kalibr results/study.json -o imu.yaml")
@click.argument("consumer")
@click.argument("file", type=click.Path(exists=True, dir_okay=False, allow_dash=True))
@click.option("-o", "--output", help="File to write, or folder for several.  [default: stdout]")
@click.option("--walk", help="What becomes of flicker: upper-bound, k-only or horizon=<seconds>.")
@click.option("--axes", help="One number for three axes: worst or rms.")
@click.option("--inflate", type=float, help="Factor on all numbers; it is written into the file.")
@click.option(
    "--correlation-time", type=Duration(), help="T of the Gauss-Markov term that stands for flicker."
)
@click.option("--rostopic", help="Topic to write into the file.")
@click.option("--channel", help="Of one axis: which.  [firmware; default: the worst]")
@click.option(
    "--filter-rate",
    type=float,
    help="Samples per second of the filter.  [firmware; default: that of the log]",
)
@click.option("--scalar", type=click.Choice(["float", "double"]), help="Precision of the filter.  [firmware]")
@click.option(
    "--flicker", type=click.Choice(["sum", "single"]), help="States for flicker: several, or one.  [firmware]"
)
@click.option("--horizon", type=Duration(), help="Time over which flicker must hold.  [firmware]")
@click.option(
    "--model", type=click.Path(exists=True, dir_okay=False), help="Study with the noise.  [openvins]"
)
@click.option(
    "--intrinsics", type=click.Choice(["kalibr", "rpng"]), help="Convention of the matrices.  [openvins]"
)
@click.option("--overbound", type=Share(), help="Write a bound above the sensor with this probability: 95%.")
@click.option(
    "--bound-until",
    type=Duration(),
    help="Longest averaging time of the bound.  [default: the longest lag fitted]",
)
@force_option
def export(consumer: str, file: str, output: str | None, force: bool, **options: Any) -> None:
    """Write a FILE of allanite in the format of a CONSUMER.

    From a study: kalibr or firmware. From a calibration: openvins (with --model for the noise) or imu-tk, which is
    several files in the folder of -o.
    """
    from allanite import delivery

    target = None if output in (None, "-") else output
    text = delivery.export_of(consumer, place_of(file), target, force=force, **options)
    click.echo(text if target is None else target, nl=target is not None)


@command("allanite report result/earth-rate.json -o report.html")
@click.argument("file", type=click.Path(exists=True, dir_okay=False, allow_dash=True))
@click.option("-o", "--output", default="report.html", show_default=True, type=click.Path(dir_okay=False))
@force_option
def report(file: str, output: str, force: bool) -> None:
    """Write the report of a FILE once more: of a study, or of the JSON that any other command left."""
    from allanite.report import render_file

    click.echo(render_file(place_of(file), output, force=force))
