// SPDX-License-Identifier: BSD-3-Clause
// A time series of any length: the server sends an envelope of what is on screen, never all samples.

import { get, numbers } from "./api.js";
import { escaped, h, said } from "./dom.js";
import { colours, isDark, onTheme } from "./theme.js";
import { CONFIG } from "./plotting.js";
import { duration } from "./wording.js";

const BLOCKS = 1200; // two points each: more than a screen has columns
const PANELS = { 1: 300, 2: 190, 3: 150 }; // pixels, by their number; more have the last
const LOWEST = 105;
const SAME = 3; // channels that lie further apart than so many times their spread would be flat lines in one panel
const ORDER = ["x", "y", "z", "purple", "orange", "sky"];
const EDGE = 8; // pixels of a band by which its end is taken, rather than the whole band
const DASHES = ["solid", "9px,4px", "1px,3px"];

/** Channels that share a unit share a panel, unless there is room for one each, or they lie far apart. */
function panelsOf(channels) {
  const panels = new Map();
  for (const channel of channels) {
    const key = `${channel.kind} ${channel.shown_unit}`;
    panels.set(key, [...(panels.get(key) || []), channel]);
  }
  const apart = (panel) => {
    const spread = Math.max(...panel.map((c) => c.high - c.low));
    return Math.max(...panel.map((c) => c.high)) - Math.min(...panel.map((c) => c.low)) > SAME * spread;
  };
  return [...panels.values()].flatMap((panel) => (channels.length <= 6 || apart(panel) ? panel.map((c) => [c]) : [panel]));
}

/** The part of the answer for one channel as x and y; a block is a stroke from its lowest to its highest. */
function line(facts, values, number, factor) {
  const { kind, first, size, count, rate } = facts;
  const x = [], y = [];
  const put = (t, v) => {
    x.push(t);
    y.push(Number.isNaN(v) ? null : v * factor);
  };
  const start = number * count * (kind === "blocks" ? 2 : 1);
  for (let i = 0; i < count; i++) {
    const t = (first + (kind === "blocks" ? (i + 0.5) * size : i)) / rate;
    put(t, values[start + i]);
    if (kind === "blocks") put(t, values[start + count + i]);
  }
  return { x, y };
}

/**
 * Show a series.
 * @param {object} meta facts of the series
 * @param {{shapes?: () => object[], marking?: () => boolean, selected?: (range: number[]) => void, dragged?: (index: number, part: string, seconds: number) => void, dropped?: () => void}}
 *   options marks over it; whether a stroke of the pointer marks rather than zooms; what to do with it, and with a mark
 *   whose "start", "stop" or "both" are dragged
 */
export class SeriesView {
  constructor(meta, options = {}) {
    this.meta = meta;
    this.options = options;
    this.whole = [0, meta.duration];
    this.range = [...this.whole];
    this.shown = meta.channels.slice(0, 12).map((c) => c.index);
    this.plot = h("div", { class: "plot", tabindex: 0, role: "group", "aria-label": `Time series of ${meta.name}. Keys: plus and minus zoom, arrows move, Home shows all.` });
    this.says = h("span", { class: "soft", role: "status" });
    this.place = h("div", { class: "series" }, this.tools(), this.plot);
    this.forget = onTheme(() => this.draw(true));
    this.plot.addEventListener("keydown", (event) => this.key(event));
    this.plot.addEventListener("pointerdown", (event) => this.grab(event), true);
    this.width = new ResizeObserver(() => this.resized());
    this.width.observe(this.plot);
  }

  close() {
    this.forget();
    this.width.disconnect();
    this.asking?.abort();
    Plotly.purge(this.plot);
  }

  tools() {
    const all = h("button", { type: "button", onclick: said(() => this.go(...this.whole)) }, "Whole record");
    const ticks = this.meta.channels.map((channel) => {
      const tick = h("input", { type: "checkbox", checked: this.shown.includes(channel.index) });
      tick.addEventListener("change", said(() => {
        this.shown = this.meta.channels.map((c) => c.index).filter((i) => (i === channel.index ? tick.checked : this.shown.includes(i)));
        return this.draw(true);
      }));
      return h("label", { class: "tick" }, tick, channel.name);
    });
    return h("div", { class: "bar" }, all, this.meta.channels.length > 1 ? h("span", { class: "ticks", role: "group", "aria-label": "Channels shown" }, ticks) : null, this.says);
  }

  /** Show from one time to another [s]. */
  go(from, to) {
    const [low, high] = this.whole;
    const length = Math.min(Math.max(to - from, 4 / this.meta.rate), high - low);
    const start = Math.min(Math.max(from, low), high - length);
    this.range = [start, start + length];
    return this.draw();
  }

  key(event) {
    const [a, b] = this.range;
    const length = b - a;
    const ways = {
      "+": [a + length / 4, b - length / 4], "=": [a + length / 4, b - length / 4], "-": [a - length / 2, b + length / 2],
      ArrowLeft: [a - length / 4, b - length / 4], ArrowRight: [a + length / 4, b + length / 4], Home: this.whole,
    };
    if (!ways[event.key] || event.target !== this.plot) return;
    event.preventDefault();
    this.go(...ways[event.key]).catch(() => {});
  }

  /** A mark is taken by an end or as a whole, at any height: Plotly would also move its upper and lower edge. */
  grab(event) {
    const band = event.target.closest?.(".shapelayer path[data-index]");
    if (!band || !this.options.marking?.()) return;
    event.preventDefault();
    event.stopPropagation();
    const { left, right, width } = band.getBoundingClientRect();
    const edge = Math.min(EDGE, width / 3);
    const part = event.clientX < left + edge ? "start" : event.clientX > right - edge ? "stop" : "both";
    const seconds = (this.range[1] - this.range[0]) / this.plot.querySelector(".nsewdrag").getBoundingClientRect().width;
    let before = event.clientX;
    const move = (news) => {
      this.options.dragged?.(Number(band.dataset.index), part, (news.clientX - before) * seconds);
      before = news.clientX;
    };
    const end = () => {
      window.removeEventListener("pointermove", move);
      this.options.dropped?.();
    };
    window.addEventListener("pointermove", move);
    window.addEventListener("pointerup", end, { once: true });
  }

  resized() {
    if (this.drawn && this.plot.clientWidth && this.plot.clientWidth !== this.drawnAt) this.paint();
  }

  /** Ask for what is in range, and draw it. An older question that is still open is given up. */
  async draw(same = false) {
    if (same && !this.drawn) return;
    this.asking?.abort();
    this.asking = new AbortController();
    const [from, to] = this.range;
    const channels = this.meta.channels.filter((c) => this.shown.includes(c.index));
    if (!channels.length) return;
    const query = new URLSearchParams({ channels: channels.map((c) => c.index).join(","), from, to, blocks: BLOCKS });
    const answer = await numbers(`/api/series/${this.meta.id}/window?${query}`, this.asking.signal);
    this.answer = { ...answer, channels };
    await this.paint();
  }

  async paint() {
    const { data, layout } = this.figure();
    this.drawnAt = this.plot.clientWidth;
    const config = { ...CONFIG, edits: { shapePosition: Boolean(this.options.marking?.()) } };
    await Plotly.react(this.plot, data, layout, config);
    const { facts } = this.answer;
    const exact = facts.kind === "samples" ? "every sample" : `lowest and highest of ${facts.size} samples each`;
    this.says.textContent = `${duration(this.range[1] - this.range[0])} on screen, ${exact}. Drag: zoom; Shift and drag: move; double click: all.`;
    if (!this.drawn) this.listen();
    this.drawn = true;
    this.plot.dataset.drawn = `${facts.kind} ${facts.size}`;
    this.plot.dataset.stroke = config.edits.shapePosition ? "marks" : "zooms";
  }

  listen() {
    this.plot.on("plotly_relayout", (change) => {
      const axis = this.plot.layout.xaxis;
      const wanted = change["xaxis.autorange"] ? this.whole : axis.range.map(Number);
      // Our own drawing is reported here as well: only a range that differs from the last one asked for is news.
      const close = (i) => Math.abs(wanted[i] - this.range[i]) <= 1e-9 * Math.max(1, Math.abs(wanted[i]));
      if (close(0) && close(1)) return;
      clearTimeout(this.waiting);
      this.waiting = setTimeout(said(() => this.go(...wanted)), 5);
    });
    if (this.options.selected) this.plot.on("plotly_selected", (event) => event?.range && this.options.selected(event.range.x));
  }

  figure() {
    const { facts, values, channels } = this.answer;
    const palette = colours();
    const panels = panelsOf(channels);
    const layout = {
      height: panels.length * (PANELS[panels.length] || LOWEST) + 76, margin: { l: 84, r: 16, t: 30, b: 46 }, width: this.plot.clientWidth,
      paper_bgcolor: palette.paper, plot_bgcolor: palette.paper, font: { family: "system-ui, sans-serif", size: 13, color: palette.ink },
      xaxis: { range: [...this.range], title: { text: "Time since the first sample [s]", font: { size: 13 }, standoff: 6 }, gridcolor: palette.grid, zeroline: false, anchor: panels.length > 1 ? `y${panels.length}` : "y", exponentformat: "none", tickformat: this.range[1] - this.range[0] > 5 ? "," : "" },
      separators: ".\u202f", dragmode: this.options.marking?.() ? "select" : "zoom", selectdirection: "h", hovermode: "closest", legend: { orientation: "h", x: 0, y: 1.01, yanchor: "bottom" },
      shapes: [...(this.options.shapes?.() || []), ...this.gaps(channels, palette)], uirevision: "kept",
      // A selection has become a mark, and is not kept by the drawing itself.
      selections: [], selectionrevision: (this.painted = (this.painted || 0) + 1), editrevision: this.painted,
    };
    const step = 1 / panels.length;
    const alike = new Map();
    for (const c of channels) alike.set(c.kind, [...(alike.get(c.kind) || []), c]);
    const data = [];
    panels.forEach((panel, p) => {
      const n = p ? String(p + 1) : "";
      const top = 1 - p * step;
      const { kind, shown_unit: unit, name } = panel[0];
      const label = panel.length === 1 ? name : kind === "unknown" ? "Value" : kind.replace(/^./, (c) => c.toUpperCase());
      layout[`yaxis${n}`] = {
        domain: [top - step + (p < panels.length - 1 ? 0.016 : 0), top - (p ? 0.016 : 0)], title: { text: `${escaped(label)}<br>[${escaped(unit)}]`, standoff: 8, font: { size: 12 } },
        gridcolor: palette.grid, zeroline: false, fixedrange: true, nticks: panels.length > 3 ? 4 : 6,
      };
      panel.forEach((channel) => {
        const i = alike.get(channel.kind)?.indexOf(channel) ?? 0;
        const { x, y } = line(facts, values, channels.indexOf(channel), channel.shown_factor);
        const style = { color: palette[ORDER[i % ORDER.length]], width: 1, dash: DASHES[Math.floor(i / ORDER.length) % DASHES.length] };
        data.push({ type: "scatter", mode: "lines", x, y, name: escaped(channel.name), line: style, yaxis: `y${n}`, xaxis: "x", showlegend: panel.length > 1, hovertemplate: "%{x} s: %{y:.5g}" });
      });
    });
    return { data, layout };
  }

  /** Where samples are missing, as grey bands. */
  gaps(channels, palette) {
    const spans = new Map(channels.flatMap((c) => this.meta.gaps[c.index] || []).map((span) => [span.join(), span]));
    return [...spans.values()].slice(0, 300).map(([a, b]) => ({ type: "rect", xref: "x", yref: "paper", x0: a, x1: b, y0: 0, y1: 1, layer: "below", line: { width: 0 }, fillcolor: palette.guide, opacity: isDark() ? 0.35 : 0.25, editable: false }));
  }
}

/** Facts of the series, as soon as it has been prepared. */
export const factsOf = (id) => get(`/api/series/${id}`);
