# SPDX-License-Identifier: BSD-3-Clause
"""What a fleet says, in sentences."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["counted", "none_sentence", "stand_out_sentence"]

_MOST = 5  # units that a sentence names


def counted(n: int, what: str) -> str:
    """A number of things.

    >>> counted(1, "unit"), counted(1200, "unit")
    ('1 unit', '1200 units')
    """
    return f"{n} {what}" if n == 1 else f"{n} {what}s"


def stand_out_sentence(units: Sequence[str], of: int, rate: float) -> str:
    """Which units, and how many of them may be there by chance.

    >>> stand_out_sentence(["sn7", "sn12"], 300, 0.05)
    'sn7, sn12: 2 of 300 units; about 5 % of such units are false alarms'
    """
    names = ", ".join(units[:_MOST]) + (", …" if len(units) > _MOST else "")
    return f"{names}: {len(units)} of {counted(of, 'unit')}; about {100 * rate:g} % of such units are false alarms"


def none_sentence(units: int, coefficients: int, rate: float) -> str:
    """What was looked at.

    >>> none_sentence(300, 18, 0.05)
    '300 units in 18 coefficients, at a false discovery rate of 5 %'
    """
    looked_at = f"{counted(units, 'unit')} in {counted(coefficients, 'coefficient')}"
    return f"{looked_at}, at a false discovery rate of {100 * rate:g} %"
