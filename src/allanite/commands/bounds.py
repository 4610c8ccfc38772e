# SPDX-License-Identifier: BSD-3-Clause
"""Bounds above the noise of a study's channels, and studies whose models are such bounds."""

from __future__ import annotations

import os
from collections.abc import Callable, Collection
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from allanite.commands.measurement import MeasurementResult, measured_result, provenance
from allanite.commands.study import curve_of
from allanite.errors import InputError

if TYPE_CHECKING:
    from allanite.fitting.overbound import Bounds
    from allanite.study.study import Study

__all__ = ["bounds_of", "bounds_of_study", "with_bounds"]

Advance = Callable[[float, str], None]


def bounds_of(
    source: str | os.PathLike[str],
    *,
    probability: float = 0.95,
    horizon: float | None = None,
    terms: Collection[str] | None = None,
    command: str | None = None,
    progress: Advance | None = None,
) -> MeasurementResult:
    """Bounds above the noise of a study's file; see `allanite.fitting.overbound.overbound`.

    Raises
    ------
    InputError
        The study shows another statistic than oadev or holds no model, or what `overbound` refuses.
    FormatError
        Not a study.
    """
    from allanite.study.result_document import Provenance
    from allanite.study.study import Study

    study = Study.load(Path(source))
    bounds = bounds_of_study(study, probability=probability, horizon=horizon, terms=terms, progress=progress)
    origin = study.provenance
    measured = measured_result(
        "overbound",
        bounds,
        lossy=False,
        provenance=Provenance(**provenance(origin.source, origin.sha256, command)),
    )
    return replace(measured, models=bounds.models)


def bounds_of_study(
    study: Study,
    *,
    probability: float = 0.95,
    horizon: float | None = None,
    terms: Collection[str] | None = None,
    progress: Advance | None = None,
) -> Bounds:
    """A bound for each channel of a study that has a model."""
    from allanite.fitting.overbound import bound_channels

    statistic = study.channels[0].curve.statistic
    if statistic != "oadev":
        raise InputError(f"the study shows {statistic}: characterize with oadev for a bound")
    step = None if progress is None else lambda fraction: progress(fraction, "bounding")
    return bound_channels(
        curve_of(study), study.models, probability=probability, horizon=horizon, terms=terms, progress=step
    )


def with_bounds(study: Study, bounds: Bounds) -> Study:
    """The study with the bound as the only model of each channel that has one."""
    return replace(
        study,
        channels=tuple(
            replace(c, models=(bounds.models[c.name],)) if c.name in bounds.models else c
            for c in study.channels
        ),
    )
