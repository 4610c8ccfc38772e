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
``calibration``  parameters, positions and turns of a self-calibration
"""

from allanite.quantities.number_words import duration, interval, number, probability, with_sd
from allanite.views.wording.calibration import (
    calibrated_words,
    calibration_facts,
    calibration_name,
    earth_seen_words,
    parameter_groups,
    position_lines,
    rest_unit,
    scatter_lines,
    sensor_words,
    still_open,
    turn_lines,
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
    channel_names,
    check_lines,
    check_wordings,
    contradictions,
    estimate_of,
    headline,
    known_rate,
    model_words,
    sentence,
    share,
    signed,
    tone,
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
    "calibrated_words",
    "calibration_facts",
    "calibration_name",
    "capitalised",
    "cautions",
    "channel_names",
    "check_lines",
    "check_wordings",
    "contradictions",
    "degrees_of",
    "direction_words",
    "drift_unit",
    "duration",
    "earth_rate_lines",
    "earth_seen_words",
    "estimate_of",
    "finding_kinds",
    "finding_line",
    "findings_headline",
    "floor_lines",
    "function_of_latitude",
    "groups",
    "headings",
    "headline",
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
    "position_lines",
    "probability",
    "provisos",
    "quantity_words",
    "reading",
    "readings",
    "record_facts",
    "rest_unit",
    "said_of",
    "scale_unit",
    "scatter_lines",
    "sensor_words",
    "sentence",
    "severity_order",
    "share",
    "shown_symbol",
    "signed",
    "slope_reading",
    "still_open",
    "tone",
    "turn_lines",
    "turn_words",
    "unstated_words",
    "weight_words",
    "with_sd",
    "worst",
]
