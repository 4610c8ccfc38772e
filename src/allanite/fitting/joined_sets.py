# SPDX-License-Identifier: BSD-3-Clause
"""The sets of a family, joined with those of the model that is reported from it.

A set is found in the full family, point estimates in the terms that the record supports or needs. The record rejects
neither: what the fewer terms estimate is not excluded, wherever the full family has its best fit. A set that would
leave out the value of the reported model is joined with the set of that parameter in the reported model.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

__all__ = ["joined_sets"]

Key = TypeVar("Key", str, int)
Ends = tuple[float, float]


def joined_sets(
    sets: Mapping[Key, Ends], values: Mapping[Key, float], of_reported: Callable[[Key], Ends]
) -> dict[Key, Ends]:
    """The sets, each of which holds its value.

    Parameters
    ----------
    sets : mapping of parameter to (float, float)
        In the full family.
    values : mapping of parameter to float
        Of the reported model, those of its terms.
    of_reported : callable
        The set of a parameter in the reported model. Called where a value lies outside.

    Returns
    -------
    dict
        What is supported stays so: no set is extended to zero.
    """
    return {key: _joined(ends, values.get(key), key, of_reported) for key, ends in sets.items()}


def _joined(ends: Ends, value: float | None, key: Key, of_reported: Callable[[Key], Ends]) -> Ends:
    if value is None or ends[0] <= value <= ends[1]:
        return ends
    low, high = of_reported(key)
    if ends[0] > 0 and low == 0:
        low = value
    return min(ends[0], low, value), max(ends[1], high, value)
