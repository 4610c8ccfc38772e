# SPDX-License-Identifier: BSD-3-Clause
"""The weight of a set of terms in words."""

from __future__ import annotations

__all__ = ["weight_words"]


def weight_words(weight: float) -> str:
    """A weight as people write it.

    >>> weight_words(0.613), weight_words(0.0012), weight_words(0.9999)
    ('61 %', '< 1 %', '> 99 %')
    """
    if weight < 0.01:
        return "< 1 %"
    return "> 99 %" if weight > 0.99 else f"{100 * weight:.0f} %"
