# SPDX-License-Identifier: BSD-3-Clause
"""Files that were written, and figures on paper."""

from __future__ import annotations

import io
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from allanite.errors import InputError
from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.atomic_file import fresh, refuse_existing
from allanite.plain_files.extras import require

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
        A suffix that is no picture, or one that needs a package which is not installed.
    StorageError
        The file exists and `force` is not given.
    """
    suffix = Path(path).suffix.lower()
    if suffix not in _FIGURES:
        raise InputError(f"{path}: a figure is written as {', '.join(_FIGURES)}; give one of these suffixes")
    if suffix != ".svg":
        require("matplotlib", "plot", f"a figure as {suffix}", ", or write it as .svg")
    refuse_existing(path, force=force)


def save_figure(result: object, path: str | os.PathLike[str], *, force: bool = False, **options: Any) -> Path:
    """Draw a result on paper; the suffix of the path says how. Options are those of `plot`."""
    refuse_figure(path, force=force)
    suffix = Path(path).suffix.lower()
    drawn = _svg(result, options) if suffix == ".svg" else _by_matplotlib(result, suffix, options)
    with fresh(path, force=force) as place:
        place.write_bytes(drawn)
    return Path(path)


def _svg(result: object, options: Mapping[str, Any]) -> bytes:
    """By our own drawing, which needs no package."""
    from allanite.views.figures import sheet_of
    from allanite.views.figures.picture import svg

    return svg(sheet_of(result, **options)).encode()


def _by_matplotlib(result: object, suffix: str, options: Mapping[str, Any]) -> bytes:
    from allanite.views.figures import plot

    drawn = io.BytesIO()
    plot(result, **options).savefig(drawn, format=suffix[1:], dpi=200)
    return drawn.getvalue()
