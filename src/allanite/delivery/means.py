# SPDX-License-Identifier: BSD-3-Clause
"""A table with one row for each position, the means of its readings, read by whatever reader its file has."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING, Any

from allanite.delivery.recordings import read_part
from allanite.errors import InputError

if TYPE_CHECKING:
    from allanite.health import Finding
    from allanite.static_spans import PositionMeans, SdOf

__all__ = ["read_means"]


def read_means(
    table: str | os.PathLike[str],
    *,
    averaging: float | None = None,
    sd_of: SdOf | None = None,
    source: str | None = None,
    **options: Any,
) -> tuple[PositionMeans, tuple[Finding, ...]]:
    """The rows, and what is found of their text; see `means_of`.

    Parameters
    ----------
    **options
        Those of `read_part`, but for what a table of means does not have.

    Raises
    ------
    InputError
        An option of logs.
    """
    from allanite.health import CATALOGUE, LOG_DETECTORS
    from allanite.static_spans import means_of

    of_logs = [name for name in ("rate", "time", "start", "stop", "repair") if options.pop(name, None)]
    if of_logs:
        names = {"start": "from", "stop": "to"}
        raise InputError(
            f"--{names.get(of_logs[0], of_logs[0])} is for logs: rows of means are positions, not samples"
        )
    recording = read_part(table, rate=1.0, time="none", source=source, **options)
    found = [f for look in LOG_DETECTORS for f in look(recording)]
    means = means_of(recording, sd_of=sd_of, averaging=averaging)
    return means, tuple(f for f in found if CATALOGUE[f.code].group == "Text")
