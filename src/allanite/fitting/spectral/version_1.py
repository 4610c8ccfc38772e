# SPDX-License-Identifier: BSD-3-Clause
"""Documents of version 1 held sentences for values: what they say in the present version."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

__all__ = ["upgraded"]

Entry = Mapping[str, object]

_WHOLE = re.compile(
    r"from (\S+) to (\S+) Hz the density is (\S+) times that of the model of the curve \(chance (\S+)\)"
)
_PARTED = re.compile(r"(\S+) from the frequencies is (\S+) times \S+ from the lags")


def upgraded(data: Entry) -> dict[str, object]:
    """A document of spectra, version 1, as one of version 2; what is damaged stays so."""
    channels = data.get("channels")
    entries = channels if isinstance(channels, Sequence) and not isinstance(channels, str) else ()
    return {
        **data,
        "version": 2,
        "channels": [_channel(c) if isinstance(c, Mapping) else c for c in entries],
    }


def _channel(data: Entry) -> dict[str, object]:
    model, words = data.get("model"), data.get("disagreement")
    compared = isinstance(model, Mapping) and data.get("compared") is not False
    return {
        **data,
        "unit": data.get("unit") or "",
        "compared": compared,
        "disagreement": _disagreement(words, model) if isinstance(words, str) and words else None,
    }


def _disagreement(words: str, model: object) -> dict[str, object]:
    whole = _WHOLE.search(words)
    low, high, ratio, p = (float(part) for part in whole.groups()) if whole else (None, None, None, None)
    return {
        "p": p,
        "band": [low, high],
        "ratio": ratio,
        "parameters": [*_parted(words, model)],
        "whole": whole is not None,
    }


def _parted(words: str, model: object) -> Iterator[dict[str, object]]:
    """The sentence holds the ratio of two estimates, and the model one of them."""
    estimates = model.get("estimates") if isinstance(model, Mapping) else None
    values = {e["symbol"]: e["value"] for e in estimates} if isinstance(estimates, Sequence) else {}
    for symbol, ratio in _PARTED.findall(words):
        lags = values.get(symbol) or 1.0
        yield {"symbol": symbol, "lags": lags, "frequencies": float(ratio) * lags}
