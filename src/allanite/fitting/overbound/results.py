# SPDX-License-Identifier: BSD-3-Clause
"""Bounds of all channels of a study, with the curves and models that they lie above."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any

from allanite.errors import InputError
from allanite.fitting.overbound.bounding import overbound
from allanite.noise import NoiseModel
from allanite.noise.allan.curve import AllanCurve

__all__ = ["BoundedChannel", "Bounds", "bound_channels"]

FORMAT = "allanite-overbound"
VERSION = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundedChannel:
    """One channel: what was measured, what was fitted, and the bound above.

    Attributes
    ----------
    curve : AllanCurve
        Of this channel alone.
    fitted, bound : NoiseModel
    """

    curve: AllanCurve
    fitted: NoiseModel
    bound: NoiseModel

    @property
    def name(self) -> str:
        """Of the channel."""
        return self.curve.names[0]

    def to_json(self) -> dict[str, Any]:
        """Plain data."""
        return {
            "name": self.name,
            "kind": self.fitted.kind,
            "unit": self.fitted.unit or self.curve.channels[0].unit,
            "curve": self.curve.to_json(),
            "models": [m.to_json() for m in self.fitted.families],
            "bound": self.bound.to_json(),
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds:
    """Bounds of several channels, each with the stated probability by itself.

    Attributes
    ----------
    probability : float
    channels : tuple of BoundedChannel
    """

    probability: float
    channels: tuple[BoundedChannel, ...]

    @property
    def models(self) -> dict[str, NoiseModel]:
        """The bound of each channel."""
        return {c.name: c.bound for c in self.channels}

    def __repr__(self) -> str:
        return f"<Bounds at {100 * self.probability:g} %: {', '.join(self.models)}>"

    def to_json(self) -> dict[str, Any]:
        """Plain data, from which figures and reports are made."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "probability": self.probability,
            "channels": [c.to_json() for c in self.channels],
        }


def bound_channels(
    curve: AllanCurve,
    models: Mapping[str, NoiseModel],
    *,
    probability: float = 0.95,
    horizon: float | None = None,
    terms: Collection[str] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Bounds:
    """A bound for each channel of a curve that has a model with terms; see `overbound`.

    Raises
    ------
    InputError
        No channel has a model with terms, or what `overbound` refuses.
    """
    able = [name for name in curve.names if name in models and models[name].terms]
    if not able:
        raise InputError("no channel has a noise model to put a bound above")
    made = []
    for i, name in enumerate(able):
        one = curve[name]
        bound = overbound(one, models[name], probability=probability, horizon=horizon, terms=terms)
        made.append(BoundedChannel(curve=one, fitted=models[name], bound=bound))
        if progress is not None:
            progress((i + 1) / len(able))
    return Bounds(probability=probability, channels=tuple(made))
