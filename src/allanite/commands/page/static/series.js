// SPDX-License-Identifier: BSD-3-Clause
// A time series of any length: the server sends an envelope of what is on screen, never all samples.

import { get, numbers } from "./api.js";
import { h, said } from "./dom.js";
import { look, timePanel } from "./timeseries.js";
import { duration } from "./wording.js";

const BLOCKS = 1200; // two points each: more than a screen has columns
const PANELS = { 1: 300, 2: 190, 3: 150 }; // pixels, by their number; more have the last
const LOWEST = 105;
const SAME = 3; // channels that lie further apart than so many times their spread would be flat lines in one panel

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
 * @param {{bands?: () => object[], marking?: () => boolean, selected?: (range: number[]) => void, dragged?: (index: number, part: string, seconds: number) => void, dropped?: () => void}}
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
    this.chart = new AllaniteChart(this.plot, {
      ...options, keys: false, tools: false, ranged: said((range) => this.go(...(range || this.whole))),
    });
    this.plot.addEventListener("keydown", (event) => this.key(event));
    this.width = new ResizeObserver(() => this.resized());
    this.width.observe(this.plot);
  }

  close() {
    this.width.disconnect();
    this.asking?.abort();
    this.chart.close();
  }

  tools() {
    const all = h("button", { type: "button", onclick: said(() => this.go(...this.whole)) }, "Whole record");
    const ticks = this.meta.channels.map((channel) => {
      const tick = h("input", { type: "checkbox", checked: this.shown.includes(channel.index) });
      tick.addEventListener("change", said(() => {
        this.shown = this.meta.channels.map((c) => c.index).filter((i) => (i === channel.index ? tick.checked : this.shown.includes(i)));
        return this.draw();
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

  resized() {
    if (this.answer && this.plot.clientWidth !== this.drawnAt) this.paint();
  }

  /** Ask for what is in range, and draw it. An older question that is still open is given up. */
  async draw() {
    this.asking?.abort();
    this.asking = new AbortController();
    const [from, to] = this.range;
    const channels = this.meta.channels.filter((c) => this.shown.includes(c.index));
    if (!channels.length) return;
    const query = new URLSearchParams({ channels: channels.map((c) => c.index).join(","), from, to, blocks: BLOCKS });
    const answer = await numbers(`/api/series/${this.meta.id}/window?${query}`, this.asking.signal);
    this.answer = { ...answer, channels };
    this.paint();
  }

  paint() {
    if (!this.answer) return;
    this.drawnAt = this.plot.clientWidth;
    this.chart.show({ panels: this.panels(), zoom: "x", marks: this.options.bands?.() || [] });
    const { facts } = this.answer;
    const exact = facts.kind === "samples" ? "every sample" : `lowest and highest of ${facts.size} samples each`;
    this.says.textContent = `${duration(this.range[1] - this.range[0])} on screen, ${exact}. Drag: zoom; Shift and drag: move; double click: all.`;
    this.plot.dataset.drawn = `${facts.kind} ${facts.size}`;
    this.plot.dataset.stroke = this.options.marking?.() ? "marks" : "zooms";
  }

  panels() {
    const { facts, values, channels } = this.answer, panels = panelsOf(channels);
    const height = PANELS[panels.length] || LOWEST, spans = this.gaps(channels), alike = new Map();
    for (const c of channels) alike.set(c.kind, [...(alike.get(c.kind) || []), c]);
    return panels.map((panel, p) => {
      const { kind, shown_unit: unit, name } = panel[0];
      const label = panel.length === 1 ? name : kind === "unknown" ? "Value" : kind.replace(/^./, (c) => c.toUpperCase());
      const curves = panel.map((channel) => ({
        ...line(facts, values, channels.indexOf(channel), channel.shown_factor), label: channel.name, ...look(alike.get(channel.kind).indexOf(channel)),
      }));
      return timePanel(curves, { label: `${label} [${unit}]`, range: [...this.range], height, last: p === panels.length - 1, spans });
    });
  }

  /** Where samples are missing, as gray bands. */
  gaps(channels) {
    const spans = new Map(channels.flatMap((c) => this.meta.gaps[c.index] || []).map((span) => [span.join(), span]));
    return [...spans.values()].slice(0, 300).map(([start, stop]) => ({ start, stop, colour: "guide", opacity: 0.3, top: 1 }));
  }
}

/** Facts of the series, as soon as it has been prepared. */
export const factsOf = (id) => get(`/api/series/${id}`);
