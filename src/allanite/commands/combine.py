# SPDX-License-Identifier: BSD-3-Clause
"""Several sensors of one kind as one."""

from __future__ import annotations

from dataclasses import replace

from allanite.commands.declaration import Command
from allanite.commands.option import CONFIDENCE, MODEL, option

__all__ = ["COMBINE"]

COMBINE = Command(
    name="combine",
    title="Redundant sensors",
    summary="Combine redundant sensors and detect faulty ones.",
    details=(
        "The weights come from the noise models and, at rest, from the noise that the sensors share. With more sensors "
        "than axes, parity residuals are free of motion and show steps, drifts, spikes, excess noise and a stuck "
        "sensor. Two more sensors than axes are needed to identify the faulty one."
    ),
    example="allanite combine gyros.parquet --model study.json --directions axes.csv -o combined.parquet",
    options=(
        replace(MODEL, required=True, help=f"{MODEL.help} One for all, or one for each."),
        option("file", "--directions", "CSV of the sensing axes: channel,x,y,z.", otherwise="all along one"),
        option("seconds", "--averaging", "Averaging time for which to optimize the weights."),
        option("flag", "--moving", "The sensors moved: take the weights from the models only."),
        option("share", "--motion-error", "Error of scale factors, and of axes in rad: 0.1%."),
        option("seconds", "--window", "Averaging window of the parity residuals.",
            otherwise="a thousandth of the record"),
        option("share", "--false-alarm", "False-alarm rate per fault-free record.", default=0.01),
        CONFIDENCE,
    ),
    on_page=False,
    work="allanite.commands.redundancy:combination_of",
    document="combination",
    tables={"weights.csv": "allanite.views.redundancy:rows"},
    series="combined signal",
)  # fmt: skip
