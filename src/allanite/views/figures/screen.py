# SPDX-License-Identifier: BSD-3-Clause
"""Panels on screen: `spec` states them as plain data; our own scripts (``panel.js``, ``chart.js``) draw them.

Colors travel as names; `palette` gives a page their values, as CSS variables.
"""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator
from dataclasses import MISSING, fields
from functools import cache
from html import escape
from pathlib import Path
from typing import Any

import numpy as np

from allanite.lazy_dataclasses import dataclass
from allanite.plain_files.atomic_file import fresh
from allanite.plain_files.printable import printable
from allanite.views.figures.frames import limits_of
from allanite.views.figures.panel import DARK, LIGHT, SPAN_LOOKS, Panel, ShadedSpan, Sheet

__all__ = ["SCRIPTS", "ScreenFigure", "palette", "script", "spec", "style"]

Json = dict[str, Any]

_HERE = Path(__file__).parent
#: In the order in which a page runs them.
SCRIPTS = ("panel.js", "chart.js")
_PARTS = ("curves", "envelopes", "guides", "labels", "limits", "rugs", "legend")


def spec(sheet: Sheet) -> Json:
    """The panels of a sheet as plain lists and dictionaries, numbers to six digits."""
    return {"columns": sheet.columns, "panels": [*_panels(sheet)]}


def _panels(sheet: Sheet) -> Iterator[Json]:
    for number, row in enumerate(sheet.rows):
        for column, panel in enumerate(row):
            made = _drawn(panel) if panel.drawing is not None else _plotted(panel)
            made["aspect"] = round(panel.aspect, 5)
            if len(sheet.panels) > 1:
                made["title"] = panel.title
            if column == 0:
                made["first"] = True
            if not sheet.labelled(number):
                made["numbered"] = False
            yield made


def _drawn(panel: Panel) -> Json:
    return {"drawing": _plain(panel.drawing)}


def _plotted(panel: Panel) -> Json:
    x, y = limits_of(panel)
    made = {name: _plain(parts) for name in _PARTS if (parts := getattr(panel, name))}
    made |= {"x": {**_plain(panel.x), "limits": _plain(x)}, "y": {**_plain(panel.y), "limits": _plain(y)}}
    made |= {"spans": [_span(span) for span in panel.spans]} if panel.spans else {}
    return {**made, "key": panel.key, "square": panel.square and panel.height is None}


def _span(span: ShadedSpan) -> Json:
    look = SPAN_LOOKS[span.kind]
    return {"start": _number(span.start), "stop": _number(span.stop), **_plain(look), "top": look.top}


def _plain(value: Any) -> Any:
    """Dataclasses as dictionaries, without what has its default."""
    if isinstance(value, np.ndarray):
        return value.tolist() if value.dtype == bool else [*map(_number, value.tolist())]
    if isinstance(value, float):
        return _number(value)
    if isinstance(value, str):
        return printable(value, lines=True)
    if isinstance(value, tuple):
        return [*map(_plain, value)]
    if hasattr(value, "__dataclass_fields__"):
        parts = ((f, getattr(value, f.name)) for f in fields(value))
        return {f.name: _plain(part) for f, part in parts if not _is_default(f.default, part)}
    return value


def _is_default(default: object, part: object) -> bool:
    return default is not MISSING and not isinstance(part, np.ndarray) and part == default


def _number(value: float) -> float | None:
    return float(f"{value:.6g}") if math.isfinite(value) else None


# -- what a page needs --------------------------------------------------------------------------------------------


@cache
def script() -> str:
    """Our scripts, which define `AllaniteChart`."""
    return "".join((_HERE / name).read_text(encoding="utf-8") for name in SCRIPTS)


@cache
def style() -> str:
    """How figures look, with the values of their colors."""
    return palette() + (_HERE / "chart.css").read_text(encoding="utf-8")


def palette() -> str:
    """The colors of figures as CSS variables: light, dark, and light again on paper."""
    light, dark = (
        " ".join(f"--of-{name}: {value};" for name, value in colours.items()) for colours in (LIGHT, DARK)
    )
    return (
        f":root {{ {light} }}\n"
        f"@media (prefers-color-scheme: dark) {{ :root:not([data-theme=light]) {{ {dark} }} }}\n"
        f":root[data-theme=dark] {{ {dark} }}\n"
        f"@media print {{ :root:root:root {{ {light} }} }}\n"
    )


@dataclass(frozen=True, slots=True)
class ScreenFigure:
    """A figure that a reader can zoom and read, in a notebook or as a file of its own; it needs no network.

    Attributes
    ----------
    sheet : Sheet
    dark : bool
        Light ink on a dark ground.
    """

    sheet: Sheet
    dark: bool = False

    def to_html(self) -> str:
        """A complete page."""
        theme = "dark" if self.dark else "light"
        data = json.dumps(spec(self.sheet), ensure_ascii=True).replace("<", "\\u003c")
        title = escape("; ".join(dict.fromkeys(panel.title for panel in self.sheet.panels)), quote=False)
        return (
            f'<!doctype html>\n<html lang="en" data-theme="{theme}">\n<meta charset="utf-8">\n'
            '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
            f"<title>{title}</title>\n<style>\n{style()}</style>\n"
            f'<body class="chart-page">\n<main><h1 class="chart-status">{title}</h1><div id="figure"></div></main>\n'
            f'<script type="application/json" id="data">{data}</script>\n<script>\n{script()}\n'
            'const chart = new AllaniteChart(document.getElementById("figure"));\n'
            'chart.show(JSON.parse(document.getElementById("data").textContent));\n'
            'window.addEventListener("resize", () => chart.draw());\n</script>\n</html>\n'
        )

    def save(self, path: str | os.PathLike[str], *, force: bool = False) -> Path:
        """Write the page.

        Parameters
        ----------
        path : path
            Path of the HTML file.
        force : bool
            Replace a file that is there.

        Raises
        ------
        StorageError
            The file exists and `force` is not given, or the disk refuses.
        """
        with fresh(path, force=force) as place:
            place.write_text(self.to_html(), encoding="utf-8")
        return Path(path)

    def _repr_html_(self) -> str:
        """In a notebook: a frame, so that nothing of ours meets anything of the page around it."""
        height = round(
            sum(
                960 * max(panel.aspect for panel in row) / self.sheet.columns + 130 for row in self.sheet.rows
            )
        )
        page = escape(self.to_html())
        return f'<iframe srcdoc="{page}" style="width: 100%; height: {height}px; border: 0" title="Figure"></iframe>'
