# SPDX-License-Identifier: BSD-3-Clause
"""An instrument that is none: one simulated process, continued from block to block for as long as one reads.

For trying a recording before the sensor is there, at the speed of a week in minutes. The samples are those of
`allanite.simulate` with the same seed, to rounding: the states of the process are carried from block to block, so
that no block leaves a trace and memory does not grow.
"""

from __future__ import annotations

import math
import os
import threading
import time
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from allanite.acquisition.instruments import Block, Identity, InstrumentTimeout, host_ns
from allanite.errors import InputError, InstrumentError
from allanite.filtering.simulation import simulate
from allanite.filtering.simulation.record import MarkovProcess, process_of
from allanite.noise import NoiseModel
from allanite.recording.records import Channel, Sampling
from allanite.study.model_file import load_models

__all__ = ["SimulatedInstrument"]

Array = NDArray[np.float64]

#: Samples of all channels made at once: 2 MiB of float64.
_LARGEST = 1 << 18
#: A week: the slowest states of flicker noise are made for a record of this length [s].
_WEEK = 7 * 86_400.0


class SimulatedInstrument:
    """Noise models as an `allanite.instruments.Instrument` of one or several channels.

    Parameters
    ----------
    model : NoiseModel or mapping of channel name to NoiseModel
        Channels are independent.
    rate : float [Hz]
        Sample rate.
    speed : float
        Times faster than time; infinity: as fast as one reads.
    seed : int
        Seed of the noise.
    sampling, unit
        As for `allanite.simulate`.
    duration : float [s]
        Length of record for which flicker noise is made; longer ones are flat at lags beyond it.
    gather : float [s]
        Least time that `read` waits, so that blocks are longer than a sample.

    Raises
    ------
    InputError
        What `allanite.simulate` refuses, or a speed that makes no sense.

    Notes
    -----
    The clock of the samples is that of the simulated sensor: `received_ns` of a block runs `speed` times as fast as
    the clock of the host, so that intervals, counter and rate agree. Nothing is lost by a reader that comes late: it
    gets the samples that are due, in blocks of bounded size. A process goes on through `stop` and `start`, `close` and
    `open`, less the samples in between.

    Examples
    --------
    >>> from allanite.noise import NoiseModel, White
    >>> sensor = SimulatedInstrument(NoiseModel.of(White(N=1e-4)), rate=100.0, speed=math.inf)
    >>> sensor.open().model
    'simulated'
    >>> sensor.start()
    >>> sensor.read(1.0).values.shape[1]
    1
    """

    def __init__(
        self,
        model: NoiseModel | Mapping[str, NoiseModel],
        *,
        rate: float,
        speed: float = 1.0,
        seed: int = 0,
        sampling: Sampling = "mean",
        unit: str | Mapping[str, str] | None = None,
        duration: float = _WEEK,
        gather: float = 0.1,
    ) -> None:
        if isinstance(speed, bool) or not isinstance(speed, (int, float)) or not speed > 0:
            raise InputError(f"speed must be a positive multiple of real time, not {speed!r}")
        # one sample: all that is asked for is checked there, and named
        one = simulate(model, rate=rate, duration=1 / rate, seed=seed, sampling=sampling, unit=unit)
        self._channels, self._rate = one.channels, one.rate
        self._speed, self._seed, self._gather = float(speed), seed, gather
        models = [model] if isinstance(model, NoiseModel) else list(model.values())
        streams = np.random.SeedSequence(seed).spawn(len(models))
        self._models = dict(zip(one.names, models, strict=True))
        self._sources = [
            _Source(
                process_of(m, 1 / self._rate, max(round(duration * rate), 1), sampling, 1 / c.scale), stream
            )
            for m, c, stream in zip(models, self._channels, streams, strict=True)
        ]
        self._largest = max(_LARGEST // len(models), 1)
        self._given = 0
        self._origin_ns = host_ns()
        self._began: float | None = None
        self._is_open = False
        self._interrupted = threading.Event()

    @classmethod
    def from_file(
        cls,
        path: str | os.PathLike[str],
        *,
        rate: float | None = None,
        speed: float = 1.0,
        seed: int = 0,
        unit: str | Mapping[str, str] | None = None,
    ) -> SimulatedInstrument:
        """The channels of a study.json, of a model file or of a data sheet, or of a model in words.

        Parameters
        ----------
        rate : float, optional [Hz]
            Sample rate; by default that of the studied recording.

        Raises
        ------
        InputError
            No such file, or no rate: only a study has one.
        FormatError
            Nothing that holds a model.
        """
        models, studied = load_models(path)
        chosen = studied if rate is None else rate
        if chosen is None:
            raise InputError(f"{path} does not state a rate: give one [Hz]")
        return cls(models, rate=chosen, speed=speed, seed=seed, unit=unit)

    @property
    def channels(self) -> tuple[Channel, ...]:
        """One for each model."""
        return self._channels

    @property
    def rate(self) -> float:
        """Samples per second of the simulated clock [Hz]."""
        return self._rate

    @property
    def settings(self) -> Mapping[str, object]:
        """Models, rate, speed and seed: enough to make the same samples again."""
        return {
            "rate": self._rate,
            "speed": self._speed if math.isfinite(self._speed) else None,
            "seed": self._seed,
            "models": {name: model.to_json() for name, model in self._models.items()},
        }

    @property
    def device(self) -> str:
        """None: any number of them may be used."""
        return ""

    # -- the instrument -----------------------------------------------------------------------------------

    def open(self) -> Identity:
        """Nothing to connect."""
        self._is_open = True
        return Identity(maker="allanite", model="simulated", serial=str(self._seed))

    def start(self) -> None:
        """Start or resume the clock of the sensor.

        Raises
        ------
        InstrumentError
            Not open.
        """
        if not self._is_open:
            raise InstrumentError("the simulated instrument is not open: call open() first")
        self._interrupted.clear()
        # as if it had run since the first start: samples given so far are those that were due
        self._began = time.monotonic() - self._given / (self._rate * self._speed)
        if not self._given:
            self._origin_ns = host_ns()

    def read(self, timeout: float) -> Block:
        """The samples that are due, waiting at most `timeout` seconds for the first of them.

        Raises
        ------
        InstrumentTimeout
            None is due by then.
        InstrumentError
            Not started.
        """
        if self._began is None:
            raise InstrumentError("the simulated instrument is not started: call start() first")
        count = self._due()
        per_second = self._rate * self._speed
        if math.isfinite(per_second) and count < per_second * self._gather:
            wanted = max(per_second * self._gather, 1.0)
            left = (self._given + wanted) / per_second - (time.monotonic() - self._began)
            self._interrupted.wait(max(min(left, timeout), 0.0))
            count = self._due()
        if count < 1:
            raise InstrumentTimeout(f"the simulated instrument: no sample was due within {timeout:g} s")
        return self._block(min(count, self._largest))

    def interrupt(self) -> None:
        """A `read` that waits ends at once."""
        self._interrupted.set()

    def stop(self) -> None:
        """Stop the clock of the sensor."""
        self._began = None

    def close(self) -> None:
        """Nothing to give back."""
        self._began, self._is_open = None, False

    # -- inside -------------------------------------------------------------------------------------------

    def _due(self) -> int:
        """Samples that the clock of the sensor has made and nobody has read."""
        if math.isinf(self._speed):
            return self._largest
        assert self._began is not None  # noqa: S101 - checked in `read`
        return math.floor((time.monotonic() - self._began) * self._rate * self._speed) - self._given

    def _block(self, count: int) -> Block:
        values = np.empty((count, len(self._sources)))
        for i, source in enumerate(self._sources):
            values[:, i] = source.samples(count)
        counter = np.arange(self._given, self._given + count, dtype=np.int64)
        self._given += count
        return Block(
            values=values,
            flags=np.zeros(count, dtype=np.uint8),
            counter=counter,
            received_ns=self._origin_ns + round(self._given * 1e9 / self._rate),
        )


class _Source:
    """One channel: its streams of random numbers and the states of its process, both carried on."""

    def __init__(self, process: MarkovProcess, stream: np.random.SeedSequence) -> None:
        self._process = process
        self._white, self._driving = (np.random.Generator(np.random.SFC64(s)) for s in stream.spawn(2))
        self._states = process.form.states
        starts = np.array([s.start for s in self._states])
        self._now: Array = starts * self._driving.standard_normal(len(starts))
        self._first = 0

    def samples(self, count: int) -> Array:
        """The next ones, in the unit of the channel."""
        white = self._process.form.white
        out: Array = np.zeros(count)
        if white > 0:
            out += math.sqrt(white) * self._white.standard_normal(count)
        if self._states:
            self._add_states(out)
        if self._process.known:
            t: Array = np.arange(self._first, self._first + count, dtype=np.float64) * self._process.dt
            for function in self._process.known:
                out += self._process.factor * function(t)
        self._first += count
        return out

    def _add_states(self, out: Array) -> None:
        """s_{k+1} = phi s_k + step w_k as a recursive filter that begins where the block before ended."""
        from scipy.signal import lfilter

        normals = self._driving.standard_normal((len(out), len(self._states)))
        for j, state in enumerate(self._states):
            later, _ = lfilter(
                [1.0],
                [1.0, -state.phi],
                state.step * normals[:, j],
                zi=[state.phi * self._now[j]],
            )
            out[0] += state.now * self._now[j]
            out[1:] += state.now * later[:-1]
            out += state.later * later
            self._now[j] = later[-1]
