# SPDX-License-Identifier: BSD-3-Clause
"""Records of a sensor, made from a noise model and a motion: exact in discrete time, reproducible by seed.

Every term becomes first-order Markov states on the sample grid, white noise, and a known function of time. Nothing
is approximated by a small step: the states are advanced by their exact transition, and where a sample is the mean
over its interval the mean is drawn from its exact distribution given the states at both ends.

The states are those of `allanite.noise.markov`. Flicker noise is a sum of Gauss-Markov states whose correlation times
are a ratio sqrt(10) apart. 1/f noise has no instantaneous value, so flicker is made as interval means under both
sampling conventions.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite import _kernels
from allanite.errors import InputError
from allanite.filtering.kalman.filtering import MOST_SEGMENT_STATES, STEPS
from allanite.filtering.kalman.steady import riccati_steps
from allanite.filtering.simulation.motion import Motion
from allanite.filtering.simulation.signal import PerChannel, Signal, SimulatedEffects, Temperature
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, Ramp, Sinusoid
from allanite.noise.markov import MarkovForm, MarkovState
from allanite.recording.checked_samples import checked_rate
from allanite.recording.records import ArrayColumn, Channel, Kind, Recording, Sampling

__all__ = [
    "MOTION_STREAM",
    "THERMOMETER_STREAM",
    "MarkovProcess",
    "checked_seed",
    "process_of",
    "readings_of",
    "simulate",
    "stream_of",
]

Array = NDArray[np.float64]
Progress = Callable[[float], None]

#: Normal numbers made at once: 1 MiB stays in the second-level cache. Results do not depend on it.
NORMALS = 1 << 17
#: Samples and states (flicker has more) from which on noise is drawn through its innovations: less than a fifth of the
#: time. Shorter records keep the samples that their seeds have always had.
LONG, MANY_STATES = 1 << 20, 5
#: Keys of the random streams of the motion and of the thermometer, far from those of the channels (0, 1, ...).
MOTION_STREAM, THERMOMETER_STREAM = 1 << 30, 1 << 29
#: What a bench multimeter writes for an overload.
OVERLOAD_WORD = 1e38
#: Of the correlation times of the states that make flicker: their Allan variance is within 0.01 % of the floor.
FLICKER_RATIO = math.sqrt(10)

_UNITS = {"rate": "rad/s", "acceleration": "m/s²", "voltage": "V", "counts": "LSB"}
_NAMES = {"rate": "gyro", "acceleration": "accelerometer", "voltage": "voltage", "counts": "counts"}


def simulate(
    model: NoiseModel | Mapping[str, NoiseModel],
    *,
    rate: float,
    duration: float,
    seed: int | np.random.Generator,
    sampling: Sampling = "mean",
    unit: str | Mapping[str, str] | None = None,
    name: str | None = None,
    start: int | None = None,
    motion: Motion | None = None,
    latitude: float | None = None,
    scale_error: PerChannel = 0.0,
    turn_on_bias: PerChannel = 0.0,
    warm_up: tuple[float, float] | None = None,
    temperature: Temperature | None = None,
    progress: Progress | None = None,
) -> Recording:
    """A record of a sensor whose noise is `model`, at rest or in motion.

    measured = (1 + scale_error) (Earth rate on the axis + rotation) + bias, warm-up, temperature + noise, then the
    full scale of the converter.

    Parameters
    ----------
    model : NoiseModel or mapping of channel name to NoiseModel
        Coefficients in SI (in the channel's own unit where `unit` has no SI value). Channels are independent.
    rate : float [Hz]
        Sample rate.
    duration : float [s]
        Length of the record, which has round(duration * rate) samples.
    seed : int or Generator
        The same seed gives the same samples, whatever the block size; each channel draws its own streams from it. A
        generator of NumPy gives its next integer as the seed, which the history of the record states.
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
    motion : Motion, optional
        Where the sensitive axes point, and what turning them brings: `Motion.reversals`, `positions`, `rotation`,
        `still`. It needs channels that are rates, and with several of them `Motion.axes`.
    latitude : float, optional [rad]
        Adds the rotation of the Earth; without it there is none. Needs a motion, for the heading.
    scale_error : float or mapping of channel name to float
        Relative error of the scale factor.
    turn_on_bias : float or mapping of channel name to float [rad/s]
        Bias of the power-on.
    warm_up : (float, float), optional [rad/s], [s]
        Adds amplitude exp(-t/time constant), t since the first sample, to every channel.
    temperature : Temperature, optional
        Adds its bias to every channel, and its readings as a channel of their own.
    progress : callable, optional
        Called with the fraction done.

    Returns
    -------
    Recording
        Recording; its history contains the models, the seed and all other settings, and under "motion" the truth: the
        turns (start, stop [s], angle [rad]), the positions (start, stop [s], true and nominal heading [rad], of the
        table), missed turns, knocks, and the parameters of the motion.

    Raises
    ------
    InputError
        A rate, duration, seed or unit that makes no sense, a unit of angle or velocity (a model describes rates), or
        a unit of another kind than the model's.

    Notes
    -----
    A random walk starts at zero, a ramp is R t, Gauss-Markov states start stationary. Streams are those of NumPy's
    SFC64; NumPy may change its normal generator between versions. The motion draws from a stream of its own: the
    noise of a seed is the same with and without it. A record of 2^20 samples or more with flicker is drawn through its
    innovations, one normal number a sample, from the same distribution; its samples are other ones than those that the
    states would give, and depend in their last digits on the linear algebra of NumPy.

    Examples
    --------
    >>> from allanite.noise import NoiseModel, RandomWalk, White
    >>> record = simulate(NoiseModel.of(White(N=1e-4), RandomWalk(K=1e-6)), rate=100.0, duration=60.0, seed=1)
    >>> record
    <Recording gyro: 6000 samples at 100 Hz, 60 s>
    """
    rate, seed = checked_rate(rate), checked_seed(seed)
    n_samples = _sample_count(rate, duration)
    models = model if isinstance(model, Mapping) else {name or _name(model): model}
    channels = tuple(_channel(key, value, unit, sampling) for key, value in models.items())
    effects = SimulatedEffects(
        motion=motion,
        latitude=latitude,
        scale_error=scale_error,
        turn_on_bias=turn_on_bias,
        warm_up=warm_up,
        temperature=temperature,
    )
    streams = np.random.SeedSequence(seed).spawn(len(channels))
    course = None if motion is None else motion.draw(n_samples / rate, stream_of(seed, MOTION_STREAM))
    advance = _counter(progress, n_samples * len(channels))
    columns = []
    for channel, one, stream in zip(channels, models.values(), streams, strict=True):
        process = process_of(one, 1 / rate, n_samples, sampling, 1 / channel.scale)
        if not effects.empty:
            process = replace(process, signal=effects.signal(channel, len(channels), course, 1 / rate))
            process = replace(process, limit=_limit(motion, channel))
        columns.append(ArrayColumn(_samples(process, n_samples, stream, advance)))
    step = {
        "step": "simulate",
        "seed": seed,
        "sampling": sampling,
        "models": {key: value.to_json() for key, value in models.items()},
        **effects.to_json(course),
    }
    if temperature is not None and temperature.channel is not None:
        channels += (Channel.of(temperature.channel, "°C", sampling=sampling),)
        readings = readings_of(
            temperature, n_samples, 1 / rate, sampling, stream_of(seed, THERMOMETER_STREAM)
        )
        columns.append(ArrayColumn(readings))
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
    silent = model.kind == Kind.RATE and not model.estimates  # the default: nobody need have chosen it
    return (
        model.kind == kind
        or Kind.UNKNOWN in (model.kind, kind)
        or (silent and kind in (Kind.ACCELERATION, Kind.COUNTS))
    )


def stream_of(seed: int, key: int) -> np.random.SeedSequence:
    """The random stream of a seed that `key` names."""
    return np.random.SeedSequence(seed, spawn_key=(key,))


def checked_seed(seed: object) -> int:
    """A seed as an integer; that of a generator is the next one that it draws.

    Raises
    ------
    InputError
        Not a seed.
    """
    if isinstance(seed, np.random.Generator):
        return int(seed.integers(1 << 63))
    if isinstance(seed, bool) or not isinstance(seed, (int, np.integer)) or seed < 0:
        raise InputError(
            f"seed must be a whole number, not negative, or a numpy.random.Generator; got {seed!r}"
        )
    return int(seed)


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
class MarkovProcess:
    """The Markov form of a model, and known functions of the time [s] and a signal, both times a factor."""

    form: MarkovForm
    known: tuple[Callable[[Array], Array], ...]
    factor: float
    dt: float
    signal: Signal | None = None
    limit: Callable[[Array], None] | None = None


def process_of(
    model: NoiseModel, dt: float, n_samples: int, sampling: Sampling, factor: float
) -> MarkovProcess:
    form, known = MarkovForm(), []
    for term in model.terms:
        if isinstance(term, (Ramp, Sinusoid)):
            known.append(_known(term, dt, sampling))
        else:
            form = form + term.markov(dt, sampling=sampling, record=dt * n_samples, ratio=FLICKER_RATIO)
    return MarkovProcess(form=form.scaled(factor), known=tuple(known), factor=factor, dt=dt)


def _known(term: Ramp | Sinusoid, dt: float, sampling: Sampling) -> Callable[[Array], Array]:
    """The term as a function of the sample instants t = k Ts; means are taken over [t, t + Ts]."""
    middle = dt / 2 if sampling == "mean" else 0.0
    if isinstance(term, Ramp):
        return lambda t: term.R * (t + middle)
    size = term.amplitude * (float(np.sinc(term.frequency * dt)) if sampling == "mean" else 1.0)
    return lambda t: size * np.sin(2 * np.pi * (term.frequency * (t + middle) % 1.0) + term.phase)


# -- samples ----------------------------------------------------------------------------------------------


class _StateNoise:
    """The process from its states: one normal number a sample for each, and one for the white noise."""

    def __init__(self, form: MarkovForm, stream: np.random.SeedSequence) -> None:
        self._white, self._driving = (np.random.Generator(np.random.SFC64(s)) for s in stream.spawn(2))
        self._sd = math.sqrt(form.white)
        self._phi, self._step, start, self._now, self._later = _columns(form.states)
        self._state = np.asarray(start * self._driving.standard_normal(len(start)), dtype=np.float64)
        self.rows = max(NORMALS // (len(form.states) + 1), 1)
        self._normals = np.empty((self.rows, len(form.states)))

    def fill(self, block: Array) -> None:
        """The next samples, in place of zeros."""
        if self._sd > 0:
            self._white.standard_normal(out=block)
            block *= self._sd
        if self._normals.shape[1]:
            drawn = self._normals[: len(block)]
            self._driving.standard_normal(out=drawn)
            _kernels.markov_noise(drawn, self._phi, self._step, self._now, self._later, self._state, block)


class _InnovationNoise:
    """The same process from its innovations: one normal number a sample, whatever the number of states.

    A sample is what the filter of the process predicts from those before it, and an innovation of the variance that the
    filter states for it [1].

    References
    ----------
    .. [1] J. Durbin, S. J. Koopman, "Time Series Analysis by State Space Methods", 2nd ed., 2012, section 4.4.5.
    """

    rows = 1 << 16

    def __init__(self, form: MarkovForm, stream: np.random.SeedSequence) -> None:
        self._normals = np.random.Generator(np.random.SFC64(stream.spawn(1)[0]))
        self._space = form.state_space()
        self._steps = riccati_steps(self._space, STEPS)
        self._state, self._covariance = np.zeros(self._space.size), self._space.initial.copy()

    def fill(self, block: Array) -> None:
        """The next samples."""
        self._normals.standard_normal(out=block)
        space = self._space
        _kernels.kalman_draw(
            space.transition,
            space.process,
            space.output,
            space.noise,
            *self._steps,
            self._state,
            self._covariance,
            block,
        )


def _source(
    form: MarkovForm, n_samples: int, stream: np.random.SeedSequence
) -> _StateNoise | _InnovationNoise:
    many = MANY_STATES <= len(form.states) < MOST_SEGMENT_STATES
    by_innovations = many and n_samples >= LONG and form.white > 0
    return (_InnovationNoise if by_innovations else _StateNoise)(form, stream)


def _samples(
    process: MarkovProcess, n_samples: int, stream: np.random.SeedSequence, advance: Callable[[int], None]
) -> Array:
    """Draw the process, block by block: the streams run on through the blocks, which therefore leave no trace."""
    source = _source(process.form, n_samples, stream)
    out = np.zeros(n_samples)
    for first in range(0, n_samples, source.rows):
        block = out[first : first + source.rows]
        source.fill(block)
        if process.known:
            t: Array = np.arange(first, first + len(block), dtype=np.float64)
            t *= process.dt
            for function in process.known:
                block += process.factor * function(t)
        if process.signal is not None:
            block += process.factor * process.signal.samples(first, len(block))
        if process.limit is not None:
            process.limit(block)
        advance(len(block))
    return out


def _limit(motion: Motion | None, channel: Channel) -> Callable[[Array], None] | None:
    """What the converter does to samples, in place."""
    if motion is None or motion.full_scale is None:
        return None
    full = abs(motion.full_scale / channel.scale)
    written = {"clip": full, "nan": math.nan, "1e38": OVERLOAD_WORD}[motion.overload]

    def limit(block: Array) -> None:
        over = np.abs(block) > full
        block[over] = np.copysign(written, block[over])

    return limit


def readings_of(
    temperature: Temperature, n_samples: int, dt: float, sampling: Sampling, stream: np.random.SeedSequence
) -> Array:
    """Of the thermometer [°C]."""
    out = temperature.noise * np.random.Generator(np.random.SFC64(stream)).standard_normal(n_samples)
    for first in range(0, n_samples, NORMALS):
        block = out[first : first + NORMALS]
        t: Array = np.arange(first, first + len(block), dtype=np.float64) * dt
        block += temperature.over(t, dt if sampling == "mean" else 0.0)
    return out


def _columns(states: tuple[MarkovState, ...]) -> tuple[Array, Array, Array, Array, Array]:
    table: Any = [[s.phi, s.step, s.start, s.now, s.later] for s in states] or np.zeros((0, 5))
    phi, step, start, now, later = np.array(table, dtype=np.float64).T.copy()
    return phi, step, start, now, later
