# SPDX-License-Identifier: BSD-3-Clause
"""One channel of a recording as a filter sees it: its samples in SI, and the states of its noise model."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.noise import SIGMA_PER_B, Flicker, GaussMarkov, NoiseModel, Quantisation, StateSpace
from allanite.recording.records import OVERLOAD, Channel, Kind, Recording, Sampling

__all__ = ["ChannelSpace", "FlickerForm", "SampleSource", "channel_space", "chosen", "with_flicker"]

Array = NDArray[np.float64]
FlickerForm = Literal["sum", "single"]

LEVEL = "level"


# -- samples ---------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class SampleSource:
    """Samples of one channel in SI, by position; angles as the rates between them.

    Attributes
    ----------
    recording : Recording
    channel : Channel
    """

    recording: Recording
    channel: Channel

    @property
    def rows(self) -> int:
        """Number of samples; one less than there are angles."""
        return max(self.recording.n_samples - self.channel.kind.integrated, 0)

    @property
    def sampling(self) -> Sampling:
        """Rates between angles are means over their interval."""
        return "mean" if self.channel.kind.integrated else self.channel.sampling

    @property
    def kind(self) -> Kind:
        """Kind of the samples in SI."""
        return self.channel.kind.rate

    @property
    def origin(self) -> float:
        """What `read` leaves out of each sample: integers far from zero keep their digits. 0.0 for all others."""
        if self.channel.kind.integrated:
            return 0.0
        return self.recording.origin(self.channel.name) * self.channel.scale

    def read(self, start: int, stop: int) -> Array:
        """Samples [start, stop) less `origin`, NaN where missing."""
        name, integrated = self.channel.name, self.channel.kind.integrated
        block = self.recording.raw(name, start, stop + integrated)
        with np.errstate(invalid="ignore"):
            if not (block.size and -OVERLOAD < block.min() and block.max() < OVERLOAD):  # NaN is neither
                block = np.where(np.abs(block) < OVERLOAD, block, np.nan)
        if integrated:
            return np.diff(block) * (self.channel.scale * self.recording.rate)
        return block * self.channel.scale


def chosen(
    recording: Recording, model: NoiseModel | Mapping[str, NoiseModel], channel: str | None
) -> tuple[Channel, NoiseModel]:
    """The channel that is meant, and its model.

    Raises
    ------
    InputError
        More than one channel could be meant, there is no model for it, or it is one of another kind of sensor.
    """
    named = model if isinstance(model, Mapping) else None
    if channel is None:
        bearing = [c.name for c in recording.channels if c.kind.noise_bearing]
        fitting = [c for c in bearing if named is None or c in named] or bearing
        if len(fitting) != 1:
            raise InputError(
                f"name the channel to filter with channel=; there are: {', '.join(fitting) or 'none'}"
            )
        channel = fitting[0]
    facts = recording[channel]
    if not facts.kind.noise_bearing:
        raise InputError(
            f"channel {channel!r} is one of {facts.kind.value}: it has no noise model and no filter"
        )
    if named is None:
        one = model
    elif channel in named:
        one = named[channel]
    elif len(named) == 1 and len(recording.channels) == 1:
        one = next(iter(named.values()))
    else:
        raise InputError(
            f"no model for channel {channel!r}; there are models for: {', '.join(named) or 'none'}"
        )
    if not isinstance(one, NoiseModel):
        raise InputError(f"filtering needs a NoiseModel, not {one!r}")
    _refuse_other_kind(facts, one)
    return facts, one


def _refuse_other_kind(channel: Channel, model: NoiseModel) -> None:
    kind = channel.kind.rate
    silent = model.kind == Kind.RATE and not model.estimates  # the default of a model made by hand
    if not silent and kind != model.kind and Kind.UNKNOWN not in (kind, model.kind):
        raise InputError(
            f"channel {channel.name!r} is one of {channel.kind.value}, the noise model is one of {model.kind}: "
            "give the model of this channel"
        )


# -- states ----------------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True, kw_only=True)
class ChannelSpace:
    """States of the noise of a channel and of its level.

    Attributes
    ----------
    space : StateSpace
        Its last state is the level, of which nothing is known at first.
    drift : ndarray, shape (n,)
        Reads out what a sample holds of everything slow: all states but quantisation and the level.
    terms : dict of str to ndarray, shape (n,)
        Reads out the part of each slow term, at the end of the sample; and the level.
    """

    space: StateSpace
    drift: Array
    terms: Mapping[str, Array]

    @property
    def readout(self) -> Array:
        """Drift first, then the terms; shape (1 + n_terms, n)."""
        return np.stack([self.drift, *self.terms.values()])


def channel_space(
    model: NoiseModel, dt: float, *, sampling: Sampling, record: float, ratio: float = 10.0
) -> ChannelSpace:
    """States for samples at interval dt [s] of a record [s].

    Quantisation noise has a mean over the sample of its own: it is noise to be removed from a sample, and no drift.
    """
    quick = tuple(t for t in model.terms if isinstance(t, Quantisation))
    slow = tuple(t for t in model.terms if not isinstance(t, Quantisation))
    plain = replace(model, alternative=None)
    drifting = replace(plain, terms=slow).state_space(dt, sampling=sampling, record=record, ratio=ratio)
    jitter = replace(plain, terms=quick).state_space(dt, sampling=sampling, record=record, ratio=ratio)
    space = (drifting + jitter).with_constant(LEVEL)
    rest = np.zeros(space.size - drifting.size)
    terms = {}
    for label in dict.fromkeys(drifting.labels):
        row = np.where([other == label for other in drifting.labels], drifting.rate, 0.0)
        if row.any():
            terms[label] = np.concatenate([row, rest])
    terms[LEVEL] = np.eye(space.size)[-1]
    return ChannelSpace(space=space, drift=np.concatenate([drifting.output, rest]), terms=terms)


def with_flicker(model: NoiseModel, flicker: FlickerForm, T: float | None) -> NoiseModel:
    """The model with flicker as it is to be filtered: as it stands ("sum"), or as one Gauss-Markov term ("single").

    The single term has its maximum at the floor of flicker: sigma = 1.0760 B.

    Raises
    ------
    InputError
        Another word, a single term without its correlation time, or a time for a sum.
    """
    if flicker not in ("sum", "single"):
        raise InputError(f"flicker must be 'sum' or 'single', not {flicker!r}")
    if flicker == "sum":
        if T is not None:
            raise InputError("T is the correlation time of a single term: give flicker='single' with it")
        return model
    if T is None or not (math.isfinite(T) and T > 0):
        raise InputError(f"flicker='single' needs T=, the correlation time of its term in seconds, not {T!r}")
    terms = tuple(
        GaussMarkov.from_sigma(SIGMA_PER_B * t.B, T) if isinstance(t, Flicker) else t for t in model.terms
    )
    return replace(model, terms=terms)
