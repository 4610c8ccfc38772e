# SPDX-License-Identifier: BSD-3-Clause
"""Numbers that a user gives of a motion, checked."""

from __future__ import annotations

import numpy as np

from allanite.errors import InputError

__all__ = ["Span", "numbers", "span"]

#: One value, or the two ends of a range from which each turn draws its own.
Span = float | tuple[float, float]


def numbers(what: str, given: object) -> tuple[float, ...]:
    """One number or several in a row.

    Raises
    ------
    InputError
        Something else, or numbers that are not finite; `what` names them.
    """
    try:
        array = np.atleast_1d(np.asarray(given, dtype=np.float64))
    except (TypeError, ValueError):
        raise InputError(f"{what} must be numbers, not {given!r}") from None
    if array.ndim != 1 or not np.isfinite(array).all():
        raise InputError(f"{what} must be finite numbers in one row, not {given!r}")
    return tuple(array.tolist())


def span(what: str, given: object) -> Span:
    """One number, or the two ends of a range.

    Raises
    ------
    InputError
        Something else.
    """
    ends = numbers(what, given)
    if len(ends) == 1:
        return ends[0]
    if len(ends) != 2 or ends[0] > ends[1]:
        raise InputError(f"{what} must be one number or the two ends of a range, not {given!r}")
    return ends[0], ends[1]
