# SPDX-License-Identifier: BSD-3-Clause
"""The likelihood of one channel of a record, ready for any sum of terms: what fits and model selection are built on."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import field, replace
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from allanite.errors import DataQualityError, InputError
from allanite.fitting.design import SHORTEST_TIME, TIME_POWER
from allanite.fitting.likelihood.bands import Band, ModeBand, bands, explained, first_guess
from allanite.fitting.likelihood.exact import sharpened, shifted
from allanite.fitting.likelihood.lines import (
    FEWEST_PERIODS,
    GIVEN_WIDTHS,
    Line,
    checked_lines,
    fit_lines,
    near,
    without,
)
from allanite.fitting.likelihood.maximum import LikelihoodSearch, Peak, maximise
from allanite.fitting.likelihood.objective import Objective, RandomTerm
from allanite.fitting.likelihood.pyramid import build
from allanite.lazy_dataclasses import dataclass
from allanite.noise import GaussMarkov, Ramp, Sinusoid, TermType, term_of
from allanite.noise.spectrum.stability import without_sinusoids
from allanite.plain_files.counted import plural
from allanite.recording.records import Channel, Recording

__all__ = ["LETTERS", "LikelihoodProblem", "Maximum", "checked_letters"]

Array = NDArray[np.float64]

#: Terms that a maximum may be asked for.
LETTERS = ("Q", "N", "B", "K", "R", "G")
_PART = 2.0  # of the record: a bias that outlasts it is a random walk
_FEWEST = 8  # samples
_NEARLY_ALL = 0.98  # of the samples: what gaps let one line take of another is no more than what is missing
#: Noise [unit of the channel] whose square, and what is small beside it, are still numbers of full precision.
_SMALLEST = 1e-135
_MOST_MARKOV = 2


@dataclass(frozen=True, slots=True, kw_only=True)
class Maximum:
    """The likelihood of a record at its maximum over the parameters of a set of terms.

    Attributes
    ----------
    letters : tuple of str
        The terms asked for.
    log_likelihood : float
        Natural logarithm of the density of the samples less their constant level, up to a constant of the record (0 for
        up to 128 samples without gaps). Differences between sets of terms of one problem, and of its `with_lines`, are
        those of the exact likelihood to a fraction of one: it is neither penalised nor restricted, and ramp and lines
        enter as unknown functions fitted with the rest. The constant level is in every model and counts in none.
    parameters : dict of str to float [SI]
        Q, N, B, K; |R|; sigma and T of the Gauss-Markov term, of two of them those of the quicker, and sigma_2 and T_2
        of the slower; amplitude, frequency of a line, amplitude_2, ... of others. 0 for a term that the record would
        rather do without.
    covariance : dict
        {"symbols": [...], "of": "natural logarithms", "matrix": [[...]]} of the parameters above zero, from the
        expected information (the Cramer-Rao bound at the estimate).
    terms : tuple of Term
        Those above zero.
    n_parameters : int
        Parameters that were free: coefficients, correlation times, a slope, three for each line. The level, which no
        contrast sees, is not counted.
    n_samples : int
        Samples present.
    chi2, dof, p : float, int, float
        Does the model explain the power in every octave? Small p: it does not.
    peak : Peak
        In sample units, for profiles.
    """

    letters: tuple[str, ...]
    log_likelihood: float
    parameters: dict[str, float]
    covariance: dict[str, Any]
    terms: tuple[TermType, ...]
    n_parameters: int
    n_samples: int
    chi2: float
    dof: int
    p: float
    peak: Peak = field(repr=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class LikelihoodProblem:
    """A channel of a record, reduced to what its likelihood needs.

        problem = LikelihoodProblem.of(recording, "gyro_x")
        few = problem.maximum(("N", "B"))
        more = problem.maximum(("N", "G", "G", "K"))
        2 * (more.log_likelihood - few.log_likelihood)

    The record is read once, by `of` (and again by `with_lines`, some times for several lines); each `maximum` then
    takes 10 ms to 1 s, however long the record is.

    Attributes
    ----------
    channel : Channel
    dt : float [s]
    block : int
        Samples in the shortest mean that takes part (1: the samples themselves).
    engine : "composite" or "exact"
        See `of`.
    objective : Objective
        Likelihood in sample units: value, gradient, information.
    lines : tuple of Line
        Removed beforehand.
    widths : float
        Over how many widths of a line, 1/record, each was looked for.
    correction : (Peak, ndarray) or None
        Where the exact likelihood was compared with the composite, and what is added to the gradient since.
    shortest : float [samples]
        Shortest correlation time.
    """

    channel: Channel
    dt: float
    n_samples: int
    block: int
    engine: str
    objective: Objective = field(repr=False)
    octaves: tuple[Band | ModeBand, ...] = field(repr=False)
    lines: tuple[Line, ...]
    recording: Recording = field(repr=False)
    correction: tuple[Peak, Array] | None = field(default=None, repr=False)
    shortest: float = SHORTEST_TIME
    widths: float = GIVEN_WIDTHS

    @classmethod
    def of(
        cls,
        recording: Recording,
        channel: str | None = None,
        *,
        block: int = 1,
        engine: str = "composite",
        lines: Sequence[Line] = (),
    ) -> LikelihoodProblem:
        """Read a channel.

        Parameters
        ----------
        recording : Recording
            At rest. NaN are gaps. Angles and velocities are differenced to rates.
        channel : str, optional
            May be left out where there is one.
        block : int
            Leave out what happens within so many samples, of which only the means are used.
        engine : "composite" or "exact"
            "composite": through means of blocks (see `pyramid`), any length in a second or two, and some percent less
            precise at most. "exact": in the end all samples go through a Kalman filter; minutes for a million samples.
        lines : sequence of Line
            To be removed.

        Raises
        ------
        InputError
            Another engine, a channel that is not there or not named, a block below one sample.
        DataQualityError
            Too few samples, or no noise in them.
        """
        if engine not in ("composite", "exact"):
            raise InputError(f"engine must be 'composite' or 'exact', not {engine!r}")
        whole = isinstance(block, (int, np.integer)) and not isinstance(block, bool)
        if not whole or block < 1 or (block > 1 and engine == "exact"):
            raise InputError(
                f"block must be a whole number of samples, at least 1, and 1 for the exact engine, not {block!r}"
            )
        block = int(block)
        name = _channel_of(recording, channel)
        n_rows = recording.n_samples // block
        pyramid = build(_averaged(without(_rates(recording, name), lines), block), n_rows, block)
        if pyramid.present < _FEWEST or pyramid.modes is None:
            raise DataQualityError(
                f"channel {name!r} has {plural(pyramid.present, 'usable sample')}, at least {_FEWEST} are needed"
            )
        objective = Objective.of(pyramid, recording[name].sampling)
        if not (objective.scale >= _SMALLEST and math.isfinite(objective.scale)):
            _refuse_no_noise(recording, name)
        return cls(
            channel=recording[name],
            dt=recording.dt,
            n_samples=recording.n_samples,
            block=block,
            engine=engine,
            objective=objective,
            octaves=tuple(bands(objective)),
            lines=tuple(lines),
            recording=recording,
        )

    def with_lines(self, frequencies: Sequence[float], widths: float = GIVEN_WIDTHS) -> LikelihoodProblem:
        """The same without the spectral lines near these frequencies [Hz], whose parameters are fitted.

        Each was looked for over so many `widths` of a line, which decides whether it is supported.

        Raises
        ------
        InputError
            A frequency outside ]0, rate/2], or one of fewer than four periods in the record.
        """
        frequencies = checked_lines(frequencies)
        if not all(0 < f * self.dt <= 0.5 * (1 + 1e-9) for f in frequencies):
            raise InputError(f"lines must lie above 0 and up to {0.5 / self.dt:g} Hz, not at {frequencies}")
        duration = self.n_samples * self.dt
        for f in frequencies:
            if f * duration < FEWEST_PERIODS * (1 - 1e-9):
                raise InputError(
                    f"a line at {f:g} Hz has {f * duration:.2g} periods in the record of {duration:g} s, and fewer "
                    f"than {FEWEST_PERIODS:g} cannot be distinguished from slow noise: leave out that "
                    "line, or record at least "
                    f"{FEWEST_PERIODS / f:.3g} s"
                )
        name = self.channel.name
        fitted: tuple[Line, ...] = ()
        if len(frequencies):
            fitted = fit_lines(
                lambda: _rates(self.recording, name), self.n_samples, [f * self.dt for f in frequencies]
            )
        made = LikelihoodProblem.of(self.recording, name, block=self.block, engine=self.engine, lines=fitted)
        return replace(made, shortest=self.shortest, widths=widths)

    def with_line_left_in(self, which: int) -> LikelihoodProblem:
        """The same with one of the lines in the record.

        The others stay as they are fitted, unless one is near, or gaps let it take some of the line that is left in.
        """
        others = [line for i, line in enumerate(self.lines) if i != which]
        full = self.objective.pyramid.present > _NEARLY_ALL * (self.n_samples // self.block)
        if not full or near(self.lines[which], others, self.n_samples):
            return self.with_lines([line.frequency / self.dt for line in others], self.widths)
        made = LikelihoodProblem.of(
            self.recording, self.channel.name, block=self.block, engine=self.engine, lines=others
        )
        return replace(made, shortest=self.shortest, widths=self.widths)

    @property
    def without_lines(self) -> Recording:
        """The channel alone, its lines removed."""
        if not self.lines:
            return self.recording.select(self.channel.name)
        each = np.array([(x.frequency, x.amplitude, math.atan2(x.cosine, x.sine)) for x in self.lines])
        return without_sinusoids(self.recording, self.channel.name, *each.T)

    def coarser(self, block: int) -> LikelihoodProblem:
        """The same from means over so many samples, with the lines that were removed."""
        made = LikelihoodProblem.of(self.recording, self.channel.name, block=block, lines=self.lines)
        return replace(made, widths=self.widths)

    @property
    def search(self) -> LikelihoodSearch:
        """What climbs the likelihood."""
        shortest = max(self.shortest, 2.0 * self.block if self.block > 1 else 1.0)
        evaluate = self.objective if self.correction is None else shifted(self.objective, *self.correction)
        return LikelihoodSearch(
            evaluate=evaluate, times=(shortest, max(self.n_samples / _PART, 2 * shortest))
        )

    def peak(
        self,
        letters: Sequence[str],
        *,
        slope: float | None = 0.0,
        averaged: bool = False,
        near: Peak | None = None,
        nested: Sequence[Peak] = (),
    ) -> Peak:
        """The maximum in sample units, for random terms (no R); the slope is free where it is None: see `Point`."""
        return maximise(
            self.search, letters, self.start, slope=slope, averaged=averaged, near=near, nested=nested
        )

    def start(self, components: tuple[RandomTerm, ...]) -> Array:
        """Coefficients to begin with."""
        return first_guess(self.objective, components, list(self.octaves))

    def maximum(
        self, terms: Sequence[str], *, engine: str | None = None, nested: Sequence[Peak] = ()
    ) -> Maximum:
        """The likelihood at its maximum over all parameters of a sum of terms.

        Parameters
        ----------
        terms : sequence of str
            Letters: Q, N, B (flicker), K, R (ramp), and G (Gauss-Markov) once or twice. Lines come by `with_lines`.
        engine : str, optional
            Another than that of the problem.
        nested : sequence of Peak
            Maxima for some of the terms, of which the new one is no lower than any.

        Raises
        ------
        InputError
            Unknown letters, one twice, more than two G, or no random term.
        """
        letters = checked_letters(terms)
        random = tuple(s for s in letters if s != "R")
        peak = self.peak(random, slope=None if "R" in letters else 0.0, nested=nested)
        if (engine or self.engine) == "exact":
            peak = sharpened(self.search, self.objective, peak, lambda: self.samples(), self.channel.sampling)
        return self.described(peak, letters)

    def samples(self) -> Array:
        """All samples [own unit], lines removed, NaN where missing."""
        return np.concatenate(list(without(_rates(self.recording, self.channel.name), self.lines)))

    def described(self, peak: Peak, letters: tuple[str, ...]) -> Maximum:
        """A peak in SI units."""
        ramp = "R" in letters
        free = len(peak.value.gradient) + ramp
        chi2, dof, p = explained(self.objective, peak.at, peak.value.slope, list(self.octaves), free)
        present = self.objective.pyramid.present
        return Maximum(
            letters=letters,
            log_likelihood=peak.log_likelihood - (present - 1) * math.log(abs(self.channel.scale)),
            parameters=self.parameters(peak, ramp=ramp),
            covariance=self.covariance(peak, ramp=ramp),
            terms=self.terms(peak, ramp=ramp),
            n_parameters=free + sum(1 if line.alternates else 3 for line in self.lines),
            n_samples=present,
            chi2=chi2,
            dof=dof,
            p=p,
            peak=peak,
        )

    # -- in SI --------------------------------------------------------------------------------------------

    def amplitude(self, symbol: str, coefficient: float) -> float:
        """SI amplitude of a variance coefficient."""
        size = self.objective.scale * abs(self.channel.scale) * self.dt ** TIME_POWER[symbol]
        return math.sqrt(coefficient) * size if math.isfinite(coefficient) else math.inf

    def slope(self, slope: float) -> float:
        """|R| [SI] of a slope per sample."""
        return abs(slope * self.channel.scale) / self.dt

    def names(self, peak: Peak) -> list[str]:
        """Symbol of every entry of the gradient: coefficients, then correlation times."""
        timed = [i for i, k in enumerate(peak.at.components) if k.T is not None]
        order = sorted(timed, key=lambda i: peak.at.components[i].T or 0.0)
        tag = {i: _numbered(order.index(i)) for i in timed}
        symbols = [f"sigma{tag[i]}" if i in tag else k.symbol for i, k in enumerate(peak.at.components)]
        return symbols + [f"T{tag[i]}" for i in timed]

    def parameters(self, peak: Peak, *, ramp: bool) -> dict[str, float]:
        """Every parameter by its symbol."""
        names, values = self.names(peak), {}
        for name, k, c in zip(names, peak.at.components, peak.at.c, strict=False):
            values[name] = self.amplitude(k.symbol, float(c))
            if k.T is not None:
                values[name.replace("sigma", "T")] = k.T * self.dt
        if ramp:
            values["R"] = self.slope(peak.value.slope)
        for i, line in enumerate(self.sinusoids()):
            values |= {f"amplitude{_numbered(i)}": line.amplitude, f"frequency{_numbered(i)}": line.frequency}
        return values

    def terms(self, peak: Peak, *, ramp: bool) -> tuple[TermType, ...]:
        """The terms above zero."""
        present: list[TermType] = []
        for k, c in zip(peak.at.components, peak.at.c, strict=True):
            value = self.amplitude(k.symbol, float(c))
            if value > 0:
                present.append(
                    term_of(k.symbol, value, dt=self.dt)
                    if k.T is None
                    else GaussMarkov.from_sigma(value, k.T * self.dt)
                )
        if ramp and peak.value.slope != 0:
            present.append(Ramp(R=self.slope(peak.value.slope)))
        return (*present, *self.sinusoids())

    def sinusoids(self) -> tuple[Sinusoid, ...]:
        """The lines as terms: amplitude and phase of the signal, of which samples are means or values."""
        means = self.channel.sampling == "mean"
        waves = []
        for line in self.lines:
            shrunk = float(np.sinc(line.frequency)) if means else 1.0
            phase = math.atan2(line.cosine, line.sine) - (math.pi * line.frequency if means else 0.0)
            if self.channel.scale < 0:
                phase += math.pi
            amplitude = line.amplitude / shrunk * abs(self.channel.scale)
            waves.append(Sinusoid(amplitude=amplitude, frequency=line.frequency / self.dt, phase=phase))
        return tuple(waves)

    def covariance(self, peak: Peak, *, ramp: bool) -> dict[str, Any]:
        """Covariance of the natural logarithms of the parameters above zero."""
        at, matrix = peak.log_covariance()
        n, names = len(peak.at.c), self.names(peak)
        half = np.array([0.5 if i < n else 1.0 for i in at])
        symbols, matrix = [names[i] for i in at], matrix * np.outer(half, half)
        extra: list[tuple[str, float]] = []
        if ramp and peak.value.slope != 0 and peak.value.slope_information > 0:
            extra.append(("R", 1 / (peak.value.slope_information * peak.value.slope**2)))
        for i, line in enumerate(self.lines):
            extra += self._line_variances(peak, line, _numbered(i))
        whole = np.zeros((len(symbols) + len(extra),) * 2)
        whole[: len(symbols), : len(symbols)] = matrix
        for k, (symbol, variance) in enumerate(extra, start=len(symbols)):
            whole[k, k] = variance
            symbols = [*symbols, symbol]
        return {"symbols": symbols, "of": "natural logarithms", "matrix": whole.tolist()} if symbols else {}

    def _line_variances(self, peak: Peak, line: Line, tag: str) -> list[tuple[str, float]]:
        """Of ln amplitude and ln frequency, by the density of the noise at the line (Rife and Boorstyn 1974)."""
        noise = self._noise_at(peak, line)
        of_amplitude, of_frequency = line.variances
        # an alternation is told from a line half a width away: two standard deviations
        frequency = (0.25 / self.n_samples) ** 2 if line.alternates else noise * of_frequency
        return [
            (f"amplitude{tag}", noise * of_amplitude / line.amplitude**2 if line.amplitude > 0 else math.inf),
            (f"frequency{tag}", frequency / line.frequency**2),
        ]

    def line_gains(self, peak: Peak) -> list[float]:
        """2 ln L that each line gains, by the density of the noise at the line."""
        return [line.gain / self._noise_at(peak, line) for line in self.lines]

    def _noise_at(self, peak: Peak, line: Line) -> float:
        """Variance of a sample of white noise with the density that there is at a line."""
        from allanite.noise import NoiseModel
        from allanite.noise.spectrum.sampled import sampled_psd

        model = NoiseModel(
            terms=tuple(t for t in self.terms(peak, ramp=False) if not isinstance(t, Sinusoid))
        )
        density = float(sampled_psd(model, line.frequency / self.dt, self.dt, self.channel.sampling))
        return density / self.dt / self.channel.scale**2  # two-sided as the terms are


def _numbered(i: int) -> str:
    """What is added to the names of the i-th term of its kind: nothing, _2, _3, ..."""
    return f"_{i + 1}" if i else ""


# -- reading ----------------------------------------------------------------------------------------------


def checked_letters(terms: Sequence[str]) -> tuple[str, ...]:
    """A set of terms by its letters.

    Raises
    ------
    InputError
        Unknown letters, one twice, more than two G, or no random term.
    """
    letters = tuple(terms) if isinstance(terms, Iterable) else ()
    unknown = [s for s in letters if s not in LETTERS]
    twice = [s for s in LETTERS if letters.count(s) > (_MOST_MARKOV if s == "G" else 1)]
    if unknown or twice or all(s == "R" for s in letters):
        raise InputError(
            f"terms are letters out of {', '.join(LETTERS)}, each once and G once or twice, at least one besides R; "
            f"got {list(letters) or terms!r}"
        )
    return letters


def _channel_of(recording: Recording, channel: str | None) -> str:
    if channel is not None:
        recording[channel]
        return channel
    if len(recording.names) != 1:
        raise InputError(f"name the channel to fit with channel=; there are: {', '.join(recording.names)}")
    return recording.names[0]


def _rates(recording: Recording, name: str) -> Iterator[Array]:
    """The channel in its own unit, near zero, as rates."""
    integrated = recording[name].kind.integrated
    origin, last = math.nan, np.full(1, np.nan)
    for _, samples in recording.blocks(name):
        block = samples
        if integrated:
            block = np.diff(samples, prepend=last) * recording.rate
            last = samples[-1:]
        block = np.where(np.isfinite(block), block, np.nan)
        if math.isnan(origin) and not np.isnan(block).all():
            origin = float(np.nanmean(block))
        yield block if math.isnan(origin) else block - origin


def _refuse_no_noise(recording: Recording, name: str) -> NoReturn:
    """A constant channel, or one that is too small."""
    known = [c[np.isfinite(c)] for c in _rates(recording, name)]
    spread = max(float(c.max()) for c in known if len(c)) - min(float(c.min()) for c in known if len(c))
    if 0 < spread < math.sqrt(_SMALLEST):
        raise DataQualityError(
            f"channel {name!r} has samples whose squares underflow (they are within {spread:.1g} "
            f"{recording[name].unit}): use a smaller unit, with samples near one"
        )
    raise DataQualityError(f"channel {name!r} is constant: no noise is resolved (resolution limit)")


def _averaged(chunks: Iterator[Array], block: int) -> Iterator[Array]:
    """Means over whole blocks of samples; NaN where one of them is missing."""
    rest = np.zeros(0)
    for chunk in chunks:
        joined = np.concatenate([rest, chunk]) if len(rest) else chunk
        whole = len(joined) // block * block
        rest = joined[whole:]
        yield joined[:whole] if block == 1 else joined[:whole].reshape(-1, block).mean(axis=1)
