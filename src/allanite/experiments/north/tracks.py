# SPDX-License-Identifier: BSD-3-Clause
"""One sensitive axis while the table turns: its block means, and the mean cosine and sine of its heading in each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field

import numpy as np
from numpy.typing import NDArray

from allanite.errors import InputError, LimitError
from allanite.experiments.reversals import Reversals
from allanite.filtering.block_means import BlockMeans, block_means, longest_block
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.quantities.result import Result
from allanite.recording.records import Kind, Recording, Sampling

__all__ = ["Axes", "Rotation", "Track", "axes_of", "tracks_of"]

Array = NDArray[np.float64]
Axes = str | Sequence[str] | Mapping[str, float]

#: Blocks in a dwell where no time lies between the dwells: a block that touches two loses the smaller part, a quarter
#: of a block on the average.
PER_TOUCHING_DWELL = 120
#: Blocks in a revolution: the mean of cosine and sine over a block is exact, only noise is averaged.
PER_REVOLUTION = 48
#: Most blocks of one axis.
MOST_BLOCKS = 2_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Rotation(Result):
    """A table that turns at a constant rate.

    Attributes
    ----------
    rate : float [rad/s]
        Positive from north over east.
    start : float [rad]
        Heading of the first axis relative to the table's zero direction at the beginning of the record: the
        direction whose azimuth is wanted.
    """

    rate: float
    start: float = 0.0

    def __post_init__(self) -> None:
        if not (math.isfinite(self.rate) and self.rate != 0 and math.isfinite(self.start)):
            raise InputError(
                f"a rotation needs a finite rate other than zero [rad/s] and a finite start [rad], not {self.rate!r} "
                f"and {self.start!r}"
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Track:
    """One axis.

    Attributes
    ----------
    name : str
        Its channel.
    offset : float [rad]
        Its heading less that of the first axis.
    blocks : BlockMeans
    cosine, sine : ndarray, shape (n,)
        Of its heading relative to the mark; NaN where that is not known or nothing was measured.
    model : NoiseModel
    sampling : "mean" or "point"
        Of the block means.
    reversals : Reversals or None
    """

    name: str
    offset: float
    blocks: BlockMeans = field(repr=False)
    cosine: Array = field(repr=False)
    sine: Array = field(repr=False)
    model: NoiseModel
    sampling: Sampling
    reversals: Reversals | None = field(repr=False)

    @property
    def used(self) -> NDArray[np.bool_]:
        """Blocks with samples and a heading."""
        return np.isfinite(self.cosine) & np.isfinite(self.blocks.mean)


def axes_of(recording: Recording, channels: Axes | None) -> dict[str, float]:
    """Channels and the heading of each less that of the first [rad].

    Raises
    ------
    InputError
        No channel of rates, several and no choice, names without their headings, a channel that is no rate.
    """
    if channels is None:
        rates = [c.name for c in recording.channels if c.kind is Kind.RATE]
        if len(rates) != 1:
            has = ", ".join(f"{c.name} ({c.kind.value})" for c in recording.channels)
            raise InputError(
                f"{len(rates)} channels of rates: {has}. Say which with channels=, those in the horizontal plane; "
                "a channel without a unit needs one, e.g. deg/s, or its scale factor"
            )
        channels = rates
    if isinstance(channels, str):
        channels = [channels]
    if not isinstance(channels, Mapping):
        if len(channels) > 1:
            first, second = channels[0], channels[1]
            raise InputError(
                f"{len(channels)} axes need their headings less that of the first [rad], clockwise from above: "
                f"channels={{{first!r}: 0.0, {second!r}: -math.pi / 2}} if {second} points to the left of {first}, "
                "+math.pi / 2 if to the right. The wrong side mirrors the azimuth"
            )
        channels = dict.fromkeys(channels, 0.0)
    for name, offset in channels.items():
        if recording[name].kind is not Kind.RATE:
            raise InputError(
                f"channel {name!r} is one of {recording[name].kind.value}, not of rates: give its unit, e.g. deg/s, "
                "or its scale factor"
            )
        if not math.isfinite(offset):
            raise InputError(f"the heading of axis {name!r} must be finite [rad], not {offset!r}")
    if not channels:
        raise InputError("north needs at least one axis")
    return {name: float(offset) for name, offset in channels.items()}


def tracks_of(
    recording: Recording,
    axes: Mapping[str, float],
    models: Mapping[str, NoiseModel],
    positions: Reversals | None,
    rotation: Rotation | None,
) -> tuple[Track, ...]:
    """The axes of a record in positions or in rotation; all have the same blocks in time.

    Raises
    ------
    InputError
        Neither positions nor rotation, or both; positions of another record; no usable sample.
    LimitError
        More blocks than can be held.
    """
    if (positions is None) == (rotation is None):
        raise InputError(
            "give either positions (dwells with headings) or a rotation, whichever the table did"
        )
    if positions is not None:
        if positions.n_samples != recording.n_samples:
            raise InputError(
                f"the positions are those of {positions.n_samples} samples, the record has {recording.n_samples}"
            )
        spans = np.array([(d.start, d.stop) for d in positions.dwells], dtype=np.int64).reshape(-1, 2)
    else:
        spans = np.array([(0, recording.n_samples)], dtype=np.int64)
    size = min(_block_size(recording, spans, rotation, axis_model) for axis_model in models.values())
    if recording.n_samples // size > MOST_BLOCKS:
        raise LimitError(
            f"{recording.n_samples // size} blocks of {size} samples are too many: take a part of the record"
        )
    tracks = []
    for name, offset in axes.items():
        blocks = block_means(recording, name, size, spans)
        if positions is not None:
            headings = np.array([d.heading for d in positions.dwells] + [math.nan])[blocks.span] + offset
            cosine, sine = np.cos(headings), np.sin(headings)
        else:
            assert rotation is not None  # noqa: S101 - for the type checker
            cosine, sine = _rotated(blocks, size, recording[name].sampling, rotation, offset)
        track = Track(
            name=name,
            offset=offset,
            blocks=blocks,
            cosine=cosine,
            sine=sine,
            model=models[name],
            sampling=recording[name].sampling if size == 1 else "mean",
            reversals=positions,
        )
        if not track.used.any():
            raise InputError(f"channel {name!r} has no usable sample in a position of known heading")
        tracks.append(track)
    return tuple(tracks)


def _block_size(
    recording: Recording, spans: NDArray[np.int64], rotation: Rotation | None, model: NoiseModel
) -> int:
    """Samples in a block."""
    if rotation is not None:
        period = abs(2 * math.pi / rotation.rate)
        length = min(period / PER_REVOLUTION, longest_block(model, period / 2))
    elif len(spans):
        dwell = float(np.quantile(spans[:, 1] - spans[:, 0], 0.2)) / recording.rate
        between = (
            float(np.quantile(spans[1:, 0] - spans[:-1, 1], 0.2)) / recording.rate if len(spans) > 1 else 0.0
        )
        length = min(longest_block(model, dwell), max(between, dwell / PER_TOUCHING_DWELL))
    else:
        raise InputError("there is no position with usable samples")
    return max(int(length * recording.rate), 1)


def _rotated(
    blocks: BlockMeans, size: int, sampling: Sampling, rotation: Rotation, offset: float
) -> tuple[Array, Array]:
    """Mean cosine and sine over the usable samples of each block, taken for contiguous.

    The mean of exp(i a) over m samples at steps x is exp(i a_middle) sin(m x/2)/(m sin(x/2)); over the intervals of m
    samples the sine below is x/2.
    """
    count = np.maximum(blocks.part * size, 1.0)
    x = rotation.rate * blocks.dt / size
    middle = blocks.time - (0.5 * blocks.dt / size if sampling == "point" else 0.0)
    step = math.sin(x / 2) if sampling == "point" else x / 2
    size_of_mean = np.sin(count * x / 2) / (count * step)
    a = rotation.start + offset + rotation.rate * middle
    missing = np.where(blocks.span >= 0, 1.0, np.nan)
    return np.cos(a) * size_of_mean * missing, np.sin(a) * size_of_mean * missing
