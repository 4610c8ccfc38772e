# SPDX-License-Identifier: BSD-3-Clause
"""separate_noise(recording): the noise of two or three sensors without the part that they share, and that part.

All sums run over the positions at which every sensor is complete. Every estimate has its own degrees of freedom, from
its exact variance under the noise terms of all parts, and the interval of `fiducial` with them.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, InputError
from allanite.fitting.design import TIME_POWER
from allanite.noise import Estimate, NoiseModel, term_of
from allanite.noise.allan.covariance import complete_starts, lag_pairs
from allanite.noise.allan.degrees import chi_square_factors
from allanite.noise.allan.lags import octave_lags
from allanite.noise.allan.matrix import AllanMatrix, allan_matrix
from allanite.noise.allan.statistics import phase_of, rounding_variance
from allanite.plain_files.counted import listed
from allanite.quantities.distributions import normal_quantile
from allanite.quantities.probabilities import require_probabilities
from allanite.recording.channel_names import for_shell
from allanite.recording.records import Recording, merge_spans
from allanite.stability.shared_noise.agreement import delay_of, same_to_all, shared_sign
from allanite.stability.shared_noise.fiducial import LEAST_FREEDOM, interval_of
from allanite.stability.shared_noise.quadratic import common_form, covariance_of, own_basis, own_form
from allanite.stability.shared_noise.results import COMMON, NoisePart, SensorDelay, Separation
from allanite.stability.shared_noise.terms import SYMBOLS, FittedTerms, fit_terms
from allanite.stability.shared_noise.verdict import SeparationVerdict

__all__ = ["separate_noise"]

Array = NDArray[np.float64]
Spans = NDArray[np.int64]
Progress = Callable[[float, str], None]

#: A lag is shorter than this part of the record, and has more terms than samples.
_LONGEST = 6
_FEWEST_SAMPLES = 64
#: Channels whose difference has less than this part of their variance are one and the same.
_SAME = 1e-20
_VERDICTS: Mapping[int, SeparationVerdict] = {
    1: SeparationVerdict.SHARED, 0: SeparationVerdict.NOT_SHARED, -1: SeparationVerdict.OPPOSITE
}  # fmt: skip


def separate_noise(
    recording: Recording,
    *,
    channels: Sequence[str] | None = None,
    opposite: Sequence[str] = (),
    confidence: float = 0.95,
    progress: Progress | None = None,
) -> Separation:
    """Separate the noise of sensors recorded together into individual and shared parts.

    Parameters
    ----------
    recording : Recording
        Record of sensors at rest: a common motion would be a common part.
    channels : sequence of str, optional
        Two or three of one kind along one axis; by default all that bear noise.
    opposite : sequence of str
        Those of them that are mounted the other way round.
    confidence : float
        Confidence level of the intervals.
    progress : callable, optional
        Called with a fraction and words.

    Returns
    -------
    Separation

    Raises
    ------
    InputError
        Not two or three channels, of several kinds or units, or twice the same.
    DataQualityError
        Fewer than 64 samples that all channels have, or no lag with three degrees of freedom.

    Notes
    -----
    Phases of more than 8 million samples are kept in temporary files. What is not validated: that the common part is
    the same in all (three sensors: tested), and that own parts are independent of each other and of it, which no data
    can tell.
    """
    require_probabilities(confidence=confidence)
    names = _channels(recording, channels)
    signs = _signs(names, opposite)
    advance = progress or (lambda fraction, what: None)
    advance(0.0, "summing")
    phases, missing = _phases(recording, names, signs)
    n_samples = len(phases[0]) - 1
    matrix = _measured(phases, missing, names)
    advance(0.5, "fitting")
    pairs = lag_pairs(
        matrix.lags, n_samples, None if len(missing) == 0 else _starts(missing, n_samples, matrix.lags)
    )
    scale = float(matrix.covariance[0].diagonal().mean())
    sampling = recording[names[0]].sampling
    terms = fit_terms(matrix.covariance / scale, pairs, sampling)
    advance(0.8, "intervals")
    return _separation(recording, names, opposite, phases, missing, matrix, terms, scale, confidence)


# -- the record ------------------------------------------------------------------------------------------------------


def _channels(recording: Recording, wanted: Sequence[str] | None) -> tuple[str, ...]:
    bearing = [c.name for c in recording.channels if c.kind.noise_bearing]
    names = tuple(bearing if wanted is None else (recording[name].name for name in wanted))
    if len(names) not in (2, 3) or len(set(names)) != len(names):
        raise InputError(_not_two_or_three(names, bearing))
    kinds = {(recording[n].kind, "" if recording[n].kind.has_si else recording[n].unit) for n in names}
    if len(kinds) > 1 or len({recording[n].sampling for n in names}) > 1:
        listing = ", ".join(f"{n} ({recording[n].kind.value}, {recording[n].unit})" for n in names)
        raise InputError(f"sensors that share noise are of one kind and unit: {listing}")
    return names


def _not_two_or_three(names: Sequence[str], bearing: Sequence[str]) -> str:
    """What is wrong with the channels, and what to do; an example only where it would be taken."""
    count = f", not {len(set(names))}{': ' if names else ''}{', '.join(dict.fromkeys(names))}"
    if len(set(names)) < len(names):
        count = f"; {listed([n for n in dict.fromkeys(names) if names.count(n) > 1])} is named twice"
    enough = [*dict.fromkeys(names), *(n for n in bearing if n not in names)]
    advice = f"name them, for instance --channels {for_shell(','.join(enough[:3]))}"
    if len(enough) < 2:
        # the others may have been left out when the log was read
        more = f"{enough[0]} and at least one more channel" if enough else "two or three channels"
        advice = f"name {more} of the log (--channels), or record the sensors into one log"
    return f"noise is separated for two or three sensors{count}; {advice}"


def _signs(names: Sequence[str], opposite: Sequence[str]) -> Array:
    unknown = [name for name in opposite if name not in names]
    if unknown:
        raise InputError(f"{listed(unknown)} cannot be opposite: the channels are {', '.join(names)}")
    return np.array([-1.0 if name in opposite else 1.0 for name in names])


def _phases(recording: Recording, names: Sequence[str], signs: Array) -> tuple[list[Array], Spans]:
    """Phases of the channels in SI, and where any of them is missing."""
    phases, gaps, n_samples = [], [], recording.n_samples
    for name, sign in zip(names, signs, strict=True):
        phase = phase_of(recording, name, factor=float(sign) * recording[name].scale)
        n_samples = phase.n_samples
        phases.append(phase.x)
        gaps.append(np.clip(phase.missing + [-1, 0], 0, n_samples) if phase.pointwise else phase.missing)
    missing = merge_spans(np.concatenate(gaps))
    present = n_samples - int((missing[:, 1] - missing[:, 0]).sum())
    if present < _FEWEST_SAMPLES:
        raise DataQualityError(
            f"{listed(names)} have {present} samples in common; separating the noise needs {_FEWEST_SAMPLES}"
        )
    return phases, missing


def _starts(missing: Spans, n_samples: int, lags: NDArray[np.int64]) -> list[Spans]:
    return [complete_starts(missing, n_samples, 2 * int(m)) for m in lags]


def _measured(phases: Sequence[Array], missing: Spans, names: Sequence[str]) -> AllanMatrix:
    lags = octave_lags(len(phases[0]) - 1, window=_LONGEST)
    matrix = allan_matrix(phases, missing, lags)
    variances = np.einsum("lii->li", matrix.covariance)
    rounding = np.stack([rounding_variance(x, lags) for x in phases], axis=1)
    noisy = (variances > rounding).all(axis=1)
    keep = (matrix.count >= np.maximum(2 * lags, 32)) & noisy
    if not keep.any():
        raise DataQualityError(f"{listed(names)}: no lag with noise and enough complete windows")
    for i in range(len(names)):
        for j in range(i):
            if matrix.difference[0, i, j] <= _SAME * matrix.covariance[0, i, i]:
                raise InputError(f"{names[j]} and {names[i]} have the same samples: nothing can be separated")
    return AllanMatrix(
        lags=lags[keep],
        covariance=matrix.covariance[keep],
        difference=matrix.difference[keep],
        count=matrix.count[keep],
    )


# -- parts -----------------------------------------------------------------------------------------------------------


def _separation(
    recording: Recording,
    names: tuple[str, ...],
    opposite: Sequence[str],
    phases: Sequence[Array],
    missing: Spans,
    matrix: AllanMatrix,
    terms: FittedTerms,
    scale: float,
    confidence: float,
) -> Separation:
    n, channel = len(names), recording[names[0]]
    one = _Estimator(recording, names, matrix, terms, scale, confidence)
    free = np.stack([one.freedom(np.outer(e, e)) for e in np.eye(n)], axis=1)
    enough = np.nanmin(free, axis=1) >= LEAST_FREEDOM
    if not enough.any():
        raise DataQualityError(f"{listed(names)}: the record is too short for an interval at any lag")
    alone = tuple(one.own(i, enough) for i in range(n))
    common = one.common(enough)
    sd = np.sqrt(np.einsum("lii->li", matrix.covariance))
    low, high = chi_square_factors(np.where(enough[:, None], free, 1.0), confidence)
    couples = [(i, j) for i in range(n) for j in range(i + 1, n)]
    r = np.stack([matrix.covariance[:, i, j] / (sd[:, i] * sd[:, j]) for i, j in couples], axis=1)
    sign = shared_sign(r, free.min(axis=1))
    same = same_to_all(matrix.covariance / scale, terms.products, free.min(axis=1))
    delays = tuple(_delays(phases, missing, matrix, names, couples, r, free, recording.dt))
    tau = matrix.lags.astype(np.float64)[enough] * recording.dt
    return Separation(
        channels=names,
        opposite=tuple(opposite),
        kind=channel.kind.value,
        unit=channel.unit,
        tau=tau,
        total=sd[enough],
        total_lower=(sd * low)[enough],
        total_upper=(sd * high)[enough],
        own=alone,
        common=common,
        correlation=r[enough],
        pairs=tuple((names[i], names[j]) for i, j in couples),
        verdict=_VERDICTS[sign],
        agreement=same,
        delays=delays,
        missing=int((missing[:, 1] - missing[:, 0]).sum()),
        confidence=confidence,
        rate=recording.rate,
        duration=recording.duration,
        source=recording.source,
    )


class _Estimator:
    """Makes parts out of the measured matrix and the terms under which its elements scatter."""

    def __init__(
        self,
        recording: Recording,
        names: tuple[str, ...],
        matrix: AllanMatrix,
        terms: FittedTerms,
        scale: float,
        confidence: float,
    ) -> None:
        self.names, self.matrix, self.terms, self.scale = names, matrix, terms, scale
        self.confidence, self.dt = confidence, recording.dt
        self.channel = recording[names[0]]
        self.n = len(names)
        self.expected = terms.matrix()

    def freedom(self, form: Array) -> Array:
        """Degrees of freedom of an estimate: twice its squares over its exact variance, shape (n_lags,)."""
        variance = np.diag(covariance_of([form], self.terms.products)[0, :, 0, :])
        made = form @ self.expected
        squares = np.einsum("lij,lji->l", made, made)
        with np.errstate(divide="ignore", invalid="ignore"):
            return np.asarray(np.where(variance > 0, 2.0 * squares / variance, np.nan))

    def own(self, i: int, enough: NDArray[np.bool_]) -> NoisePart:
        basis = own_basis(self.n, i)
        edf = self.freedom(own_form(self.n, i))
        reduced = self._of_differences(basis)
        return self._part(self.names[i], i, np.array([[0.0, 0.5], [0.5, 0.0]]), reduced, edf, enough)

    def common(self, enough: NDArray[np.bool_]) -> NoisePart:
        form = common_form(self.n)
        return self._part(COMMON, self.n, form, self.matrix.covariance, self.freedom(form), enough)

    def _of_differences(self, basis: Array) -> Array:
        """Covariance matrix of two combinations, from variances of differences: without cancellation."""
        c, d = self.matrix.covariance, self.matrix.difference
        if self.n == 2:
            i = int(np.flatnonzero(basis[0] == 1.0)[0])
            alone = 0.5 * (c[:, i, i] - c[:, 1 - i, 1 - i] + d[:, 0, 1])
            return np.stack([np.stack([c[:, i, i], alone], -1), np.stack([alone, d[:, 0, 1]], -1)], -2)
        i = int(np.flatnonzero(basis[0] * basis[1] == 1.0)[0])
        j, k = (int(np.flatnonzero(row == -1.0)[0]) for row in basis)
        alone = 0.5 * (d[:, i, j] + d[:, i, k] - d[:, j, k])
        return np.stack([np.stack([d[:, i, j], alone], -1), np.stack([alone, d[:, i, k]], -1)], -2)

    def _part(
        self, name: str, row: int, form: Array, matrix: Array, edf: Array, enough: NDArray[np.bool_]
    ) -> NoisePart:
        variance = np.einsum("ij,lij->l", form, matrix)
        ends = np.array(
            [
                interval_of(form, m, e, self.confidence) if ok else (math.nan, math.nan)
                for m, e, ok in zip(matrix, edf, enough, strict=True)
            ]
        )
        low, high = ends[enough].T
        resolved = low > 0
        # where chance takes even the upper end below zero, the limit is what chance alone would leave
        room = np.where(high > 0, high, (high - low) / 2)
        return NoisePart(
            name=name,
            variance=variance[enough],
            variance_lower=low,
            variance_upper=high,
            deviation=np.sqrt(np.where(resolved & (variance[enough] > 0), variance[enough], np.nan)),
            lower=np.sqrt(np.where(np.isnan(low), np.nan, np.maximum(low, 0.0))),
            upper=np.sqrt(room),
            edf=edf[enough],
            model=self._model(row),
        )

    def _model(self, row: int) -> NoiseModel:
        reach = normal_quantile(0.5 + self.confidence / 2)
        terms, estimates = [], []
        for k, symbol in enumerate(SYMBOLS):
            unit = math.sqrt(self.scale) * self.dt ** TIME_POWER[symbol]
            value = self.terms.free[row, k]
            low, high = self.terms.interval(row, k, reach)
            supported = bool(low > 0)
            estimates.append(
                Estimate(
                    symbol=symbol,
                    value=math.sqrt(value) * unit if supported else None,
                    lower=math.sqrt(low) * unit if supported else 0.0,
                    upper=math.sqrt(high) * unit,
                    supported=supported,
                    note="" if supported else "upper limit" if math.isfinite(high) else "not determined",
                )
            )
            amount = self.terms.coefficients[row, k]
            if amount > 0 and (row == self.n or symbol != "N" or supported):
                terms.append(term_of(symbol, math.sqrt(amount) * unit, dt=self.dt))
        return NoiseModel(
            terms=tuple(terms),
            estimates=tuple(estimates),
            confidence=self.confidence,
            kind=self.channel.kind.value,
            unit="" if self.channel.kind.has_si else self.channel.unit,
        )


def _delays(
    phases: Sequence[Array],
    missing: Spans,
    matrix: AllanMatrix,
    names: Sequence[str],
    couples: Sequence[tuple[int, int]],
    r: Array,
    free: Array,
    dt: float,
) -> Iterator[SensorDelay]:
    """Sensors that feel the common part later than others, at the shortest lag at which they are correlated."""
    edf = free.min(axis=1)
    for k, (i, j) in enumerate(couples):
        for at, m in enumerate(matrix.lags):
            if edf[at] > 8 and shared_sign(r[at : at + 1, k : k + 1], edf[at : at + 1]) > 0:
                delay = delay_of(phases[i], phases[j], missing, int(m), float(edf[at]))
                if delay:
                    late, early = (names[j], names[i]) if delay > 0 else (names[i], names[j])
                    yield SensorDelay(late=late, early=early, delay=abs(delay) * dt)
                break
