# SPDX-License-Identifier: BSD-3-Clause
"""A run out of an instrument: its folder, its warnings, its document."""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import TYPE_CHECKING, Any

from allanite.errors import DataQualityWarning

if TYPE_CHECKING:
    from allanite.capture import Captured, Progress
    from allanite.instruments import Identity, Instrument

__all__ = ["captured_document", "record_to", "run_name"]

Advance = Callable[[float, str], None]


def record_to(
    instrument: Instrument,
    out: str | os.PathLike[str],
    *,
    name: str = "",
    duration: float | None = None,
    scale_date: str | None = None,
    progress: Advance | None = None,
) -> Captured:
    """Record an instrument into a new folder under `out`, until the duration is over or a signal comes.

    Parameters
    ----------
    name : str
        Of the sensor, for the name of the folder; by default the model of the instrument.
    duration, scale_date
        As of `allanite.capture.capture`.
    progress : callable, optional
        Told the share done and how it is going.

    Raises
    ------
    InstrumentError, StorageError
        As of `allanite.capture.capture`.
    """
    from allanite.capture import capture, space_of, stopping_on_signals

    space = space_of(out, instrument.rate, len(instrument.channels), duration)
    if not space.enough and space.needed is not None:
        warnings.warn(
            f"the run needs {space.needed / 1e6:.0f} MB, and {space.free / 1e6:.0f} MB are free: make room, or record "
            "to another disk",
            DataQualityWarning,
            stacklevel=2,
        )

    def say(state: Progress) -> None:
        if progress is not None:
            progress(state.share or 0.0, _words(state))

    with stopping_on_signals() as stop:
        return capture(
            instrument,
            lambda identity: Path(out) / run_name(name or identity.model, identity, datetime.now(UTC)),
            duration=duration,
            stop=stop,
            scale_date=scale_date,
            progress=say,
        )


def run_name(name: str, identity: Identity, now: datetime) -> str:
    """<sensor>_<serial>_<UTC>, of characters that every system takes.

    >>> from allanite.instruments import Identity
    >>> meter = Identity(maker="HP", model="3458A", serial="US 28/1")
    >>> run_name("SiRRS01-03", meter, datetime(2026, 11, 22, tzinfo=UTC))
    'SiRRS01-03_US-28-1_20261122T000000Z'
    """
    parts = [name, identity.serial, f"{now:%Y%m%dT%H%M%SZ}"]
    return "_".join(re.sub(r"[^A-Za-z0-9.-]+", "-", part).strip("-.") for part in parts if part)


def _words(state: Progress) -> str:
    missing = f", {state.missing} missing" if state.missing else ""
    last = ", ".join(f"{v:.6g}" for v in state.values[:3])
    remark = f"; {state.remark}" if state.remark else ""
    return f"{state.samples} samples{missing}, last {last}{remark}"


def captured_document(found: Captured) -> Mapping[str, Any]:
    """Plain data of a run that has ended."""
    return {
        "format": "allanite-captured",
        "version": 1,
        "folder": str(found.folder),
        "instrument": found.identity.to_json(),
        "samples": found.samples,
        "missing": found.missing,
        "gaps": found.gaps,
        "dropped": found.dropped,
        "status": found.status,
        "reason": found.reason,
    }
