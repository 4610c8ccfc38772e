# SPDX-License-Identifier: BSD-3-Clause
"""Findings about held samples: a sensor that renews its value less often than the log has rows.

Channels of one sensor renew their values at the same rows, those of several sensors each at their own. Channels are
therefore looked at together first, then those of one kind, then one by one: where several axes repeat in the same row,
the step of their values does not explain it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from allanite.lazy_dataclasses import dataclass
from allanite.recording.channel_names import for_shell
from allanite.recording.health.disturbance import moved
from allanite.recording.health.finding import Finding, Severity, finding, percent
from allanite.recording.health.renewal import Renewal, renewal_of
from allanite.recording.health.repeats import hold_factor, repeated
from allanite.recording.health.survey import ChannelSurvey

__all__ = ["Hold", "by_chance", "held_samples", "holds", "without_short_scales"]

#: Share of repeats from which a channel is looked at.
FEW = 0.01
#: Share of a group's fresh rows that each of its channels must have, but for neighbors equal by chance.
TOGETHER = 0.9
#: Holds within which differences of means do not scatter like those of noise.
SHORT = 4.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Hold:
    """How the values of one channel are held.

    Attributes
    ----------
    survey : ChannelSurvey
    factor : int
        How many times each value stands, the same all along; 1 where that varies.
    renewal : Renewal or None
        The even clock of the sensor, where there is one.
    share : float
        Samples that repeat the one before.
    """

    survey: ChannelSurvey
    factor: int
    renewal: Renewal | None
    share: float

    @property
    def ratio(self) -> float:
        """Values per row."""
        if self.renewal is not None:
            return self.renewal.ratio
        return 1.0 / self.factor if self.factor > 1 else 1.0 - self.share


def holds(surveys: Sequence[ChannelSurvey]) -> dict[str, Hold]:
    """The channels whose values are held, by name."""
    repeating = [
        s
        for s in surveys
        if not s.constant and not s.channel.kind.integrated and _repeats(s) > FEW * s.present
    ]
    by_name = {}
    for group in _together(repeating):
        chance = math.prod(by_chance(s) for s in group)
        renewal = None
        if chance < 0.5 and not any(map(moved, group)):  # motion changes how often neighbors are equal
            renewal = renewal_of(group[0].recording, [s.name for s in group], chance)
        for s in group:
            one = _hold(s, renewal)
            if one is not None:
                by_name[s.name] = one
    return by_name


def _hold(survey: ChannelSurvey, renewal: Renewal | None) -> Hold | None:
    factor = hold_factor(survey)
    if renewal is not None:
        slipped = abs(renewal.ratio * factor - 1.0) * survey.n_samples / factor
        exact = factor > 1 and slipped < 1.0
        share = 1.0 - renewal.fresh / max(renewal.rows, 1)
        return Hold(survey=survey, factor=factor if exact else 1, renewal=renewal, share=share)
    if factor > 1:
        return Hold(survey=survey, factor=factor, renewal=None, share=1.0 - 1.0 / factor)
    share = repeated(survey)
    return Hold(survey=survey, factor=1, renewal=None, share=share) if share > FEW else None


def _repeats(survey: ChannelSurvey) -> int:
    """Samples that equal the one before."""
    return int((np.arange(len(survey.equal_histogram)) - 1).clip(0) @ survey.equal_histogram)


def _together(surveys: Sequence[ChannelSurvey]) -> Iterator[list[ChannelSurvey]]:
    """Channels that are renewed at the same rows: all of them, those of one kind, or each alone."""
    if not surveys:
        return
    if _alike(surveys):
        yield list(surveys)
        return
    kinds = sorted({s.channel.kind for s in surveys})
    if len(kinds) > 1:
        for kind in kinds:
            yield from _together([s for s in surveys if s.channel.kind is kind])
    else:
        yield from ([s] for s in surveys)


def _alike(surveys: Sequence[ChannelSurvey]) -> bool:
    """True where no channel is renewed less often than all of them together, but for neighbors equal by chance."""
    if len(surveys) == 1:
        return True
    steps = [[np.diff(values) for _, values in s.probes] for s in surveys]
    fresh = [sum(int(np.count_nonzero(d != 0.0) - np.count_nonzero(np.isnan(d))) for d in s) for s in steps]
    joint = sum(
        int(np.count_nonzero(np.any([(d != 0.0) & ~np.isnan(d) for d in rows], axis=0)))
        for rows in zip(*steps, strict=True)
    )
    return all(
        alone >= TOGETHER * joint * (1.0 - by_chance(s)) for s, alone in zip(surveys, fresh, strict=True)
    )


def by_chance(survey: ChannelSurvey) -> float:
    """Share of neighboring values that are equal by the step in which they come.

    Of two Gaussian values of standard deviation s on steps of q it is q/(s sqrt(4 pi)). The values that differ give s:
    their mean square difference is 2 s^2/(1 - share).
    """
    step = survey.lattice.step
    if step == 0.0 or not survey.probes:
        return 0.0
    jump = np.concatenate([np.diff(values) for _, values in survey.probes])
    jump = jump[np.isfinite(jump) & (jump != 0.0)]
    if len(jump) == 0:
        return 1.0
    middle = float(np.median(np.abs(jump)))
    with np.errstate(over="ignore"):  # in steps: the squares of values near 1e-200 are 0
        square = float(np.mean((np.minimum(np.abs(jump), 5.0 * middle) / step) ** 2))
    share = 0.0
    for _ in range(8):
        share = min(1.0 / math.sqrt(max(2.0 * math.pi * square * (1.0 - share), 1e-9)), 0.95)
    return share


# -- findings ---------------------------------------------------------------------------------------------


def held_samples(held: Mapping[str, Hold]) -> Iterator[Finding]:
    """Each value logged several times, evenly or now and then (battery B7; class 1)."""
    kept = {h.renewal.channels if h.renewal else (h.factor, h.share) for h in held.values()}
    for hold in held.values():
        yield _finding(hold, several=len(kept) > 1)


def _finding(hold: Hold, several: bool) -> Finding:
    survey, rate = hold.survey, hold.survey.recording.rate
    together = hold.renewal.channels if hold.renewal else (survey.name,)
    chosen = f" --channels {for_shell(','.join(together))}" if several else ""
    advice = f"analyze each value once: --repair drop_repeats{chosen}; `characterize` does so itself"
    count = round(hold.share * survey.present)
    if hold.factor > 1:
        true_rate = rate / hold.factor
        text = f"every value appears {hold.factor} times: the true rate is rate/{hold.factor} = {true_rate:.6g} Hz"
        keep = f"keep one row in {hold.factor} and give the rate {true_rate:.6g} Hz{chosen}"
        advice = f"{keep}; `characterize` does so itself"
        count = survey.present
    elif hold.renewal is not None:
        text = (
            f"{percent(hold.share)} of the samples repeat the previous one: the sensor updates at "
            f"{_with_uncertainty(rate * hold.ratio, rate * hold.renewal.sd)}; the log runs at {rate:.6g} Hz"
        )
    else:
        text = (
            f"{percent(hold.share)} of the samples repeat the previous one, at no steady rate, and the "
            f"step of the values does not explain it: the log has about {rate * (1.0 - hold.share):.3g} "
            "values per second"
        )
        advice = (
            "log on the sensor's data-ready signal, or log its counter; values that repeat more often than others make "
            "N too large"
        )
    return finding(
        "held_samples", text, severity=Severity.WARNING, channel=survey.name, count=count, advice=advice
    )


def _with_uncertainty(rate: float, sd: float) -> str:
    """A rate to the place of the first digit of its standard uncertainty, if it has one."""
    if not sd > 0.0:
        return f"{rate:.9g} Hz"
    return f"{rate:.{max(-math.floor(math.log10(sd)), 0)}f} Hz (standard uncertainty {sd:.1g} Hz)"


def without_short_scales(survey: ChannelSurvey, held: Mapping[str, Hold]) -> ChannelSurvey:
    """The facts without the scales at which repeats, not noise, make the differences; a sensor that moved keeps all."""
    hold = held.get(survey.name)
    if hold is None or moved(survey):
        return survey
    scales = tuple(s for s in survey.scales if s.lag * hold.ratio >= SHORT)
    return replace(survey, scales=scales or survey.scales[-1:])
