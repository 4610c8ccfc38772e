# SPDX-License-Identifier: BSD-3-Clause
"""What is the population of a fleet, and which units do not belong to it?"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from allanite.commands.declaration import Command
from allanite.commands.option import CONFIDENCE, option

if TYPE_CHECKING:
    from allanite.commands.measurement import MeasurementResult
    from allanite.study.result_document import Provenance

__all__ = ["FLEET_REPORT", "population_of_fleet", "provenance_of_fleet"]

FLEET_REPORT = Command(
    name="fleet report",
    title="Population of a fleet",
    summary="Describe a fleet, and name the units that stand out.",
    details=(
        "FLEET is a folder that `allanite fleet run` wrote, or its fleet.parquet. Every log takes part with its "
        "likelihood, an upper limit included. The report gives middle and spread of each coefficient, the next unit, "
        "a tolerance bound, and the effects of temperature, date and lot. With --sheet, also the share of units beyond "
        "the values of a data sheet."
    ),
    example="allanite fleet report fleet --out population",
    takes="fleet",
    options=(
        CONFIDENCE,
        option(
            "share", "--false-discoveries", "Expected share of false alarms among the units that stand out.",
            python="false_discovery_rate", default=0.05,
        ),
        option("share", "--content", "Share of the units below the tolerance bound.", default=0.99),
        option(
            "file", "--sheet", "Data sheet (YAML) whose values --content of the units must keep.", on_page=False
        ),
        option(
            "names", "--condition", "Numeric columns whose effect is estimated: temperature,date.",
            python="conditions", otherwise="those of temperature and date that every log has", metavar="NAMES",
        ),
        option("flag", "--no-lots", "Treat all units as one lot.", python="no_lots"),
    ),
    on_page=False,
    work="allanite.commands.fleet.report:population_of_fleet",
    document="population",
    tables={
        "coefficients.csv": "allanite.views.fleet:coefficient_rows",
        "standing_out.csv": "allanite.views.fleet:standing_out_rows",
        "lots.csv": "allanite.views.fleet:lot_rows",
        "drifts.csv": "allanite.views.fleet:drift_rows",
        "correlations.csv": "allanite.views.fleet:correlation_rows",
    },
)  # fmt: skip


def population_of_fleet(
    fleet: str | os.PathLike[str],
    *,
    confidence: float = 0.95,
    false_discovery_rate: float = 0.05,
    content: float = 0.99,
    conditions: Sequence[str] | None = None,
    no_lots: bool = False,
    sheet: str | os.PathLike[str] | None = None,
    command: str | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> MeasurementResult:
    """The population of a fleet; see `allanite.describe_fleet`.

    Raises
    ------
    InputError
        What `describe_fleet` refuses, and a sheet without a value for a coefficient of the fleet.
    """
    from allanite.commands.fleet.sheet_limits import limits_of_fleet
    from allanite.commands.measurement import measured_result
    from allanite.stability.fleet.population import describe_fleet

    result = describe_fleet(
        Path(fleet),
        confidence=confidence,
        false_discovery_rate=false_discovery_rate,
        content=content,
        conditions=conditions,
        by_lot=not no_lots,
        limits=None if sheet is None else limits_of_fleet(sheet, fleet),
        progress=progress,
    )
    return measured_result(
        "population", result, lossy=result.failed > 0, provenance=provenance_of_fleet(fleet, command)
    )


def provenance_of_fleet(fleet: str | os.PathLike[str], command: str | None) -> Provenance:
    """Where a result of a fleet comes from: its folder, and the digest of its table."""
    from allanite.commands.measurement import provenance
    from allanite.stability.fleet.table_files import table_sha256
    from allanite.study.result_document import Provenance

    place = Path(fleet)
    return Provenance(**provenance(place.resolve().name, table_sha256(place), command))
