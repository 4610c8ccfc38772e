# SPDX-License-Identifier: BSD-3-Clause
"""New logs of a fleet as they come: each is taken once it no longer grows."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from allanite.commands.fleet.addresses import logs_of
from allanite.commands.fleet.folder import FleetFolder
from allanite.commands.fleet.jobs import workers
from allanite.commands.fleet.running import FleetRun, run_logs

__all__ = ["watch"]


def watch(
    folder: str | os.PathLike[str],
    *,
    every: float = 10.0,
    once: bool = False,
    client: Any = None,
    max_workers: int | None = None,
    progress: Callable[[float, str], None] | None = None,
) -> Iterator[FleetRun]:
    """Look for new and changed logs, with the settings of the run that made the fleet.

    Parameters
    ----------
    folder : path
        Of a fleet.
    every : float [s]
        Between two looks. A log that changes from one to the next is still being written, and waits.
    once : bool
        Take what is there, as it is, and end.

    Yields
    ------
    FleetRun
        After each look that took logs, and at least one with `once`.

    Raises
    ------
    FormatError
        The folder is no fleet.
    InputError
        An address that is not reached.
    """
    fleet = FleetFolder(folder)
    settings = fleet.settings()
    before: dict[str, str] = {}
    with fleet.locked(), workers(client=client, count=max_workers) as at:
        while True:
            logs = logs_of(settings["paths"], Path(settings["folder"]), none_is_fine=True)
            ready = [log for log in logs if once or before.get(log.name) == log.stamp]
            new = [
                log
                for log in ready
                if (state := fleet.logs.get(log.name)) is None or state.stamp != log.stamp
            ]
            if new or once:
                yield run_logs(fleet, settings, new, at, progress)
            if once:
                return
            before = {log.name: log.stamp for log in logs}
            time.sleep(every)
