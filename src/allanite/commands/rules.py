# SPDX-License-Identifier: BSD-3-Clause
"""Which options go together: what excludes each other, and what needs another."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

from allanite.lazy_dataclasses import dataclass

__all__ = ["OF_MEANS", "Conflict", "Requirement", "Rule", "of_logs"]


class Rule(Protocol):
    """Of options together."""

    @property
    def says(self) -> str: ...

    def broken(self, given: Mapping[str, object]) -> bool: ...


@dataclass(frozen=True, slots=True, kw_only=True)
class Conflict:
    """Options that exclude each other.

    Attributes
    ----------
    one : str
        As the function has it.
    others : tuple of str
        None of which goes with it.
    says : str
        The refusal.
    """

    one: str
    others: tuple[str, ...]
    says: str

    def broken(self, given: Mapping[str, object]) -> bool:
        """Whether options that were given exclude each other."""
        return self.one in given and any(name in given for name in self.others)


@dataclass(frozen=True, slots=True, kw_only=True)
class Requirement:
    """Options that need another.

    Attributes
    ----------
    any_of : tuple of str
        One of which is needed.
    by : tuple of str
        Where one of these is given; always, where there are none.
    says : str
        The refusal.
    """

    any_of: tuple[str, ...]
    by: tuple[str, ...] = ()
    says: str

    def broken(self, given: Mapping[str, object]) -> bool:
        """Whether what is needed is missing."""
        asked = not self.by or any(name in given for name in self.by)
        return asked and not any(name in given for name in self.any_of)


OF_MEANS: tuple[Rule, ...] = tuple(
    Requirement(any_of=("means",), by=(name,), says=f"--{name.replace('_', '-')} goes with --means")
    for name in ("averaging", "sd_of")
)
"""What only a table of means has."""


def of_logs(*names: str) -> tuple[Rule, ...]:
    """What a table of means has not."""
    return tuple(
        Conflict(
            one="means",
            others=(name,),
            says=f"--{name.replace('_', '-')} is for logs: leave it out with --means",
        )
        for name in names
    )
