# SPDX-License-Identifier: BSD-3-Clause
"""A budget of dead reckoning, from models out of files or words to everything that a report needs."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import replace
from typing import Any, Literal

from allanite.commands.measurement import MeasurementResult, measured_result, provenance
from allanite.commands.recordings import models_of_several
from allanite.plain_files.json_values import parse_plain
from allanite.plain_files.regular_file import read_regular_text

__all__ = ["dead_reckoning_of"]


def dead_reckoning_of(
    models: Iterable[str | os.PathLike[str]],
    *,
    height: Literal["free", "held"] = "free",
    command: str | None = None,
    **options: Any,
) -> MeasurementResult:
    """Errors over time, by source; options are those of `dead_reckon`.

    Parameters
    ----------
    models : iterable of path
        Studies, models, data sheets, or words; several where gyros and accelerometers were studied apart.
    height : str
        Of the vertical channel: unaided, or held by something else.

    Raises
    ------
    InputError
        Two sources that name the same channel.
    """
    from allanite.experiments.dead_reckoning import dead_reckon
    from allanite.study.result_document import Provenance

    sources = list(models)
    given, rate = models_of_several(sources)
    if rate is not None:
        options.setdefault("rate", rate)
    made = dead_reckon(given, held=height == "held", **options)
    records = [length for source in sources if (length := _length(source)) is not None]
    return measured_result(
        "dead-reckoning",
        replace(made, record=min(records, default=None)),
        lossy=False,
        provenance=Provenance(**provenance("", command=command)),
    )


def _length(source: str | os.PathLike[str]) -> float | None:
    """Of the record that was studied [s]; None for models that do not tell it."""
    try:
        document = parse_plain(read_regular_text(source))
    except (OSError, ValueError):  # words, a data sheet
        return None
    if not isinstance(document, dict) or document.get("format") != "allanite-study":
        return None
    return float(document["recording"]["duration"])
