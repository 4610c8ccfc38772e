# SPDX-License-Identifier: BSD-3-Clause
"""Results as the page shows them: figures with terms switched off, the table of a study."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from typing import Any

from allanite.errors import FormatError, InputError

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
    dark: bool = False,
    **options: Any,
) -> dict[str, Any]:
    """Traces and layout for Plotly of any result.

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
    from allanite.views.figures import sheet_of
    from allanite.views.figures.plotly import spec

    if models is not None or without:
        if document.get("format") != "allanite-study":
            raise InputError("terms are switched off, and models are drawn, over the curves of a study")
        document = _with_models(document, models, without)
    shown: Any = document
    if "format" not in document:
        models_inside = [m for m in document.values() if isinstance(m, Mapping) and "terms" in m]
        if not models_inside:
            raise InputError("nothing in this document has a figure")
        shown = NoiseModel.from_json(models_inside[0])
    try:
        return spec(sheet_of(shown, **options), dark=dark)
    except (ArithmeticError, AttributeError, LookupError, TypeError) as error:
        raise FormatError(f"the document is damaged: {type(error).__name__}: {error}") from error


def _with_models(study: Json, models: Json | None, without: Collection[str]) -> Json:
    """A study with other models, and without some terms of them."""
    letters = set(without)
    unknown = letters - set("QNBGKRS")
    if unknown:
        raise InputError(
            f"no noise term has the letter {sorted(unknown)[0]!r}; there are Q, N, B, G, K, R, S"
        )
    channels = []
    for channel in study["channels"]:
        given = channel["models"] if models is None else _split(models.get(channel["name"]))
        kept = [{**m, "terms": [t for t in m["terms"] if _letter(t) not in letters]} for m in given]
        channels.append({**channel, "models": [m for m in kept if m["terms"]]})
    return {**study, "channels": channels}


def _split(model: Json | None) -> list[Json]:
    """A model and its alternative as a study holds them."""
    if model is None:
        return []
    other = model.get("alternative")
    alone = {k: v for k, v in model.items() if k != "alternative"}
    return [alone] if other is None else [alone, other]


def _letter(term: Json) -> str:
    return {
        "quantisation": "Q", "white": "N", "flicker": "B", "gauss-markov": "G", "random-walk": "K", "ramp": "R",
    }.get(str(term.get("type")).replace("_", "-"), "S")  # fmt: skip


def parameters_of(study: Json) -> dict[str, Any]:
    """The parameter table of a study: in SI, in the unit that people use, and the factors to others.

    Raises
    ------
    InputError
        No study.
    """
    from allanite.views.wording.study import groups, readings

    if study.get("format") != "allanite-study":
        raise InputError("only a study has a table of parameters")
    channels = []
    for group in groups(study["channels"]):
        for channel in group.channels:
            models = []
            for model in channel["models"]:
                read = readings(channel, model)
                estimates = {e["symbol"]: e for e in model["estimates"]}
                rows = [_row(group, channel, symbol, r, estimates) for symbol, r in read.items()]
                models.append(
                    {"family": model.get("family", ""), "verdict": model.get("verdict", ""), "rows": rows}
                )
            channels.append({"name": channel["name"], "kind": channel["kind"], "models": models})
    return {"channels": channels}


def _row(group: Any, channel: Json, symbol: str, reading: Any, estimates: Json) -> dict[str, Any]:
    estimate = estimates[reading.symbol]
    bounded = estimate["upper"] is not None
    return {
        "symbol": reading.symbol,
        "name": group.name_of(symbol),
        "value": estimate["value"],
        "lower": estimate["lower"],
        "upper": estimate["upper"],
        "supported": reading.supported,
        "status": "resolved" if reading.supported else "upper limit" if bounded else "not resolved",
        "says": reading.text,
        "note": reading.note,
        "unit": reading.si_unit,
        "units": _units(channel["kind"], symbol, channel.get("unit") or ""),
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
