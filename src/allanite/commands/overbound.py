# SPDX-License-Identifier: BSD-3-Clause
"""A noise model above the sensor."""

from __future__ import annotations

from allanite.commands.declaration import Command
from allanite.commands.option import option

__all__ = ["OVERBOUND"]

OVERBOUND = Command(
    name="overbound",
    title="Noise model above the sensor",
    summary="Inflate a noise model until it bounds the sensor.",
    details=(
        "The bound exceeds the sensor's noise at all averaging times, by as little as possible. Every command accepts "
        "it as a noise model; `allanite export --overbound 95%` writes one directly."
    ),
    example="allanite overbound results/study.json -o bound.json --plot bound.pdf",
    takes="study",
    options=(
        option("share", "--probability", "Probability that the bound lies above the sensor.", default=0.95),
        option(
            "seconds",
            "--until",
            "Longest averaging time.",
            python="horizon",
            otherwise="the longest lag fitted",
        ),
        option("names", "--terms", "Terms allowed in the bound: N,K."),
    ),
    on_page=False,
    work="allanite.commands.bounds:bounds_of",
    tables={"inflation.csv": "allanite.views.overbound:rows"},
    models="bounding models",
)
