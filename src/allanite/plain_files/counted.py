# SPDX-License-Identifier: BSD-3-Clause
"""Counts and lists in sentences: the noun and the verb beside a count agree with it."""

from __future__ import annotations

from collections.abc import Sequence

__all__ = ["listed", "plural"]

_HISSING = ("ch", "sh", "s", "x")
#: Verbs of the singular that no ending makes.
_SINGULAR = {"are": "is", "were": "was", "have": "has", "do": "does", "cannot": "cannot", "can": "can"}


def plural(count: int, noun: str, verb: str = "") -> str:
    """A number with its noun, and the verb that follows.

    Parameters
    ----------
    count : int
    noun : str
        Of one of them.
    verb : str, optional
        Of several of them; what follows its first word stays.

    >>> plural(1, "stretch"), plural(2, "stretch"), plural(1, "position", "determine"), plural(3, "lag", "can be used")
    ('1 stretch', '2 stretches', '1 position determines', '3 lags can be used')
    """
    counted = f"{count} {noun}" if count == 1 else f"{count} {noun}{'es' if noun.endswith(_HISSING) else 's'}"
    if not verb:
        return counted
    first, _, rest = verb.partition(" ")
    if count == 1:
        first = _SINGULAR.get(first) or first + ("es" if first.endswith(_HISSING) else "s")
    return f"{counted} {first} {rest}".rstrip()


def listed(names: Sequence[str]) -> str:
    """Names as people list them.

    >>> listed(["x"]), listed(["x", "y", "z"]), listed([])
    ('x', 'x, y and z', '')
    """
    return " and ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))
