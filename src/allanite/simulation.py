# SPDX-License-Identifier: BSD-3-Clause
"""Records of a sensor at rest, made from a noise model: exact in discrete time, reproducible by seed.

Every term becomes first-order Markov states on the sample grid, white noise, and a known function of time. Nothing
is approximated by a small step: the states are advanced by their exact transition, and where a sample is the mean
over its interval the mean is drawn from its exact distribution given the states at both ends.

Notes
-----
Let s be a Gauss-Markov state with variance sigma^2 and correlation time T, and a = Ts/T. Between two instants it is
a bridge, and its mean over the interval, given both ends, is

    w (s_k + s_{k+1}) + independent noise,    w = tanh(a/2)/a,
    variance of that noise = (2 sigma^2/a^2) (a - 2 tanh(a/2))                                            (1)

(the mean from E[s(t) | ends] = [sinh((Ts - t)/T) s_k + sinh(t/T) s_{k+1}]/sinh(a); the variance is that of the mean,
(2 sigma^2/a^2)(a - 1 + e^-a), less w^2 times that of s_k + s_{k+1}). For a random walk the limit is w = 1/2 and
K^2 Ts/12. Intervals are independent given the states, so all this noise merges with the white noise of the sample:
one normal number for each sample and one for each state.

Flicker noise is a sum of Gauss-Markov states whose correlation times are a ratio sqrt(10) apart. States that forget
everything within one sample share one state; states slower than the record share one random walk. The Allan
variance of interval means is then within 0.01 % of the floor for m to N/10, and within 0.5 % at the last, m = N/2.
1/f noise has no instantaneous value, so flicker is made as interval means under both sampling conventions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.errors import InputError
from allanite.noise import (
    Flicker,
    GaussMarkov,
    NoiseModel,
    Quantisation,
    Ramp,
    RandomWalk,
    Sinusoid,
    TermType,
    White,
)
from allanite.recording import ArrayColumn, Channel, Kind, Recording, Sampling, checked_rate

__all__ = ["simulate"]

Array = NDArray[np.float64]
Progress = Callable[[float], None]

#: Normal numbers made at once: 1 MiB stays in the second-level cache. Results do not depend on it.
NORMALS = 1 << 17
#: Beyond this a = Ts/T a state forgets: exp(-a) < 5e-5.
FORGETFUL = 10.0
#: A state with T beyond so many records is a random walk to the record: 0.1 % of the flicker floor at its end.
SLOW_RECORDS = 5.0

_UNITS = {"rate": "rad/s", "acceleration": "m/s²", "voltage": "V", "counts": "LSB"}
_RATE_OF: Mapping[str, str] = {Kind.ANGLE: Kind.RATE, Kind.VELOCITY: Kind.ACCELERATION}
_NAMES = {"rate": "gyro", "acceleration": "accelerometer", "voltage": "voltage", "counts": "counts"}


def simulate(
    model: NoiseModel | Mapping[str, NoiseModel],
    *,
    rate: float,
    duration: float,
    seed: int,
    sampling: Sampling = "mean",
    unit: str | Mapping[str, str] | None = None,
    name: str | None = None,
    start: int | None = None,
    progress: Progress | None = None,
) -> Recording:
    """A record of a sensor at rest whose noise is `model`.

    Parameters
    ----------
    model : NoiseModel or mapping of channel name to NoiseModel
        Coefficients in SI (in the channel's own unit where `unit` has no SI value). Channels are independent.
    rate : float [Hz]
    duration : float [s]
        The record holds round(duration * rate) samples.
    seed : int
        The same seed gives the same samples, whatever the block size; each channel draws its own streams from it.
    sampling : "mean" or "point"
        Means over each interval, or values at the instants k/rate. White noise has the same variance N^2 rate in
        both.
    unit : str or mapping of channel name to str, optional
        Unit the samples are written in; by default SI, by the model's kind. It must be a unit of that kind, for the
        coefficients are numbers of that kind. Two say nothing about it: a unit nobody knows, and the kind "rate" of
        a model that was not fitted, which is the default of `NoiseModel.of`: its coefficients are taken for
        accelerations or counts where `unit` is one of theirs.
    name : str, optional
        Channel name for a single model.
    start : int, optional [ns]
        UTC of the first sample.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    Recording
        Its history holds the models and the seed.

    Raises
    ------
    InputError
        A rate, duration, seed or unit that makes no sense, a unit of angle or velocity (a model describes rates), or
        a unit of another kind than the model's.

    Notes
    -----
    A random walk starts at zero, a ramp is R t, Gauss-Markov states start stationary. Streams are those of NumPy's
    SFC64; NumPy may change its normal generator between versions.

    Examples
    --------
    >>> from allanite.noise import NoiseModel, RandomWalk, White
    >>> record = simulate(NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-6)), rate=100.0, duration=60.0, seed=1)
    >>> record
    <Recording gyro: 6000 samples at 100 Hz, 60 s>
    """
    rate = checked_rate(rate)
    n_samples = _sample_count(rate, duration)
    models = model if isinstance(model, Mapping) else {name or _name(model): model}
    channels = tuple(_channel(key, value, unit, sampling) for key, value in models.items())
    advance = _counter(progress, n_samples * len(channels))
    columns = []
    for channel, one, stream in zip(channels, models.values(), _streams(seed, len(channels)), strict=True):
        process = _process(one, 1 / rate, n_samples, sampling).scaled(1 / channel.scale)
        columns.append(ArrayColumn(_samples(process, n_samples, stream, advance)))
    step = {
        "step": "simulate",
        "seed": int(seed),
        "sampling": sampling,
        "models": {key: value.to_json() for key, value in models.items()},
    }
    return Recording(
        channels=channels, columns=tuple(columns), rate=rate, start=start, history=(step,), source="simulated"
    )


# -- what was asked for -----------------------------------------------------------------------------------


def _sample_count(rate: float, duration: float) -> int:
    if isinstance(duration, bool) or not isinstance(duration, (int, float, np.integer, np.floating)):
        raise InputError(f"duration must be a number of seconds, not {duration!r}")
    if not (math.isfinite(duration) and duration * rate >= 0.5):
        raise InputError(f"duration must hold at least one sample; {duration!r} s at {rate:g} Hz does not")
    return round(duration * rate)


def _name(model: NoiseModel) -> str:
    return _NAMES.get(model.kind, "sensor") if isinstance(model, NoiseModel) else "sensor"


def _channel(
    name: str, model: NoiseModel, unit: str | Mapping[str, str] | None, sampling: Sampling
) -> Channel:
    if not isinstance(model, NoiseModel):
        raise InputError(
            f"channel {name!r}: NoiseModel.of(White(N=...)) makes the model that is needed, not {model!r}"
        )
    text = unit.get(name) if isinstance(unit, Mapping) else unit
    channel = Channel.of(
        name, _UNITS.get(model.kind, model.unit) if text is None else text, sampling=sampling
    )
    if channel.kind.integrated or not channel.kind.noise_bearing:
        raise InputError(
            f"channel {name!r}: a noise model describes a rate, an acceleration or a voltage; "
            f"{channel.unit!r} is a unit of {channel.kind.value}. Simulate the rate and integrate it"
        )
    if not _describes(model, channel.kind):
        raise InputError(
            f"channel {name!r}: the noise model is one of {model.kind}, {channel.unit!r} is a unit of "
            f"{channel.kind.value}: its coefficients would be written as if they were of {channel.kind.value}. "
            f"Give a unit of {model.kind}, or a model made for this one: "
            f"NoiseModel.of(..., kind={channel.kind.value!r})"
        )
    return channel


def _describes(model: NoiseModel, kind: Kind) -> bool:
    """The model's coefficients are numbers of this kind, as far as one can know."""
    own = _RATE_OF.get(model.kind, model.kind)
    silent = own == Kind.RATE and not model.estimates  # the default: nobody need have chosen it
    return own == kind or Kind.UNKNOWN in (own, kind) or (silent and kind in (Kind.ACCELERATION, Kind.COUNTS))


def _streams(seed: int, count: int) -> list[np.random.SeedSequence]:
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
        raise InputError(f"seed must be a whole number, not negative; got {seed!r}")
    return np.random.SeedSequence(int(seed)).spawn(count)


def _counter(progress: Progress | None, total: int) -> Callable[[int], None]:
    done = 0

    def advance(samples: int) -> None:
        nonlocal done
        done += samples
        if progress is not None:
            progress(done / total)

    return advance


# -- terms as processes on the sample grid ----------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class _State:
    """s_{k+1} = phi s_k + step w_k, s_0 with deviation `start`; sample k holds now s_k + later s_{k+1}."""

    phi: float
    step: float
    start: float
    now: float
    later: float

    def scaled(self, factor: float) -> _State:
        return replace(self, now=self.now * factor, later=self.later * factor)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Process:
    """A sum of Markov states, white noise (variance of one sample) and known functions of the time [s]."""

    states: tuple[_State, ...] = ()
    white: float = 0.0
    known: tuple[Callable[[Array], Array], ...] = ()
    factor: float = 1.0  # of the known functions
    dt: float

    def __add__(self, other: _Process) -> _Process:
        return replace(
            self,
            states=self.states + other.states,
            white=self.white + other.white,
            known=self.known + other.known,
        )

    def scaled(self, factor: float) -> _Process:
        states = tuple(s.scaled(factor) for s in self.states)
        return replace(self, states=states, white=self.white * factor**2, factor=self.factor * factor)


def _process(model: NoiseModel, dt: float, n_samples: int, sampling: Sampling) -> _Process:
    parts = (_term(term, dt, n_samples, sampling) for term in model.terms)
    return reduce(_Process.__add__, parts, _Process(dt=dt))


def _term(term: TermType, dt: float, n_samples: int, sampling: Sampling) -> _Process:
    match term:
        case White():
            return _Process(white=term.N**2 / dt, dt=dt)
        case Quantisation():  # the difference of white angle errors
            return _Process(
                states=(_State(phi=0.0, step=term.Q, start=term.Q, now=-1 / dt, later=1 / dt),), dt=dt
            )
        case RandomWalk():
            return _walk(term.K, dt, sampling)
        case GaussMarkov():
            return _gauss_markov(term, dt, sampling)
        case Flicker():
            return _flicker(term, dt, n_samples)
        case Ramp() | Sinusoid():
            return _Process(known=(_known(term, dt, sampling),), dt=dt)
    raise InputError(f"no simulation is known for the term {term!r}")


def _walk(K: float, dt: float, sampling: Sampling) -> _Process:
    step = K * math.sqrt(dt)
    if sampling == "point":
        return _Process(states=(_State(phi=1.0, step=step, start=0.0, now=1.0, later=0.0),), dt=dt)
    state = _State(phi=1.0, step=step, start=0.0, now=0.5, later=0.5)
    return _Process(states=(state,), white=K**2 * dt / 12, dt=dt)


def _gauss_markov(term: GaussMarkov, dt: float, sampling: Sampling) -> _Process:
    a = dt / term.T
    phi, step, sigma = math.exp(-a), term.sigma * math.sqrt(-math.expm1(-2 * a)), term.sigma
    if sampling == "point":
        return _Process(states=(_State(phi=phi, step=step, start=sigma, now=1.0, later=0.0),), dt=dt)
    weight, rest = _bridge(a)
    state = _State(phi=phi, step=step, start=sigma, now=weight, later=weight)
    return _Process(states=(state,), white=sigma**2 * rest, dt=dt)


def _bridge(a: float) -> tuple[float, float]:
    """Weight of the end points, and variance of the rest over sigma^2, of the mean of a Gauss-Markov state: eq. (1).

    tanh x = x/(1 + d) with the continued fraction d = x^2/(3 + x^2/(5 + ...)), so that x - tanh x = x d/(1 + d) keeps
    every digit however small x is.
    """
    x = a / 2
    if x > 1:
        return math.tanh(x) / a, (1 - math.tanh(x) / x) / x
    d = 0.0
    for odd in (17, 15, 13, 11, 9, 7, 5, 3):
        d = x * x / (odd + d)
    return 0.5 / (1 + d), 0.0 if x == 0 else d / (1 + d) / x


def _flicker(term: Flicker, dt: float, n_samples: int) -> _Process:
    longest = SLOW_RECORDS * dt * n_samples
    parts = term.gauss_markov_sum(dt / FORGETFUL**10, longest * FORGETFUL**10)
    middle = [g for g in parts if dt / FORGETFUL < g.T <= longest]
    fast = [_gauss_markov(g, dt, "mean") for g in parts if dt / FORGETFUL >= g.T]
    shared = math.sqrt(sum((p.states[0].now * p.states[0].start) ** 2 for p in fast))
    ends = _State(phi=0.0, step=shared, start=shared, now=1.0, later=1.0)
    slow = _walk(math.sqrt(sum(g.q**2 for g in parts if longest < g.T)), dt, "mean")
    quick = _Process(states=(ends,), white=sum(p.white for p in fast), dt=dt)
    return reduce(_Process.__add__, (_gauss_markov(g, dt, "mean") for g in middle), quick + slow)


def _known(term: Ramp | Sinusoid, dt: float, sampling: Sampling) -> Callable[[Array], Array]:
    """The term as a function of the sample instants t = k Ts; means are taken over [t, t + Ts]."""
    middle = dt / 2 if sampling == "mean" else 0.0
    if isinstance(term, Ramp):
        return lambda t: term.R * (t + middle)
    size = term.amplitude * (float(np.sinc(term.frequency * dt)) if sampling == "mean" else 1.0)
    return lambda t: size * np.sin(2 * np.pi * (term.frequency * (t + middle) % 1.0) + term.phase)


# -- samples ----------------------------------------------------------------------------------------------


def _samples(
    process: _Process, n_samples: int, stream: np.random.SeedSequence, advance: Callable[[int], None]
) -> Array:
    """Draw the process, block by block: the streams run on through the blocks, which therefore leave no trace."""
    white, driving = (np.random.Generator(np.random.SFC64(s)) for s in stream.spawn(2))
    phi, step, start, now, later = _columns(process.states)
    state = np.asarray(start * driving.standard_normal(len(start)), dtype=np.float64)
    rows = max(NORMALS // (len(process.states) + 1), 1)
    normals = np.empty((rows, len(process.states)))
    out = np.zeros(n_samples)
    for first in range(0, n_samples, rows):
        block = out[first : first + rows]
        if process.white > 0:
            white.standard_normal(out=block)
            block *= math.sqrt(process.white)
        if process.states:
            drawn = normals[: len(block)]
            driving.standard_normal(out=drawn)
            _kernels.markov_noise(drawn, phi, step, now, later, state, block)
        if process.known:
            t: Array = np.arange(first, first + len(block), dtype=np.float64)
            t *= process.dt
            for function in process.known:
                block += process.factor * function(t)
        advance(len(block))
    return out


def _columns(states: tuple[_State, ...]) -> tuple[Array, Array, Array, Array, Array]:
    table: Any = [[s.phi, s.step, s.start, s.now, s.later] for s in states] or np.zeros((0, 5))
    phi, step, start, now, later = np.array(table, dtype=np.float64).T.copy()
    return phi, step, start, now, later
