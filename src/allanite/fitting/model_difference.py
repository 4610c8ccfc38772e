# SPDX-License-Identifier: BSD-3-Clause
"""Two noise models side by side: their parameters, and what each does to a navigator that nobody helps.

The drift after t seconds is the standard deviation of the angle (of the velocity) that the noise adds up to in t
seconds, the bias being known as the mean over r seconds of rest just before,

    e = x(t) - x(0) - (t/r) (x(0) - x(-r)),      x the running integral of the noise,

which exists for every term, flicker and random walk included: weights 1, -(1 + t/r), t/r annihilate a constant bias,
and the variance is the sum of w_i w_j S(t_i - t_j) over the generalised autocovariance S of the phase [1]. With r = t
it is sqrt(2) t times the Allan deviation at t.

The interval of the ratio comes from what is known of each fitted model. Its parameters scatter as their covariance
says, to first order in their logarithms. Below, the drift may be that of the terms that the record shows, alone;
above, that of all terms, those that it does not show at their upper limits, and of the other model where the record
cannot decide between two. Both sides join those of the other model in quadrature of the logarithms [2]. Where a record
is short for the time that is asked about, the interval is wide: what the noise does then is extrapolated. A model that
was stated, not fitted, has none.

References
----------
.. [1] C. Greenhall, W. Riley, "Uncertainty of stability variances based on finite differences", PTTI 2003.
.. [2] A. Donner, G. Zou, "Closed-form confidence intervals for functions of the normal mean and standard deviation",
   Stat. Methods Med. Res. 21 (2012) 347: limits of a difference from the limits of its parts.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import ClassVar

import numpy as np

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise import BY_LETTER, NoiseModel, Ramp, TermType
from allanite.noise.parameters import holder_of, with_factor
from allanite.quantities.earlier_documents import Entry, entries, members, quantity_entry
from allanite.quantities.quantity import Quantity, QuantityStatus
from allanite.quantities.result import Result

__all__ = ["ChannelDifference", "Difference", "DriftPair", "drift", "model_difference"]

#: After how long drifts are told [s].
SECONDS = (1.0, 100.0, 1000.0)
_NORMAL_95 = 1.959963984540054
_STEP = 1e-4


def drift(model: NoiseModel, seconds: float, rest: float | None = None) -> float:
    """Standard deviation of the angle after a time of dead reckoning.

    Parameters
    ----------
    model : NoiseModel
    seconds : float [s]
    rest : float, optional [s]
        Over which the bias was averaged before; as long as `seconds` by default.

    Returns
    -------
    float [rad, or m/s of an accelerometer]

    Raises
    ------
    InputError
        A time that is not positive.

    Examples
    --------
    >>> from allanite.noise import White
    >>> round(drift(NoiseModel.of(White(N=1e-4)), 100.0, rest=1e9), 6)  # N sqrt(t) where the bias is known
    0.001
    """
    for name, value in (("seconds", seconds), ("rest", seconds if rest is None else rest)):
        if not (math.isfinite(value) and value > 0):
            raise InputError(f"{name} must be a positive time, not {value!r}")
    return math.sqrt(sum(_variance(t, seconds, seconds if rest is None else rest) for t in model.terms))


def _variance(term: TermType, t: float, r: float) -> float:
    if r == t:
        return 2 * t**2 * float(term.avar(t))
    if isinstance(term, Ramp):
        return (term.R * t * (t + r) / 2) ** 2
    places = np.array([-r, 0.0, t])
    weights = np.array([t / r, -1.0 - t / r, 1.0])
    distances = np.abs(places[:, None] - places[None, :])
    return float(weights @ np.asarray(term.phase_covariance(distances, 1.0, "mean")) @ weights)


@dataclass(frozen=True, slots=True, kw_only=True)
class DriftPair(Result):
    """The drift of both models after a time.

    Attributes
    ----------
    seconds : float [s]
        Time of dead reckoning.
    first, second : float [rad or m/s]
        Standard deviation of each.
    ratio : Quantity
        Second over first with its 95 % interval; "given" where both were stated, and "not resolved" where one of them
        shows no term at all.
    """

    seconds: float
    first: float
    second: float
    ratio: Quantity


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelDifference(Result):
    """One sensor of both sources.

    Attributes
    ----------
    name, kind, unit : str
        Of the sensor; of two names both.
    names : tuple of str
        What it is called in each.
    first, second : NoiseModel
        Of each.
    drifts : tuple of DriftPair
        After each time.
    intervals : tuple of bool
        Which of the two models has intervals.
    """

    STATED: ClassVar[tuple[str, ...]] = ("intervals",)

    name: str
    kind: str
    unit: str
    names: tuple[str, str]
    first: NoiseModel
    second: NoiseModel
    drifts: tuple[DriftPair, ...]

    @property
    def intervals(self) -> tuple[bool, bool]:
        """Which of the two models has intervals."""
        return bool(_fitted(self.first)), bool(_fitted(self.second))


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference(Result):
    """Two sources of noise models, sensor by sensor.

    Attributes
    ----------
    names : tuple of str
        Of the sources.
    rest : float or None [s]
        Over which the bias was averaged before; None: as long as each time.
    channels : tuple of ChannelDifference
        Sensors that go together.
    unpaired : tuple of str
        Sensors that only one of them holds.
    """

    FORMAT: ClassVar[str] = "allanite-difference"
    VERSION: ClassVar[int] = 2

    names: tuple[str, str]
    rest: float | None
    channels: tuple[ChannelDifference, ...]
    unpaired: tuple[str, ...] = ()

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        """Version 1 held the ends of a ratio beside it, and which of two models had intervals."""
        if data.get("version") != 1:
            return data
        channels = [
            {**c, "drifts": [{**d, "ratio": _ratio_entry(d, c)} for d in entries(c.get("drifts"))]}
            for c in entries(data.get("channels"))
        ]
        return {**data, "version": 2, "channels": channels}


def _ratio_entry(drift: Entry, channel: Entry) -> dict[str, object]:
    ends = (drift.get("lower"), drift.get("upper"))
    entry = quantity_entry(drift.get("ratio"), ends, "1", resolved=ends[0] is not None)
    return entry if any(members(channel.get("intervals"))) else {**entry, "status": "given"}


def model_difference(
    first: Mapping[str, NoiseModel],
    second: Mapping[str, NoiseModel],
    *,
    names: tuple[str, str] = ("first", "second"),
    seconds: Sequence[float] = SECONDS,
    rest: float | None = None,
) -> Difference:
    """Put two sources of noise models side by side.

    Parameters
    ----------
    first, second : mapping of str to NoiseModel
        Models as `load_models` gives them. Sensors of one name are compared; a single one of its kind is compared with
        all of that kind in the other, as one data sheet describes three axes; equal numbers of a kind are compared in
        their order.
    names : tuple of str
        Names of the sources.
    seconds : sequence of float [s]
        Times after which to compare the drifts.
    rest : float, optional [s]
        Rest before, as for `drift`.

    Returns
    -------
    Difference

    Raises
    ------
    InputError
        No sensor in common, or several of a kind that do not go together.
    """
    pairs, left = _paired(first, second, names)
    channels = tuple(_channel(a, b, first[a], second[b], seconds, rest) for a, b in pairs)
    return Difference(names=names, rest=rest, channels=channels, unpaired=left)


def _paired(
    first: Mapping[str, NoiseModel], second: Mapping[str, NoiseModel], names: tuple[str, str]
) -> tuple[list[tuple[str, str]], tuple[str, ...]]:
    pairs = [(n, n) for n in first if n in second and first[n].kind == second[n].kind]
    for kind in dict.fromkeys(m.kind for m in first.values()):
        a = [n for n, m in first.items() if m.kind == kind and (n, n) not in pairs]
        b = [n for n, m in second.items() if m.kind == kind and (n, n) not in pairs]
        if not a or not b:
            continue
        if len(a) == 1:
            pairs += [(a[0], n) for n in b]
        elif len(b) == 1:
            pairs += [(n, b[0]) for n in a]
        elif len(a) == len(b):
            pairs += zip(a, b, strict=True)
        else:
            raise InputError(
                f"{len(a)} sensors of {kind} in {names[0]} ({', '.join(a)}) and {len(b)} in {names[1]} "
                f"({', '.join(b)}): which go together? Name them alike"
            )
    if not pairs:
        kinds = [", ".join(f"{n} ({m.kind})" for n, m in s.items()) for s in (first, second)]
        raise InputError(
            f"{names[0]} holds {kinds[0]}, and {names[1]} {kinds[1]}: no sensor of a kind in both"
        )
    taken = ({a for a, _ in pairs}, {b for _, b in pairs})
    left = [
        f"{n} in {name}"
        for source, used, name in zip((first, second), taken, names, strict=True)
        for n in source
        if n not in used
    ]
    return pairs, tuple(left)


def _channel(
    a: str, b: str, first: NoiseModel, second: NoiseModel, seconds: Sequence[float], rest: float | None
) -> ChannelDifference:
    return ChannelDifference(
        name=a if a == b else f"{a} / {b}",
        kind=first.kind,
        unit=first.unit,
        names=(a, b),
        first=first,
        second=second,
        drifts=tuple(_pair(first, second, t, rest) for t in seconds),
    )


def _pair(first: NoiseModel, second: NoiseModel, t: float, rest: float | None) -> DriftPair:
    a, b = drift(first, t, rest), drift(second, t, rest)
    return DriftPair(seconds=t, first=a, second=b, ratio=_ratio(first, second, t, rest, a, b))


def _ratio(
    first: NoiseModel, second: NoiseModel, t: float, rest: float | None, a: float, b: float
) -> Quantity:
    ratio, lower, upper = b / a if a > 0 else math.nan, math.nan, math.nan
    fitted = bool(_fitted(first) or _fitted(second))
    if a > 0 and b > 0 and fitted:
        (less_a, more_a), (less_b, more_b) = (_margins(m, t, rest) for m in (first, second))
        down, up = math.hypot(less_b, more_a), math.hypot(more_b, less_a)
        if math.isfinite(down + up):
            lower, upper = ratio * math.exp(-down), ratio * math.exp(up)
    status = QuantityStatus.NOT_RESOLVED if fitted else QuantityStatus.GIVEN
    known = QuantityStatus.RESOLVED if math.isfinite(upper) else status
    return Quantity(value=ratio, lower=lower, upper=upper, unit="1", status=known)


def _margins(model: NoiseModel, t: float, rest: float | None) -> tuple[float, float]:
    """How far the logarithm of the drift may lie below and above that of the model, at 95 %; zeros where stated."""
    if not _fitted(model):
        return 0.0, 0.0
    scatter = _NORMAL_95 * _log_sd(model, t, rest)
    best = drift(model, t, rest)
    ends = [_extremes(family, t, rest) for family in model.families]
    low, high = min(a for a, _ in ends), max(b for _, b in ends)
    less = math.inf if low <= 0 else math.log(best / low)
    return math.hypot(scatter, max(less, 0.0)), math.hypot(scatter, max(math.log(high / best), 0.0))


def _extremes(model: NoiseModel, t: float, rest: float | None) -> tuple[float, float]:
    """The drift of the terms that are shown alone, and that of all with the others at their limits."""
    limits = {e.symbol: e.upper for e in model.estimates if e.value is None and math.isfinite(e.upper)}
    hidden = [holder_of(symbol, model.terms) for symbol in limits]
    shown = tuple(term for term in model.terms if not any(term is h for h in hidden))
    letters = {symbol.replace("B_equiv", "B"): upper for symbol, upper in limits.items() if upper > 0}
    others = tuple(BY_LETTER[s](**{s: upper}) for s, upper in letters.items() if s in BY_LETTER)
    low, high = (drift(replace(model, terms=terms), t, rest) for terms in (shown, shown + others))
    return low, high


def _fitted(model: NoiseModel) -> Sequence[str]:
    """Symbols whose uncertainty is known."""
    return list(model.covariance.get("symbols", ()))


def _log_sd(model: NoiseModel, t: float, rest: float | None) -> float:
    """Standard deviation of the logarithm of the drift; zero of a model that was stated."""
    symbols = _fitted(model)
    if not symbols:
        return 0.0
    slopes = np.array([_slope(model, symbol, t, rest) for symbol in symbols])
    matrix = np.array(model.covariance["matrix"], dtype=np.float64)
    return math.sqrt(max(float(slopes @ matrix @ slopes), 0.0))


def _slope(model: NoiseModel, symbol: str, t: float, rest: float | None) -> float:
    """Of the logarithm of the drift over that of a parameter; zero where no term has it."""
    moved = [with_factor(model.terms, symbol, math.exp(step)) for step in (_STEP, -_STEP)]
    up, down = (math.log(max(drift(replace(model, terms=terms), t, rest), 1e-300)) for terms in moved)
    return (up - down) / (2 * _STEP)
