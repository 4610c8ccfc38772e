# SPDX-License-Identifier: BSD-3-Clause
"""In which units people read a noise coefficient, and what its SI unit is called."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar

from allanite.errors import InputError
from allanite.quantities.units import parse_unit

__all__ = ["coefficient_unit", "display_unit", "read_in_si", "si_unit"]

# symbol, for rate and angle channels, for acceleration and velocity, in the channel's own unit
_DISPLAY = """
Q          arcsec     m/s       {}·s
N          deg/√h     m/s/√h    {}/√Hz
B          deg/h      µg        {}
K          deg/h/√h   µg/√h     {}/√s
R          deg/h/h    µg/h      {}/s
q          deg/h/√h   µg/√h     {}/√s
sigma      deg/h      µg        {}
amplitude  deg/h      µg        {}
adev       deg/h      µg        {}
mean       deg/h      m/s²      {}
sd         deg/s      m/s²      {}
"""
_DISPLAY_UNITS = {row[0]: row[1:] for row in map(str.split, _DISPLAY.strip().splitlines())}
_DISPLAY_COLUMN = {"rate": 0, "angle": 0, "acceleration": 1, "velocity": 1}
#: Of clocks, in SI: seconds, and fractional frequency, which has no dimension.
_CLOCK_UNITS = {"Q": "s", "N": "1/√Hz", "K": "1/√s", "R": "1/s", "q": "1/√s"}
_IN_SI: ContextVar[bool] = ContextVar("in_si", default=False)


@contextmanager
def read_in_si(asked: bool) -> Iterator[None]:
    """Within it, where `asked`, people read SI: one choice for all that one command prints."""
    before = _IN_SI.set(asked)
    try:
        yield
    finally:
        _IN_SI.reset(before)


def display_unit(kind: str, symbol: str, unit: str = "") -> tuple[str, float]:
    """The unit in which people read a noise coefficient.

    Parameters
    ----------
    kind : str
        Kind of the channel: "rate", "angle", "acceleration", "velocity", "voltage", "counts", "unknown", ...
    symbol : str
        Q, N, B (and B_equiv), K, R, the Gauss-Markov q, sigma and T, amplitude and frequency of a line, or adev, mean,
        sd; of several terms of a kind with their number: sigma_2.
    unit : str, optional
        The channel's own unit, used where it has no SI meaning (counts, unknown).

    Returns
    -------
    text : str
    factor : float
        One unit of `text` is `factor` in SI; 1.0 where the channel keeps its own unit.

    Raises
    ------
    InputError
        A symbol that no noise term has.
    """
    symbol = _symbol(symbol)
    if symbol in ("T", "T_b", "tau"):
        return "s", 1.0
    if symbol in ("frequency", "f0"):
        return "Hz", 1.0
    if symbol not in _DISPLAY_UNITS:
        raise InputError(f"no noise coefficient named {symbol!r}")
    if kind in ("phase", "frequency"):
        return ("s" if kind == "phase" and symbol in ("mean", "sd") else _CLOCK_UNITS.get(symbol, "1")), 1.0
    if kind in _DISPLAY_COLUMN and _IN_SI.get():
        return si_unit(kind, symbol), 1.0
    if kind in _DISPLAY_COLUMN:
        text = _DISPLAY_UNITS[symbol][_DISPLAY_COLUMN[kind]]
        return text, parse_unit(text).factor
    base = "V" if kind == "voltage" else unit or "units"
    pattern = _DISPLAY_UNITS[symbol][2]
    return pattern.format(f"({base})" if "/" in base and pattern != "{}" else base), 1.0


def coefficient_unit(kind: str, symbol: str, unit: str) -> tuple[str, float]:
    """The unit in which people read a coefficient whose SI unit is known, and its size as for `display_unit`.

    >>> coefficient_unit("rate", "B", "rad/s")[0], coefficient_unit("counts", "N", "counts/√Hz")
    ('deg/h', ('counts/√Hz', 1.0))
    """
    return display_unit(kind, symbol) if kind in (*_DISPLAY_COLUMN, *_OF_THEIR_KIND) else (unit, 1.0)


_OF_THEIR_KIND = ("voltage", "phase", "frequency")
_SI_BASES = {"rate": "rad/s", "angle": "rad/s", "acceleration": "m/s²", "velocity": "m/s²", "voltage": "V"}
_SI_SHORT = {
    ("rad/s", "Q"): "rad",
    ("rad/s", "R"): "rad/s²",
    ("m/s²", "Q"): "m/s",
    ("m/s²", "R"): "m/s³",
}
_SI_PATTERNS = {
    "N": "{}/√Hz",
    "K": "{}/√s",
    "q": "{}/√s",
    "R": "{}/s",
    "T": "s",
    "Q": "{}·s",
    "frequency": "Hz",
}  # all others: the unit of the samples


def si_unit(kind: str, symbol: str, unit: str = "") -> str:
    """Text of the SI unit of a coefficient; the channel's own unit where that has no SI meaning."""
    symbol = _symbol(symbol)
    if kind in ("phase", "frequency"):
        return display_unit(kind, symbol)[0]
    base = _SI_BASES.get(kind, "")
    if (base, symbol) in _SI_SHORT:
        return _SI_SHORT[base, symbol]
    channel_unit = unit or "units"
    return _SI_PATTERNS.get(symbol, "{}").format(
        base or (f"({channel_unit})" if "/" in channel_unit else channel_unit)
    )


def _symbol(symbol: str) -> str:
    """A coefficient without the number of its term; B_equiv of a Gauss-Markov term is a B."""
    return re.sub(r"_\d+$", "", symbol).replace("B_equiv", "B")
