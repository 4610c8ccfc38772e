# SPDX-License-Identifier: BSD-3-Clause
"""How is the noise spread over frequency?"""

from __future__ import annotations

from dataclasses import replace

from allanite.commands.declaration import Command
from allanite.commands.option import CONFIDENCE, MODEL, option

__all__ = ["SPECTRUM"]

SPECTRUM = Command(
    name="spectrum",
    title="Power spectral density",
    summary="Compute the power spectral density, with intervals and lines.",
    details=(
        "Densities are two-sided. A line with constant amplitude and phase is reported as a sinusoid. A noise model "
        "can be shown with it."
    ),
    example="allanite spectrum gyro.csv --unit deg/s --model study.json --plot spectrum.pdf",
    options=(
        replace(MODEL, help=f"{MODEL.help} One for all channels, or one for each."),
        option(
            "choice", "--method", "Logarithmic bins over all frequencies, or Welch segments of one length.",
            choices=("log", "welch"), default="log",
        ),
        option(
            "seconds", "--segment", "Length of the Welch segments.", otherwise="an eighth, at most 16384 samples",
        ),
        option(
            "choice", "--window", "Window of the Welch segments.", choices=("hann", "blackman", "blackman-harris"),
            default="hann",
        ),
        option("share", "--overlap", "Overlap of the Welch segments.", default=0.5),
        CONFIDENCE,
    ),
    work="allanite.commands.spectra:spectra_of",
    tables={"spectrum.csv": "allanite.views.spectrum:rows"},
)  # fmt: skip
