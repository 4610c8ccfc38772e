# SPDX-License-Identifier: BSD-3-Clause
"""Which view shows which result. To add a result: one line here."""

from __future__ import annotations

from collections.abc import Mapping
from importlib import import_module

from allanite.quantities.result import Result
from allanite.study.result_document import Reportable, read_document

__all__ = ["VIEWS", "document_of", "kind_of"]

#: Format of a document -> where its result is defined, its name there, and the module whose `view` shows it.
VIEWS: Mapping[str, tuple[str, str, str]] = {
    "allanite-study": ("allanite.study.study", "Study", "allanite.views.study"),
    "allanite-variation": ("allanite.stability.variation", "Variation", "allanite.views.variation"),
    "allanite-comparison": (
        "allanite.stability.record_comparison",
        "Comparison",
        "allanite.views.comparison",
    ),
    "allanite-environment": ("allanite.stability.environment", "Environment", "allanite.views.environment"),
    "allanite-spectrum": ("allanite.fitting.spectral.spectra", "Spectra", "allanite.views.spectrum"),
    "allanite-selection": ("allanite.fitting.selection", "TermSelection", "allanite.views.selection"),
    "allanite-separation": ("allanite.stability.shared_noise", "Separation", "allanite.views.shared_noise"),
    "allanite-earth-rate": (
        "allanite.experiments.earth_rate",
        "EarthRateEstimate",
        "allanite.views.earth_rate",
    ),
    "allanite-rate-vector": (
        "allanite.experiments.rate_vector",
        "RateVector",
        "allanite.views.rate_vector",
    ),
    "allanite-rate-table": (
        "allanite.experiments.rate_table",
        "RateTableEstimate",
        "allanite.views.rate_table",
    ),
    "allanite-alignment": (
        "allanite.experiments.alignment",
        "AlignmentEstimate",
        "allanite.views.alignment",
    ),
    "allanite-combination": (
        "allanite.experiments.redundancy",
        "Combination",
        "allanite.views.redundancy",
    ),
    "allanite-north": ("allanite.experiments.north", "NorthEstimate", "allanite.views.north"),
    "allanite-plan": ("allanite.experiments.planning", "Plan", "allanite.views.plan"),
    "allanite-position-plan": (
        "allanite.experiments.position_planning",
        "PositionPlan",
        "allanite.views.position_plan",
    ),
    "allanite-dead-reckoning": (
        "allanite.experiments.dead_reckoning",
        "DeadReckoning",
        "allanite.views.dead_reckoning",
    ),
    "allanite-datasheet": ("allanite.study.datasheet", "DatasheetJudgement", "allanite.views.datasheet"),
    "allanite-overbound": ("allanite.fitting.overbound", "Bounds", "allanite.views.overbound"),
    "allanite-east-west-null": ("allanite.experiments.north", "EastWestNull", "allanite.views.null_test"),
}


def kind_of(data: Mapping[str, object]) -> type[Result]:
    """The class of the result that plain data hold."""
    module, name, _ = VIEWS[str(data["format"])]
    kind: type[Result] = getattr(import_module(module), name)
    return kind


def document_of(data: Mapping[str, object]) -> Reportable:
    """The document of a result that has a view, out of plain data.

    Raises
    ------
    FormatError
        As for `Result.from_json`.
    """
    from allanite.study.study import Study

    kind = kind_of(data)
    if issubclass(kind, Study):
        return kind.from_json(data)
    return read_document(kind, data)
