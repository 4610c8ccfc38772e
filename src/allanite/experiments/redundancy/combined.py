# SPDX-License-Identifier: BSD-3-Clause
"""The combined record, read block by block, and the noise model that weights make of those of the sensors."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from allanite.experiments.redundancy.geometry import FLAT, best_weights
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel, TermType
from allanite.recording.records import Channel, Kind, Recording, scaled_samples
from allanite.recording.sample_columns import Calculated, Column

__all__ = ["combined_model", "combined_recording"]

Array = NDArray[np.float64]

_UNITS = {Kind.RATE: "rad/s", Kind.ACCELERATION: "m/s²"}


def combined_model(models: Sequence[NoiseModel], weights: Array, correlation: Array) -> NoiseModel:
    """Noise of the weighted sum of sensors, shape (n,): terms of one kind add by their correlation."""
    groups: dict[tuple[Any, ...], list[tuple[int, TermType]]] = {}
    for i, model in enumerate(models):
        for term in model.terms:
            size = term.symbols[0]
            others = tuple((s, getattr(term, s)) for s in ("T", "dt", "frequency") if hasattr(term, s))
            groups.setdefault((term.type, size, others), []).append((i, term))
    terms = []
    for (_, size, _), members in groups.items():
        part = np.zeros(len(models))
        for i, term in members:  # a sensor may have two terms of one kind: independent of each other
            part[i] = math.hypot(part[i], float(getattr(term, size)))
        signed = weights * part
        value = math.sqrt(max(float(signed @ correlation @ signed), 0.0))
        if value > 0:
            terms.append(replace(members[0][1], **{size: value}))  # type: ignore[arg-type]
    return NoiseModel(terms=tuple(terms), kind=models[0].kind, unit=models[0].unit)


def combined_recording(
    recording: Recording,
    channels: Sequence[str],
    axes: Sequence[str],
    directions: Array,
    covariance: Array,
    differences: Array,
    left_out: Mapping[str, Sequence[tuple[int, int]]],
) -> Recording:
    """The recording of the combined axes.

    Parameters
    ----------
    covariance : ndarray, shape (n, n)
        Of the sensors, from which the weights of any of them follow.
    differences : ndarray, shape (n,) [SI]
        Taken off the sensors first, so that the level does not jump where one of them is left out.
    left_out : mapping of str to sequence of (start, stop) [samples]
        Spans in which a sensor does not take part.
    """
    kind = recording[channels[0]].kind
    places = [recording.index(name) for name in channels]
    sources = tuple((recording.columns[i], recording.channels[i].scale) for i in places)
    spans = tuple(tuple(left_out.get(name, ())) for name in channels)
    shared = _Weighing(directions=directions, covariance=covariance, cache={})
    columns = [
        _Combined(sources=sources, spans=spans, differences=differences, weighing=shared, axis=k)
        for k in range(len(axes))
    ]
    facts = [
        Channel(name=name, kind=kind, unit=_UNITS[kind], scale=1.0, sampling=recording[channels[0]].sampling)
        for name in axes
    ]
    step = {
        "step": "combine",
        "channels": list(channels),
        "left_out": {name: [list(span) for span in given] for name, given in left_out.items()},
    }
    return replace(
        recording, columns=tuple(columns), channels=tuple(facts), history=(*recording.history, step)
    )


@dataclass(frozen=True, slots=True)
class _Weighing:
    """Weights of any set of sensors, kept once they are known."""

    directions: Array
    covariance: Array
    cache: dict[bytes, Array | None] = field(default_factory=dict)

    def of(self, use: NDArray[np.bool_]) -> Array | None:
        """Shape (m, n), zero for sensors that are not there; None where too few are left."""
        key = use.tobytes()
        if key not in self.cache:
            self.cache[key] = self._made(use)
        return self.cache[key]

    def _made(self, use: NDArray[np.bool_]) -> Array | None:
        h = self.directions[use]
        if len(h) < h.shape[1] or np.linalg.svd(h, compute_uv=False)[-1] < FLAT:
            return None
        out = np.zeros((h.shape[1], len(use)))
        out[:, use] = best_weights(h, self.covariance[np.ix_(use, use)])
        return out


@dataclass(frozen=True, slots=True)
class _Combined(Calculated):
    """One axis of the combined recording."""

    sources: Sequence[tuple[Column, float]]
    spans: Sequence[Sequence[tuple[int, int]]]
    differences: Array
    weighing: _Weighing
    axis: int

    def __len__(self) -> int:
        return len(self.sources[0][0])

    def read(self, start: int, stop: int) -> Array:
        y = np.stack([self._sensor(i, start, stop) for i in range(len(self.sources))], axis=-1)
        out = np.full(len(y), np.nan)
        there, begins = ~np.isnan(y), np.ones(len(y), dtype=bool)
        begins[1:] = (there[1:] != there[:-1]).any(axis=1)  # runs of rows are few: only these are sorted
        patterns, which = np.unique(there[begins], axis=0, return_inverse=True)
        pattern = which.ravel()[np.cumsum(begins) - 1]
        for p, use in enumerate(patterns):
            weights = self.weighing.of(use)
            if weights is not None:
                rows = pattern == p
                out[rows] = np.where(use, y[rows], 0.0) @ weights[self.axis]
        return out

    def _sensor(self, i: int, start: int, stop: int) -> Array:
        column, scale = self.sources[i]
        y = scaled_samples(column, scale, start, stop) - self.differences[i]
        for a, b in self.spans[i]:
            y[max(a - start, 0) : max(b - start, 0)] = np.nan
        return np.asarray(y)
