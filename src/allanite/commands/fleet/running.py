# SPDX-License-Identifier: BSD-3-Clause
"""fleet(paths): from many logs to one table."""

from __future__ import annotations

import hashlib
import json
import os
import tempfile
import time
from collections.abc import Callable, Collection, Mapping, Sequence
from concurrent.futures import Executor
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from allanite import __version__
from allanite.commands.fleet.addresses import LogAddress, logs_of
from allanite.commands.fleet.folder import FleetFolder, LogState
from allanite.commands.fleet.jobs import Workers, outcomes, workers
from allanite.commands.fleet.labels import LogLabels
from allanite.commands.option import READING
from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.atomic_file import fresh, make_folder
from allanite.quantities.number_words import duration as duration_words

if TYPE_CHECKING:
    import pyarrow as pa

    from allanite.study.study import Study

__all__ = ["TIMEOUT", "FleetRun", "fleet", "labels_of", "run_logs"]

Progress = Callable[[float, str], None]
Json = Mapping[str, Any]

TIMEOUT = 3600.0
"""Time that a log may take, unless another is given [s]."""
_STUDIES = "studies"
_FILES = ("layout",)  # reading options that name a file
_READING = ", ".join(option.python for option in READING)


@dataclass(frozen=True, slots=True, kw_only=True)
class FleetRun:
    """What a run of a fleet leaves.

    Attributes
    ----------
    folder : Path
    path : Path
        Of the table, a folder of Parquet files.
    done : int
        Logs that were characterized in this run.
    kept : int
        Logs that were done before and have not changed.
    failed : tuple of str
        Logs of this run and of those before without a result, by name.
    """

    folder: Path
    path: Path
    done: int
    kept: int
    failed: tuple[str, ...]

    @property
    def table(self) -> pa.Table:
        """The table: one row for each log, channel and coefficient (docs/reference/fleet-table.md)."""
        from allanite.stability.fleet.rows import read_table

        return read_table(self.path)

    def errors(self, most: int) -> dict[str, str]:
        """Of the first logs that failed: the first line of why."""
        from allanite.stability.fleet.rows import read_table

        names = self.failed[:most]
        rows = read_table(self.path, columns=["log", "error"], filters=[("log", "in", names)])
        errors = dict(zip(rows["log"].to_pylist(), rows["error"].to_pylist(), strict=True))
        return {name: str(errors.get(name)).partition("\n")[0] for name in names}

    def study(self, log: str) -> Study:
        """The whole study of a log: the one that was kept, or made again from the log.

        Raises
        ------
        InputError
            No such log in the fleet.
        AllaniteError
            What the log is refused for.
        """
        from allanite.commands.fleet.one_log import local_copy, studied
        from allanite.study.study import Study

        folder = FleetFolder(self.folder)
        folder.load()
        state, settings = folder.logs.get(log), folder.settings()
        if state is None:
            raise InputError(f"no log {log!r} in {self.folder}; logs are named as in the column 'log'")
        saved = _study_file(self.folder, state.sha256)
        if saved is not None and saved.is_file():
            return Study.load(saved)
        place = log if "://" in log else os.fspath(Path(settings["folder"]) / log)
        with tempfile.TemporaryDirectory() as scratch:
            return studied(local_copy(place, scratch), log, settings["reading"], settings["options"])[1]


def fleet(
    paths: str | os.PathLike[str] | Sequence[str | os.PathLike[str]],
    *,
    out: str | os.PathLike[str],
    pattern: str | None = None,
    metadata: str | os.PathLike[str] | None = None,
    executor: Executor | None = None,
    client: Any = None,
    max_workers: int | None = None,
    timeout: float = TIMEOUT,
    memory: float | None = None,
    retries: int = 2,
    keep: bool = False,
    accept: Collection[str] = (),
    temperature: str | Mapping[str, str] | None = None,
    warm_up: Literal["model", "cut"] | None = None,
    exclude: Sequence[tuple[float, float]] = (),
    progress: Progress | None = None,
    **reading: Any,
) -> FleetRun:
    """Characterize many logs, each in a process of its own, and gather the results in one table.

    A log that is in the table is not done again unless its content, the options or the version of allanite changed.
    A log that fails, hangs or needs too much memory is one row with its error. The run may be ended at any moment: the
    next one goes on with what is left.

    Parameters
    ----------
    paths : path, or sequence of path
        Globs (``logs/**/*.csv``) and addresses of fsspec (``s3://bucket/logs/*.csv``).
    out : path
        Folder of the fleet, with fleet.parquet.
    pattern : str, optional
        What the end of a path says of its log: ``{lot}/{unit}_{date}_{temperature}C.csv``. Each name becomes a column;
        a log that does not match is a row with an error.
    metadata : path, optional
        CSV file with a column "unit" or "log"; its other columns become columns of the table.
    executor : concurrent.futures.Executor, optional
        Where the logs are done; by default processes of this machine.
    client : dask.distributed.Client, optional
        The workers of its scheduler read the logs themselves, from a shared folder or an address.
    max_workers : int, optional
        Processes of this machine; by default one for each processor.
    timeout : float [s]
        Time that a log may take.
    memory : float, optional [bytes]
        Memory that a log may take; by default 80 % of the machine's, shared by its processors.
    retries : int
        Further attempts where a worker was lost.
    keep : bool
        Keep the studies, in the folder "studies", by the SHA-256 of the log.
    accept, temperature, warm_up, exclude
        As for `characterize`.
    progress : callable, optional
        Called with the fraction done and how many logs and how much time are left.
    **reading
        Options of `read`: unit, rate, channels, ...

    Returns
    -------
    FleetRun

    Raises
    ------
    InputError
        No log, or a pattern or metadata that name none.
    StorageError
        Another run writes the folder, or the disk refuses.
    WorkerError
        Workers without allanite, or with another version.
    """
    if unknown := reading.keys() - {option.python for option in READING}:
        raise InputError(f"fleet takes no option {', '.join(sorted(unknown))}; those of read are: {_READING}")
    given = [paths] if isinstance(paths, (str, os.PathLike)) else [*paths]
    settings: dict[str, Any] = {
        "paths": [os.fspath(path) for path in given],
        "folder": os.fspath(Path.cwd()),
        "pattern": pattern,
        "metadata": None if metadata is None else os.fspath(Path(metadata).absolute()),
        "reading": {k: os.fspath(Path(v).absolute()) if k in _FILES and v else v for k, v in reading.items()},
        "options": {
            "accept": [*accept], "temperature": temperature, "warm_up": warm_up, "exclude": [[*e] for e in exclude]
        },
        "timeout": timeout, "memory": memory, "retries": retries, "keep": keep,
    }  # fmt: skip
    labels, logs = labels_of(settings), logs_of(settings["paths"], Path(settings["folder"]))
    _refuse_all_unmatched(logs, labels, pattern)
    folder = FleetFolder(out)
    with folder.locked(), workers(executor=executor, client=client, count=max_workers) as at:
        folder.save_settings(settings)
        folder.forget_failed([log.name for log in logs])
        return run_logs(folder, settings, logs, at, progress)


def labels_of(settings: Json) -> LogLabels:
    """What the settings of a fleet say of its logs."""
    return LogLabels(settings["pattern"], settings["metadata"])


def run_logs(
    folder: FleetFolder,
    settings: Json,
    logs: Sequence[LogAddress],
    at: Workers,
    progress: Progress | None = None,
) -> FleetRun:
    """Do those of the logs that are not done, and make the table; the folder is locked by the caller."""
    labels, key = labels_of(settings), _key(settings)
    todo = [log for log in logs if not _is_done(folder.logs.get(log.name), log.stamp, key)]
    refused = {log.name: reason for log in todo if (reason := labels.refusal(log.name))}
    tasks = {log.name: _task(log, settings, key, folder.logs.get(log.name)) for log in todo}
    for name, reason in refused.items():
        folder.commit(_rows(tasks.pop(name), {"rows": [], "error": f"InputError: {reason}"}))
    advance = _CountedLogs(len(tasks), progress)
    try:
        for task, outcome in outcomes(tasks.values(), at, settings["retries"]):
            _take(folder, task, outcome)
            advance(failed=outcome["error"] is not None)
    finally:
        folder.compact(labels)
    failed = (name for name, state in folder.logs.items() if state.failed)
    return FleetRun(
        folder=folder.path,
        path=folder.table,
        done=len(todo),
        kept=len(logs) - len(todo),
        failed=tuple(sorted(failed)),
    )


def _refuse_all_unmatched(logs: Sequence[LogAddress], labels: LogLabels, pattern: str | None) -> None:
    if all(reasons := [labels.refusal(log.name) for log in logs]):
        raise InputError(
            f"{logs[0].name}: {reasons[0]}, nor does any other of {len(logs)} logs; correct the pattern {pattern!r}"
        )


# -- one log ---------------------------------------------------------------------------------------------


def _key(settings: Json) -> str:
    """Of all that a result depends on, beside the content of the log."""
    text = json.dumps([__version__, settings["reading"], settings["options"]], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def _is_done(state: LogState | None, stamp: str, key: str) -> bool:
    return state is not None and (state.stamp, state.key) == (stamp, key)


def _task(log: LogAddress, settings: Json, key: str, state: LogState | None) -> dict[str, Any]:
    return {
        "log": log.name, "place": log.place, "stamp": log.stamp, "key": key, "version": __version__,
        "known": state.sha256 if state is not None and state.key == key else None,
        **{name: settings[name] for name in ("reading", "options", "timeout", "memory", "keep")},
    }  # fmt: skip


def _take(folder: FleetFolder, task: Json, outcome: Json) -> None:
    """Keep what came of a log."""
    if not outcome["rows"] and outcome["error"] is None:  # its content is what it was
        folder.touch(task["log"], task["stamp"])
        return
    saved = _study_file(folder.path, outcome["sha256"])
    if outcome.get("study") and saved is not None:
        make_folder(saved.parent)
        with fresh(saved, force=True, durable=True) as place:
            place.write_text(outcome["study"], encoding="utf-8")
    folder.commit(_rows(task, outcome))


def _rows(task: Json, outcome: Json) -> list[dict[str, Any]]:
    """Rows for a part; of a log that failed there is one, with the error."""
    of_log = {
        "log": task["log"],
        "sha256": outcome.get("sha256"),
        "version": task["version"],
        "seconds": outcome.get("seconds"),
        "_stamp": task["stamp"],
        "_key": "" if outcome.get("again") else task["key"],
        "_temperature": outcome.get("temperature"),
        "_start": outcome.get("start"),
    }
    refused = {"status": "error", "error": outcome["error"], "findings": outcome.get("findings", [])}
    return [row | of_log for row in outcome["rows"] or [refused]]


def _study_file(folder: Path, sha256: str | None) -> Path | None:
    return None if sha256 is None else folder / _STUDIES / f"{sha256}.json"


class _CountedLogs:
    """Counts logs, and says how many and how much time are left."""

    def __init__(self, total: int, progress: Progress | None) -> None:
        self._total, self._progress, self._began = total, progress, time.monotonic()
        self._done = self._failed = 0

    def __call__(self, *, failed: bool) -> None:
        self._done += 1
        self._failed += failed
        if self._progress is None:
            return
        left = (time.monotonic() - self._began) * (self._total - self._done) / self._done
        words = f"{self._done} of {self._total} logs"
        words += f", {self._failed} failed" if self._failed else ""
        words += f", {duration_words(left)} left" if self._done < self._total else ""
        self._progress(self._done / self._total, words)
