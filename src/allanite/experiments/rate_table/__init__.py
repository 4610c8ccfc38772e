# SPDX-License-Identifier: BSD-3-Clause
"""A sensor on a rate table: scale factor, bias, nonlinearity, asymmetry, misalignment, bandwidth.

The table turns at rates that are known, in steps, in sweeps or in sinusoids, by its own clock. The record of the sensor
is regressed on them in the noise of the model (`allanite.filtering.regression`), so that every number comes with an
interval that holds in noise that is not white. What the table and the user know and no record shows is stated, and
enters the budget.

``motion``          how the table turned: RateSteps, Sampled, Sinusoids, and the clocks
``table_file``      the same from a CSV
``record``          what is made of the samples: clocks, range, regression
``step_means``, ``residual_checks``  what the residuals say
``verdict``, ``checks``, ``words``  codes, questions, sentences
``twin``            a record whose truth is known
"""

from allanite.experiments.rate_table.estimation import measure_rate_table
from allanite.experiments.rate_table.motion import RateSteps, RateTable, Sampled, Sinusoids, TableClock
from allanite.experiments.rate_table.results import RateTableEstimate, ResponseParameter, TableUncertainty
from allanite.experiments.rate_table.table_file import read_rate_table
from allanite.experiments.rate_table.twin import simulate_on_table

__all__ = [
    "RateSteps",
    "RateTable",
    "RateTableEstimate",
    "ResponseParameter",
    "Sampled",
    "Sinusoids",
    "TableClock",
    "TableUncertainty",
    "measure_rate_table",
    "read_rate_table",
    "simulate_on_table",
]
