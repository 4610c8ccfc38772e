# SPDX-License-Identifier: BSD-3-Clause
"""Series of any length, ready to be looked at: all samples, and the lowest and highest of each 16, 256, 4096, ...

`build` reads a recording once, channel by channel and block by block, in memory that does not grow with it. What it
leaves in a folder is mapped by `SeriesPyramid`, which answers any stretch of time with at most so many blocks; the ends
of a block are exact, they are two of its samples. Missing samples are NaN, and a block is NaN where all of it is
missing.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from allanite.errors import FormatError, InputError
from allanite.lazy_dataclasses import dataclass

if TYPE_CHECKING:
    from allanite.recording.records import Recording

__all__ = ["FACTOR", "SeriesPyramid", "SeriesWindow", "build"]

Json = Mapping[str, Any]
Array = NDArray[np.float64]

FACTOR = 16
"""Samples of a block on the first level, and blocks of one level in a block of the next."""

VERSION = 2
_FACTS = "series.json"
_WHOLE = 4  # levels whose blocks are no longer than what is read at a time
_CHUNK = FACTOR**_WHOLE
_SMALLEST = 256  # blocks; no level is made of fewer
_GAPS = 1000  # spans of missing samples that are kept for the picture


@dataclass(frozen=True, slots=True, kw_only=True)
class SeriesWindow:
    """A stretch of a series.

    Attributes
    ----------
    kind : "blocks" or "samples"
    first : int
        Number of its first sample.
    size : int
        Samples per block; the last one may reach beyond the end of the series. 1 for samples.
    count : int
    values : tuple of ndarray, shape (2, count) or (1, count)
        Of each channel: lowest and highest, or the samples; in the unit as written.
    """

    kind: Literal["blocks", "samples"]
    first: int
    size: int
    count: int
    values: tuple[Array, ...] = field(repr=False)


@dataclass(frozen=True, slots=True)
class SeriesPyramid:
    """What `build` has left.

    Parameters
    ----------
    folder : Path

    Raises
    ------
    FormatError
        Nothing that `build` has left.
    """

    folder: Path
    facts: Json = field(init=False)
    _maps: list[list[NDArray[Any]]] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        try:
            facts = json.loads((self.folder / _FACTS).read_text(encoding="utf-8"))
            maps = [
                [_mapped(self.folder / _file(i, level)) for level in range(facts["levels"] + 1)]
                for i in range(len(facts["channels"]))
            ]
        except (OSError, ValueError, KeyError) as error:
            raise FormatError(f"{self.folder} has no prepared series: {error}") from None
        object.__setattr__(self, "facts", facts)
        object.__setattr__(self, "_maps", maps)

    @property
    def samples(self) -> int:
        """Of each channel, missing ones included."""
        return int(self.facts["samples"])

    def window(
        self, channels: Sequence[int], start: float = 0.0, stop: float | None = None, *, blocks: int = 1500
    ) -> SeriesWindow:
        """The stretch from `start` to `stop` [s], in at most so many blocks and two more.

        Exact samples where they are no more than twice the blocks. Blocks lie on a grid of their own size, so that they
        stay the same while a picture is moved.

        Raises
        ------
        InputError
            No such channel, times or number of blocks.
        """
        if not all(0 <= i < len(self._maps) for i in channels):
            raise InputError(f"channels are numbered from 0 to {len(self._maps) - 1}")
        if not 1 <= blocks <= 20_000:
            raise InputError(f"blocks must be between 1 and 20000, not {blocks}")
        rate = float(self.facts["rate"])
        end = self.samples / rate if stop is None else stop
        if not (math.isfinite(start) and math.isfinite(end) and start < end):
            raise InputError(f"no stretch of time from {start} s to {end} s")
        first = min(max(math.floor(start * rate), 0), self.samples)
        last = min(max(math.ceil(end * rate), first), self.samples)
        count = last - first
        if count <= 2 * blocks:
            values = tuple(self._samples(i, first, last)[None] for i in channels)
            return SeriesWindow(kind="samples", first=first, size=1, count=count, values=values)
        level, size = self._grid(count, blocks)
        first = first // size * size
        many = -(-(last - first) // size)
        values = tuple(self._blocks(i, level, size, first // size, many) for i in channels)
        return SeriesWindow(kind="blocks", first=first, size=size, count=many, values=values)

    def _grid(self, count: int, blocks: int) -> tuple[int, int]:
        """The level to read, and samples per block, a multiple of those of the level."""
        size = -(-count // blocks)
        level = min(int(math.log(size, FACTOR) + 1e-9), int(self.facts["levels"]))
        while FACTOR**level > size:
            level -= 1
        step = FACTOR**level
        return level, -(-size // step) * step

    def _blocks(self, channel: int, level: int, size: int, first: int, count: int) -> Array:
        """Neighbouring blocks of a level joined."""
        join = size // FACTOR**level
        begin, end = first * join, (first + count) * join
        if level:
            block_ends = self._maps[channel][level][:, begin:end]
            low, high = block_ends[0], block_ends[1]
        else:
            low = high = self._maps[channel][0][begin:end]
        ends = np.stack([_joined(low, join, count, np.fmin), _joined(high, join, count, np.fmax)])
        return ends + self._origin(channel)

    def _samples(self, channel: int, first: int, last: int) -> Array:
        samples: Array = self._maps[channel][0][first:last] + self._origin(channel)
        return samples

    def _origin(self, channel: int) -> float:
        return float(self.facts["channels"][channel]["origin"])


def _joined(values: NDArray[Any], join: int, count: int, least: np.ufunc) -> Array:
    padded = values
    if values.size < join * count:
        padded = np.full(join * count, np.nan)
        padded[: values.size] = values
    joined: Array = least.reduce(padded.reshape(count, join), axis=1)
    return joined


def _mapped(path: Path) -> NDArray[Any]:
    mapped: NDArray[Any] = np.load(path, mmap_mode="r", allow_pickle=False)
    return mapped


def _file(channel: int, level: int) -> str:
    return f"{channel}-{level}.npy"


# -- making one -------------------------------------------------------------------------------------------


def build(
    recording: Recording,
    folder: Path,
    *,
    facts: Json | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> Json:
    """Write the pyramid of a recording into a folder that is there and empty; its facts.

    Parameters
    ----------
    facts : mapping, optional
        Further ones that are kept with it.
    progress : callable, optional
        Told the share done and what is being done.

    Notes
    -----
    One pass over each channel. On the disk: 8 bytes for a sample, and an eighth and some more for the levels.
    """
    n, many = recording.n_samples, len(recording.channels)
    levels = 0
    while n / FACTOR ** (levels + 1) > _SMALLEST:
        levels += 1
    channels = []
    for i, channel in enumerate(recording.channels):

        def step(done: float, i: int = i, name: str = channel.name) -> None:
            if progress is not None:
                progress((i + done) / many, f"preparing {name}")

        channels.append({**channel.to_json(), **_channel(recording, channel.name, i, levels, folder, step)})
    known = {
        "version": VERSION,
        "source": recording.source,
        "rate": recording.rate,
        "samples": n,
        "duration": recording.duration,
        "start": recording.start,
        "levels": levels,
        "channels": channels,
        **(facts or {}),
    }
    (folder / _FACTS).write_text(json.dumps(known, ensure_ascii=False, allow_nan=False), encoding="utf-8")
    return known


def _channel(
    recording: Recording, name: str, number: int, levels: int, folder: Path, step: Callable[[float], None]
) -> dict[str, Any]:
    """Write one channel; what is known of it."""
    n, gaps = recording.n_samples, _Gaps()
    width = _width(recording, name)
    samples = _created(folder / _file(number, 0), (n,), width)
    ladder = [
        _created(folder / _file(number, k), (2, -(-n // FACTOR**k)), width) for k in range(1, levels + 1)
    ]
    low, high = math.inf, -math.inf
    for start, values in recording.blocks(name, _CHUNK):
        samples[start : start + len(values)] = values
        gaps.take(start, np.isnan(values))
        below = above = values
        for k, rows in enumerate(ladder[:_WHOLE], 1):
            count = -(-len(values) // FACTOR**k)
            at = start // FACTOR**k
            below, above = _joined(below, FACTOR, count, np.fmin), _joined(above, FACTOR, count, np.fmax)
            rows[0, at : at + count], rows[1, at : at + count] = below, above
        if not np.isnan(values).all():
            low, high = min(low, float(np.nanmin(values))), max(high, float(np.nanmax(values)))
        step((start + len(values)) / n)
    for k in range(_WHOLE + 1, levels + 1):  # small, and their blocks longer than a chunk: of the level below
        for end, least in enumerate((np.fmin, np.fmax)):
            ladder[k - 1][end] = _joined(ladder[k - 2][end], FACTOR, ladder[k - 1].shape[1], least)
    origin = recording.origin(name)
    some = math.isfinite(low)
    return {
        "origin": origin,
        "missing": gaps.missing,
        "low": low + origin if some else None,
        "high": high + origin if some else None,
        "gaps": gaps.spans,
    }


def _width(recording: Recording, name: str) -> type[np.floating[Any]]:
    """float32 where the file has no more than that, or integers of 16 bits: nothing is lost, half the disk."""
    kind = recording.columns[recording.index(name)].dtype
    small = kind == np.float32 or (kind.kind in "iu" and kind.itemsize <= 2)
    return np.float32 if small else np.float64


def _created(path: Path, shape: tuple[int, ...], width: type[np.floating[Any]]) -> NDArray[Any]:
    created: NDArray[Any] = np.lib.format.open_memmap(path, mode="w+", dtype=width, shape=shape)
    return created


class _Gaps:
    """Spans of missing samples, the first thousand of them, and how many samples are missing in all."""

    def __init__(self) -> None:
        self.missing = 0
        self.spans: list[list[int]] = []

    def take(self, start: int, missing: NDArray[np.bool_]) -> None:
        count = int(np.count_nonzero(missing))
        self.missing += count
        if not count:
            return
        edges = np.flatnonzero(np.diff(np.concatenate([[0], missing.view(np.int8), [0]]))) + start
        for a, b in edges.reshape(-1, 2)[: _GAPS + 1].tolist():
            if self.spans and self.spans[-1][1] == a:
                self.spans[-1][1] = b
            elif len(self.spans) < _GAPS:
                self.spans.append([a, b])
