# SPDX-License-Identifier: BSD-3-Clause
"""Panels on screen: Plotly figures. `spec` gives the plain document that the report puts into its page.

Only SVG traces: WebGL traces compile code, which a page's security policy rightly forbids. Colours carry their name
in ``meta`` so that a page can change them with its theme.
"""

from __future__ import annotations

import html
import math
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.figures.panel import (
    LIGHT,
    Array,
    Axis,
    Curve,
    Envelope,
    Guide,
    Label,
    Limit,
    Panel,
    Sheet,
    Span,
    decades,
)

if TYPE_CHECKING:
    from plotly.graph_objects import Figure

__all__ = ["figure", "spec"]

Json = dict[str, Any]

_DASH = {
    "solid": "solid",
    "dashed": "9px,4px",
    "dotted": "1px,3px",
    "dashdot": "9px,3px,2px,3px",
    "thin": "solid",
}
_MARKERS = {
    "circle": "circle",
    "square": "square",
    "triangle": "triangle-up",
    "diamond": "diamond",
    "down": "triangle-down",
    "cross": "x",
}
_SHIFTS = {"above": (0, 14), "below": (0, -14), "right": (8, 0), "left": (-8, 0)}
_WIDTH = 900  # pixels, for a figure that stands alone
_BESIDE = 84  # pixels between panels in a row


def figure(sheet: Sheet) -> Figure:
    """A Plotly figure that shows itself in a notebook without asking the network for its script."""
    from plotly.graph_objects import Figure

    class OfflineFigure(Figure):  # type: ignore[misc]
        """Plotly's own `_repr_html_` loads the script from another host; this one brings it along."""

        def _repr_html_(self) -> str:
            return str(self.to_html(include_plotlyjs=True, full_html=False))

        def _repr_mimebundle_(self, *_args: Any, **_kwargs: Any) -> Json:
            return {"text/html": self._repr_html_()}

        def _ipython_display_(self) -> None:
            raise NotImplementedError  # makes IPython use the bundle above

    return OfflineFigure(spec(sheet))


def spec(sheet: Sheet) -> Json:
    """Traces and layout of a sheet as plain lists and dictionaries, numbers to six digits."""
    parts = _Parts()
    titled = len(sheet.panels) > 1
    around = _around(sheet)
    across = _WIDTH * max(1.0, 0.52 * sheet.columns) - _MARGIN["l"] - _MARGIN["r"]
    each = (across - _BESIDE * (sheet.columns - 1)) / sheet.columns
    heights = [max(p.aspect for p in row) * each for row in sheet.rows]
    total = sum(heights) + around * (len(heights) - 1)
    top = total
    for row, height in zip(sheet.rows, heights, strict=True):
        up = (top - height) / total, top / total
        for column, panel in enumerate(row):
            start = column * (each + _BESIDE) / across
            last = row is sheet.rows[-1] or not panel.envelopes
            parts.add(panel, (start, start + each / across), up, titled=titled, last=last)
        top -= height + around
    bare = not any(p.curves for p in sheet.panels)  # no legend
    margin = {**_MARGIN, "t": 40 if bare else 64 if titled else 46}
    size = {
        "width": round(across + margin["l"] + margin["r"]),
        "height": round(total + margin["t"] + margin["b"]),
    }
    legend = {**_LEGEND, "y": 1 + (26 if titled else 18) / total}
    # A page that stretches the figure keeps its proportions with this: height = width share * aspect + the rest.
    meta = {"aspect": round(total / across, 5)}
    layout = {**parts.layout, **_LOOK, **size, "margin": margin, "legend": legend, "meta": meta}
    return {"data": parts.data, "layout": layout}


_MARGIN = {"l": 72, "r": 20, "t": 46, "b": 54}
_LEGEND: Json = {"orientation": "h", "x": 0, "xanchor": "left", "yanchor": "bottom", "itemsizing": "trace"}
_LOOK: Json = {
    "autosize": True,
    "font": {"family": "system-ui, -apple-system, 'Segoe UI', sans-serif", "size": 13, "color": LIGHT["ink"]},
    "paper_bgcolor": "rgba(0,0,0,0)",
    "plot_bgcolor": "rgba(0,0,0,0)",
    "hovermode": "closest",
}


class _Parts:
    """Traces and layout while they grow."""

    def __init__(self) -> None:
        self.data: list[Json] = []
        self.layout: Json = {"annotations": [], "shapes": []}
        self._named: set[str] = set()
        self._count = 0

    def add(
        self, panel: Panel, across: tuple[float, float], up: tuple[float, float], *, titled: bool, last: bool
    ) -> None:
        self._count += 1
        n = "" if self._count == 1 else str(self._count)
        self.layout[f"xaxis{n}"] = {**_axis(panel.x), "domain": _rounded(across), "anchor": f"y{n}"}
        self.layout[f"yaxis{n}"] = {**_axis(panel.y), "domain": _rounded(up), "anchor": f"x{n}"}
        if not last:
            self.layout[f"xaxis{n}"] |= {"title": {"text": ""}, "showticklabels": False}
        if panel.square:  # as many pixels per decade upwards as to the right
            self.layout[f"yaxis{n}"] |= {"scaleanchor": f"x{n}", "scaleratio": 1, "constrain": "domain"}
            self.layout[f"xaxis{n}"] |= {"constrain": "domain"}
        where = {"xaxis": f"x{n}", "yaxis": f"y{n}"}
        ref = {"xref": f"x{n}", "yref": f"y{n}"}
        log = panel.x.log, panel.y.log
        for envelope in panel.envelopes:
            self.data.append({**_envelope(envelope), **where})
        for guide in panel.guides:
            self.data.append({**_guide(guide), **where})
            self.layout["annotations"].append({**_guide_name(guide), **ref})
        for limit in panel.limits:
            self.data.append({**_limit(limit), **where})
            self.layout["annotations"] += [{**a, **ref} for a in _limit_words(limit)]
        for curve in panel.curves:
            self.data += [{**t, **where} for t in _curve(curve, self._first)]
        for label in panel.labels:
            self._label(label, where, ref, log)
        for span in panel.spans:
            self.layout["shapes"].append({**_span(span), "xref": f"x{n}", "yref": f"y{n} domain"})
        for at, name in panel.x.landmarks:
            self.layout["annotations"].append(
                {
                    **_words(name, "guide"),
                    "x": _place(at, log[0]),
                    "y": 1,
                    "xref": f"x{n}",
                    "yref": f"y{n} domain",
                }
                | {"yanchor": "bottom", "font": {"size": 11, "color": LIGHT["guide"]}}
            )
        if titled:
            title: Json = {"x": 0, "y": 1, "xref": f"x{n} domain", "yref": f"y{n} domain", "xanchor": "left"}
            text = {
                **_words(f"<b>{_plain(panel.title)}</b>", "ink", plain=True),
                "yanchor": "bottom",
                "yshift": 3,
            }
            self.layout["annotations"].append({**text, **title})

    def _label(self, label: Label, where: Json, ref: Json, log: tuple[bool, bool]) -> None:
        if label.place == "line":
            line = {"type": "line", "x0": label.x, "x1": label.x, "y0": 0, "y1": 1, "layer": "below"}
            look = {"line": {"color": LIGHT[label.colour], "width": 1, "dash": "dash"}, "name": label.colour}
            self.layout["shapes"].append(
                {**line, **look, "xref": ref["xref"], "yref": f"{ref['yref']} domain"}
            )
            foot = {
                "x": _place(label.x, log[0]),
                "y": 0,
                "yanchor": "bottom",
                "xanchor": "right",
                "textangle": -90,
            }
            words = {
                **_words(label.text, label.colour),
                **foot,
                "xref": ref["xref"],
                "yref": f"{ref['yref']} domain",
            }
            self.layout["annotations"].append(words)
            return
        point: Json = {
            "x": [label.x],
            "y": [label.y],
            "type": "scatter",
            "mode": "markers",
            "showlegend": False,
        }
        dot: Json = {"color": "white", "size": 8, "line": {"color": LIGHT[label.colour], "width": 1.5}}
        words = {**_words(label.text, label.colour), **_beside(label.side), **ref}
        self.data.append({**point, "marker": dot, "meta": label.colour, "hoverinfo": "skip", **where})
        self.layout["annotations"].append(
            {**words, "x": _place(label.x, log[0]), "y": _place(label.y, log[1])},
        )

    def _first(self, name: str) -> bool:
        """True the first time that a name asks for its entry in the legend."""
        new = name not in self._named
        self._named.add(name)
        return new


# -- traces -----------------------------------------------------------------------------------------------


def _curve(curve: Curve, first: Any) -> list[Json]:
    colour, name = LIGHT[curve.colour], _plain(curve.label)
    group = name or "model"
    traces: list[Json] = []
    if curve.lower is not None and curve.upper is not None:
        traces.append(_band(curve, curve.lower, curve.upper, group))
    line = {"color": colour, "dash": _DASH[curve.style], "width": 1 if curve.style == "thin" else 2}
    trace: Json = {
        "type": "scatter",
        "x": _numbers(curve.x),
        "y": _numbers(curve.y),
        "mode": "lines+markers" if curve.marker and curve.x.size <= 120 else "lines",
        "line": line,
        "name": name,
        "meta": curve.colour,
        "legendgroup": group,
        "showlegend": bool(name) and first(name),
        "hoverinfo": "skip" if curve.marker is None and curve.lower is None else "all",
    }
    if curve.marker:
        trace["marker"] = {"symbol": _symbols(curve), "size": 7, "color": colour}
    if curve.lower is not None and curve.upper is not None:
        trace["customdata"] = [
            list(pair) for pair in zip(_numbers(curve.lower), _numbers(curve.upper), strict=True)
        ]
        trace["hovertemplate"] = "%{x:.4g}: %{y:.4g} [%{customdata[0]:.4g}, %{customdata[1]:.4g}]"
    return [*traces, trace]


def _band(curve: Curve, lower: Array, upper: Array, group: str) -> Json:
    good = np.isfinite(lower) & np.isfinite(upper) & (lower > 0)
    look = {"fill": "toself", "fillcolor": _faint(curve.colour, 0.18), "line": {"width": 0}, "mode": "lines"}
    facts = {"name": "", "legendgroup": group, "meta": curve.colour}
    return {"type": "scatter", **_outline(curve.x, lower, upper, good), **look, **facts, **_SILENT}


def _outline(x: Array, lower: Array, upper: Array, good: NDArray[np.bool_]) -> Json:
    """Closed outlines, one around each unbroken run of good points, with a null between them."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], good, [False])).astype(np.int8)))
    xs: list[float | None] = []
    ys: list[float | None] = []
    for start, stop in edges.reshape(-1, 2):
        run = slice(start, stop)
        xs += [*_numbers(np.concatenate([x[run], x[run][::-1]])), None]
        ys += [*_numbers(np.concatenate([lower[run], upper[run][::-1]])), None]
    return {"x": xs[:-1], "y": ys[:-1]}


def _symbols(curve: Curve) -> str | list[str]:
    symbol = _MARKERS[curve.marker or "circle"]
    if curve.hollow is None or not curve.hollow.any():
        return symbol
    return [f"{symbol}-open" if hollow else symbol for hollow in curve.hollow.tolist()]


def _envelope(envelope: Envelope) -> Json:
    good = np.isfinite(envelope.low) & np.isfinite(envelope.high)
    line = {"width": 0.5, "color": LIGHT[envelope.colour]}
    look = {"fill": "toself", "fillcolor": _faint(envelope.colour, 0.5), "line": line, "mode": "lines"}
    outline = _outline(envelope.x, envelope.low, envelope.high, good)
    return {"type": "scatter", **outline, **look, "meta": envelope.colour, **_SILENT}


def _guide(guide: Guide) -> Json:
    look = {"mode": "lines", "line": {"color": LIGHT["guide"], "width": 1}, "meta": "guide"}
    return {"type": "scatter", "x": _numbers(guide.x), "y": _numbers(guide.y), **look, **_SILENT}


def _limit(limit: Limit) -> Json:
    look = {"mode": "lines", "line": {"color": LIGHT["limit"], "width": 1.5, "dash": "dot"}, "meta": "limit"}
    return {"type": "scatter", "x": _numbers(limit.x), "y": _numbers(limit.y), **look, **_SILENT}


_SILENT = {"hoverinfo": "skip", "showlegend": False}


# -- words ------------------------------------------------------------------------------------------------


def _words(text: str, colour: str, *, plain: bool = False) -> Json:
    look = {"font": {"size": 12, "color": LIGHT[colour]}, "bgcolor": _faint("paper", 0.8), "borderpad": 0}
    return {"text": text if plain else _plain(text), "showarrow": False, "name": colour, **look}


def _beside(side: str, lower: float = 0) -> Json:
    dx, dy = (sum(_SHIFTS[word][i] for word in side.split()) for i in (0, 1))
    anchor = "left" if dx > 0 else "right" if dx < 0 else "center"
    return {"xshift": dx, "yshift": dy - lower * (dy < 0), "xanchor": anchor, "yanchor": "middle"}


def _guide_name(guide: Guide) -> Json:
    angle = -math.degrees(math.atan(guide.slope))
    place = {
        "x": _place(guide.name_x, True),
        "y": _place(guide.name_y, True),
        "textangle": angle,
        "yshift": 0,
    }
    return {**_words(guide.name, "guide"), **place, "font": {"size": 11, "color": LIGHT["guide"]}}


def _limit_words(limit: Limit) -> list[Json]:
    place = {"x": _place(limit.at[0], True), "y": _place(limit.at[1], True)}
    arrow = {"showarrow": True, "arrowhead": 2, "arrowwidth": 2, "arrowcolor": LIGHT["limit"], "text": ""}
    # The arrow's head is at (x, y) + shift, its foot a further (ax, ay) pixels away: down from the line.
    head = {"ax": 0, "ay": -24, "yshift": -26, "standoff": 0, "name": "limit"}
    return [{**arrow, **head, **place}, {**_words(limit.text, "limit"), **_beside(limit.side, 8), **place}]


def _span(span: Span) -> Json:
    colour, top = ("gap", 1.0) if span.kind == "gap" else ("finding", 0.05)
    look = {"fillcolor": LIGHT[colour], "opacity": 0.35 if span.kind == "gap" else 0.9, "name": colour}
    edge = {"line": {"width": 1, "color": LIGHT[colour]}, "layer": "below" if span.kind == "gap" else "above"}
    return {"type": "rect", "x0": span.start, "x1": span.stop, "y0": 0, "y1": top, **look, **edge}


# -- axes and places --------------------------------------------------------------------------------------


def _axis(axis: Axis) -> Json:
    made: Json = {
        "title": {"text": _plain(axis.label), "standoff": 8},
        "gridcolor": LIGHT["grid"],
        "linecolor": LIGHT["guide"],
        "tickcolor": LIGHT["guide"],
        "showline": True,
        "mirror": True,
        "ticks": "outside",
        "zeroline": False,
    }
    if axis.log:
        made |= {
            "type": "log",
            "tickformat": "~g",
            "dtick": _spacing(axis),
            "minor": {"ticks": "outside", "ticklen": 3, "showgrid": False},
        }
    if axis.limits:
        made["range"] = [_place(end, axis.log) for end in axis.limits]
    return made


def _ticks(axis: Axis) -> int:
    """One tick per decade as the figure opens; zoomed in, the same number falls inside the decades."""
    whole = decades(axis.limits) if axis.limits else 6.0
    return 8 if whole < 2 else math.ceil(whole) + 1


def _spacing(axis: Axis) -> int | str:
    """One tick per decade; 1, 2, 5 in less than two of them; all digits in less than one."""
    whole = decades(axis.limits) if axis.limits else 6.0
    return 1 if whole > 2 else "D2" if whole > 1 else "D1"


def _place(value: float, log: bool) -> float:
    """Annotations and ranges of a logarithmic axis are given as exponents."""
    return round(math.log10(value), 5) if log else value


def _rounded(ends: tuple[float, float]) -> list[float]:
    return [min(max(round(end, 5), 0.0), 1.0) for end in ends]


def _around(sheet: Sheet) -> float:
    """Pixels between rows: room for words below an axis and a title above the next."""
    return 28 if any(p.envelopes for p in sheet.panels) else 92


def _numbers(values: Any) -> list[float | None]:
    return [
        float(f"{v:.6g}") if math.isfinite(v) else None for v in np.asarray(values, dtype=np.float64).tolist()
    ]


def _faint(colour: str, alpha: float) -> str:
    red, green, blue = (int(LIGHT[colour][i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{alpha})"


def _plain(text: str) -> str:
    """Text that Plotly must not read as markup or as mathematics."""
    return html.escape(text, quote=False).replace("$", "&#36;")
