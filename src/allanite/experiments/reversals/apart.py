# SPDX-License-Identifier: BSD-3-Clause
"""Positions that were recorded one by one: where the time between them comes from, and what else was not told."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence

from allanite.lazy_dataclasses import dataclass
from allanite.quantities.earlier_documents import first_match
from allanite.quantities.result import Result

__all__ = ["PositionsApart", "apart_of_sentences"]

_TOLD = re.compile(r"the time between the (?:positions is that of the (table)|files is that of their stamps)")
_ASSUMED = re.compile(r"the (?:files|(rows)) do not say when they were \w+: (\S+) s are assumed between them")
_SD_IGNORED = "standard deviations in the table are not used"
_LEAST = re.compile(r"slow noise is allowed (\S+) s between rows at least")


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionsApart(Result):
    """Positions in files or in rows of a table, one by one.

    Attributes
    ----------
    rows : bool
        Rows of means in a table; else files.
    count : int
        How many there are.
    headed : bool
        The heading of each is known.
    assumed : float or None [s]
        Time from one to the next where they do not tell it; None where they do.
    least : float or None [s]
        Of rows: what slow noise is allowed between two at least, where less time is between some.
    sd_ignored : bool
        The table has standard deviations, and the noise is that of the model.
    """

    rows: bool = False
    count: int = 2
    headed: bool = True
    assumed: float | None = None
    least: float | None = None
    sd_ignored: bool = False

    @property
    def says(self) -> tuple[str, ...]:
        """Where the time between them comes from, and what was not used."""
        return tuple(self._sentences())

    def _sentences(self) -> Iterator[str]:
        what, when = ("rows", "taken") if self.rows else ("files", "recorded")
        time = (
            "the table gives the time between the positions"
            if self.rows
            else "the time stamps of the files give the time between them"
        )
        if self.assumed is not None:
            between = f"{self.assumed:g} s between them are assumed (--between)"
            time = f"the {what} do not state when they were {when}: {between}"
        if self.least is not None:
            time += f"; the rows are taken to start at least {self.least:g} s apart, the length of one mean"
        if self.count > 1:
            yield time
        if self.sd_ignored:
            yield f"the noise comes from the model: {_SD_IGNORED}"


def apart_of_sentences(advice: Sequence[str]) -> dict[str, object] | None:
    """The same, as plain data, of what a document of version 1 says; None where it says nothing of the kind."""
    known, assumed = (first_match(pattern, advice) for pattern in (_TOLD, _ASSUMED))
    time, sd_ignored = assumed or known, any(_SD_IGNORED in words for words in advice)
    if time is None and not sd_ignored:
        return None
    least = first_match(_LEAST, advice)
    return {
        "rows": time is None or bool(time[1]),
        "count": 1 if time is None else 2,
        "headed": not any("nothing says by how much the unit was turned" in words for words in advice),
        "assumed": None if assumed is None else float(assumed[2]),
        "least": None if least is None else float(least[1]),
        "sd_ignored": sd_ignored,
    }
