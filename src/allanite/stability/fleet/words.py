# SPDX-License-Identifier: BSD-3-Clause
"""What a fleet says, in sentences."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

__all__ = ["by_channel", "capability_sentence", "counted", "named", "none_sentence", "stand_out_sentence"]

_MOST = 5  # units that a sentence names


def counted(n: int, what: str) -> str:
    """A number of things.

    >>> counted(1, "unit"), counted(1200, "unit")
    ('1 unit', '1200 units')
    """
    return f"{n} {what}" if n == 1 else f"{n} {what}s"


def named(names: Sequence[str]) -> str:
    """The first of several names.

    >>> named(["a", "b"]), named(list("abcdefg"))
    ('a, b', 'a, b, c, d, e, …')
    """
    return ", ".join(names[:_MOST]) + (", …" if len(names) > _MOST else "")


def by_channel(coefficients: Iterable[str]) -> str:
    """Coefficients, each channel named once.

    >>> by_channel(["Q of gx", "B of gx", "N of gy"])
    'Q, B of gx and N of gy'
    """
    symbols: dict[str, list[str]] = {}
    for coefficient in coefficients:
        symbol, channel = coefficient.split(" of ", 1)
        symbols.setdefault(channel, []).append(symbol)
    each = [f"{', '.join(of_channel)} of {channel}" for channel, of_channel in symbols.items()]
    return " and ".join(("; ".join(each[:-1]), each[-1])) if len(each) > 1 else "".join(each)


def stand_out_sentence(units: Sequence[str], of: int, rate: float) -> str:
    """Which units, and how many of them may be there by chance.

    >>> stand_out_sentence(["sn7", "sn12"], 300, 0.05)
    'sn7, sn12: 2 of 300 units; about 5 % of such units are false alarms'
    """
    share = f"{len(units)} of {counted(of, 'unit')}"
    return f"{named(units)}: {share}; about {100 * rate:g} % of such units are false alarms"


def none_sentence(units: int, coefficients: int, rate: float) -> str:
    """What was looked at.

    >>> none_sentence(300, 18, 0.05)
    '300 units in 18 coefficients, at a false discovery rate of 5 %'
    """
    looked_at = f"{counted(units, 'unit')} in {counted(coefficients, 'coefficient')}"
    return f"{looked_at}, at a false discovery rate of {100 * rate:g} %"


def capability_sentence(verdict: str, names: Sequence[str], allowed: float, confidence: float) -> str:
    """Which coefficients decide a capability, by the interval of their share beyond the limit.

    >>> capability_sentence("meets", ["N of x", "B of x"], 0.01, 0.95)
    'N of x, B of x: at most 1 % of units lie above the limit, with 95 % confidence'
    >>> capability_sentence("does not meet", ["N of x"], 0.01, 0.95)
    'N of x: more than 1 % of units lie above the limit, with 95 % confidence'
    >>> capability_sentence("cannot tell", ["N of x"], 0.01, 0.95)
    'N of x: the 95 % interval of the share of units above the limit includes 1 %'
    """
    listed = named(names)
    share, sure = f"{100 * allowed:.4g} %", f"{100 * confidence:.4g} %"
    if verdict == "cannot tell":
        return f"{listed}: the {sure} interval of the share of units above the limit includes {share}"
    least = "at most" if verdict == "meets" else "more than"
    return f"{listed}: {least} {share} of units lie above the limit, with {sure} confidence"
