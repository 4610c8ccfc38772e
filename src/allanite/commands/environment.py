# SPDX-License-Identifier: BSD-3-Clause
"""What do temperature and warm-up do to a sensor?"""

from __future__ import annotations

from dataclasses import replace

from allanite.commands.declaration import Command
from allanite.commands.option import ACCEPT, CONFIDENCE, MODEL, TEMPERATURE, WARM_UP

__all__ = ["ENVIRONMENT"]

ENVIRONMENT = Command(
    name="environment",
    title="Temperature and warm-up",
    summary="Separate temperature and warm-up from noise.",
    details=(
        "Estimates temperature coefficients, thermometer lag, hysteresis and warm-up, with intervals, and removes only "
        "what the record resolves."
    ),
    example="allanite environment gyro.csv --temperature temp --warm-up model --out environment",
    options=(TEMPERATURE, WARM_UP, replace(MODEL, otherwise="fitted to the log"), CONFIDENCE, ACCEPT),
    work="allanite.commands.environment_effects:environment_of",
    series="residual",
)
