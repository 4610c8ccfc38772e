# SPDX-License-Identifier: BSD-3-Clause
"""Results in people's words: numbers with the digits their interval allows, in the units people use.

Terminal, report and figures say the same thing because they all say it through this package. It reads the plain
documents of results and holds no formula: it rounds, chooses units and makes sentences.

``study``    noise coefficients and what a study says of them
``findings``  what is wrong with a record
``provisos``  aperture, scale factor, what a run lacks
``rates``    Earth rate, filter and plan
``north``    directions
``selection``  weights of sets of terms
``rate_table``  the response to a rate table
``difference``  the unit of a drift
``dead_reckoning``  which errors of a navigator are shown
``calibration``  parameters of a self-calibration
"""

from allanite.quantities.number_words import duration, interval, number, probability, with_sd
from allanite.views.wording.calibration import (
    calibration_name,
    parameter_groups,
    rest_unit,
    sensor_words,
)
from allanite.views.wording.dead_reckoning import BUDGET_QUANTITIES, quantity_words
from allanite.views.wording.difference import drift_unit
from allanite.views.wording.findings import (
    finding_kinds,
    finding_line,
    findings_headline,
    movement,
    said_of,
    severity_order,
    worst,
)
from allanite.views.wording.floor import floor_lines
from allanite.views.wording.north import arcs_words, degrees_of, direction_words
from allanite.views.wording.provisos import missing_lines, provisos, record_facts
from allanite.views.wording.rate_table import PPM, output_unit, scale_unit
from allanite.views.wording.rates import (
    DEG,
    DEG_H,
    CheckWording,
    EarthRateWording,
    angle,
    budget_lines,
    capitalised,
    check_wordings,
    contradictions,
    estimate_of,
    known_rate,
    model_words,
    sentence,
    share,
    signed,
)
from allanite.views.wording.selection import weight_words
from allanite.views.wording.study import (
    COLUMNS,
    EQUIVALENT,
    GUARANTEE,
    ChannelGroup,
    CoefficientWording,
    KeyNumber,
    cautions,
    groups,
    headings,
    is_poor,
    key_numbers,
    limit_words,
    reading,
    readings,
    shown_symbol,
    slope_reading,
)
from allanite.views.wording.turned_axis import (
    axis_facts,
    earth_rate_lines,
    function_of_latitude,
    turn_words,
    unstated_words,
)

__all__ = [
    "BUDGET_QUANTITIES",
    "COLUMNS",
    "DEG",
    "DEG_H",
    "EQUIVALENT",
    "GUARANTEE",
    "PPM",
    "ChannelGroup",
    "CheckWording",
    "CoefficientWording",
    "EarthRateWording",
    "KeyNumber",
    "angle",
    "arcs_words",
    "axis_facts",
    "budget_lines",
    "calibration_name",
    "capitalised",
    "cautions",
    "check_wordings",
    "contradictions",
    "degrees_of",
    "direction_words",
    "drift_unit",
    "duration",
    "earth_rate_lines",
    "estimate_of",
    "finding_kinds",
    "finding_line",
    "findings_headline",
    "floor_lines",
    "function_of_latitude",
    "groups",
    "headings",
    "interval",
    "is_poor",
    "key_numbers",
    "known_rate",
    "limit_words",
    "missing_lines",
    "model_words",
    "movement",
    "number",
    "output_unit",
    "parameter_groups",
    "probability",
    "provisos",
    "quantity_words",
    "reading",
    "readings",
    "record_facts",
    "rest_unit",
    "said_of",
    "scale_unit",
    "sensor_words",
    "sentence",
    "severity_order",
    "share",
    "shown_symbol",
    "signed",
    "slope_reading",
    "turn_words",
    "unstated_words",
    "weight_words",
    "with_sd",
    "worst",
]
