# SPDX-License-Identifier: BSD-3-Clause
"""What a bench test comes to, in a sentence."""

from __future__ import annotations

import math
from collections.abc import Sequence

from allanite.fitting.record_lengths import span

__all__ = ["check_sentence"]

_MOST = 5  # coefficients that a sentence names


def check_sentence(
    verdict: str, names: Sequence[str], of: int, unfitted: Sequence[str], needed: float | None
) -> str:
    """Which coefficients decide a check, and how long a record decides what is open.

    >>> check_sentence("fail", ["N of x"], 3, [], None)
    'N of x lies above its limit'
    >>> check_sentence("cannot tell", ["B of x", "K of x"], 3, [], 7200.0)
    'the limits of B of x, K of x lie inside the intervals; a record of about 2 h decides'
    >>> check_sentence("pass", ["N of x"], 3, [], None)
    'all 3 coefficients lie below their limits'
    """
    listed = ", ".join(names[:_MOST]) + (f" and {len(names) - _MOST} more" if len(names) > _MOST else "")
    one = len(names) == 1
    if verdict == "pass":
        return f"all {of} coefficients lie below their limits" if of > 1 else f"{listed} lies below its limit"
    if verdict == "fail":
        return f"{listed} lies above its limit" if one else f"{listed} lie above their limits"
    parts = [f"no sum of noise terms explains {', '.join(unfitted)}"] if unfitted else []
    if names:
        inside = "limit of {} lies inside its interval" if one else "limits of {} lie inside the intervals"
        parts.append(f"the {inside.format(listed)}")
    if needed is not None and math.isfinite(needed):
        parts.append(f"a record of about {span(needed)} decides")
    elif needed is not None:
        parts.append("no record of reasonable length decides")
    return "; ".join(parts)
