# SPDX-License-Identifier: BSD-3-Clause
"""A damaged run made whole, and a finished one in less space; beside the original."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from allanite.files.store import Recovery

__all__ = ["compaction_of", "recovery_document", "recovery_of"]


def recovery_of(
    run: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    dry_run: bool = False,
    progress: Callable[[float, str], None] | None = None,
) -> Recovery:
    """What can be read of a run; see `allanite.files.store.recover`.

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
    from allanite.files.store import recover

    advance = progress or (lambda fraction, what: None)
    place = Path(run).resolve()
    beside = place.with_name(f"{place.name}-recovered")
    return recover(
        run,
        None if dry_run else out or beside,
        progress=lambda fraction: advance(fraction, "reading"),
    )


def recovery_document(recovery: Recovery) -> Mapping[str, Any]:
    """Plain data of what was recovered, with what was noted as missing while recording."""
    from allanite.commands.run_account import account_of_recovery

    return {**recovery.to_json(), **account_of_recovery(recovery).to_json()}


def compaction_of(
    run: str | os.PathLike[str],
    out: str | os.PathLike[str] | None = None,
    *,
    part: int | None = None,
    force: bool = False,
) -> Mapping[str, Any]:
    """A finished run as one Parquet file; see `allanite.files.store.compact`. Plain data of what came of it.

    Parameters
    ----------
    out : path, optional
        New file; by default that of the run with ".parquet" behind its name.
    part : int, optional
        Where the settings changed in mid-run.

    Raises
    ------
    InputError, FormatError
        There is no run, or no such part.
    DataQualityError
        It is damaged, or its settings change and no part is named.
    StorageError
        It is still being recorded, the file exists, or the disk refuses.
    """
    from allanite.files.store import compact

    place = Path(run).resolve()
    made = compact(run, out or place.with_name(f"{place.name}.parquet"), part=part, force=force)
    return {
        "format": "allanite-compaction",
        "version": 1,
        "folder": str(run),
        "file": str(made),
        "bytes": made.stat().st_size,
        "bytes_of_run": sum(path.stat().st_size for path in place.iterdir() if path.is_file()),
    }
