# SPDX-License-Identifier: BSD-3-Clause
"""How much noise does motion add?"""

from __future__ import annotations

from dataclasses import replace

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, CONFIDENCE, MODEL, option

__all__ = ["IN_MOTION"]

IN_MOTION = Command(
    name="in-motion",
    title="Noise in motion",
    summary="Compare the noise in motion with that at rest.",
    details=(
        "MOTION is a log with motors on, or carried. Reports the inflation of N, of K and of each band of frequency, "
        "with intervals, and the lines of rotors. --output writes the noise model to give to a filter, with "
        "the reason. Log options apply to all logs, or to the log that they name."
    ),
    example="allanite in-motion rest.bag motors-on.bag -o told.json --out moved",
    takes="recordings",
    logs="REST MOTION...",
    options=(
        option(
            "number", "--above", "Lowest frequency that counts as noise, in Hz: half the update rate of the filter, or "
            "where movement of the body ends.", otherwise="10, at most an eighth of the lowest sample rate",
        ),
        option("flag", "--fixed", "The body was held still in all logs: slow changes are noise as well."),
        option(
            "texts", "--match", "Channels to compare: x, or its names at rest and in motion: x,gyro_x.",
            metavar="CHANNELS",
        ),
        replace(MODEL, help="Noise model at rest, in place of the fit to REST."),
        ACCEPT,
        CONFIDENCE,
    ),
    on_page=False,
    work="allanite.commands.motion_logs:in_motion_of",
    tables={"bands.csv": "allanite.views.in_motion:band_rows", "lines.csv": "allanite.views.in_motion:line_rows"},
    models="noise models for a filter",
)  # fmt: skip
