# SPDX-License-Identifier: BSD-3-Clause
"""Many records on several processes; what is done is kept, so that a run that was cut goes on where it stopped."""

from __future__ import annotations

import json
import time
from collections.abc import Callable, Sequence
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any

__all__ = ["Say", "place_of", "spread"]

Say = Callable[[str], None]

_WORDS = 20  # of progress in a run


def place_of(cache: Path | None, *names: object) -> Path | None:
    """The file in the cache of a run with these names; no file without a cache."""
    if cache is None:
        return None
    words = "-".join(str(name) for name in names)
    return cache / ("".join(c if c.isalnum() or c in "+." else "-" for c in words) + ".jsonl")


def spread(
    work: Callable[[Any], Any],
    tasks: Sequence[Any],
    *,
    workers: int,
    say: Say | None = None,
    place: Path | None = None,
    chunk: int = 4,
) -> list[Any]:
    """`work` of every task, in their order.

    Parameters
    ----------
    work : callable
        Of a module, or a partial of one: it goes to other processes. Its results go through JSON where they are kept:
        tuples come back as lists.
    place : Path, optional
        JSON lines, one for each of the first tasks: these are not done again. More tasks of the same run go after them.
    """
    done = [json.loads(line) for line in place.read_text().splitlines()] if place and place.exists() else []
    begun, todo = time.monotonic(), tasks[len(done) :]
    with ProcessPoolExecutor(workers) as pool:
        for i, result in enumerate(pool.map(work, todo, chunksize=chunk), 1):
            done.append(result)
            if place is not None:
                with place.open("a") as out:
                    out.write(json.dumps(result, default=_plain) + "\n")
            if say is not None and i % max(len(todo) // _WORDS, 1) == 0:
                left = (time.monotonic() - begun) / i * (len(todo) - i)
                say(
                    f"{'' if place is None else place.stem + ': '}{len(done)} of {len(tasks)}, {left:.0f} s left"
                )
    return done[: len(tasks)]


def _plain(value: Any) -> Any:
    """NumPy's scalars as Python's."""
    return value.item()
