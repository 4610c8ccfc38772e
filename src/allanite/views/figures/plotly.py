# SPDX-License-Identifier: BSD-3-Clause
"""Panels on screen: Plotly figures. `spec` gives the plain document that the report puts into its page.

Only SVG traces: WebGL traces compile code, which a page's security policy rightly forbids. Colours carry their name
in ``meta`` so that a page can change them with its theme.
"""

from __future__ import annotations

import html
import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from allanite.views.figures.drawing import Drawing, DrawnShape, Words
from allanite.views.figures.panel import (
    DARK,
    LIGHT,
    SPAN_LOOKS,
    Array,
    Axis,
    Curve,
    Envelope,
    Guide,
    Label,
    Limit,
    Panel,
    Rug,
    ShadedSpan,
    Sheet,
    SpanLook,
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
    "none": "solid",
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
_LEAST = (640, 820)  # pixels, for one panel with its legend above it, and for several
_BESIDE = 84  # pixels between panels in a row


#: Plotly offers a button that sends the data of a figure to a server of its makers.
_AT_HOME = {"displaylogo": False, "plotlyServerURL": "", "modeBarButtonsToRemove": ["sendChartToCloud"]}


def figure(sheet: Sheet, *, dark: bool = False) -> Figure:
    """A Plotly figure that shows itself in a notebook without asking the network for its script."""
    from plotly.graph_objects import Figure

    class OfflineFigure(Figure):  # type: ignore[misc]
        """Plotly's own `_repr_html_` loads the script from another host; this one brings it along."""

        def _repr_html_(self) -> str:
            return str(self.to_html(include_plotlyjs=True, full_html=False, config=_AT_HOME))

        def _repr_mimebundle_(self, *_args: Any, **_kwargs: Any) -> Json:
            return {"text/html": self._repr_html_()}

        def _ipython_display_(self) -> None:
            raise NotImplementedError  # makes IPython use the bundle above

    return OfflineFigure(spec(sheet, dark=dark))


def spec(sheet: Sheet, *, dark: bool = False) -> Json:
    """Traces and layout of a sheet as plain lists and dictionaries, numbers to six digits."""
    return _darkened(_spec(sheet)) if dark else _spec(sheet)


def _spec(sheet: Sheet) -> Json:
    parts = _PlotlyParts()
    titled = len(sheet.panels) > 1
    across = _WIDTH * max(1.0, 0.52 * sheet.columns) - _MARGIN["l"] - _MARGIN["r"]
    each = (across - _BESIDE * (sheet.columns - 1)) / sheet.columns
    heights = [max(p.aspect for p in row) * each for row in sheet.rows]
    gaps = [_between(sheet, i) for i in range(1, len(sheet.rows))]
    total = sum(heights) + sum(gaps)
    top = total
    for number, (row, height) in enumerate(zip(sheet.rows, heights, strict=True)):
        up = (top - height) / total, top / total
        for column, panel in enumerate(row):
            start = column * (each + _BESIDE) / across
            place = (start, start + each / across), up
            parts.add(panel, *place, titled=titled, labelled=sheet.labelled(number), total=total)
        top -= height + (gaps[number] if number < len(gaps) else 0)
    margin = {**_MARGIN, "t": _over(sheet)}
    if all(panel.drawing for panel in sheet.rows[-1]):
        margin["b"] = 20
    size = {
        "width": round(across + margin["l"] + margin["r"]),
        "height": round(total + margin["t"] + margin["b"]),
    }
    legend = {**_LEGEND, "y": 1 + (26 if titled else 18) / total}
    # A page that stretches the figure keeps its proportions with this: height = width share * aspect + the rest. The
    # words of a drawing belong to its proportions: at another width they are so many times as large. Legends and
    # titles between panels do not: below the least width the page has to scroll.
    meta: Json = {"aspect": round(total / across, 5)}
    if any(panel.drawing for panel in sheet.panels):
        meta["drawn_at"] = size["width"]
    keys = len(sheet.panels) > 1 and any(panel.key == "above" for panel in sheet.panels)
    if sheet.columns > 1 or keys or any(panel.drawing for panel in sheet.panels):
        meta["least"] = _LEAST[len(sheet.rows) > 1]
    if len(sheet.rows) > 1 and not any(panel.square or panel.drawing for panel in sheet.panels):
        meta["tall"] = round(total)  # rows that become no lower on a narrow screen
    if switches := [curve for panel in sheet.panels for curve in panel.switches]:
        meta["switches"] = [[_plain(c.axis), c.axis, c.colour, c.marker or "line"] for c in switches]
    layout = {**parts.layout, **_LOOK, **size, "margin": margin, "legend": legend, "meta": meta}
    return {"data": parts.data, "layout": layout}


def _darkened(document: Json) -> Json:
    """The same document in the colours for a dark ground, by the names that its parts carry."""
    for trace in document["data"]:
        value = DARK.get(trace.get("meta", ""), DARK["ink"])
        if "line" in trace:
            trace["line"] = {**trace["line"], "color": value}
        if "fillcolor" in trace:
            trace["fillcolor"] = _faint(trace["meta"], float(trace["fillcolor"].split(",")[-1][:-1]), DARK)
        if "marker" in trace:
            hollow = "line" in trace["marker"]
            edge = {"line": {"color": value, "width": 1.5}} if hollow else {}
            trace["marker"] = {**trace["marker"], "color": DARK["paper"] if hollow else value, **edge}
    layout = document["layout"]
    for note in layout["annotations"]:
        note["font"] = {**note.get("font", {}), "color": DARK[note["name"]]}
        note |= {key: DARK[note["name"]] for key in ("arrowcolor",) if key in note}
        note |= {key: _faint("paper", 0.8, DARK) for key in ("bgcolor",) if key in note}
    for shape in layout["shapes"]:
        shape["line"] = {**shape["line"], "color": DARK[shape["name"]]}
        shape |= {key: DARK[shape["name"]] for key in ("fillcolor",) if key in shape}
    for key in [k for k in layout if k[:5] in ("xaxis", "yaxis")]:
        colours = {"gridcolor": "grid", "linecolor": "guide", "tickcolor": "guide"}
        layout[key] = {**layout[key], **{part: DARK[name] for part, name in colours.items()}}
    ground = {"paper_bgcolor": DARK["paper"], "plot_bgcolor": DARK["paper"]}
    document["layout"] = {**layout, **ground, "font": {**layout["font"], "color": DARK["ink"]}}
    return document


def _over(sheet: Sheet) -> int:
    """Pixels above the first row: for its title and its legend, or for one legend of the whole sheet."""
    titled = len(sheet.panels) > 1
    keys = max(map(_key_height, sheet.rows[0]))
    if keys:
        return 24 + keys + (20 if titled else 0) + (14 if any(p.x.landmarks for p in sheet.rows[0]) else 0)
    if sheet.panels[0].drawing is not None:
        return 40 if titled else 14
    bare = not any(p.curves for p in sheet.panels)  # no legend
    return 40 if bare else 64 if titled else 46


def _between(sheet: Sheet, number: int) -> float:
    """Pixels between a row and the one above it: for the words below an axis, a title, a legend."""
    above, row = sheet.rows[number - 1], sheet.rows[number]
    words = 8 if above[0].drawing or not sheet.labelled(number - 1) else 56
    landmarks = 14 if any(p.x.landmarks for p in row) else 0
    return words + 22 + (max(map(_key_height, row)) or (16 if words > 8 else 0)) + landmarks


def _key_height(panel: Panel) -> int:
    """Pixels that the legend above a panel takes."""
    return 3 + 20 * panel.key_grid(_CHARACTERS)[1] if panel.key == "above" else 0


_CHARACTERS = 112  # of a legend that have room beside one another
_MARGIN = {"l": 72, "r": 20, "t": 46, "b": 54}
_LEGEND: Json = {"orientation": "h", "x": 0, "xanchor": "left", "yanchor": "bottom", "itemsizing": "trace"}
_LEGEND["tracegroupgap"] = 0
_LOOK: Json = {
    "autosize": True,
    "font": {"family": "system-ui, -apple-system, 'Segoe UI', sans-serif", "size": 13, "color": LIGHT["ink"]},
    "paper_bgcolor": "rgba(0,0,0,0)",
    "plot_bgcolor": "rgba(0,0,0,0)",
    "hovermode": "closest",
}


class _PlotlyParts:
    """Traces and layout while they grow."""

    def __init__(self) -> None:
        self.data: list[Json] = []
        self.layout: Json = {"annotations": [], "shapes": []}
        self._named: set[str] = set()
        self._count = 0

    def add(
        self,
        panel: Panel,
        across: tuple[float, float],
        up: tuple[float, float],
        *,
        titled: bool,
        labelled: bool,
        total: float,
    ) -> None:
        self._count += 1
        n = "" if self._count == 1 else str(self._count)
        if titled:
            self._title(panel, n, lift=3 + _key_height(panel) + (14 if panel.x.landmarks else 0))
        if panel.drawing is not None:
            self._drawing(panel.drawing, n, across, up)
            return
        self.layout[f"xaxis{n}"] = {**_axis(panel.x), "domain": _rounded(across), "anchor": f"y{n}"}
        self.layout[f"yaxis{n}"] = {**_axis(panel.y), "domain": _rounded(up), "anchor": f"x{n}"}
        if not labelled:
            self.layout[f"xaxis{n}"] |= {"title": {"text": ""}, "showticklabels": False}
        if panel.square:  # as many pixels per decade upwards as to the right
            self.layout[f"yaxis{n}"] |= {"scaleanchor": f"x{n}", "scaleratio": 1, "constrain": "domain"}
            self.layout[f"xaxis{n}"] |= {"constrain": "domain"}
        where = {"xaxis": f"x{n}", "yaxis": f"y{n}"}
        ref = {"xref": f"x{n}", "yref": f"y{n}"}
        log = panel.x.log, panel.y.log
        first = self._first
        if panel.key == "above":  # a legend of its own
            where["legend"] = f"legend{self._count + 1}"
            lift = 14 if panel.x.landmarks else 0
            self.layout[where["legend"]] = {
                **_LEGEND,
                "x": round(across[0], 5),
                "y": up[1] + (1 + lift) / total,
            }
            self._named.clear()
        for envelope in panel.envelopes:
            self.data.append({**_envelope(envelope, named=panel.key == "above"), **where})
        for guide in panel.guides:
            self.data.append({**_guide(guide), **where})
            self.layout["annotations"].append({**_guide_name(guide), **ref})
        for limit in panel.limits:
            self.data.append({**_limit(limit), **where})
            self.layout["annotations"] += [{**a, **ref} for a in _limit_words(limit)]
        for curve in panel.curves:
            traces = _curve(curve, first, log=log[1], banded=panel.key == "above")
            self.data += [{**t, **where} for t in traces]
        for label in panel.labels:
            self._label(label, where, ref, log)
        foot = {"xref": f"x{n}", "yref": f"y{n} domain"}
        self.layout["shapes"] += [{**_span(span, panel), **foot} for span in panel.spans]
        self.data += [{**_patch(look), **where} for look in panel.explained]
        for rug in panel.rugs:
            self.layout["shapes"].append({**_rug(rug), **foot})
            self.data.append({**_stroke(rug), **where})
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

    def _title(self, panel: Panel, n: str, lift: float) -> None:
        title: Json = {"x": 0, "y": 1, "xref": f"x{n} domain", "yref": f"y{n} domain", "xanchor": "left"}
        words = _words(f"<b>{_plain(panel.title)}</b>", "ink", plain=True)
        self.layout["annotations"].append({**words, "yanchor": "bottom", "yshift": lift, **title})

    def _drawing(
        self, drawing: Drawing, n: str, across: tuple[float, float], up: tuple[float, float]
    ) -> None:
        plain = {"visible": False, "fixedrange": True}
        x, y = ({**plain, "range": [0, size]} for size in (drawing.width, drawing.height))
        self.layout[f"xaxis{n}"] = {**x, "domain": _rounded(across), "anchor": f"y{n}", "constrain": "domain"}
        self.layout[f"yaxis{n}"] = {**y, "domain": _rounded(up), "anchor": f"x{n}", "constrain": "domain"}
        self.layout[f"yaxis{n}"] |= {"scaleanchor": f"x{n}", "scaleratio": 1}
        self.data.append({"type": "scatter", "x": [], "y": [], **_SILENT, "xaxis": f"x{n}", "yaxis": f"y{n}"})
        ref = {"xref": f"x{n}", "yref": f"y{n}"}
        for part in drawing.parts:
            if isinstance(part, Words):
                self.layout["annotations"].append({**_written(part), **ref})
            else:
                self.layout["shapes"] += [{**shape, **ref} for shape in _outlines(part)]

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
        if label.place == "level":
            line = {"type": "line", "x0": 0, "x1": 1, "y0": label.y, "y1": label.y, "layer": "above"}
            look = {
                "line": {"color": LIGHT[label.colour], "width": 1.2, "dash": "dash"},
                "name": label.colour,
            }
            edge = {"xref": f"{ref['xref']} domain", "yref": ref["yref"]}
            self.layout["shapes"].append({**line, **look, **edge})
            anchor = "top" if "below" in label.side else "bottom"
            words = {**_words(label.text, label.colour), "x": 1, "xanchor": "right", "xshift": -4, **edge}
            self.layout["annotations"].append({**words, "y": _place(label.y, log[1]), "yanchor": anchor})
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


def _curve(curve: Curve, first: Any, *, log: bool, banded: bool) -> list[Json]:
    colour, name = LIGHT[curve.colour], _plain(curve.label)
    group = _plain(curve.axis) or name or "model"
    traces: list[Json] = []
    if curve.lower is not None and curve.upper is not None and not curve.bars:
        band = _band(curve, curve.lower, curve.upper, group, log=log)
        in_legend = banded and bool(curve.band_label) and first(curve.band_label)
        named = {"name": _plain(curve.band_label), "legendgroup": "", "showlegend": True} if in_legend else {}
        traces.append({**band, **named})
    line = {"color": colour, "dash": _DASH[curve.style], "width": 1 if curve.style == "thin" else 2}
    trace: Json = {
        "type": "scatter",
        "x": _numbers(curve.x),
        "y": _numbers(curve.y),
        "mode": _mode(curve),
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
        if curve.bars:
            ends = {"array": _numbers(curve.upper - curve.y), "arrayminus": _numbers(curve.y - curve.lower)}
            trace["error_y"] = {"type": "data", "symmetric": False, "thickness": 1.2, "width": 0, **ends}
    return [*traces, trace]


def _mode(curve: Curve) -> str:
    if curve.style == "none":
        return "markers"
    return "lines+markers" if curve.marker and curve.x.size <= 120 else "lines"


def _band(curve: Curve, lower: Array, upper: Array, group: str, *, log: bool) -> Json:
    good = np.isfinite(lower) & np.isfinite(upper) & ((lower > 0) | (not log))
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


def _envelope(envelope: Envelope, *, named: bool) -> Json:
    good = np.isfinite(envelope.low) & np.isfinite(envelope.high)
    line = {"width": 0.5, "color": LIGHT[envelope.colour]}
    look = {"fill": "toself", "fillcolor": _faint(envelope.colour, 0.5), "line": line, "mode": "lines"}
    outline = _outline(envelope.x, envelope.low, envelope.high, good)
    legend = {"name": _plain(envelope.label), "showlegend": True} if named else {}
    return {"type": "scatter", **outline, **look, "meta": envelope.colour, **_SILENT, **legend}


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


def _span(span: ShadedSpan, panel: Panel) -> Json:
    look = SPAN_LOOKS[span.kind]
    edge = {"line": {"width": 1, "color": LIGHT[look.colour]}, "layer": "below" if look.top == 1 else "above"}
    common = {"opacity": look.opacity, "name": look.colour, **edge}
    if look.hatched:
        return {"type": "path", "path": _hatching(span, panel), **common}
    fill = {"fillcolor": LIGHT[look.colour]}
    return {"type": "rect", "x0": span.start, "x1": span.stop, "y0": 0, "y1": look.top, **fill, **common}


def _hatching(span: ShadedSpan, panel: Panel) -> str:
    """Oblique strokes over the whole height, cut at both ends of the span."""
    whole = panel.x.limits[1] - panel.x.limits[0] if panel.x.limits else 1.0
    step, reach = 0.02 * whole, panel.aspect * whole  # a stroke of 45 deg goes so far across
    strokes = []
    at = span.start - reach
    while at < span.stop:
        left, right = max(at, span.start), min(at + reach, span.stop)
        if left < right:
            low, high = ((end - at) / reach for end in (left, right))
            strokes.append(f"M {left:.6g},{low:.4f} L {right:.6g},{high:.4f}")
        at += step
    return " ".join(strokes)


def _patch(look: SpanLook) -> Json:
    """An entry in the legend for a kind of span."""
    symbol = "square-x-open" if look.hatched else "square"
    marker = {"symbol": symbol, "size": 11, "color": LIGHT[look.colour], "opacity": look.opacity}
    return _entry(look.words, look.colour, marker)


def _rug(rug: Rug) -> Json:
    strokes = " ".join(f"M {x:.6g},0 L {x:.6g},0.06" for x in rug.x.tolist())
    line = {"width": 1, "color": LIGHT[rug.colour]}
    return {"type": "path", "path": strokes or "M 0,0", "line": line, "name": rug.colour, "layer": "above"}


def _stroke(rug: Rug) -> Json:
    return _entry(rug.label, rug.colour, {"symbol": "line-ns-open", "size": 9, "color": LIGHT[rug.colour]})


def _entry(words: str, colour: str, marker: Json) -> Json:
    facts = {"type": "scatter", "x": [None], "y": [None], "mode": "markers", "hoverinfo": "skip"}
    return {**facts, "marker": marker, "name": _plain(words), "meta": colour, "showlegend": True}


# -- drawings ---------------------------------------------------------------------------------------------


def _outlines(shape: DrawnShape) -> list[Json]:
    """The area of a shape and its line: one shape has one colour."""
    path = "M " + " L ".join(f"{x:.6g},{y:.6g}" for x, y in shape.points) + (" Z" if shape.closed else "")
    made: list[Json] = []
    if shape.fill:
        none = {"line": {"width": 0, "color": LIGHT[shape.fill]}}
        area = {"fillcolor": LIGHT[shape.fill], "opacity": shape.opacity, "name": shape.fill}
        made.append({"type": "path", "path": path, **area, **none})
    if shape.colour:
        line = {"color": LIGHT[shape.colour], "width": 1.4 * shape.width}
        dash = {"dash": _DASH["dashed"]} if shape.dashed else {}
        made.append({"type": "path", "path": path, "line": {**line, **dash}, "name": shape.colour})
    return made


def _written(words: Words) -> Json:
    text = "<br>".join(_plain(row) for row in words.text.split("\n"))
    font = {"size": round(13 * words.size, 1), "color": LIGHT[words.colour]}
    place = {"x": words.x, "y": words.y, "xanchor": words.across, "yanchor": words.up, "align": words.across}
    text = f"<b>{text}</b>" if words.bold else text
    return {"text": text, "showarrow": False, "name": words.colour, "font": font, "borderpad": 0, **place}


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
    if axis.names:
        made |= {
            "tickvals": [at for at, _ in axis.names],
            "ticktext": [_plain(name).replace("\n", "<br>") for _, name in axis.names],
        }
    if axis.limits:
        made["range"] = [_place(end, axis.log) for end in axis.limits]
    return made


def _spacing(axis: Axis) -> int | str:
    """One tick per decade; 1, 2, 5 in less than two of them; all digits in less than one."""
    whole = decades(axis.limits) if axis.limits else 6.0
    return 1 if whole > 2 else "D2" if whole > 1 else "D1"


def _place(value: float, log: bool) -> float:
    """Annotations and ranges of a logarithmic axis are given as exponents."""
    return round(math.log10(value), 5) if log else value


def _rounded(ends: tuple[float, float]) -> list[float]:
    return [min(max(round(end, 5), 0.0), 1.0) for end in ends]


def _numbers(values: Any) -> list[float | None]:
    return [
        float(f"{v:.6g}") if math.isfinite(v) else None for v in np.asarray(values, dtype=np.float64).tolist()
    ]


def _faint(colour: str, alpha: float, colours: Mapping[str, str] = LIGHT) -> str:
    red, green, blue = (int(colours[colour][i : i + 2], 16) for i in (1, 3, 5))
    return f"rgba({red},{green},{blue},{alpha})"


def _plain(text: str) -> str:
    """Text that Plotly must not read as markup or as mathematics."""
    return html.escape(text, quote=False).replace("$", "&#36;")
