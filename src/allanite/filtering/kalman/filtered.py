# SPDX-License-Identifier: BSD-3-Clause
"""A recording through the filter of its noise model: corrected samples, drift, level, and whether the model holds."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.filtering.kalman.channel import (
    LEVEL,
    ChannelSpace,
    FlickerForm,
    SampleSource,
    channel_space,
    chosen,
    with_flicker,
)
from allanite.filtering.kalman.consistency import Consistency, ConsistencySums
from allanite.filtering.kalman.estimate import FilterConditions, FilterEstimate, TermSeries, TestedFilter
from allanite.filtering.kalman.filtering import FilterRun, Form
from allanite.filtering.kalman.series import SeriesEnvelope, instants
from allanite.filtering.kalman.smoothing import block_rows, smoothed_blocks
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.plain_files.loggers import logger_of
from allanite.recording.block_series import BlockSeries
from allanite.recording.records import ArrayColumn, Channel, Kind, Recording, Sampling

__all__ = ["Filtered", "filter_recording"]

_LOG = logger_of(__name__)
Array = NDArray[np.float64]
Progress = Callable[[float], None]

#: Rows filtered at once.
_ROWS = 1 << 16
#: What a document holds as it is here.
_SHARED = (
    "channel", "unit", "rate", "smoothed", "form", "model", "level", "level_sd", "mean_measured", "mean_corrected",
    "log_likelihood", "consistency", "conditions", "terms",
)  # fmt: skip
_SI = {Kind.RATE: "rad/s", Kind.ACCELERATION: "m/s²", Kind.VOLTAGE: "V"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Filtered(TestedFilter):
    """A channel without its drift.

    Attributes
    ----------
    channel : str
    kind : Kind
        Of the samples in SI; angles come back as rates.
    unit : str
        Unit of every number here: SI, or the channel's own unit where that is unknown.
    rate : float [Hz]
    sampling : "mean" or "point"
    smoothed : bool
        The drift at each sample is estimated from the whole record, not from the samples up to it.
    form : "covariance" or "square root"
    model : NoiseModel
        The model that was used.
    n_states : int
        The level included.
    corrected : ndarray, shape (n_samples,)
        Samples less `drift`; NaN where missing. A series longer than some 8 million samples is a memory map.
    drift, drift_sd : ndarray, shape (n_samples,)
        Sum of all slow noise in each sample, and its standard deviation.
    level, level_sd : float
        The constant under the drift. It is the true mean plus the bias of the sensor: one axis at rest cannot
        separate the two. A random walk is counted from the beginning of the record.
    terms : dict of str to TermSeries
        Each slow term by its type, at the end of a sample, and the level as it becomes known.
    mean_measured, mean_corrected : float
        Plain means of the samples, before and after.
    consistency : Consistency
        Size and whiteness of the innovations; `verdict` and `reason` are its own.
    log_likelihood : float
    conditions : FilterConditions
        How it was filtered; `notes` say it in sentences.
    """

    channel: str
    kind: Kind
    unit: str
    rate: float
    sampling: Sampling
    smoothed: bool
    form: Form
    model: NoiseModel
    n_states: int
    corrected: Array = field(repr=False)
    drift: Array = field(repr=False)
    drift_sd: Array = field(repr=False)
    level: float
    level_sd: float
    terms: Mapping[str, TermSeries] = field(repr=False)
    mean_measured: float
    mean_corrected: float
    consistency: Consistency
    log_likelihood: float
    conditions: FilterConditions
    source: Recording = field(repr=False)

    @property
    def n_samples(self) -> int:
        """Samples, missing ones included."""
        return len(self.corrected)

    def __repr__(self) -> str:
        return f"<Filtered {self.channel}: {self.n_samples} samples, {self.n_states} states, {self.verdict}>"

    def recording(self) -> Recording:
        """Corrected samples, drift and its standard deviation as a recording: to be characterised, plotted or written.

        The channels are the name, and the name with ``_drift`` and ``_drift_sd``.
        """
        step = {
            "step": "filter",
            "channel": self.channel,
            "smoothed": self.smoothed,
            "model": self.model.to_json(),
        }
        channels = tuple(
            Channel(
                name=self.channel + suffix,
                kind=self.kind,
                unit=self.unit,
                scale=1.0,
                sampling=self.sampling,
            )
            for suffix in ("", "_drift", "_drift_sd")
        )
        return Recording(
            channels=channels,
            columns=tuple(ArrayColumn(x) for x in (self.corrected, self.drift, self.drift_sd)),
            rate=self.rate,
            start=self.source.start,
            history=(*self.source.history, step),
            source=self.source.source,
        )

    @property
    def result(self) -> FilterEstimate:
        """What a document holds: of the long series no more than a picture needs."""
        shared: dict[str, Any] = {name: getattr(self, name) for name in _SHARED}
        return FilterEstimate(
            **shared,
            kind=self.kind.value,
            samples=self.n_samples,
            states=self.n_states,
            measured=SeriesEnvelope.of(self.rate, self.corrected, self.drift),
            corrected=SeriesEnvelope.of(self.rate, self.corrected),
            drift=SeriesEnvelope.of(self.rate, self.drift),
            drift_sd=SeriesEnvelope.of(self.rate, self.drift_sd),
        )

    def to_json(self) -> dict[str, object]:
        """Plain data of `result`."""
        return self.result.to_json()


def filter_recording(
    recording: Recording,
    model: NoiseModel | Mapping[str, NoiseModel],
    *,
    channel: str | None = None,
    smooth: bool = False,
    form: Form = "covariance",
    flicker: FlickerForm = "sum",
    T: float | None = None,
    ratio: float = 10.0,
    progress: Progress | None = None,
) -> Filtered:
    """Take the drift that a noise model knows off one channel.

    Parameters
    ----------
    recording : Recording
        Missing samples are predicted over, and all others used: `clean` first what has spikes or repeats its samples.
    model : NoiseModel or mapping of channel name to NoiseModel
        Model in SI, as a fit gives it; `Study.models` is such a mapping. If the fit could not decide between two
        families, the one that drifts more over half of the record is filtered; with flicker="single" the first.
    channel : str, optional
        Needed where more than one could be meant.
    smooth : bool
        Estimate the drift at each sample from the whole record. The mean of the corrected samples is then the level.
    form : "covariance" or "square root"
        Form of the filter. The second is used automatically, and reported, if rounding breaks the first.
    flicker : "sum" or "single"
        A sum of Gauss-Markov terms, flat over the band of the record; or one term, of correlation time `T`, as the
        seed paper has it. One term needs a time that records hardly determine, and its standard deviation is 11-18 %
        too small for T of 100-1000 s if the noise is 1/f.
    T : float, optional [s]
        Correlation time of the single term.
    ratio : float
        Ratio of the correlation times of the sum (see `NoiseModel.state_space`).
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    Filtered

    Raises
    ------
    InputError
        No channel or model, or more than one, that could be meant; a model of another kind of sensor; a model
        without any noise in a sample.
    StorageError
        The record is long and the disk for temporary files is full.

    Notes
    -----
    Memory is bounded: a week at 32 Hz takes some tens of megabytes, and a temporary file.

    From 8192 samples on, the covariance form takes the gain and the standard deviations from polynomials in time where
    no sample is missing. Estimates are within 1e-9 standard deviations of those of the filter row by row, and standard
    deviations within 1e-9 of themselves. Flicker needs one state for each decade of its band at the default `ratio`.
    """
    facts, given = chosen(recording, model, channel)
    if flicker == "sum":  # else the family is the caller's choice
        given = given.cautious(recording.duration / 2)
    used = with_flicker(given, flicker, T)
    source = SampleSource(recording, facts)
    dt = 1 / recording.rate
    states = channel_space(used, dt, sampling=source.sampling, record=max(source.rows, 1) * dt, ratio=ratio)
    if not (states.space.noise > 0 or np.trace(states.space.initial) > 0):
        raise InputError("the noise model has no noise in a sample: give it at least N, or a stationary term")
    work = _FilterPass(source, states, smooth, form, progress)
    work.run()
    conditions = _conditions(given, used, flicker, states.space.labels)
    if work.skipped and form == "covariance":
        conditions = replace(conditions, broke=work.skipped)
        _LOG.info(
            "%s: rounding broke the covariance in %d rows: the square-root form is used",
            facts.name,
            work.skipped,
        )
        work = _FilterPass(source, states, smooth, "square root", progress)
        work.run()
    return _result(source, used, states, work, replace(conditions, left_out=work.skipped))


class _FilterPass:
    """One pass of the filter over a channel, and the way back of the smoother."""

    def __init__(
        self,
        source: SampleSource,
        states: ChannelSpace,
        smooth: bool,
        form: Form,
        progress: Progress | None,
    ) -> None:
        self._drift = states.drift
        self.filter = FilterRun(
            states.space, readout=states.readout if smooth else states.readout[1:], form=form
        )
        self.tests = ConsistencySums()
        self.smooth = smooth
        self._source, self._progress = source, progress or (lambda _: None)
        self._size = block_rows(states.space.size) if smooth else _ROWS
        self._first, self._step = instants(source.rows)
        points = len(range(self._first, source.rows, self._step))
        self.values, self.sds = (np.empty((points, len(states.terms))) for _ in range(2))
        self._series = {name: BlockSeries(source.rows) for name in ("corrected", "drift", "drift_sd")}
        self.series: dict[str, Array] = {}
        self._sums = np.zeros(3)  # of the samples less `_first_value`, of the drift in them, and their number
        self._first_value = math.nan

    def run(self) -> None:
        """Filter, and smooth if that is wanted."""
        rows, size, checkpoints = self._source.rows, self._size, []
        memory = np.empty((3, 0 if self.smooth else min(size, rows)))
        for start in range(0, rows, size):
            block = self._source.read(start, min(start + size, rows))
            if self.smooth:
                checkpoints.append(self.filter.checkpoint())
                errors, variances, _, _ = self.filter.feed(block, readout=False)
                self.tests.feed(errors, np.where(np.isinf(variances), np.nan, variances))
            else:
                self._forward(start, block, memory)
            self._progress((start + len(block)) / rows * (0.4 if self.smooth else 1.0))
        if self.smooth:
            self._back(checkpoints)
        self.series = {name: one.finish() for name, one in self._series.items()}

    def _forward(self, start: int, block: Array, memory: Array) -> None:
        number, first = self._next_instant(start)
        of = self.filter.feed_drift(
            block, self._drift, first=first, step=self._step, rows=self._source.rows, memory=memory
        )
        self.tests.feed_standardized(of.standardized, whole=of.whole)
        self._keep_terms(number, of.means, of.sds)
        self._keep(start, block, of.mean, of.sd, whole=of.whole)

    def _back(self, checkpoints: list[Any]) -> None:
        rows, size = self._source.rows, self._size

        def again(index: int) -> tuple[Array, dict[str, Array | None]]:
            return self._source.read(index * size, min((index + 1) * size, rows)), {}

        for index, means, sds in smoothed_blocks(self.filter, checkpoints, again):
            number, first = self._next_instant(index * size)
            self._keep_terms(number, means[first :: self._step, 1:], sds[first :: self._step, 1:])
            self._keep(index * size, again(index)[0], means[:, 0], sds[:, 0], whole=False)
            self._progress(1 - 0.6 * index * size / rows)

    def _next_instant(self, start: int) -> tuple[int, int]:
        """Number of the next instant from row `start` on, and how many rows after it that is."""
        number = max(-(-(start - self._first) // self._step), 0)
        return number, self._first + number * self._step - start

    def _keep_terms(self, number: int, means: Array, sds: Array) -> None:
        self.values[number : number + len(means)] = means
        self.sds[number : number + len(sds)] = sds

    def _keep(self, start: int, block: Array, drift: Array, sd: Array, *, whole: bool) -> None:
        """Keep the series of a block, and the sums for its plain means; `whole`: no sample is missing."""
        corrected = block - drift
        origin = self._source.origin
        for name, values in (
            ("corrected", corrected + origin if origin else corrected),
            ("drift", drift),
            ("drift_sd", sd),
        ):
            self._series[name].put(start, values)
        if not whole:
            present = np.isfinite(corrected)
            block, drift = block[present], drift[present]
        if len(block):
            if math.isnan(self._first_value):
                self._first_value = float(block[0])
            self._sums += [(block - self._first_value).sum(), drift.sum(), len(block)]

    @property
    def skipped(self) -> int:
        """Rows whose innovation had no positive variance."""
        return self.filter.skipped

    @property
    def t(self) -> Array:
        """Instants of `values` and `sds` [s]: middles of samples."""
        rows = np.arange(self._first, self._source.rows, self._step)
        return np.asarray((rows + 0.5) / self._source.recording.rate, dtype=np.float64)

    @property
    def level(self) -> tuple[float, float]:
        """The level given all rows, and its standard deviation."""
        if self.filter.unresolved:
            return math.nan, math.inf
        return float(self.filter.state[-1]) + self._source.origin, math.sqrt(
            max(float(self.filter.covariance[-1, -1]), 0.0)
        )

    @property
    def means(self) -> tuple[float, float]:
        """Plain means of the measured and of the corrected samples."""
        if not self._sums[2]:
            return math.nan, math.nan
        above, drift = self._sums[:2] / self._sums[2]
        base = self._source.origin + self._first_value
        return float(base + above), float(base + (above - drift))


def _result(
    source: SampleSource,
    model: NoiseModel,
    states: ChannelSpace,
    work: _FilterPass,
    conditions: FilterConditions,
) -> Filtered:
    level, level_sd = work.level
    measured, corrected = work.means
    terms = {
        name: TermSeries(t=work.t, value=work.values[:, i], sd=work.sds[:, i])
        for i, name in enumerate(states.terms)
    }
    unresolved = work.filter.unresolved > 0
    return Filtered(
        channel=source.channel.name,
        kind=source.kind,
        unit=_SI.get(source.kind, source.channel.unit),
        rate=source.recording.rate,
        sampling=source.sampling,
        smoothed=work.smooth,
        form=work.filter.form,
        model=model,
        n_states=states.space.size,
        corrected=work.series["corrected"],
        drift=work.series["drift"],
        drift_sd=work.series["drift_sd"],
        level=level,
        level_sd=level_sd,
        terms=terms,
        mean_measured=measured,
        mean_corrected=corrected,
        consistency=work.tests.result(),
        log_likelihood=math.nan if unresolved else work.filter.log_likelihood,
        conditions=conditions,
        source=source.recording,
    )


def _conditions(
    given: NoiseModel, used: NoiseModel, flicker: FlickerForm, labels: tuple[str, ...]
) -> FilterConditions:
    count = sum(label == "flicker" for label in labels) if used.term("flicker") is not None else 1
    other = given.alternative
    return FilterConditions(
        drifting=any(label not in (LEVEL, "mean", "quantisation") for label in labels),
        flicker_states=None if given.term("flicker") is None else count,
        families=None if other is None else (given.family, other.family),
        cautious=flicker == "sum",
    )
