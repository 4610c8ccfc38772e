# SPDX-License-Identifier: BSD-3-Clause
"""Files that were written, and figures on paper."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.atomic_file import fresh, refuse_existing

__all__ = ["Delivered", "refuse_figure", "save_figure"]

_FIGURES = (".pdf", ".svg", ".png")


@dataclass(frozen=True, slots=True, kw_only=True)
class Delivered:
    """Files that were written, and why others were not.

    Attributes
    ----------
    files : tuple of Path
    notes : tuple of str
        One sentence for each file that could not be made.
    """

    files: tuple[Path, ...]
    notes: tuple[str, ...]


def refuse_figure(path: str | os.PathLike[str], *, force: bool) -> None:
    """Raise, before hours are spent, if a figure cannot be written there.

    Raises
    ------
    InputError
        A suffix that is no picture.
    StorageError
        The file exists and `force` is not given.
    """
    if Path(path).suffix.lower() not in _FIGURES:
        raise InputError(f"{path}: a figure is written as {', '.join(_FIGURES)}; give one of these suffixes")
    refuse_existing(path, force=force)


def save_figure(result: object, path: str | os.PathLike[str], *, force: bool = False, **options: Any) -> Path:
    """Draw a result on paper; the suffix of the path says how. Options are those of `plot`."""
    from allanite.views.figures import plot

    refuse_figure(path, force=force)
    drawn = plot(result, **options)
    with fresh(path, force=force) as place:
        drawn.savefig(place, dpi=200)
    return Path(path)
