# SPDX-License-Identifier: BSD-3-Clause
"""Results as the page shows them: figures with terms switched off, the table of a study."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from allanite.errors import FormatError, InputError
from allanite.plain_files.json_values import plain

if TYPE_CHECKING:
    from allanite.noise import NoiseModel, TermType
    from allanite.study.results import ChannelStudy
    from allanite.study.study import Study
    from allanite.views.wording.study import ChannelGroup, CoefficientWording

__all__ = ["figure_of", "parameters_of"]

Json = Mapping[str, Any]

#: Units beside that of the table, by the family of the sensor and the coefficient; the page offers those that fit.
_UNITS: Mapping[str, Mapping[str, tuple[str, ...]]] = {
    "rate": {
        "N": ("deg/√h", "deg/s/√Hz", "mdeg/s/√Hz", "deg/h/√Hz", "rad/s/√Hz"),
        "B": ("deg/h", "deg/s", "rad/s"),
        "K": ("deg/h/√h", "deg/s/√s", "rad/s/√s"),
        "R": ("deg/h/h", "deg/h/s", "rad/s/s"),
        "Q": ("arcsec", "deg", "µrad", "rad"),
        "T": ("s", "min", "h"),
    },
    "acceleration": {
        "N": ("m/s/√h", "µg/√Hz", "mg/√Hz", "m/s^2/√Hz"),
        "B": ("µg", "mg", "m/s^2"),
        "K": ("m/s/h/√h", "µg/√s", "m/s^2/√s"),
        "R": ("µg/h", "m/s^2/s"),
        "Q": ("m/s", "mm/s"),
        "T": ("s", "min", "h"),
    },
}
_ALIKE = {"angle": "rate", "velocity": "acceleration"}


def figure_of(
    document: Json,
    *,
    models: Json | None = None,
    without: Collection[str] = (),
    **options: Any,
) -> dict[str, Any]:
    """The panels of any result as plain data.

    Parameters
    ----------
    document : mapping
        Of a result, or noise models by channel as `allanite fit --output` leaves them.
    models : mapping, optional
        Noise models by channel, to be drawn over the curves of a study in place of its own.
    without : collection of str
        Letters of noise terms (Q, N, B, G, K, R, S for spectral lines) that are switched off, of a study.
    **options
        Those of `allanite.plot`.

    Raises
    ------
    InputError
        Nothing that has a figure, an unknown option or letter.
    FormatError
        A document that is damaged.
    """
    from allanite.noise import NoiseModel
    from allanite.study.study import Study
    from allanite.views.figures import sheet_of
    from allanite.views.figures.screen import spec

    shown: object = document
    if models is not None or without:
        if document.get("format") != Study.FORMAT:
            raise InputError("terms are switched off, and models are drawn, over the curves of a study")
        given = None if models is None else {n: NoiseModel.from_json(m) for n, m in models.items()}
        shown = _with_models(Study.from_json(document), given, without)
    elif "format" not in document:
        models_inside = [m for m in document.values() if isinstance(m, Mapping) and "terms" in m]
        if not models_inside:
            raise InputError("this document has no figures")
        shown = NoiseModel.from_json(models_inside[0])
    try:
        return spec(sheet_of(shown, **options))
    except (ArithmeticError, AttributeError, LookupError, TypeError) as error:
        raise FormatError(f"the document is damaged: {type(error).__name__}: {error}") from error


def _with_models(study: Study, models: Mapping[str, NoiseModel] | None, without: Collection[str]) -> Study:
    """A study with other models, and without some terms of them."""
    letters = set(without)
    unknown = letters - set("QNBGKRS")
    if unknown:
        raise InputError(
            f"no noise term has the letter {sorted(unknown)[0]!r}; there are Q, N, B, G, K, R, S"
        )
    channels = []
    for channel in study.channels:
        other = None if models is None else models.get(channel.name)
        given = channel.models if models is None else () if other is None else other.families
        kept = [replace(m, terms=tuple(t for t in m.terms if _letter(t) not in letters)) for m in given]
        channels.append(replace(channel, models=tuple(m for m in kept if m.terms)))
    return replace(study, channels=tuple(channels))


def _letter(term: TermType) -> str:
    return {"q": "G", "amplitude": "S"}.get(term.symbols[0], term.symbols[0])


def parameters_of(document: Json) -> dict[str, Any]:
    """The parameter table of a study: in SI, in the unit that people use, and the factors to others.

    Raises
    ------
    InputError
        No study.
    """
    from allanite.study.study import Study
    from allanite.views.wording.study import groups, readings

    if document.get("format") != Study.FORMAT:
        raise InputError("only a study has a table of parameters")
    channels = []
    for group in groups(Study.from_json(document).channels):
        for channel in group.channels:
            models = [
                {
                    "family": model.family,
                    "verdict": model.verdict,
                    "rows": [_row(group, channel, model, s, r) for s, r in readings(channel, model).items()],
                }
                for model in channel.models
            ]
            channels.append({"name": channel.name, "kind": channel.kind, "models": models})
    return {"channels": channels}


def _row(
    group: ChannelGroup[ChannelStudy],
    channel: ChannelStudy,
    model: NoiseModel,
    symbol: str,
    reading: CoefficientWording,
) -> dict[str, Any]:
    estimate = next(e for e in model.estimates if e.symbol == reading.symbol)
    bounded = math.isfinite(estimate.upper)
    return {
        "symbol": reading.symbol,
        "name": group.name_of(symbol),
        **{name: plain(getattr(estimate, name)) for name in ("value", "lower", "upper")},
        "supported": reading.supported,
        "status": "resolved" if reading.supported else "upper limit" if bounded else "not resolved",
        "says": reading.text,
        "note": reading.note,
        "unit": reading.si_unit,
        "units": _units(channel.kind, symbol, channel.unit),
    }


def _units(kind: str, symbol: str, shown_in: str) -> list[dict[str, Any]]:
    """Units of a coefficient, that of people first: value in SI times factor is the value in the unit."""
    from allanite.quantities.display_units import display_unit
    from allanite.quantities.units import parse_unit

    first, size = display_unit(kind, symbol, shown_in)
    factors = {first: 1.0 / size}
    same: Sequence[str] = _UNITS.get(_ALIKE.get(kind, kind), {}).get(symbol, ())
    quantity = None
    for text in (first, *same):
        try:
            parsed = parse_unit(text)
        except InputError:
            continue
        quantity = quantity or parsed.quantity
        if parsed.quantity == quantity:
            factors.setdefault(text, 1.0 / parsed.factor)
    return [{"unit": text, "factor": factor} for text, factor in factors.items()]
