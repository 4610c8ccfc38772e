# SPDX-License-Identifier: BSD-3-Clause
"""Jobs: work outside the server, some at a time, the others in a queue; told how far they are, and ended at once.

A job that crashes has failed, and nothing else has happened: it runs in processes of its own.
"""

from __future__ import annotations

import errno
import secrets
import shutil
import threading
import time
from collections import deque
from collections.abc import Callable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any, Literal

from allanite.commands.page.catalogue import utc
from allanite.commands.page.children import Child, Nursery
from allanite.commands.page.options import asked_for
from allanite.commands.page.replies import Refused
from allanite.commands.page.settings import Limits
from allanite.commands.page.work import Work
from allanite.errors import AllaniteError
from allanite.lazy_dataclasses import dataclass

__all__ = ["Job", "Jobs"]

Json = Mapping[str, Any]
State = Literal["queued", "running", "done", "failed", "cancelled"]

_LOSS = 3  # exit code of a command whose record has gaps
_LINES = 40  # of what a command complains, that are kept


@dataclass(slots=True, eq=False)
class Job:
    """One piece of work.

    Attributes
    ----------
    id : str
    work : Work
    state : str
    number : int
        Of the last change of any job.
    """

    id: str
    work: Work
    state: State = "queued"
    number: int = 0
    progress: float = 0.0
    step: str = ""
    exit: int | None = None
    message: str = ""
    notes: list[str] = field(default_factory=list)
    created: float = field(default_factory=time.time)
    started: float | None = None
    ended: float | None = None
    document: Path | None = None
    files: tuple[Path, ...] = ()
    output: str = ""
    child: Child | None = field(default=None, repr=False)

    @property
    def over(self) -> bool:
        """Whether nothing more will happen."""
        return self.state in ("done", "failed", "cancelled")


class Jobs:
    """The queue.

    Parameters
    ----------
    limits : Limits
    finished : callable
        Told of a job that is done or has failed (it has a message then), before anybody else knows: keeps what it
        found out.

    Attributes
    ----------
    folders : set of Path
        Of all results so far, also of work that was cancelled: none is given to two jobs.
    number : int
        Of the last change of any job.
    """

    def __init__(self, limits: Limits, finished: Callable[[Job], None]) -> None:
        self._limits, self._finished = limits, finished
        self._lock = threading.Condition()
        self._jobs: dict[str, Job] = {}
        self.folders: set[Path] = set()
        self._queue: deque[Job] = deque()
        self._nursery = Nursery()
        self._closed = False
        self.number = 0
        for _ in range(limits.workers):
            threading.Thread(target=self._run, daemon=True).start()

    # -- for the page -----------------------------------------------------------------------------------------

    def prepare(self) -> None:
        """Have a child ready."""
        self._nursery.prepare()

    def submit(self, work: Work) -> Job:
        """Queue a piece of work.

        Raises
        ------
        Refused
            The queue is full, or the folder of the result cannot be made.
        FileExistsError
            Another program has made the folder of the result meanwhile.
        """
        with self._lock:
            if len(self._queue) >= self._limits.queue:
                raise Refused(
                    429, f"{len(self._queue)} jobs are already waiting: let some of them end, or cancel some"
                )
            _make(work)
            if work.folder is not None:
                self.folders.add(work.folder)
            job = Job(id=secrets.token_hex(12), work=work)
            self._jobs[job.id] = job
            self._queue.append(job)
            self._changed(job)
            self._forget()
            self._lock.notify()
            return job

    def get(self, given: object) -> Job:
        """The job with this id.

        Raises
        ------
        Refused
            There is none.
        """
        with self._lock:
            job = self._jobs.get(given) if isinstance(given, str) else None
        if job is None:
            raise Refused(404, "no job with this id")
        return job

    def all(self) -> list[Job]:
        """The newest first."""
        with self._lock:
            return list(reversed(self._jobs.values()))

    def since(self, number: int) -> list[Job]:
        """Those that have changed after a number."""
        with self._lock:
            return sorted((j for j in self._jobs.values() if j.number > number), key=lambda j: j.number)

    def place(self, job: Job) -> int | None:
        """In the queue, from 1."""
        with self._lock:
            return self._queue.index(job) + 1 if job in self._queue else None

    def running(self, kind: str, key: str) -> Job | None:
        """One that prepares this series already."""
        with self._lock:
            same = (
                j for j in self._jobs.values()
                if not j.over and j.work.kind == kind and j.work.series and j.work.series["key"] == key
            )  # fmt: skip
            return next(same, None)

    def cancel(self, job: Job) -> None:
        """End a job at once; one that is over stays as it is."""
        with self._lock:
            if job.over:
                return
            child = job.child
            if job in self._queue:
                self._queue.remove(job)
            self._end(job, "cancelled")
        if child is not None:
            child.end()
        _remove(job.work)

    def close(self) -> None:
        """End all jobs."""
        with self._lock:
            self._closed = True
            self._lock.notify_all()
        for job in self.all():
            self.cancel(job)
        self._nursery.close()

    # -- the work ---------------------------------------------------------------------------------------------

    def _run(self) -> None:
        while True:
            with self._lock:
                while not self._queue and not self._closed:
                    self._lock.wait()
                if self._closed:
                    return
                job = self._queue.popleft()
                job.state, job.started, job.child = "running", time.time(), self._nursery.take()
                self._changed(job)
                child = job.child
            if self._limits.ahead:
                self._nursery.prepare()
            self._follow(job, child)

    def _follow(self, job: Job, child: Child) -> None:
        """Give a job to a child and listen until it is over."""
        work = job.work
        child.tell(work.series or {"task": "command", "argv": list(work.argv), "cwd": str(work.cwd)})
        end: Json | None = None
        for word in child.words():
            if "ended" in word:
                end = word["ended"]
                break
            with self._lock:
                if not job.over:
                    job.progress, job.step = float(word.get("progress", 0.0)), str(word.get("step", ""))
                    self._changed(job)
        if end is None:
            self._died(job, child)
        else:
            self._ended(job, end)
        child.end()

    def _died(self, job: Job, child: Child) -> None:
        how = child.died()
        with self._lock:
            if job.over:
                return
            self._end(
                job,
                "failed",
                f"the process died {how}: the file is damaged, or memory ran out. Nothing else was affected",
            )
        _remove(job.work)

    def _ended(self, job: Job, end: Json) -> None:
        code = int(end["exit"])
        lines = [line for line in str(end.get("stderr", "")).splitlines() if line.strip()][-_LINES:]
        notes = [
            line.removeprefix("allanite: note: ") for line in lines if line.startswith("allanite: note: ")
        ]
        if code not in (0, _LOSS):
            rest = [line for line in lines if not line.startswith("allanite: note: ")]
            message = str(end.get("message") or "\n".join(rest)).removeprefix("allanite: ")
            job.message = message or f"the command ended with status {code}"
            self._tell(job, notes)
            with self._lock:
                if not job.over:
                    job.exit, job.notes = code, notes
                    self._end(job, "failed", job.message)
            _remove(job.work)
            return
        job.output = str(end.get("stdout", ""))
        job.document, job.files = _found(job.work)
        self._tell(job, notes)
        with self._lock:
            if not job.over:
                job.exit, job.notes = code, notes
                self._end(job, "done")

    def _tell(self, job: Job, notes: list[str]) -> None:
        try:
            self._finished(job)
        except (AllaniteError, KeyError, OSError, TypeError, ValueError) as error:
            notes.append(f"not kept: {error}")

    def _end(self, job: Job, state: State, message: str = "") -> None:
        job.state, job.message, job.ended, job.child = state, message, time.time(), None
        job.progress = 1.0 if state == "done" else job.progress
        self._changed(job)

    def _changed(self, job: Job) -> None:
        self.number += 1
        job.number = self.number

    def _forget(self) -> None:
        """The oldest that are over."""
        over = [j for j in self._jobs.values() if j.over]
        for job in over[: max(len(self._jobs) - self._limits.kept - self._limits.queue, 0)]:
            del self._jobs[job.id]

    # -- plain data -------------------------------------------------------------------------------------------

    def to_json(self, job: Job, document: str | None) -> dict[str, Any]:
        """One job; `document` is the id of its result."""
        now = job.ended or time.time()
        files = [(i, p) for i, p in enumerate(job.files) if p.exists()]
        return {
            "id": job.id, "kind": job.work.kind, "title": job.work.title, "state": job.state,
            "progress": round(job.progress, 4), "step": job.step, "place": self.place(job),
            "created": utc(job.created), "started": None if job.started is None else utc(job.started),
            "ended": None if job.ended is None else utc(job.ended),
            "seconds": 0.0 if job.started is None else round(now - job.started, 3),
            "command": job.work.command, "python": job.work.python, "exit": job.exit, "lossy": job.exit == _LOSS,
            "message": job.message, "asks": asked_for(job.message), "notes": job.notes,
            "recording": job.work.recording, "document": document,
            "series": job.work.series["key"] if job.work.series and job.state == "done" else None,
            "files": [{"index": i, "name": p.name, "size": p.stat().st_size} for i, p in files],
        }  # fmt: skip


def _make(work: Work) -> None:
    """The folder of the result, with what the command reads from it."""
    if work.folder is None:
        return
    try:
        work.folder.mkdir(parents=True)
    except FileExistsError:
        raise
    except OSError as error:
        raise _no_folder(work.folder, error) from None
    try:
        for name, text in (work.lists or {}).items():
            (work.folder / name).write_text(text, encoding="utf-8")
    except OSError as error:
        _remove(work)
        raise _no_folder(work.folder, error) from None


def _no_folder(folder: Path, error: OSError) -> Refused:
    return Refused(
        507 if error.errno == errno.ENOSPC else 409,
        f"no folder for the result: {error.strerror}: {folder.name}",
    )


def _remove(work: Work) -> None:
    """What a job has left that did not end well: the folder was made for it alone."""
    if work.folder is not None:
        shutil.rmtree(work.folder, ignore_errors=True)


def _found(work: Work) -> tuple[Path | None, tuple[Path, ...]]:
    """The document of a result, and all its files."""
    if work.folder is None or not work.folder.is_dir():
        return None, ()
    files = tuple(
        p for p in sorted(work.folder.rglob("*"))
        if p.is_file() and not p.is_symlink() and not p.name.startswith(".")
    )  # fmt: skip
    there = {p.name: p for p in files}
    return next((there[name] for name in work.result if name in there), None), files
