# SPDX-License-Identifier: BSD-3-Clause
"""Powers of ten as plain text: with raised digits."""

from __future__ import annotations

import re

__all__ = ["raised", "raised_powers"]

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_POWER = re.compile(r"(?<=[\d\]])e([+-]?\d+)")


def raised(power: int) -> str:
    """-5 as ⁻⁵."""
    return str(power).translate(_RAISED)


def raised_powers(text: str) -> str:
    """1.2e-05 as 1.2 × 10⁻⁵."""
    return _POWER.sub(lambda m: f"\u202f×\u202f10{raised(int(m[1]))}", text)
