# SPDX-License-Identifier: BSD-3-Clause
"""A Finding: one thing that is wrong, or worth knowing, about a recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field, replace
from enum import StrEnum
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.counted import plural
from allanite.recording.health.catalogue import CATALOGUE
from allanite.recording.records import merge_spans

__all__ = ["PLACES", "Finding", "Severity", "finding", "percent", "plural", "short"]

Spans = NDArray[np.int64]

#: Places that a finding names; the rest is counted.
PLACES = 5


class Severity(StrEnum):
    """How far a finding reaches.

    INFO
        Worth knowing; no number suffers.
    WARNING
        A number suffers, by an amount that is stated or small.
    FATAL
        Numbers would be wrong by much and nobody would see it: refused unless accepted by name.
    """

    INFO = "info"
    WARNING = "warning"
    FATAL = "fatal"

    @property
    def rank(self) -> int:
        """0 for the gravest, so that findings sort by it."""
        return ("fatal", "warning", "info").index(self.value)


def _no_spans() -> Spans:
    return np.zeros((0, 2), dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True)
class Finding:
    """One finding.

    Attributes
    ----------
    code : str
        Key of `allanite.recording.health.CATALOGUE`, as ``--accept`` takes it.
    severity : Severity
        Severity of the finding.
    channel : str or None
        Name of the channel; None for the whole recording.
    message : str
        The finding, with its numbers.
    advice : str
        Advice for the user.
    risk : str
        Risk of continuing despite the finding; "" if there is none.
    count : int
        Samples (rows, for the text of a file) that are affected.
    places : tuple of (start, stop), at most five [samples]
        First places to look at.
    excludes : bool
        True if `prepare` takes the samples of `spans` out of the analysis.
    accepted : bool
        True if the user accepted the finding.
    spans : ndarray of int64, shape (n_spans, 2) [samples]
        All places, sorted and disjoint; not serialized.
    """

    code: str
    severity: Severity
    channel: str | None
    message: str
    advice: str
    risk: str
    count: int
    places: tuple[tuple[int, int], ...] = ()
    excludes: bool = False
    accepted: bool = False
    spans: Spans = field(default_factory=_no_spans, repr=False, compare=False)

    def __str__(self) -> str:
        return f"{self.severity.value} {self.code}{_of(self.channel)}: {self.message}"

    def advise(self, advice: str) -> Finding:
        """The same finding with another advice; the repair that answers it stays."""
        return replace(self, advice=_with_repair(advice, CATALOGUE[self.code].repair))

    def unrepaired(self, repair: str) -> Finding:
        """The same finding where this repair would do harm: the advice does not name it."""
        return replace(self, advice=self.advice.removesuffix(_by_repair(repair)))

    def harmless(self) -> Finding:
        """The same finding for an analysis that does without what is lacking: at most a warning, and nothing to do."""
        severity = Severity.WARNING if self.severity is Severity.FATAL else self.severity
        return replace(self, severity=severity, advice="none needed")

    def accept(self) -> Finding:
        """The same finding, accepted."""
        return replace(self, accepted=True)

    def to_json(self) -> dict[str, Any]:
        """Plain data for a study."""
        return {
            "code": self.code,
            "severity": self.severity.value,
            "channel": self.channel,
            "message": self.message,
            "advice": self.advice,
            "risk": self.risk,
            "count": self.count,
            "places": [list(place) for place in self.places],
            "excludes": self.excludes,
            "accepted": self.accepted,
        }

    @classmethod
    def from_json(cls, data: Mapping[str, Any]) -> Finding:
        """Inverse of `to_json`; `spans` holds the places that were kept.

        Raises
        ------
        InputError
            A field is missing or of the wrong form.
        """
        try:
            places = tuple((int(a), int(b)) for a, b in data["places"])
            return cls(
                code=str(data["code"]),
                severity=Severity(data["severity"]),
                channel=data["channel"],
                message=str(data["message"]),
                advice=str(data["advice"]),
                risk=str(data["risk"]),
                count=int(data["count"]),
                places=places,
                excludes=bool(data.get("excludes", False)),
                accepted=bool(data["accepted"]),
                spans=_frozen(places),
            )
        except (KeyError, TypeError, ValueError) as error:
            raise InputError(f"not a finding: {error!r} in {dict(data)!r}") from None


def finding(
    code: str,
    message: str,
    *,
    severity: Severity,
    channel: str | None = None,
    spans: ArrayLike = (),
    count: int | None = None,
    excludes: bool = False,
    advice: str | None = None,
    shown: ArrayLike | None = None,
    weight: ArrayLike | None = None,
    repaired: bool = True,
) -> Finding:
    """A finding whose risk and advice come from the catalogue.

    Parameters
    ----------
    spans : array_like, shape (n_spans, 2) [samples]
    count : int, optional
        Default: the samples in `spans`.
    advice : str, optional
        In place of the catalogue's.
    shown : array_like, shape (n_shown, 2), optional
        The spans among which the places are chosen; default: `spans`.
    weight : array_like, shape (n_shown,), optional
        How bad each of these is; the worst become the places. Default: the first ones.
    repaired : bool
        The repair of the catalogue, if there is one, mends this.
    """
    entry = CATALOGUE[code]
    places = np.asarray(spans if shown is None else shown, dtype=np.int64).reshape(-1, 2)
    if weight is not None:
        places = places[np.argsort(np.asarray(weight), kind="stable")[::-1]]
    places = _frozen(places[:PLACES])
    merged = _frozen(spans)
    return Finding(
        code=code,
        severity=severity,
        channel=channel,
        message=message,
        advice=_with_repair(entry.advice if advice is None else advice, entry.repair if repaired else ""),
        risk=entry.risk,
        count=int(np.diff(merged, axis=1).sum()) if count is None else int(count),
        places=tuple((int(a), int(b)) for a, b in places),
        excludes=excludes,
        spans=merged,
    )


def percent(share: float) -> str:
    """A share as people write it: "0.12 %"."""
    return f"{100.0 * share:.{2 if share < 0.1 else 3}g} %"


def short(value: float) -> str:
    """A number to three digits, without an exponent where people would write none."""
    return f"{value:.3g}" if not 999.5 <= abs(value) < 1e7 else f"{value:.0f}"


def _with_repair(advice: str, repair: str) -> str:
    return advice + _by_repair(repair) if repair and f"--repair {repair}" not in advice else advice


def _by_repair(repair: str) -> str:
    return f" (--repair {repair})"


def _frozen(spans: ArrayLike) -> Spans:
    merged = merge_spans(np.asarray(spans, dtype=np.int64).reshape(-1, 2))
    merged.flags.writeable = False
    return merged


def _of(channel: str | None) -> str:
    return "" if channel is None else f" [{channel}]"
