# SPDX-License-Identifier: BSD-3-Clause
"""Densities over frequency, with a model over them: spectrum."""

from __future__ import annotations

from typing import Any

import click

from allanite.commands.cli.options import MODEL, Duration, Share, confidence_option, log_options, place_of
from allanite.commands.cli.program import command
from allanite.commands.cli.results import Destination, result_options

__all__ = ["spectrum"]


@command("allanite spectrum gyro.csv --unit deg/s --model study.json --plot spectrum.pdf")
@click.argument("log")
@log_options
@click.option("--model", metavar="MODEL", help=f"{MODEL} One for all channels, or one for each.")
@click.option(
    "--method",
    type=click.Choice(["log", "welch"]),
    default="log",
    show_default=True,
    help="Logarithmic bins over all frequencies, or Welch segments of one length.",
)
@click.option(
    "--segment",
    type=Duration(),
    help="Length of the Welch segments.  [default: an eighth, at most 16384 samples]",
)
@click.option(
    "--window",
    type=click.Choice(["hann", "blackman", "blackman-harris"]),
    default="hann",
    show_default=True,
    help="Window of the Welch segments.",
)
@click.option(
    "--overlap", type=Share(), default="50%", show_default=True, help="Overlap of the Welch segments."
)
@confidence_option
@result_options
def spectrum(
    log: str, method: str, segment: float | None, window: str, overlap: float, confidence: float,
    to: Destination, **options: Any,
) -> int:  # fmt: skip
    """Compute the power spectral density, with intervals and lines.

    Densities are two-sided. A line with constant amplitude and phase is reported as a sinusoid. A noise model can be
    shown with it.
    """
    from allanite.commands.spectrum import spectra_of
    from allanite.views import terminal

    choices = {
        "method": method,
        "segment": segment,
        "window": window,
        "overlap": overlap,
        "confidence": confidence,
    }
    return to.deliver(
        "spectrum",
        lambda **known: spectra_of(place_of(log), estimate=choices, **known, **options),
        terminal.show_spectrum,
        tables=["spectrum.csv"],
        log=log,
    )
