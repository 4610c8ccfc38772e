# SPDX-License-Identifier: BSD-3-Clause
"""Tails of the white noise: Gaussian, contaminated, or heavy otherwise; and what they do to N.

*Contaminated* noise is a mixture: each sample, independently of time, is drawn with probability e from a normal law
with k times the spread of the others. Its variance is 1 - e + e k^2 times that of the rest, its excess kurtosis

    g = 3 (1 - e + e k^4)/(1 - e + e k^2)^2 - 3.                                                         (1)

The verdict takes four tests of the samples about their local median. Each has the false-alarm probability `ALARM`.

1. Their kurtosis exceeds that of a normal law (Anscombe and Glynn). Rounding, clipping and a uniform law lower it.
2. The mixture, fitted by maximum likelihood, explains them better than Student's and Laplace's laws do (Vuong's test).
3. The outlying samples come in no clusters: bursts and vibration do.
4. They are as frequent in all parts of the record: noise that changes with time has the same law as a whole.

Excess kurtosis g of n white samples adds g/n to the relative variance of the Allan variance at every lag, fully
correlated between lags: the fourth cumulant enters the sum of squares of lag m with the weight 1/(n m) for each sample.
So it widens the interval of N^2 alone, whatever else is in the model.

References
----------
F. J. Anscombe, W. J. Glynn, "Distribution of the kurtosis statistic b2 for normal samples", Biometrika 70 (1983).
J. W. Tukey, "A survey of sampling from contaminated distributions", in: Contributions to Probability and Statistics
(1960).
Q. H. Vuong, "Likelihood ratio tests for model selection and non-nested hypotheses", Econometrica 57 (1989).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from enum import StrEnum

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import normal_quantile, student_quantile
from allanite.recording.health.finding import Finding, Severity, finding, percent
from allanite.recording.health.impulses import Spikes
from allanite.recording.health.survey import ChannelSurvey, lattice_of, probes
from allanite.recording.health.tallies import Extremes
from allanite.recording.records import Recording

__all__ = [
    "ALARM",
    "TailLaw",
    "Tails",
    "contaminated",
    "law_of",
    "law_of_survey",
    "reach_of_tails",
    "tails_of",
    "without_short_scales",
]

Samples = NDArray[np.float64]

#: False alarms of each test, per channel.
ALARM = 1e-4
#: Samples whose median is their local level.
LEVEL = 64
#: Samples that tell of tails.
FEWEST = 2000
#: Correlation of neighbors beyond which the noise is not white enough for independent samples.
WHITE = 0.2
#: Excess kurtosis that is worth a word: it makes the interval of N 5 % wider.
SLIGHT = 0.2
#: Contaminated samples, and their share, below which they are isolated spikes and above which they are half the noise.
COUNTED, RARE, COMMON = 30.0, 1.5e-3, 0.25
#: Ratio of spreads below which a mixture is told from no other law.
APART = 3.0
#: Step of the values, in deviations of the core, beyond which rounding decides what the law looks like.
COARSE = 1.5
#: Samples from one outlying sample to the next within which they are a cluster.
NEAR = 4
#: Parts of a record that are compared.
PARTS = 16


class TailLaw(StrEnum):
    """What the samples of the white noise follow.

    UNKNOWN
        Too few samples, no white noise, or steps too coarse: nothing is said.
    GAUSSIAN
        Nothing speaks against a normal law with its excess kurtosis of zero.
    CONTAMINATED
        The mixture of two normal laws, independent of time.
    HEAVY
        Heavy tails of another law.
    CLUSTERED
        Outlying samples in clusters, or more of them in some parts of the record.
    """

    UNKNOWN = "unknown"
    GAUSSIAN = "gaussian"
    CONTAMINATED = "contaminated"
    HEAVY = "heavy"
    CLUSTERED = "clustered"


@dataclass(frozen=True, slots=True, kw_only=True)
class Tails:
    """The law of the samples about their local level.

    Attributes
    ----------
    law : TailLaw
    samples : int
        Samples looked at.
    kurtosis : float
        Excess kurtosis: of the mixture by (1), else of the samples; 0 for GAUSSIAN and UNKNOWN.
    share, share_sd : float
        Of the contaminated samples, with its standard error; 0 but for CONTAMINATED.
    ratio, ratio_sd : float
        Of their spread to that of the others.
    core, core_sd : float
        Standard deviation of the others, in the unit of the samples, and its relative standard error.
    """

    law: TailLaw
    samples: int = 0
    kurtosis: float = 0.0
    share: float = 0.0
    share_sd: float = 0.0
    ratio: float = 1.0
    ratio_sd: float = 0.0
    core: float = 0.0
    core_sd: float = 0.0

    @property
    def excess(self) -> float:
        """By how much the contaminated samples raise N, as a share of N without them."""
        return math.sqrt(1.0 + self.share * (self.ratio**2 - 1.0)) - 1.0


def contaminated(survey: ChannelSurvey, tails: Tails) -> Iterator[Finding]:
    """A mixture of two normal laws in the white noise."""
    if tails.law is not TailLaw.CONTAMINATED:
        return
    yield finding(
        "contaminated",
        f"{percent(tails.share)} of the samples (standard error {percent(tails.share_sd)}), evenly "
        f"distributed over the record, scatter {tails.ratio:.2g} times as much as the others: N is "
        f"{percent(tails.excess)} larger with them "
        "than without",
        severity=Severity.WARNING,
        channel=survey.name,
        count=round(tails.share * survey.present),
    )


def tails_of(stretches: Sequence[Samples], step: float = 0.0) -> Tails:
    """The law of a channel's white noise.

    Parameters
    ----------
    stretches : sequence of ndarray
        Consecutive samples; NaN where missing.
    step : float
        In which the values come; 0.0 if in none.
    """
    samples = _rows(stretches)
    n = samples.size
    if n < FEWEST:
        return Tails(law=TailLaw.UNKNOWN, samples=n)
    rows = _about_level(samples)
    values = rows.ravel()
    if not np.median(np.abs(values)) > 0.0:
        return Tails(law=TailLaw.UNKNOWN, samples=n)
    spread = float(np.median(np.abs(values))) / 0.6745
    if step > COARSE * spread or abs(_neighbors(rows, spread)) > WHITE:
        return Tails(law=TailLaw.UNKNOWN, samples=n)
    scaled = values / spread  # the fourth power of a small number is zero
    excess = float(np.mean(scaled**4)) / float(np.mean(scaled**2)) ** 2 - 3.0
    if excess < SLIGHT or _kurtosis_deviate(excess, n) < _bar():
        return Tails(law=TailLaw.GAUSSIAN, samples=n)
    binned = _Binned.of(scaled)
    share, ratio, core = _mixture(binned)
    if not _scattered(rows, spread * core, share, ratio):
        return Tails(law=TailLaw.CLUSTERED, samples=n, kurtosis=excess)
    plausible = RARE <= share <= COMMON and share * n >= COUNTED and ratio >= APART
    if not plausible or not _explained(binned, share, ratio, core):
        return Tails(law=TailLaw.HEAVY, samples=n, kurtosis=excess)
    share_sd, ratio_sd, core_sd = _errors(binned, share, ratio, core)
    variance = 1.0 - share + share * ratio**2
    return Tails(
        law=TailLaw.CONTAMINATED,
        samples=n,
        kurtosis=3.0 * (1.0 - share + share * ratio**4) / variance**2 - 3.0,
        share=share,
        share_sd=share_sd,
        ratio=ratio,
        ratio_sd=ratio_sd,
        core=core * spread,
        core_sd=core_sd,
    )


def law_of_survey(survey: ChannelSurvey) -> Tails:
    """The law of the white noise of a channel that was surveyed."""
    if survey.channel.kind.integrated or survey.constant:
        return Tails(law=TailLaw.UNKNOWN)
    return tails_of([values for _, values in survey.probes], survey.lattice.step)


def reach_of_tails(survey: ChannelSurvey, law: Tails) -> float:
    """How far samples of heavy-tailed noise may lie from their level: beyond is one in a thousand records.

    That of Student's law, fitted to the samples without those that may be no part of the noise.

    Parameters
    ----------
    survey : ChannelSurvey
    law : Tails
        Of all samples.

    Returns
    -------
    float
        In the unit of the samples; 0.0 where the others have no heavy tails.
    """
    apart = survey.impulses.position
    if law.law is not TailLaw.HEAVY or not len(apart):
        return 0.0
    others = [_without(values, apart - first) for first, values in survey.probes]
    if tails_of(others, survey.lattice.step).law not in (TailLaw.HEAVY, TailLaw.CONTAMINATED):
        return 0.0
    rows = _about_level(_rows(others))
    spread = float(np.median(np.abs(rows))) / 0.6745
    _, freedom, scale = _student(_Binned.of(rows.ravel() / spread))
    tail = Spikes.ALARM / (2.0 * survey.present)
    return spread * math.sqrt(scale) * student_quantile(1.0 - tail, freedom)


def _without(values: Samples, places: NDArray[np.int64]) -> Samples:
    left = values.copy()
    left[places[(places >= 0) & (places < len(values))]] = np.nan
    return left


def without_short_scales(survey: ChannelSurvey, tails: Tails) -> ChannelSurvey:
    """The facts without the scales at which contaminated samples make windows stand out.

    The mean of m samples has 1/m of their excess kurtosis.
    """
    if tails.law is not TailLaw.CONTAMINATED:
        return survey
    scales = tuple(s for s in survey.scales if s.lag >= tails.kurtosis)
    return replace(survey, scales=scales or survey.scales[-1:])


def law_of(recording: Recording, name: str, stretches: Sequence[Samples] | None = None) -> Tails:
    """The law of the white noise of a channel, from the stretches that a survey keeps; they are read if not given."""
    if recording[name].kind.integrated:
        return Tails(law=TailLaw.UNKNOWN)
    stretches = probes(recording, name) if stretches is None else list(stretches)
    high, low = Extremes(+1), Extremes(-1)
    return tails_of(stretches, lattice_of(stretches, high.result(), low.result()).step)


def _bar() -> float:
    return normal_quantile(1.0 - ALARM)


# -- samples ----------------------------------------------------------------------------------------------


def _rows(stretches: Sequence[Samples]) -> Samples:
    """Rows of `LEVEL` consecutive samples, shape (n_rows, LEVEL); those with a missing sample are left out."""
    whole = [s[: len(s) // LEVEL * LEVEL].reshape(-1, LEVEL) for s in stretches]
    rows = np.concatenate(whole) if whole else np.zeros((0, LEVEL))
    return np.asarray(rows[np.isfinite(rows).all(axis=1)])


def _about_level(rows: Samples) -> Samples:
    """Samples less the level of their row: its mean, with outlying samples cut to three deviations from its median.

    Where none is cut, the level takes 1/LEVEL off the variance; it is put back.
    """
    about = np.asarray(rows - np.median(rows, axis=1, keepdims=True))
    reach = 3.0 * float(np.median(np.abs(about))) / 0.6745
    about -= np.clip(about, -reach, reach).mean(axis=1, keepdims=True)
    return np.asarray(about / math.sqrt(1.0 - 1.0 / LEVEL))


def _neighbors(rows: Samples, spread: float) -> float:
    """Correlation of neighbors, outlying samples cut to three deviations."""
    cut = np.clip(rows, -3.0 * spread, 3.0 * spread)
    return float(np.mean(cut[:, 1:] * cut[:, :-1]) / np.mean(cut**2))


def _kurtosis_deviate(excess: float, n: int) -> float:
    """Standard normal deviate of the kurtosis of n normal numbers (Anscombe and Glynn, equations 1 to 5)."""
    mean = -6.0 / (n + 1)
    variance = 24.0 * n * (n - 2) * (n - 3) / ((n + 1) ** 2 * (n + 3) * (n + 5))
    x = (excess - mean) / math.sqrt(variance)
    skew = 6.0 * (n * n - 5 * n + 2) / ((n + 7) * (n + 9))
    skew *= math.sqrt(6.0 * (n + 3) * (n + 5) / (n * (n - 2) * (n - 3)))
    a = 6.0 + 8.0 / skew * (2.0 / skew + math.sqrt(1.0 + 4.0 / skew**2))
    below = 1.0 + x * math.sqrt(2.0 / (a - 4.0))
    root = math.copysign(abs((1.0 - 2.0 / a) / below) ** (1.0 / 3.0), below)
    return (1.0 - 2.0 / (9.0 * a) - root) / math.sqrt(2.0 / (9.0 * a))


@dataclass(frozen=True, slots=True)
class _Binned:
    """Squares of samples in bins much narrower than their deviation: their mean, and how many there are."""

    square: Samples
    count: Samples

    @classmethod
    def of(cls, values: Samples) -> _Binned:
        size = np.abs(values)
        top = max(float(size.max()), 6.0)
        edges = np.concatenate(
            [np.linspace(0.0, 6.0, 301), 6.0 * np.exp(np.arange(0.01, math.log(top / 6.0) + 0.02, 0.01))]
        )
        place = np.searchsorted(edges, size, side="right")
        count = np.bincount(place).astype(np.float64)
        square = np.bincount(place, weights=size**2)
        there = count > 0
        return cls(square[there] / count[there], count[there])


# -- laws -------------------------------------------------------------------------------------------------


def _normal(square: Samples, sd: float) -> Samples:
    return np.asarray(np.exp(-0.5 * square / sd**2) / (sd * math.sqrt(2.0 * math.pi)))


def _density(square: Samples, share: float, ratio: float, core: float) -> Samples:
    return (1.0 - share) * _normal(square, core) + share * _normal(square, ratio * core)


def _mixture(binned: _Binned) -> tuple[float, float, float]:
    """Share, ratio and core of the mixture of largest likelihood, by expectation and maximization."""
    total = float(binned.count.sum())
    best = (-math.inf, (0.0, 1.0, 1.0))
    for share, ratio in ((0.03, 6.0), (0.2, 3.0)):
        core = 1.0
        for _ in range(300):
            wide = share * _normal(binned.square, ratio * core)
            both = wide + (1.0 - share) * _normal(binned.square, core)
            belongs = binned.count * wide / np.maximum(both, 1e-300)
            belongs = np.where(both > 1e-300, belongs, binned.count)
            number = float(belongs.sum())
            if not 0.0 < number < total:
                break
            rest = binned.count - belongs
            before = core
            core = math.sqrt(float(rest @ binned.square) / (total - number))
            ratio = math.sqrt(float(belongs @ binned.square) / number) / core
            moved = abs(number / total - share) + abs(core - before)
            share = number / total
            if moved < 1e-9:
                break
        log = float(binned.count @ np.log(np.maximum(_density(binned.square, share, ratio, core), 1e-300)))
        best = max(best, (log, (share, ratio, core)))
    return best[1]


def _explained(binned: _Binned, share: float, ratio: float, core: float) -> bool:
    """Vuong's test of the mixture against Student's and Laplace's laws."""
    mixture = np.log(np.maximum(_density(binned.square, share, ratio, core), 1e-300))
    total = float(binned.count.sum())
    for rival in (_student(binned)[0], _laplace(binned)):
        gain = mixture - rival
        mean = float(binned.count @ gain) / total
        sd = math.sqrt(max(float(binned.count @ (gain - mean) ** 2) / total, 1e-300))
        if mean * math.sqrt(total) / sd < _bar():
            return False
    return True


def _student(binned: _Binned) -> tuple[Samples, float, float]:
    """Student's law of largest likelihood, the freedom on a grid: logarithm of its density, freedom, squared scale."""
    best, law = -math.inf, (np.zeros_like(binned.square), 60.0, 1.0)
    total = float(binned.count.sum())
    for freedom in np.geomspace(1.0, 60.0, 24).tolist():
        scale = 1.0
        for _ in range(60):
            weight = (freedom + 1.0) / (freedom + binned.square / scale)
            scale = float(binned.count @ (weight * binned.square)) / total
        norm = math.lgamma(0.5 * (freedom + 1.0)) - math.lgamma(0.5 * freedom)
        norm -= 0.5 * math.log(freedom * math.pi * scale)
        trial = norm - 0.5 * (freedom + 1.0) * np.log1p(binned.square / (freedom * scale))
        log = float(binned.count @ trial)
        if log > best:
            best, law = log, (trial, freedom, scale)
    return law


def _laplace(binned: _Binned) -> Samples:
    size = np.sqrt(binned.square)
    scale = float(binned.count @ size) / float(binned.count.sum())
    return np.asarray(-size / scale - math.log(2.0 * scale))


def _errors(binned: _Binned, share: float, ratio: float, core: float) -> tuple[float, float, float]:
    """Standard errors of share and ratio, and the relative one of the core, from the observed information."""
    at = np.array([math.log(share / (1.0 - share)), math.log(ratio), math.log(core)])

    def log(p: Samples) -> float:
        e = 1.0 / (1.0 + math.exp(-p[0]))
        return float(
            binned.count @ np.log(_density(binned.square, e, math.exp(p[1]), math.exp(p[2])) + 1e-300)
        )

    matrix = _curvature(log, at)
    try:
        sd = np.sqrt(np.maximum(np.diag(np.linalg.inv(-matrix)), 0.0))
    except np.linalg.LinAlgError:
        return share, ratio, 1.0
    return float(sd[0]) * share * (1.0 - share), float(sd[1]) * ratio, float(sd[2])


def _curvature(function: Callable[[Samples], float], at: Samples, h: float = 1e-3) -> Samples:
    """Second derivatives by central differences, shape (k, k)."""
    k = len(at)
    out = np.zeros((k, k))
    step = h * np.eye(k)
    for i in range(k):
        for j in range(i + 1):
            signs = ((1, 1), (1, -1), (-1, 1), (-1, -1))
            total = sum(a * b * function(at + a * step[i] + b * step[j]) for a, b in signs)
            out[i, j] = out[j, i] = total / (4.0 * h * h)
    return out


# -- time -------------------------------------------------------------------------------------------------


def _scattered(rows: Samples, core: float, share: float, ratio: float) -> bool:
    """True where outlying samples come independently of one another and as often in all parts of the record."""
    out = np.abs(rows) > _bound(share, ratio) * core
    rate = float(out.mean())
    if rate == 0.0:
        return True
    pairs = sum(int(np.count_nonzero(out[:, k:] & out[:, :-k])) for k in range(1, NEAR + 1))
    expected = rate**2 * sum(len(rows) * (LEVEL - k) for k in range(1, NEAR + 1))
    if pairs > expected + _bar() * math.sqrt(expected) + 6.0:
        return False
    parts = np.array([p.sum() for p in np.array_split(out.sum(axis=1), PARTS)], dtype=np.float64)
    there = np.array([len(p) for p in np.array_split(rows, PARTS)]) * LEVEL * rate
    statistic = float((((parts - there) ** 2) / np.maximum(there * (1.0 - rate), 1e-300)).sum())
    dof = PARTS - 1
    spread = 2.0 / (9.0 * dof)  # Wilson and Hilferty
    return statistic < dof * (1.0 - spread + (_bar() + 0.3) * math.sqrt(spread)) ** 3


def _bound(share: float, ratio: float) -> float:
    """Distance, in deviations of the core, from which a sample is more likely one of the others."""
    if ratio <= 1.0 or not 0.0 < share < 1.0:
        return 4.0
    gain = 2.0 * math.log(ratio * (1.0 - share) / share) / (1.0 - ratio**-2)
    return math.sqrt(max(gain, 4.0))
