# SPDX-License-Identifier: BSD-3-Clause
"""Bounds of all channels of a study, with the curves and models that they lie above."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Mapping
from dataclasses import field
from typing import ClassVar, cast

from allanite.errors import FormatError, InputError
from allanite.fitting.overbound.bounding import overbound
from allanite.lazy_dataclasses import dataclass
from allanite.noise import NoiseModel
from allanite.noise.allan.channel_curve import ChannelCurve
from allanite.noise.allan.curve import AllanCurve
from allanite.noise.inflation import Inflation
from allanite.noise.parameters import amplitude_of, amplitude_symbols
from allanite.quantities.earlier_documents import entries
from allanite.quantities.result import Result

__all__ = ["BoundedChannel", "BoundedTerm", "Bounds", "bound_channels"]


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundedTerm:
    """A term of a bound; a Gauss-Markov term by its standard deviation.

    Attributes
    ----------
    symbol : str
        A second term of a kind is called like the first with a 2.
    fitted : float or None
        Amplitude in the fit; None where it holds no such term.
    bound, factor : float, float or None
        Amplitude in the bound, and over the fit.
    needed : bool
        The record cannot tell it from another term like it.
    """

    symbol: str
    fitted: float | None
    bound: float
    factor: float | None
    needed: bool


@dataclass(frozen=True, slots=True, kw_only=True)
class BoundedChannel(Result):
    """One channel: what was measured, what was fitted, and the bound above.

    Attributes
    ----------
    name, kind, unit : str
        Of the channel.
    curve : ChannelCurve
        What was measured.
    fitted : NoiseModel
        With its alternative, where the record cannot decide.
    bound : NoiseModel
        Above all of them; its "overbound" says what it promises.
    """

    name: str
    kind: str
    unit: str
    curve: ChannelCurve = field(repr=False)
    fitted: NoiseModel
    bound: NoiseModel

    def __post_init__(self) -> None:
        if self.bound.overbound is None:
            raise FormatError(f"the bound of {self.name} states no overbound")

    @property
    def inflation(self) -> Inflation:
        """What the bound promises, and what it is inflated by."""
        return cast("Inflation", self.bound.overbound)

    def terms(self) -> Iterator[BoundedTerm]:
        """The terms of the bound beside those of the fit."""
        fitted, bound = _amplitudes(self.fitted), _amplitudes(self.bound)
        limits = {e.symbol for e in self.fitted.estimates if e.value is None and not e.supported}
        for symbol, factor in self.inflation.factors.items():
            if symbol in bound:
                yield BoundedTerm(
                    symbol=symbol,
                    fitted=None if factor is None else fitted.get(symbol),
                    bound=bound[symbol],
                    factor=factor,
                    needed=factor is not None and symbol in limits,
                )


def _amplitudes(model: NoiseModel) -> dict[str, float]:
    return dict(zip(amplitude_symbols(model.terms), map(amplitude_of, model.terms), strict=True))


@dataclass(frozen=True, slots=True, kw_only=True)
class Bounds(Result):
    """Bounds of several channels, each with the stated probability by itself.

    Attributes
    ----------
    probability : float
        With which each lies above its sensor.
    channels : tuple of BoundedChannel
        Those that have a model with terms.
    """

    FORMAT: ClassVar[str] = "allanite-overbound"
    VERSION: ClassVar[int] = 2

    probability: float
    channels: tuple[BoundedChannel, ...]

    @property
    def models(self) -> dict[str, NoiseModel]:
        """The bound of each channel."""
        return {c.name: c.bound for c in self.channels}

    def __repr__(self) -> str:
        return f"<Bounds at {100 * self.probability:g} %: {', '.join(self.models)}>"

    @classmethod
    def _upgraded(cls, data: Mapping[str, object]) -> Mapping[str, object]:
        """Version 1 listed the families of a model one beside the other."""
        if data.get("version") != 1:
            return data
        channels = [
            {**c, "fitted": _with_alternative(c.get("models"))} for c in entries(data.get("channels"))
        ]
        return {**data, "version": 2, "channels": channels}


def _with_alternative(models: object) -> dict[str, object]:
    first, *others = entries(models) or [{}]
    return {**first, **({"alternative": others[0]} if others else {})}


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
        one, fitted = curve[name], models[name]
        bound = overbound(one, fitted, probability=probability, horizon=horizon, terms=terms)
        made.append(
            BoundedChannel(
                name=name,
                kind=fitted.kind,
                unit=fitted.unit or one.channels[0].unit,
                curve=ChannelCurve.of(one),
                fitted=fitted,
                bound=bound,
            )
        )
        if progress is not None:
            progress((i + 1) / len(able))
    return Bounds(probability=probability, channels=tuple(made))
