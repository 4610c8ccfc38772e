# SPDX-License-Identifier: BSD-3-Clause
"""What is to be said of one kind of finding."""

from __future__ import annotations

from allanite.lazy_dataclasses import dataclass

__all__ = ["FindingKind"]


@dataclass(frozen=True, slots=True, kw_only=True)
class FindingKind:
    """One kind of finding.

    Attributes
    ----------
    group : str
        Heading in the printed table.
    severity : str
        The severities it can have, mildest first.
    means : str
        What the recording shows.
    risk : str
        What accepting it would risk.
    done : str
        What allanite does about it.
    advice : str
        What the user may do.
    excludes : bool
        True when the samples in question are left out of the analysis.
    repair : str
        Name of the repair of `allanite.recording.cleaning` that answers it; "" where there is none.
    """

    group: str
    severity: str
    means: str
    risk: str
    done: str
    advice: str
    excludes: bool = False
    repair: str = ""
