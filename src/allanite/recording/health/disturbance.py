# SPDX-License-Identifier: BSD-3-Clause
"""Findings about rest: impulses, and stretches in which the signal moves more, or less, than elsewhere.

The test of rest. Differences of adjacent block means are stationary for white noise, flicker and a random walk of
the rate alike, whatever the record has drifted. Their mean square over a window of g differences is then
chi-square, scaled by a level that the quieter quarter of the windows gives. It has g degrees of freedom, or fewer
where a low-pass filter makes the differences alike; how many is read from the scatter of neighbouring windows. A
window stands out when it exceeds both four times the level and the chi-square quantile at which one clean
record in 10 000 has such a window at any scale (raised by 1.2 for the error of the level).

Noise that is louder for a part of the record makes windows stand out as well, at every scale and by what the noise
from sample to sample is louder there. Where that explains all of them the sensor rested, and its noise changed
(`constancy`).
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.distributions import normal_quantile
from allanite.recording.health.finding import Finding, Severity, finding, percent, plural, short
from allanite.recording.health.impulses import Impulses, Spikes
from allanite.recording.health.resolution import is_unresolved
from allanite.recording.health.survey import ChannelSurvey
from allanite.recording.health.tallies import BlockDifferences, Energies
from allanite.recording.records import OVERLOAD, merge_spans

__all__ = [
    "Unrest",
    "amplitude_drop",
    "excess_of",
    "freedom_of",
    "half_before_gap",
    "impulses",
    "impulses_of",
    "moved",
    "quiet_deviations",
    "rest",
    "unrest",
]

Samples = NDArray[np.float64]
Spans = NDArray[np.int64]

#: False alarms of the test of rest, per channel.
ALARM = 1e-4
#: Ratio of power below which a window does not stand out, however sure it is.
LIVELY = 4.0
#: Excess of the Allan variance, at some lag, that is worth a warning; and that makes it the motion's alone.
NOTICED, MOVED = 0.05, 300.0
#: Excess that is not worth a word: half a per cent of the deviation.
SLIGHT = 0.01
#: Bursts are left out if they raise the variance of the white noise by more than this, alone and in sum (the
#: share of N is half of it). No more of them: every gap costs the long lags windows.
ALONE, IN_SUM = 1e-3, 1e-2
#: Share of samples beyond which impulses are no impulses.
MANY = 1e-3
#: Share of a record beyond which stretches of less noise are no exception: then the noise changes.
RARE = 0.25
#: Blocks of a record in which the noise from sample to sample has its own level, and windows of each at the least.
BLOCKS, FEW = 64, 4
#: Ratios of power beyond which it is louder there, and beyond which it is no sensor's noise that became louder.
CLEARLY, LOUDEST = 1.5, 25.0
#: Differences below this share of a step are none: where most windows hold one code, the rounding of the numbers.
_DUST = 1e-3


# -- impulses ---------------------------------------------------------------------------------------------


def impulses(survey: ChannelSurvey, reach: float = 0.0) -> Iterator[Finding]:
    """Isolated samples far from their neighbours (battery B17); or too many of them to be isolated.

    An impulse of height A adds A^2/n to the variance of n samples of white noise, at every lag alike. Those within
    `reach` are the tails of noise that is not Gaussian: without them N would be too low.
    """
    outliers = impulses_of(survey)
    if survey.sigma <= _DUST * survey.lattice.step or is_unresolved(survey):
        return
    if outliers.crowded > 0.1 * survey.present or len(outliers.position) > max(MANY * survey.present, 3):
        restless = _standing_out(survey)
        if all(
            u.excess < NOTICED for u in restless
        ):  # otherwise the disturbance, or the change of the noise, says it
            yield _heavy_tails(survey, outliers)
        return
    far = np.abs(outliers.deviation) > reach
    if not far.all():
        yield _long_tails(survey, _of(outliers, ~far))
        outliers = _of(outliers, far)
    if len(outliers.position) == 0:
        return
    weight = 3.0 if survey.channel.kind.integrated else 1.0
    excess = weight * outliers.deviation**2 / (survey.present * survey.sigma**2)
    yield _spikes(survey, outliers, excess)


def impulses_of(survey: ChannelSurvey) -> Impulses:
    """The samples far from those around them, but for what noise that is louder there makes of its own."""
    outliers = survey.impulses
    louder = _louder_noise(survey.scales, _standing_out(survey))
    if louder is None or not len(outliers.position):
        return outliers
    at = np.minimum(outliers.position // survey.scales[0].window, len(louder) - 1)
    far = np.abs(outliers.deviation) > Spikes.factor(survey.n_samples) * outliers.sigma * np.sqrt(louder[at])
    return _of(outliers, far)


def _of(outliers: Impulses, some: NDArray[np.bool_]) -> Impulses:
    return replace(
        outliers,
        position=outliers.position[some],
        deviation=outliers.deviation[some],
        sigma=outliers.sigma[some],
    )


def _heavy_tails(survey: ChannelSurvey, outliers: Impulses) -> Finding:
    count = max(outliers.crowded, len(outliers.position))
    share = percent(count / survey.present)
    return _not_gaussian(
        survey, count, f"large steps are too frequent for isolated impulses in {share} of the samples"
    )


def _long_tails(survey: ChannelSurvey, outliers: Impulses) -> Finding:
    count = len(outliers.position)
    what = f"{plural(count, 'outlying sample', 'lie')} within the tails of the others"
    return _not_gaussian(survey, count, what)


def _not_gaussian(survey: ChannelSurvey, count: int, what: str) -> Finding:
    return finding(
        "heavy_tails",
        f"{what}: the noise is not Gaussian",
        severity=Severity.WARNING,
        channel=survey.name,
        count=count,
    )


def _spikes(survey: ChannelSurvey, outliers: Impulses, excess: Samples) -> Finding:
    bursts, sums = _bursts(outliers.position, excess)
    out = _largest(sums)
    k = int(np.argmax(np.abs(outliers.deviation)))
    deviation = float(outliers.deviation[k])
    largest = f"{deviation:+.3g}{survey.unit} ({short(abs(deviation) / float(outliers.sigma[k]))} sigma)"
    effect = f"{'it makes' if len(outliers.position) == 1 else 'they make'} N {_larger(excess)}"
    if len(out):
        count = int(np.diff(bursts[out], axis=1).sum())
        effect += f"; with {plural(count, 'sample')} excluded, N is {_larger(np.delete(sums, out))}"
    shown = out if len(out) else np.arange(len(bursts))
    return finding(
        "spikes",
        f"{_which(outliers.position, len(bursts))} "
        f"{largest} at {survey.seconds(int(outliers.position[k]))}; {effect}",
        severity=Severity.WARNING if len(out) else Severity.INFO,
        channel=survey.name,
        spans=bursts[shown],
        count=len(excess),
        weight=sums[shown],
        excludes=len(out) > 0,
    )


def _which(position: NDArray[np.int64], bursts: int) -> str:
    if position.tolist() == [0]:
        return "the first sample is far from those after it, by"
    count = plural(len(position), "sample")
    return f"{count} far from the surrounding samples, in {plural(bursts, 'burst')}, the largest"


def _bursts(position: NDArray[np.int64], excess: Samples) -> tuple[Spans, Samples]:
    """Impulses that follow closely, as spans, with the sum of what they add."""
    begins = np.concatenate(([0], np.flatnonzero(np.diff(position) > Spikes.APART) + 1))
    ends = np.append(begins[1:], len(position))
    spans = np.stack([position[begins], position[ends - 1] + 1], axis=1)
    return spans, np.add.reduceat(excess, begins)


def _largest(excess: Samples) -> NDArray[np.int64]:
    """Those that matter alone, and as many more of the largest as needed for the rest not to matter in sum."""
    order = np.argsort(excess)[::-1]
    left = np.cumsum(excess[order][::-1])[::-1]  # [k]: what remains without the k largest
    return order[(excess[order] > ALONE) | (left > IN_SUM)]


#: Relative change of N below which impulses leave it as it is.
_UNSEEN = 5e-5


def _larger(excess: Samples) -> str:
    """What impulses do to N: "3.2 % larger", "11.6 times as large", "unaffected"."""
    factor = math.sqrt(1.0 + float(excess.sum()))
    if factor - 1.0 < _UNSEEN:
        return "unaffected"
    return f"{percent(factor - 1.0)} larger" if factor < 2.0 else f"{short(factor)} times as large"


# -- rest -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class Unrest:
    """Windows of one scale that stand out.

    Attributes
    ----------
    scale : BlockDifferences
    ratio : ndarray, shape (n_windows,)
        Power over that of the quiet windows; NaN where samples are missing.
    bar : float
        Beyond this ratio a window stands out.
    out : ndarray of bool, shape (n_windows,)
        The windows that stand out.
    excess : float
        What they add to the Allan variance at this lag, in units of the quiet variance.
    """

    scale: BlockDifferences
    ratio: Samples
    bar: float
    out: NDArray[np.bool_]
    excess: float


def unrest(survey: ChannelSurvey) -> tuple[Unrest, ...]:
    """The scales at which windows stand out, the worst first; none where the noise itself is louder for a time."""
    restless = _standing_out(survey)
    if _louder_noise(survey.scales, restless) is not None:
        return ()
    return tuple(sorted(restless, key=lambda u: -u.excess))


def _standing_out(survey: ChannelSurvey) -> list[Unrest]:
    made = (_stand_out(scale, len(survey.scales), survey.lattice.step) for scale in survey.scales)
    return [u for u in made if u is not None]


def _louder_noise(scales: Sequence[BlockDifferences], restless: Sequence[Unrest]) -> Samples | None:
    """How loud the noise is where no window stands out of what it is from sample to sample there; else None."""
    louder = _loudness(scales[0]) if restless else None
    if louder is None or louder.max() > LOUDEST:
        return None
    explained = all(_beyond(u, louder, scales[0].window) < SLIGHT for u in restless)
    return louder if explained else None


def _beyond(u: Unrest, louder: Samples, window: int) -> float:
    """What windows add to the Allan variance beyond noise that is so much louder, as `Unrest.excess`."""
    middle = np.flatnonzero(u.out) * u.scale.window + u.scale.window // 2
    ratio = u.ratio[u.out] / louder[np.minimum(middle // window, len(louder) - 1)]
    windows = int(np.count_nonzero(~np.isnan(u.scale.energy)))
    return float((ratio[ratio > u.bar] - 1.0).sum()) / windows


def _loudness(shortest: BlockDifferences) -> Samples | None:
    """Power of the noise from sample to sample over that of the quiet parts, window by window.

    Each has the median of its block, which no burst shorter than half a block moves, or that of a louder neighbor: a
    change does not wait for the end of a block.
    """
    size = max(FEW, -(-len(shortest.energy) // BLOCKS))
    rows = len(shortest.energy) // size
    quiet = _quiet(shortest)
    if rows < 3 or quiet == 0.0:
        return None
    energy = shortest.energy[: rows * size].reshape(rows, size)
    level = np.array([np.median(e[~np.isnan(e)]) if not np.isnan(e).all() else 0.0 for e in energy])
    level /= quiet * _chi_square(freedom_of(shortest), 0.5)
    around = np.concatenate(([0.0], level, [0.0]))
    louder = np.maximum(np.maximum(around[:-2], around[2:]), level)
    return np.repeat(np.where(louder > CLEARLY, louder, 1.0), size)


def excess_of(survey: ChannelSurvey) -> float:
    """Largest excess of the Allan variance that restless windows cause, over the lags; 0.0 at rest."""
    restless = unrest(survey)
    return restless[0].excess if restless else 0.0


def moved(survey: ChannelSurvey) -> bool:
    """True when the sensor was not at rest."""
    return 1.0 + excess_of(survey) >= MOVED


def _stand_out(scale: BlockDifferences, n_scales: int, step: float) -> Unrest | None:
    there = ~np.isnan(scale.energy)
    windows = int(np.count_nonzero(there))
    quiet = _quiet(scale)
    if windows < Energies.LEAST or quiet <= (_DUST * step / scale.lag) ** 2:
        return None
    ratio = scale.energy / quiet
    bar = max(LIVELY, 1.2 * _chi_square(freedom_of(scale), 1.0 - ALARM / (windows * n_scales)))
    out = there & (np.nan_to_num(ratio) > bar)
    if not out.any():
        return None
    return Unrest(
        scale=scale, ratio=ratio, bar=bar, out=out, excess=float((ratio[out] - 1.0).sum()) / windows
    )


def _quiet(scale: BlockDifferences) -> float:
    """Power of the quiet windows: the lower quartile over that of chi-square."""
    energy = scale.energy[~np.isnan(scale.energy)]
    return float(np.quantile(energy, 0.25)) / _chi_square(freedom_of(scale), 0.25) if len(energy) else 0.0


def freedom_of(scale: BlockDifferences) -> float:
    """Degrees of freedom of a window's energy, from the ratios of neighbours.

    The logarithm of chi-square over nu has variance psi'(nu/2), about 1/(nu/2 - 1/2). Neighbouring windows share
    a disturbance, mostly, so their ratio does not see it.
    """
    energy = scale.energy[scale.energy > 0.0]  # NaN drop out
    if len(energy) < Energies.LEAST:
        return float(scale.details)
    scatter = 0.5 * (float(np.median(np.abs(np.diff(np.log(energy))))) / 0.6745) ** 2
    return min(float(scale.details), 1.0 + 2.0 / scatter) if scatter > 0.0 else float(scale.details)


def quiet_deviations(survey: ChannelSurvey) -> list[float]:
    """Allan deviation of the quiet windows at each scale, in the channel's unit."""
    return [math.sqrt(0.5 * _quiet(scale)) for scale in survey.scales]


def _chi_square(dof: float, p: float) -> float:
    """Quantile of chi-square over its degrees of freedom (Wilson-Hilferty; 2 % at 16 degrees and p = 1 - 1e-9)."""
    spread = 2.0 / (9.0 * dof)
    return max(1.0 - spread + normal_quantile(p) * math.sqrt(spread), 0.0) ** 3


def rest(survey: ChannelSurvey) -> Iterator[Finding]:
    """Stretches in which the signal moves more than in the quiet ones (class 14)."""
    restless = unrest(survey)
    if not restless or restless[0].excess < SLIGHT or (is_unresolved(survey) and not moved(survey)):
        return  # of noise below the step a rare code is all there is to see
    worst = restless[0]
    spans = np.concatenate([_windows(u, survey.n_samples)[0] for u in restless])
    shown, weight = _windows(worst, survey.n_samples)
    share = percent(_covered(spans) / survey.n_samples)
    lag = worst.scale.lag * survey.dt
    factor = math.sqrt(1.0 + worst.excess)
    fatal = 1.0 + worst.excess >= MOVED
    severity = Severity.WARNING if worst.excess >= NOTICED else Severity.INFO
    yield finding(
        "not_at_rest" if fatal else "disturbance",
        f"{share} of the record is disturbed; this makes the Allan deviation at {lag:.3g} s {short(factor)} times as "
        "large",
        severity=Severity.FATAL if fatal else severity,
        channel=survey.name,
        spans=spans,
        shown=shown,
        weight=weight,
    )


def _windows(u: Unrest, n_samples: int) -> tuple[Spans, Samples]:
    """Windows of a scale that stand out, neighbours joined, with their largest power."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], u.out, [False])).astype(np.int8))).reshape(-1, 2)
    weight = [float(np.nanmax(u.ratio[a:b])) for a, b in edges]
    return np.minimum(edges.astype(np.int64) * u.scale.window, n_samples), np.array(weight)


def _covered(spans: Spans) -> int:
    return int(np.diff(merge_spans(spans), axis=1).sum())


# -- less than usual --------------------------------------------------------------------------------------


def amplitude_drop(survey: ChannelSurvey) -> Iterator[Finding]:
    """Stretches whose noise, from sample to sample, has less than half its usual power."""
    if not survey.scales or excess_of(survey) >= NOTICED:
        return
    scale = survey.scales[0]
    join = max(1, 256 // scale.details)
    energy = scale.energy[: len(scale.energy) // join * join].reshape(-1, join).mean(axis=1)
    there = ~np.isnan(energy)
    windows = int(np.count_nonzero(there))
    if windows < Energies.LEAST or survey.lattice.step > 2.0 * survey.sigma:
        return
    usual = float(np.median(energy[there]))
    low = min(0.5, _chi_square(join * freedom_of(scale), ALARM / windows) / 1.2)
    with np.errstate(invalid="ignore"):
        out = there & (energy < low * usual)
    if out.any() and out.sum() <= RARE * windows:
        size = join * scale.window
        starts = np.flatnonzero(out) * size
        yield finding(
            "amplitude_drop",
            f"in {plural(int(out.sum()), 'window')} of {size * survey.dt:.3g} s the noise has less than half its usual "
            f"power, {percent(float(energy[out].min()) / usual)} at the least",
            severity=Severity.INFO,
            channel=survey.name,
            spans=np.stack([starts, starts + size], axis=1),
            weight=-energy[out],
        )


def half_before_gap(survey: ChannelSurvey) -> Iterator[Finding]:
    """Half the level, or half the noise, just before a gap (class 4)."""
    if survey.channel.kind.integrated or survey.sigma == 0.0:
        return
    gaps = survey.missing_spans[:1000, 0].tolist()
    steady = excess_of(survey) < NOTICED
    spans = [span for gap in gaps if (span := _half(survey, gap, steady)) is not None]
    end = _half(survey, survey.n_samples, False)
    spans += [end] if end is not None else []
    if spans:
        count = sum(b - a for a, b in spans)
        yield finding(
            "half_before_gap",
            f"just before {'a gap' if len(spans) == 1 else plural(len(spans), 'gap')}, {plural(count, 'sample')} "
            f"{'has' if count == 1 else 'have'} half the level or half the noise",
            severity=Severity.WARNING,
            channel=survey.name,
            spans=spans,
            excludes=True,
        )


def _half(survey: ChannelSurvey, gap: int, steady: bool) -> tuple[int, int] | None:
    before = survey.recording.raw(survey.name, max(gap - 2048, 0), gap)
    bad = np.flatnonzero(~(np.abs(before) < OVERLOAD))
    before = (before[bad[-1] + 1 :] if len(bad) else before) + survey.origin
    if len(before) < 64:
        return None
    count = _half_level(before, survey.sigma) or (_half_noise(before) if steady else 0)
    return (gap - count, gap) if count else None


def _half_level(before: Samples, sigma: float) -> int:
    """Samples at the end that lie at half the level; 0 if none do."""
    level = float(np.median(before))
    spread = max(float(np.median(np.abs(before - level))) * 1.4826, sigma)
    if abs(level) < 16.0 * spread:
        return 0
    nearer = np.abs(before - 0.5 * level) < 0.25 * abs(level)
    count = len(before) if nearer.all() else int(np.argmin(nearer[::-1]))
    if count == 0:
        return 0
    off = abs(float(before[-count:].mean()) - 0.5 * level)
    return count if off < 4.0 * spread / math.sqrt(count) + 0.02 * abs(level) else 0


def _half_noise(before: Samples) -> int:
    """512 if the last so many samples have a quarter of the power of those before; 0 if not.

    Over 512 and 1024 samples the ratio scatters by 8 %: 0.15 to 0.4 lies 7 standard errors from 1.
    """
    if len(before) < 1537:
        return 0
    power = np.diff(before) ** 2
    usual = float(power[-1536:-512].mean())
    return 512 if usual > 0.0 and 0.15 < float(power[-512:].mean()) / usual < 0.4 else 0
