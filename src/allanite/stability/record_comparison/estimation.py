# SPDX-License-Identifier: BSD-3-Clause
"""compare(records): from studies or curves to what they say of one another."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np

from allanite.errors import InputError
from allanite.fitting.families import FLICKER, GAUSS_MARKOV
from allanite.fitting.objective import advantage
from allanite.quantities.display_units import si_unit
from allanite.quantities.probabilities import require_probabilities
from allanite.stability.record_comparison.bias import bias_profiles
from allanite.stability.record_comparison.curves import compared, holm, ratios
from allanite.stability.record_comparison.equality import joint_equality
from allanite.stability.record_comparison.evidence import Evidence, evidence_of
from allanite.stability.record_comparison.parameters import bias_comparison, parameter_comparison
from allanite.stability.record_comparison.pooled import model_of, pooled_fit
from allanite.stability.record_comparison.results import (
    ChannelComparison,
    ComparedCurve,
    ComparedRecord,
    Comparison,
    Equality,
    FamilyEvidence,
    FamilyName,
    Outlier,
    ParameterComparison,
)
from allanite.stability.record_comparison.series import (
    FittedChannel,
    Record,
    matched,
    record_of,
    refuse_other_kinds,
)

__all__ = ["compare"]

Progress = Callable[[float, str], None]

#: A family is rejected by a record from this advantage of its rival on, as in the fit of one record.
_REJECTS_FLICKER, _REJECTS_GAUSS_MARKOV = 8.0, 5.0
#: Gauss-Markov, which has one parameter more in every record, must do better by this and by some for each record.
#: Flicker noise makes the sum of k advantages k on average, with variance 5 k: one in a hundred is beyond 5 + 2 k.
_PREFERS_GAUSS_MARKOV, _PREFERS_EACH = 5.0, 2.0
#: Shown also where no record resolves them.
_ALWAYS = ("N", "B", "B_equiv", "K")


def compare(
    records: Sequence[object],
    *,
    names: Sequence[str] | None = None,
    channels: Sequence[str | Sequence[str]] | None = None,
    confidence: float = 0.95,
    level: float = 0.05,
    threads: int | None = None,
    progress: Progress | None = None,
) -> Comparison:
    """Are several records the same within their intervals? And how much do sensors of their kind scatter?

    Parameters
    ----------
    records : sequence of Study, mapping or AllanCurve
        Two at least, independent of one another; a mapping is the document of a study. Their rates, lengths and
        sampling conventions may differ.
    names : sequence of str, optional
        Names of the records; by default those of their logs.
    channels : sequence of str or of sequences of str, optional
        Channels to compare, by one name or by one name for each record; by default all that have one name in all
        records, or the only one of each.
    confidence : float
        Level of the intervals.
    level : float
        Level of the tests.
    threads : int, optional
        The digits do not depend on it.
    progress : callable, optional
        Called with the fraction done and what is being done.

    Raises
    ------
    InputError
        Fewer than two records, one record twice, channels that do not belong together or do not measure the same,
        curves that are not oadev, probabilities outside (0, 1).
    DataQualityError, FitError
        A curve with too few lags, or that no noise terms describe.
    """
    require_probabilities(confidence=confidence, level=level)
    given = _named([record_of(r) for r in records], names)
    report = progress or (lambda fraction, what: None)
    pairs = matched(given, channels)
    comparisons, done = [], 0

    def fitted(task: tuple[Record, str]) -> FittedChannel:
        nonlocal done
        record, channel = task
        series = record.series(channel)
        done += 1
        report(0.5 * done / (len(given) * len(pairs)), f"fitting {record.name}")
        return series

    with ThreadPoolExecutor(threads or 2) as pool:
        for i, (name, of_channel) in enumerate(pairs):
            series = list(pool.map(fitted, zip(given, of_channel, strict=True)))
            refuse_other_kinds(series)
            _refuse_twins(series)
            report(0.5 + 0.5 * i / len(pairs), f"comparing {name}")
            comparisons.append((series, _channel(name, series, confidence, level / len(pairs), pool)))
    first = comparisons[0][0]
    report(1.0, "done")
    return Comparison(
        records=tuple(_facts(r, s) for r, s in zip(given, first, strict=True)),
        channels=_adjusted([c for _, c in comparisons]),
        level=level,
        confidence=confidence,
    )


def _named(records: Sequence[Record], names: Sequence[str] | None) -> list[Record]:
    """Records with the names given, or their own; equal ones are numbered."""
    if len(records) < 2:
        raise InputError(f"{len(records)} record; a comparison needs at least two")
    if names is not None and (len(names) != len(records) or len(set(names)) < len(names)):
        raise InputError(
            f"{len(records)} records need as many names, all different; given: {', '.join(names)}"
        )
    wanted = [r.name for r in records] if names is None else list(names)
    made = []
    for i, (record, name) in enumerate(zip(records, wanted, strict=True)):
        number = wanted[: i + 1].count(name)
        made.append(replace(record, name=name if wanted.count(name) == 1 else f"{name} ({number})"))
    return made


def _refuse_twins(series: Sequence[FittedChannel]) -> None:
    for a, b in itertools.combinations(series, 2):
        if np.array_equal(a.curve.deviation, b.curve.deviation, equal_nan=True):
            raise InputError(
                f"{a.record} ({a.channel!r}) and {b.record} ({b.channel!r}) are the same samples; "
                "compared records must be independent"
            )


def _facts(record: Record, series: FittedChannel) -> ComparedRecord:
    return ComparedRecord(
        name=record.name,
        source=record.source,
        sha256=record.sha256,
        rate=1 / series.curve.dt,
        duration=series.duration,
        sampling=series.sampling,
    )


# -- one channel --------------------------------------------------------------------------------------------------


def _channel(
    name: str, series: Sequence[FittedChannel], confidence: float, level: float, pool: ThreadPoolExecutor
) -> ChannelComparison:
    family, families = _family(series)
    design, pooled = pooled_fit(series, FLICKER if family == "flicker" else GAUSS_MARKOV)
    evidence = list(pool.map(lambda s: evidence_of(s, pooled.symbols, confidence), series))
    loss, law = joint_equality(design, pooled)
    joint_p = law.tail(loss)
    curves = compared(ratios(design, pooled))
    p = min(2 * min(joint_p, curves.p), 1.0)
    shared = model_of(series[0], pooled)
    models = [shared if p >= level else model_of(e.series, e.best) for e in evidence]
    bias = bias_profiles(series, models, confidence)
    records, kind, unit = [s.record for s in series], series[0].kind.value, series[0].unit
    return ChannelComparison(
        name=name,
        kind=kind,
        unit=unit,
        channels=tuple(s.channel for s in series),
        family=family,
        families=families,
        unexplained=tuple(s.record for s in series if s.fit.data.discrepancy > 0),
        apertures_differ=len({s.curve.channels[0].aperture for s in series}) > 1,
        scale_uncertainty=max(
            (u for s in series if (u := s.curve.channels[0].scale_uncertainty)), default=None
        ),
        curves=tuple(_drawn(e) for e in evidence),
        tau=curves.tau,
        lag_p=curves.lag_p,
        lag_p_adjusted=curves.lag_p_adjusted,
        curve=_equality(curves.statistic, curves.dof, curves.p),
        joint=_equality(loss, law.dof, joint_p),
        p=p,
        outlier=_outlier(records, [r[2] for r in curves.records], curves.rest),
        parameters=_parameters(evidence, confidence),
        bias=None
        if bias is None
        else bias_comparison(records, bias, confidence, si_unit(kind, "mean", unit)),
        model=shared,
    )


def _equality(statistic: float, dof: float, p: float) -> Equality:
    return Equality(statistic=statistic, dof=dof, p=p, p_adjusted=min(2 * p, 1.0))


def _family(series: Sequence[FittedChannel]) -> tuple[FamilyName, tuple[FamilyEvidence, ...]]:
    """The family that all records together prefer, and what each supports by itself."""
    flicker, markov, each = 0.0, 0.0, list[FamilyEvidence]()
    evidence: Mapping[tuple[bool, bool], FamilyEvidence] = {
        (True, True): "neither", (True, False): "gauss-markov", (False, True): "flicker", (False, False): "both"
    }  # fmt: skip
    for s in series:
        data = s.fit.data
        against_flicker = max(advantage(data, s.fit.markov, s.fit.flicker), 0.0)
        against_markov = max(advantage(data, s.fit.flicker, s.fit.markov), 0.0)
        flicker, markov = flicker + against_flicker, markov + against_markov
        rejected = against_flicker > _REJECTS_FLICKER, against_markov > _REJECTS_GAUSS_MARKOV
        each.append(evidence[rejected])
    better = flicker - markov > _PREFERS_GAUSS_MARKOV + _PREFERS_EACH * len(series)
    return ("gauss-markov" if better else "flicker"), tuple(each)


def _parameters(evidence: Sequence[Evidence], confidence: float) -> tuple[ParameterComparison, ...]:
    order = ("Q", "N", "B", "B_equiv", "T", "q", "K", "R")
    made = []
    for symbol in order:
        holding = [e for e in evidence if symbol in e.profiles]
        resolved = [e for e in holding if e.profiles[symbol].supported]
        if holding and (resolved or symbol in _ALWAYS):
            made.append(parameter_comparison(evidence, symbol, confidence))
    return tuple(made)


def _outlier(records: Sequence[str], p: Sequence[float], rest: Sequence[float]) -> Outlier | None:
    if len(records) < 3:
        return None
    i, looked = int(np.argmin(p)), len(records)
    return Outlier(record=records[i], p=min(p[i] * looked, 1.0), looked_at=looked, rest_p=rest[i])


def _drawn(e: Evidence) -> ComparedCurve:
    """The curve with the intervals of its own model, where it has one."""
    curve, model = e.series.curve, model_of(e.series, e.best)
    curve = curve.with_model(model) if model.terms else curve
    return ComparedCurve(
        tau=curve.tau,
        deviation=curve.deviation[:, 0],
        lower=curve.lower[:, 0],
        upper=curve.upper[:, 0],
        used=e.series.fit.used,
    )


def _adjusted(channels: Sequence[ChannelComparison]) -> tuple[ChannelComparison, ...]:
    """Adjusts the p values of the parameters of all channels, and of their biases, for their number."""
    every = [p for c in channels for p in c.parameters]
    tests = [p.equality for p in every if p.equality is not None]
    adjusted = iter(holm(np.array([t.p for t in tests])).tolist())
    looked = len(tests)
    means = [c.bias for c in channels if c.bias is not None]
    mean_p = iter(holm(np.array([b.equality.p if b.equality else 1.0 for b in means])).tolist())

    def among(outlier: Outlier | None, number: int) -> Outlier | None:
        if outlier is None:
            return None
        return replace(outlier, p=min(outlier.p * number, 1.0), looked_at=outlier.looked_at * number)

    def one(p: ParameterComparison, new: float, number: int) -> ParameterComparison:
        equality = None if p.equality is None else replace(p.equality, p_adjusted=new)
        return replace(p, equality=equality, outlier=among(p.outlier, number))

    made = []
    for c in channels:
        parameters = tuple(p if p.equality is None else one(p, next(adjusted), looked) for p in c.parameters)
        bias = None if c.bias is None else one(c.bias, next(mean_p), len(means))
        outlier = among(c.outlier, len(channels))
        made.append(replace(c, parameters=parameters, bias=bias, outlier=outlier))
    return tuple(made)
