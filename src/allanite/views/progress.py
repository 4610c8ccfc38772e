# SPDX-License-Identifier: BSD-3-Clause
"""How far a long call is, for `progress=`: below the cell of a notebook, or on a terminal."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from html import escape
from importlib import import_module
from typing import Any

from allanite.views.terminal.console import progress

__all__ = ["progress_bar"]

Advance = Callable[..., None]
_INTERVAL = 0.1  # [s] between two states that are shown


@contextmanager
def progress_bar() -> Iterator[Advance]:
    """A bar for the argument `progress` of any function: it shows how far the call is, and is gone at the end.

    In a notebook it stands below the cell, on a terminal in the last line of stderr. Where nobody looks, a pipe or a
    file, it shows nothing.

    Yields
    ------
    callable
        Called with the fraction done and, if there is one, the name of the step.

    Examples
    --------
    >>> import allanite as al
    >>> model = al.NoiseModel.of(al.White(N=1e-4))
    >>> with al.progress_bar() as bar:
    ...     recording = al.simulate(model, rate=100.0, duration=60.0, seed=1, progress=bar)
    """
    if _in_notebook():
        bar = _NotebookBar()
        try:
            yield bar
        finally:
            bar.close()
        return
    with progress() as advance:
        yield advance or _unseen


def _unseen(fraction: float, text: str = "") -> None:
    """Nobody looks."""


def _in_notebook() -> bool:
    """Whether a kernel of Jupyter runs this process; IPython on a terminal has none."""
    shells = sys.modules.get("IPython")
    return getattr(shells and shells.get_ipython(), "kernel", None) is not None


class _NotebookBar:
    """A bar below a cell, as HTML that is replaced: every notebook shows it, without a widget."""

    def __init__(self) -> None:
        self._display = import_module("IPython.display")
        self._text, self._shown_at = "", time.monotonic()
        self._place: Any = self._display.display(self._bar(0.0), display_id=True)

    def __call__(self, fraction: float, text: str = "") -> None:
        self._text = text or self._text
        if (now := time.monotonic()) - self._shown_at >= _INTERVAL:
            self._shown_at = now
            self._place.update(self._bar(fraction))

    def close(self) -> None:
        self._place.update(self._display.HTML(""))

    def _bar(self, fraction: float) -> Any:
        done = f"{100 * fraction:.0f} %"
        return self._display.HTML(
            f'<progress value="{fraction:.4f}" max="1" style="width: 20em"></progress> {done} {escape(self._text)}'
        )
