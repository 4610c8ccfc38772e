# SPDX-License-Identifier: BSD-3-Clause
"""Which noise terms does a log support?"""

from __future__ import annotations

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, CONFIDENCE, option

__all__ = ["SELECT"]

SELECT = Command(
    name="select",
    title="Which terms?",
    summary="Choose the noise terms that a log supports.",
    details=(
        "Weighs every combination of quantization, white noise, flicker, up to two Gauss-Markov terms, random walk, "
        "ramp and spectral lines. Parameter intervals include the uncertainty about the combination."
    ),
    example="allanite select gyro.parquet --lines 12.3 --out selection",
    options=(
        option(
            "lines", "--lines", "Spectral lines: auto (the steady ones of the spectrum), none, or frequencies in Hz "
            "like 12.3,50.", default="auto",
        ),
        CONFIDENCE,
        ACCEPT,
    ),
    work="allanite.commands.selection:selection_of",
    document="selection",
    tables={"selection.csv": "allanite.views.selection:rows"},
)  # fmt: skip
