# SPDX-License-Identifier: BSD-3-Clause
"""examine_variation(recording): the Allan deviation window by window, and whether the noise changes.

Windows are contiguous and share no term of the sum; at lags that are long for them, two, four, ... are joined, until
a window holds at least four lags. Lags for which fewer than four windows are left say nothing about change, and are
left out: a deviation over half a day cannot be known to change within a day.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, FitError, InputError
from allanite.noise import NoiseModel, term_of
from allanite.noise.allan import AllanCurve, allan_curve
from allanite.noise.allan.cells import AllanCells, cell_covariance, cells_of
from allanite.noise.allan.degrees import chi_square_factors
from allanite.noise.allan.statistics import Phase, phase_of, rounding_variance
from allanite.noise.given_models import models_of
from allanite.plain_files.counted import plural
from allanite.quantities.distributions import chi_square_tail, normal_quantile
from allanite.quantities.probabilities import require_probabilities
from allanite.quantities.quantity import Quantity
from allanite.recording.clock_channels import without_noise
from allanite.recording.records import Channel, Recording
from allanite.stability.variation.changes import ChangeScan, find_changes, undivided
from allanite.stability.variation.constancy import WindowScatter, excess_kurtosis, together, window_scores
from allanite.stability.variation.results import Change, ChannelVariation, LagTest, Variation
from allanite.stability.variation.shapes import doubts_of, shares_of
from allanite.stability.variation.sizes import FoundChange, ratio_of
from allanite.stability.variation.verdict import ModelSource, VariationVerdict

__all__ = ["examine_variation"]

Array = NDArray[np.float64]
Progress = Callable[[float, str], None]

#: Lags that a window holds at least, windows of a lag at least, and samples of a window at least.
LAGS, FEWEST, LEAST = 4, 4, 16
#: Degrees of freedom that a window needs for its cube root to be normal.
_FREE = 1.5


def examine_variation(
    recording: Recording,
    *,
    channels: Sequence[str] | None = None,
    models: Mapping[str, NoiseModel] | NoiseModel | None = None,
    windows: int = 64,
    confidence: float = 0.95,
    false_alarm: float = 0.05,
    progress: Progress | None = None,
) -> Variation:
    """Does the noise change during the record?

    Parameters
    ----------
    recording : Recording
        Record of sensors at rest.
    channels : sequence of str, optional
        Channels to examine; by default all channels that have noise.
    models : NoiseModel, or mapping of channel name to NoiseModel, optional
        Noise models whose covariance gives the expected scatter of the windows, and whose terms may change; by default
        the fit to the whole record.
    windows : int
        Largest number of windows, at short lags.
    confidence : float
        Confidence level of the intervals.
    false_alarm : float
        Probability that a channel with constant noise is reported to change.
    progress : callable, optional
        Called with a fraction and words.

    Returns
    -------
    Variation

    Raises
    ------
    InputError
        Unknown channels, fewer than four windows, or a probability outside (0, 1).
    DataQualityError
        A record too short for four windows, or without a sample.

    Notes
    -----
    The phase of one channel is held in memory, that of more than 8 million samples in a temporary file.
    """
    require_probabilities(confidence=confidence, false_alarm=false_alarm)
    if windows < FEWEST:
        raise InputError(f"change needs at least {FEWEST} windows, not {windows!r}")
    bearing = [c.name for c in recording.channels if c.kind.noise_bearing]
    names = bearing if channels is None else [recording[name].name for name in channels]
    if not names:
        raise without_noise(recording)
    given = models_of(models, {name: recording[name].kind for name in names})
    advance = progress or (lambda fraction, what: None)
    results = []
    for i, name in enumerate(names):
        advance(i / len(names), f"windows of {name}")
        results.append(_channel(recording, name, given.get(name), windows, confidence, false_alarm))
    return Variation(
        channels=tuple(results),
        rate=recording.rate,
        duration=recording.duration,
        confidence=confidence,
        false_alarm=false_alarm,
        source=recording.source,
    )


def _channel(
    recording: Recording,
    name: str,
    given: NoiseModel | None,
    windows: int,
    confidence: float,
    false_alarm: float,
) -> ChannelVariation:
    channel, dt = recording[name], recording.dt
    phase = phase_of(recording, name)
    cells, silent = _cells(phase, windows, channel)
    model, model_source = (given, ModelSource.GIVEN) if given is not None else _fitted(recording, name)
    level = false_alarm / 2
    tails = excess_kurtosis(phase.x, cells)
    cells, scatter = _scatter(cells, model, phase.n_samples, dt, channel.sampling, tails)
    scan = _scan(cells, scatter, model, dt, channel.sampling, level, confidence)
    # a window that a step divides looks like one with tails
    calm = excess_kurtosis(phase.x, cells.where(undivided(scan.changes, cells))) if tails else 0.0
    if calm < tails:
        tails = calm
        cells, scatter = _scatter(cells, model, phase.n_samples, dt, channel.sampling, tails)
        scan = _scan(cells, scatter, model, dt, channel.sampling, level, confidence)
    chi2, dof = together(cells.variance, cells.row, scatter)
    p = chi_square_tail(chi2, dof)
    lags = _lag_tests(cells, scatter, dt, abs(channel.scale), confidence, false_alarm)
    changes = () if len(silent) else tuple(_change(c, dt, confidence) for c in scan.changes)
    fluctuates = p < level or len(silent) > 0
    return ChannelVariation(
        name=name,
        kind=channel.kind.value,
        unit=channel.unit,
        verdict=(
            VariationVerdict.CHANGES
            if changes
            else VariationVerdict.FLUCTUATES
            if fluctuates
            else VariationVerdict.CONSTANT
        ),
        lags=lags,
        changes=changes,
        silent=tuple((start * dt, stop * dt) for start, stop in silent.tolist()),
        chi2=chi2,
        dof=dof,
        p=p,
        p_change=scan.p,
        p_left=chi_square_tail(*scan.left) if scan.left[1] > 0 else 1.0,
        visible=scan.visible,
        kurtosis=tails,
        model=model,
        model_source=model_source,
    )


def _scan(
    cells: AllanCells,
    scatter: WindowScatter,
    model: NoiseModel,
    dt: float,
    sampling: str,
    level: float,
    confidence: float,
) -> ChangeScan:
    shares, doubts = (of(model, cells.lags, dt, sampling) for of in (shares_of, doubts_of))
    return find_changes(cells, scatter, shares, doubts, level=level, confidence=confidence)


# -- windows and how they scatter ----------------------------------------------------------------------------------


def _cells(phase: Phase, windows: int, channel: Channel) -> tuple[AllanCells, Array]:
    """Windows that hold noise, and start and stop of those of the shortest lag that hold none, shape (n, 2)."""
    n = phase.n_samples
    while windows >= FEWEST and n // windows < LEAST:
        windows //= 2
    if windows < FEWEST:
        raise DataQualityError(
            f"channel {channel.name!r}: {plural(n, 'sample')}; change needs {FEWEST} windows of {LEAST} samples"
        )
    shortest = -(-n // windows)
    lags, lengths, m, length = [], [], 1, shortest
    while True:
        while length < LAGS * m:
            length *= 2
        if -(-n // length) < FEWEST:
            break
        lags.append(m)
        lengths.append(length)
        m *= 2
    every = cells_of(phase, lags, lengths)
    noisy = every.variance > rounding_variance(phase.x, every.lag)
    if np.count_nonzero(noisy & (every.row == 0)) < FEWEST:
        noisy = np.zeros(len(every), dtype=np.bool_)  # longer lags only spread those few
    return _enough(every.where(noisy), channel.name), _silent(every, noisy)


def _silent(cells: AllanCells, noisy: NDArray[np.bool_]) -> Array:
    """Start and stop of the windows of the shortest lag that hold one and the same value [samples]."""
    here = (cells.row == 0) & ~noisy
    return np.column_stack([cells.start[here], cells.stop[here]]).astype(np.float64)


def _enough(cells: AllanCells, name: str) -> AllanCells:
    """Lags of which at least four windows are there."""
    there = np.bincount(cells.row, minlength=len(cells.lags))
    keep = there[cells.row] >= FEWEST if len(cells) else np.zeros(0, dtype=np.bool_)
    if not keep.any():
        raise DataQualityError(f"channel {name!r}: fewer than {FEWEST} windows have samples and noise")
    return cells.where(keep)


def _fitted(recording: Recording, name: str) -> tuple[NoiseModel, ModelSource]:
    """The fit to the whole record; a rough sum of terms where no fit explains the curve."""
    from allanite.fitting import fit

    curve = allan_curve(recording.select(name))
    try:
        model = fit(curve)
        if model.terms:
            return model, ModelSource.FITTED
    except (FitError, DataQualityError):
        pass
    return _rough(curve, recording[name]), ModelSource.ROUGH


def _rough(curve: AllanCurve, channel: Channel) -> NoiseModel:
    """Terms by relative least squares, none of them negative."""
    from allanite.fitting.nonnegative import nonnegative

    ok = np.isfinite(curve.variance[:, 0]) & (curve.variance[:, 0] > 0)
    m, v = curve.lags[ok].astype(np.float64), curve.variance[ok, 0]
    units = [term_of(symbol, 1.0, dt=curve.dt) for symbol in ("Q", "N", "B", "K")]
    columns = np.stack([t.avar_sampled(m, curve.dt, channel.sampling) / v for t in units], axis=1)
    norm = np.linalg.norm(columns, axis=0)
    amount = np.sqrt(nonnegative(columns / norm, np.ones(len(v))) / norm)
    terms = tuple(
        term_of(s, float(a), dt=curve.dt) for s, a in zip(("Q", "N", "B", "K"), amount, strict=True) if a > 0
    )
    return NoiseModel(terms=terms, kind=channel.kind.value, unit="" if channel.kind.has_si else channel.unit)


def _scatter(
    cells: AllanCells, model: NoiseModel, n_samples: int, dt: float, sampling: str, tails: float
) -> tuple[AllanCells, WindowScatter]:
    mean = model.avar_sampled(cells.lag.astype(np.float64), dt, sampling)
    relative = cell_covariance(cells, model, n_samples, dt, sampling) / np.outer(mean, mean)
    if tails:
        white = sum(
            (
                t.avar_sampled(cells.lag.astype(np.float64), dt, sampling)
                for t in model.terms
                if t.type == "white"
            ),
            np.zeros(len(cells)),
        )
        share = white / mean / (cells.stop - cells.start)
        shared = np.minimum.outer(cells.stop, cells.stop) - np.maximum.outer(cells.start, cells.start)
        relative += tails * np.outer(share, share) * np.maximum(shared, 0)
    known = (np.diag(relative) > 0) & (np.diag(relative) < 2.0 / _FREE)
    there = np.bincount(cells.row[known], minlength=len(cells.lags))
    keep = known & (there[cells.row] >= FEWEST)
    if not keep.any():
        raise DataQualityError("too few samples in the windows: use fewer windows, or record longer")
    return cells.where(keep), WindowScatter.of(relative[np.ix_(keep, keep)])


# -- results ---------------------------------------------------------------------------------------------------


def _lag_tests(
    cells: AllanCells, scatter: WindowScatter, dt: float, scale: float, confidence: float, false_alarm: float
) -> tuple[LagTest, ...]:
    bar = normal_quantile(1 - false_alarm / (2 * len(cells)))
    whole = cells.whole
    tests = []
    for row, m in enumerate(cells.lags):
        here = np.flatnonzero(cells.row == row)
        windows = scatter.of_cells(here)
        chi2, scores = window_scores(cells.variance[here], windows)
        deviation = np.sqrt(cells.variance[here]) * scale
        low, high = chi_square_factors(windows.edf, confidence)
        tests.append(
            LagTest(
                tau=float(m) * dt,
                window=float((cells.stop[here] - cells.start[here]).max()) * dt,
                start=cells.start[here].astype(np.float64) * dt,
                stop=cells.stop[here].astype(np.float64) * dt,
                deviation=deviation,
                lower=deviation * low,
                upper=deviation * high,
                edf=windows.edf,
                ratio=np.sqrt(cells.variance[here] / whole[row]),
                significant=np.abs(scores) > bar,
                whole=float(np.sqrt(whole[row]) * scale),
                chi2=chi2,
                dof=len(here) - 1,
                p=chi_square_tail(chi2, len(here) - 1),
            )
        )
    return tuple(tests)


def _change(change: FoundChange, dt: float, confidence: float) -> Change:
    ratio, lower, upper = ratio_of(change, confidence)
    return Change(
        symbol=change.shape.symbol,
        time=_time(change, dt),
        ratio=Quantity.of(ratio, (lower, upper), "1"),
        p=change.p,
    )


def _time(change: FoundChange, dt: float) -> Quantity | None:
    """Of a step."""
    if change.shape.time is None:
        return None
    ends = (math.nan if end is None else end * dt for end in (change.lower, change.upper))
    return Quantity.of(change.shape.time * dt, (next(ends), next(ends)), "s")
