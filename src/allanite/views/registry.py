# SPDX-License-Identifier: BSD-3-Clause
"""Every analysis: its result, its view, its command. To add one: one line here."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module
from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    from allanite.quantities.result import Result
    from allanite.study.result_document import Reportable

__all__ = ["VIEWS", "Analysis", "document_of", "kind_of"]


class Analysis(NamedTuple):
    """Where the three parts of an analysis are; each loads when it is asked for.

    Attributes
    ----------
    result : str
        "module:name" of its class.
    view : str
        Module whose `view` shows it.
    command : str
        "module:name" of its declaration; "" where another command makes it, or one that is not declared.
    """

    result: str
    view: str
    command: str = ""


#: By the format of the document, in the order of the reference.
VIEWS: Mapping[str, Analysis] = {
    "allanite-study": Analysis(
        "allanite.study.study:Study", "allanite.views.study", "allanite.commands.characterize:CHARACTERIZE"
    ),
    "allanite-spectrum": Analysis(
        "allanite.fitting.spectral.spectra:Spectra",
        "allanite.views.spectrum",
        "allanite.commands.spectrum:SPECTRUM",
    ),
    "allanite-variation": Analysis(
        "allanite.stability.variation:Variation",
        "allanite.views.variation",
        "allanite.commands.variation:VARIATION",
    ),
    "allanite-selection": Analysis(
        "allanite.fitting.selection:TermSelection",
        "allanite.views.selection",
        "allanite.commands.select:SELECT",
    ),
    "allanite-comparison": Analysis(
        "allanite.stability.record_comparison.results:Comparison",
        "allanite.views.comparison",
        "allanite.commands.compare:COMPARE",
    ),
    "allanite-in-motion": Analysis(
        "allanite.stability.in_motion:InMotion",
        "allanite.views.in_motion",
        "allanite.commands.in_motion:IN_MOTION",
    ),
    "allanite-separation": Analysis(
        "allanite.stability.shared_noise:Separation",
        "allanite.views.shared_noise",
        "allanite.commands.shared_noise:COMMON",
    ),
    "allanite-environment": Analysis(
        "allanite.stability.environment.results:Environment",
        "allanite.views.environment",
        "allanite.commands.environment:ENVIRONMENT",
    ),
    "allanite-filtered": Analysis(
        "allanite.filtering.kalman:FilterEstimate",
        "allanite.views.filtered",
        "allanite.commands.filter:FILTER",
    ),
    "allanite-innovations": Analysis(
        "allanite.filtering.innovations:Innovations",
        "allanite.views.innovations",
        "allanite.commands.innovations:INNOVATIONS",
    ),
    "allanite-reference-aided": Analysis(
        "allanite.experiments.aided_readings:AidedTake", "allanite.views.reference_aided"
    ),
    "allanite-plan": Analysis(
        "allanite.experiments.planning:Plan", "allanite.views.plan", "allanite.commands.plan:PLAN"
    ),
    "allanite-position-plan": Analysis(
        "allanite.experiments.position_planning:PositionPlan",
        "allanite.views.position_plan",
        "allanite.commands.position_plan:PLAN_POSITIONS",
    ),
    "allanite-earth-rate": Analysis(
        "allanite.experiments.earth_rate:EarthRateEstimate",
        "allanite.views.earth_rate",
        "allanite.commands.earth_rate:EARTH_RATE",
    ),
    "allanite-rate-vector": Analysis(
        "allanite.experiments.rate_vector:RateVector", "allanite.views.rate_vector"
    ),
    "allanite-north": Analysis(
        "allanite.experiments.north:NorthEstimate", "allanite.views.north", "allanite.commands.north:NORTH"
    ),
    "allanite-east-west-null": Analysis(
        "allanite.experiments.north:EastWestNull", "allanite.views.null_test"
    ),
    "allanite-alignment": Analysis(
        "allanite.experiments.alignment:AlignmentEstimate",
        "allanite.views.alignment",
        "allanite.commands.align:ALIGN",
    ),
    "allanite-calibration-estimate": Analysis(
        "allanite.experiments.calibration:CalibrationEstimate",
        "allanite.views.calibration",
        "allanite.commands.calibrate:CALIBRATE",
    ),
    "allanite-rate-table": Analysis(
        "allanite.experiments.rate_table:RateTableEstimate",
        "allanite.views.rate_table",
        "allanite.commands.rate_table:RATE_TABLE",
    ),
    "allanite-combination": Analysis(
        "allanite.experiments.redundancy:Combination",
        "allanite.views.redundancy",
        "allanite.commands.combine:COMBINE",
    ),
    "allanite-dead-reckoning": Analysis(
        "allanite.experiments.dead_reckoning:DeadReckoning",
        "allanite.views.dead_reckoning",
        "allanite.commands.dead_reckon:DEAD_RECKON",
    ),
    "allanite-datasheet": Analysis(
        "allanite.study.datasheet:DatasheetJudgement",
        "allanite.views.datasheet",
        "allanite.commands.datasheet:DATASHEET",
    ),
    "allanite-difference": Analysis(
        "allanite.fitting.model_difference:Difference",
        "allanite.views.difference",
        "allanite.commands.diff:DIFF",
    ),
    "allanite-overbound": Analysis(
        "allanite.fitting.overbound:Bounds",
        "allanite.views.overbound",
        "allanite.commands.overbound:OVERBOUND",
    ),
    "allanite-fleet": Analysis(
        "allanite.stability.fleet.results:FleetPopulation",
        "allanite.views.fleet",
        "allanite.commands.fleet.report:FLEET_REPORT",
    ),
    "allanite-control-chart": Analysis(
        "allanite.stability.fleet.charts:ControlChart",
        "allanite.views.control_chart",
        "allanite.commands.fleet.chart:FLEET_CHART",
    ),
    "allanite-fleet-check": Analysis(
        "allanite.stability.fleet.checking:FleetCheck",
        "allanite.views.fleet_check",
        "allanite.commands.fleet.check:FLEET_CHECK",
    ),
}


def kind_of(data: Mapping[str, object]) -> type[Result]:
    """The class of the result that plain data hold."""
    module, _, name = VIEWS[str(data["format"])].result.partition(":")
    kind: type[Result] = getattr(import_module(module), name)
    return kind


def document_of(data: Mapping[str, object]) -> Reportable:
    """The document of a result that has a view, out of plain data.

    Raises
    ------
    FormatError
        As for `Result.from_json`.
    """
    from allanite.study.result_document import read_document
    from allanite.study.study import Study

    kind = kind_of(data)
    if issubclass(kind, Study):
        return kind.from_json(data)
    return read_document(kind, data)
