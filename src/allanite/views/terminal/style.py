# SPDX-License-Identifier: BSD-3-Clause
"""How much of a result a terminal shows, and in which units."""

from __future__ import annotations

from allanite.lazy_dataclasses import dataclass

__all__ = ["BRIEF", "TerminalStyle"]


@dataclass(frozen=True, slots=True, kw_only=True)
class TerminalStyle:
    """What a user wants to see.

    Attributes
    ----------
    si : bool
        Coefficients in SI units, instead of customary ones.
    details : bool
        Every finding in full with its advice, and all notes.
    quiet : bool
        Nothing but the files that were written.
    """

    si: bool = False
    details: bool = False
    quiet: bool = False


BRIEF = TerminalStyle()
