# SPDX-License-Identifier: BSD-3-Clause
"""One task for each log over an executor: some at a time, and again where a worker was lost."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, Executor, Future, ThreadPoolExecutor, wait
from contextlib import contextmanager
from typing import Any

from allanite import __version__
from allanite.commands.fleet import worker
from allanite.errors import WorkerError
from allanite.plain_files.extras import require

__all__ = ["Workers", "dask_client", "outcomes", "workers"]

Json = Mapping[str, Any]
_ANSWER = 10.0  # s to wait for a scheduler
_AHEAD = 2  # tasks for each thread that works, so that none waits for the next one


class Workers:
    """Where tasks go, and how many at a time."""

    def __init__(self, executor: Executor, room: Callable[[], int]) -> None:
        self.executor, self.room = executor, room


def outcomes(tasks: Iterable[Json], at: Workers, retries: int) -> Iterator[tuple[Json, Json]]:
    """Tasks with their outcomes, as they come.

    Parameters
    ----------
    retries : int
        Further attempts where the worker failed, not the log.

    Raises
    ------
    WorkerError
        The executor takes no more tasks.
    """
    waiting = iter(tasks)
    running: dict[Future[Any], tuple[Json, int]] = {}
    while True:
        while len(running) < at.room() and (task := next(waiting, None)) is not None:
            running[_submitted(at, task)] = task, 0
        if not running:
            return
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            task, attempts = running.pop(future)
            error = future.exception()
            if error is None:
                yield task, future.result()
            elif attempts < retries:
                running[_submitted(at, task)] = task, attempts + 1
            else:
                yield task, _lost(error)


def _submitted(at: Workers, task: Json) -> Future[Any]:
    try:
        return at.executor.submit(worker.run_log, task)
    except RuntimeError as fault:  # broken, or shut down
        raise WorkerError(
            f"the executor takes no more logs: {fault}; what is done is kept, run it again"
        ) from fault


def _lost(error: BaseException) -> dict[str, Any]:
    """The outcome of a log that no worker brought to an end."""
    kind = "" if isinstance(error, WorkerError) else f" ({type(error).__name__})"
    words = f"WorkerError: {' '.join(str(error).split())}{kind}"
    return {"sha256": None, "rows": [], "error": words, "findings": [], "again": True}


@contextmanager
def workers(
    *, executor: Executor | None = None, client: Any = None, count: int | None = None
) -> Iterator[Workers]:
    """An executor that the caller has, that of a Dask client, or threads that hold a process each."""
    if executor is not None:
        most = getattr(executor, "_max_workers", None) or os.cpu_count() or 1
        yield Workers(executor, lambda: _AHEAD * most)
    elif client is not None:
        _refuse_other_versions(client)
        yield Workers(client.get_executor(), lambda: _AHEAD * max(sum(client.nthreads().values()), 1))
    else:
        _refuse_without_fork()
        count = count or os.cpu_count() or 1
        pool = ThreadPoolExecutor(count, thread_name_prefix="fleet")
        try:
            yield Workers(pool, lambda: count)
        finally:
            worker.end_processes()
            pool.shutdown(wait=True, cancel_futures=True)


def _refuse_without_fork() -> None:
    if not hasattr(os, "fork"):
        raise WorkerError(
            "a fleet needs a process for each log, made by fork, which Windows does not have. Run it in the Windows "
            "Subsystem for Linux, or on workers with Linux (--scheduler)"
        )


def _refuse_other_versions(client: Any) -> None:
    try:
        versions = client.run(worker.version)
    except Exception as fault:
        raise WorkerError(
            f"a worker cannot import allanite {__version__}: {fault}; install it there"
        ) from fault
    other = {address: v for address, v in versions.items() if v != __version__}
    if other:
        listed = ", ".join(f"{address} has {v}" for address, v in sorted(other.items()))
        raise WorkerError(
            f"all workers need allanite {__version__}: {listed}; install one version everywhere"
        )


@contextmanager
def dask_client(address: str) -> Iterator[Any]:
    """A client of a scheduler.

    Raises
    ------
    WorkerError
        Dask is not installed, or nobody answers.
    """
    require("distributed", "cluster", "a scheduler of Dask", error=WorkerError)
    from distributed import Client

    connect: Callable[..., Any] = Client
    try:
        client = connect(address, timeout=_ANSWER)
    except (OSError, ValueError) as fault:
        raise WorkerError(
            f"no scheduler answers at {address}: {fault}; give its address as in tcp://host:8786"
        ) from None
    with client:
        yield client
