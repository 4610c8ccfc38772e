# SPDX-License-Identifier: BSD-3-Clause
"""What the manifest of a run tells besides samples: the plan, gaps with their reasons, trouble, the end."""

from __future__ import annotations

from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

__all__ = ["Story", "utc_text"]

#: Reasons of gaps that are told apart; a run that gives more has the others together.
_REASONS = 20
_OTHER_REASONS = "other reasons"


class Story:
    """The manifest, read on at each look.

    Attributes
    ----------
    status, reason : str
        As of `allanite.files.store.Run`.
    planned : int or None
        Samples of the planned duration.
    end : int
        Number behind the last sample that is noted as missing.
    remarks : int
        Of the instrument: rejected lines, garbage, doubled frames, counters in doubt.
    last_gap : dict or None
    """

    def __init__(self, folder: Path) -> None:
        self._folder, self._offset = folder, 0
        self._close: Mapping[str, Any] | None = None
        self._because: dict[str, list[int]] = {}
        self._trouble: tuple[int, str] | None = None  # the last: its clock, and what it was
        self.status = self.reason = ""
        self.planned: int | None = None
        self.end = self.remarks = 0
        self.last_gap: Mapping[str, Any] | None = None

    def look(self) -> None:
        """Read what was added."""
        from allanite.files.store.manifest import is_locked, read_manifest_on

        alive = is_locked(self._folder)  # asked first: who ends meanwhile has written its end
        lines, self._offset = read_manifest_on(self._folder, self._offset)
        for line in lines:
            self._take(line)
        if self._close is not None:
            self.status, self.reason = str(self._close["status"]), str(self._close["reason"])
        else:
            self.status = "recording" if alive else "unfinished"

    def because(self) -> list[Mapping[str, Any]]:
        """Gaps by their reason, the largest first."""
        ranked = sorted(self._because.items(), key=lambda item: -item[1][1])
        return [{"reason": reason, "gaps": gaps, "samples": samples} for reason, (gaps, samples) in ranked]

    def trouble_after(self, clock_ns: int) -> str | None:
        """Why nothing has come since a sample, as far as that is noted; None where nothing is."""
        if self._trouble is None or self._trouble[0] <= clock_ns:
            return None
        return self._trouble[1]

    def _take(self, line: Mapping[str, Any]) -> None:
        kind = line["kind"]
        if kind == "plan":
            self.planned = int(line["samples"])
        elif kind == "end":
            self._close = line
        elif kind in ("silence", "lost"):
            self._trouble = int(line["monotonic_ns"]), str(line.get("reason", ""))
        elif kind == "remark":
            self.remarks += int(line.get("more", 1))
        elif kind == "gap" and "samples" in line:
            self._take_gap(line)

    def _take_gap(self, line: Mapping[str, Any]) -> None:
        reason, samples = str(line.get("reason", "")), int(line["samples"])
        known = reason in self._because or len(self._because) < _REASONS
        sums = self._because.setdefault(reason if known else _OTHER_REASONS, [0, 0])
        sums[0] += 1
        sums[1] += samples
        if "counter" in line:
            self.end = max(self.end, int(line["counter"]) + samples)
        self.last_gap = {
            "counter": line.get("counter"),
            "samples": samples,
            "reason": reason,
            "noted": utc_text(datetime.fromtimestamp(int(line["utc_ns"]) / 1e9, UTC)),
        }


def utc_text(moment: datetime) -> str:
    """2026-11-22T18:26:00Z."""
    return f"{moment:%Y-%m-%dT%H:%M:%SZ}"
