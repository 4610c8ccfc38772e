# SPDX-License-Identifier: BSD-3-Clause
"""A damaged run made whole, beside the original."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from allanite.log_store import Recovery

__all__ = ["recovery_of"]


def recovery_of(
    run: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    dry_run: bool = False,
    progress: Callable[[float, str], None] | None = None,
) -> Recovery:
    """What can be read of a run; see `allanite.log_store.recover`.

    Parameters
    ----------
    out : path, optional
        New folder; by default that of the run with "-recovered" behind its name.
    dry_run : bool
        Only look.

    Raises
    ------
    FormatError
        There is no run.
    StorageError
        It is still being recorded, the new folder holds a run, or the disk refuses.
    """
    from allanite.log_store import recover

    advance = progress or (lambda fraction, what: None)
    place = Path(run).resolve()
    beside = place.with_name(f"{place.name}-recovered")
    return recover(
        run,
        None if dry_run else out or beside,
        progress=lambda fraction: advance(fraction, "reading"),
    )
