# SPDX-License-Identifier: BSD-3-Clause
"""A study as rows of the table of a fleet: one for each coefficient of each channel."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import Any

from allanite.errors import DataQualityError, FitError
from allanite.fitting.families import FLICKER
from allanite.noise import Estimate, NoiseModel
from allanite.quantities.display_units import si_unit
from allanite.stability.fleet.levels import levels_of
from allanite.stability.fleet.log_profiles import profiles_of
from allanite.stability.record_comparison.profiles import Profile
from allanite.stability.record_comparison.series import Record, record_of
from allanite.study.results import ChannelStudy
from allanite.study.study import Study

__all__ = ["rows_of"]

Row = dict[str, Any]


def rows_of(study: Study, confidence: float = 0.95) -> list[Row]:
    """The rows of a study, without what is known of the log beside its samples."""
    record = record_of(study)
    return [row for channel in study.channels for row in _of_channel(study, record, channel, confidence)]


def _of_channel(study: Study, record: Record, channel: ChannelStudy, confidence: float) -> Iterator[Row]:
    facts = _facts(study, record, channel)
    if not channel.models:
        yield facts | {"status": "error", "error": _refusal(study, channel)}
        return
    profiles = _profiles(record, channel.name, confidence)
    estimates = _estimates(channel)
    for term in dict.fromkeys((*FLICKER, *estimates)):
        model, estimate = estimates.get(term, (channel.models[0], None))
        yield (
            facts
            | _of_term(model, estimate)
            | _of_profile(profiles.get(term))
            | {
                "term": term,
                "unit_of_measure": si_unit(channel.kind, term, channel.unit),
            }
        )


def _facts(study: Study, record: Record, channel: ChannelStudy) -> Row:
    curve = record.channels[channel.name].curve
    missing = sum(int(stop - start) for start, stop in curve.missing[0])
    return {
        "channel": channel.name,
        "kind": channel.kind,
        "findings": sorted({f.code for f in study.findings if f.channel in (None, channel.name)}),
        "rate": 1 / curve.dt,
        "span": curve.n_samples * curve.dt,
        "samples": curve.n_samples - missing,
    }


def _refusal(study: Study, channel: ChannelStudy) -> str:
    """Why a channel has no model."""
    reasons = [f.message for f in study.findings if f.code == "not_fitted" and f.channel == channel.name]
    return f"FitError: {reasons[0] if reasons else 'no noise model'}"


def _estimates(channel: ChannelStudy) -> dict[str, tuple[NoiseModel, Estimate]]:
    """By symbol: of the preferred model, and of its alternative what that does not have."""
    made: dict[str, tuple[NoiseModel, Estimate]] = {}
    for model in channel.models:
        for estimate in model.estimates:
            made.setdefault(estimate.symbol, (model, estimate))
    return made


def _of_term(model: NoiseModel, estimate: Estimate | None) -> Row:
    p = model.goodness.get("p")
    facts = {"family": model.family, "confidence": model.confidence, "p": None if p is None else float(p)}
    if estimate is None:  # flicker, of a record that rejects it
        return facts | {"status": "not_resolved"}
    upper = estimate.upper if math.isfinite(estimate.upper) else None
    if estimate.supported and estimate.value is not None and upper is not None:
        ends = {"estimate": estimate.value, "lower": estimate.lower, "upper": upper}
        return facts | {"status": "resolved", **ends}
    status = "not_resolved" if upper is None else "upper_limit"
    return facts | {"status": status, "lower": estimate.lower, "upper": upper}


def _profiles(record: Record, channel: str, confidence: float) -> Mapping[str, Profile]:
    """What the record says of flicker's coefficients, so that all logs speak of the same ones."""
    try:
        return profiles_of(record.series(channel), confidence)
    except (DataQualityError, FitError):  # the samples were fitted, where the curve has too few lags
        return {}


def _of_profile(profile: Profile | None) -> Row:
    if profile is None:
        return {}
    levels, root_at_zero = levels_of(profile)
    return {"profile": levels.tolist(), "root_at_zero": root_at_zero}
