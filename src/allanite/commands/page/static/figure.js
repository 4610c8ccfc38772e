// SPDX-License-Identifier: BSD-3-Clause
// Figures that the server made: the page only gives them their size and keeps their colours with the theme.

import { get } from "./api.js";
import { h } from "./dom.js";
import { colours, isDark, onTheme } from "./theme.js";
import { CONFIG } from "./plotting.js";

// An axis is no shorter than its title, which would be cut.
const LETTER = 7.5; // pixels, on average
const LEAST = 160;

function tallest(layout) {
  const axes = Object.entries(layout).filter(([key, axis]) => /^yaxis/.test(key) && axis.title?.text);
  const needed = axes.map(([, { title, domain = [0, 1] }]) => {
    const longest = Math.max(...title.text.split("<br>").map((line) => line.replace(/<[^>]*>/g, "").length));
    return (longest * LETTER * (title.font?.size || 15)) / 15 / (domain[1] - domain[0]);
  });
  return Math.max(LEAST, ...needed);
}

// One decade up is as long as one decade across at every width; words below a least width would run together.
function sized(layout, width) {
  const { margin, meta } = layout;
  const wide = Math.max(width, meta.least || 0);
  const share = Math.min(wide / (meta.drawn_at || wide), 1);
  for (const note of layout.annotations || []) if (note.font) note.font.size *= share;
  const height = Math.round(Math.max((wide - margin.l - margin.r) * meta.aspect, meta.tall || 0, tallest(layout)) + margin.t + margin.b);
  const { guide, ink } = colours();
  const modebar = { bgcolor: "rgba(0,0,0,0)", color: guide, activecolor: ink };
  return { ...layout, width: wide, height, modebar, uirevision: "kept" };
}

// A logarithmic axis has a tick at each decade; one that is zoomed in needs more.
const spacing = (decades) => (decades > 2 ? 1 : decades > 1 ? "D2" : "D1");

function ticked(plot) {
  const wanted = {};
  for (const key of Object.keys(plot.layout).filter((k) => /^[xy]axis/.test(k))) {
    const axis = plot.layout[key];
    if (axis.type !== "log" || !axis.range) continue;
    const step = spacing(Math.abs(axis.range[1] - axis.range[0]));
    if (axis.dtick !== step) wanted[`${key}.dtick`] = step;
  }
  if (Object.keys(wanted).length) Plotly.relayout(plot, wanted);
}

/** A place for a figure, drawn anew when the theme or the width changes. */
export class FigureView {
  /**
   * @param {string} name for those who do not see it
   * @param {{more?: (figure: object) => object[], clicked?: (point: object) => void}} options traces to add; what to do with a point
   */
  constructor(name, options = {}) {
    this.options = options;
    this.plot = h("div", { class: "plot", role: "group", "aria-label": name });
    this.place = h("div", { class: "wide" }, this.plot);
    this.forget = onTheme(() => this.source && this.load(this.source));
    this.watcher = new ResizeObserver(() => this.figure && this.place.clientWidth && this.place.clientWidth !== this.width && this.paint());
    this.watcher.observe(this.place);
  }

  close() {
    this.forget();
    this.watcher.disconnect();
    Plotly.purge(this.plot);
  }

  /** Ask `source(dark)` for a figure, and draw it; an answer that was overtaken by a later question is dropped. */
  async load(source) {
    this.source = source;
    const number = (this.number = (this.number || 0) + 1);
    this.place.classList.add("waiting");
    try {
      const figure = await source(isDark());
      if (number === this.number) await this.show(figure);
    } finally {
      if (number === this.number) this.place.classList.remove("waiting");
    }
  }

  /** Draw a figure of a document. */
  document(id, options) {
    return this.load((dark) => {
      const query = new URLSearchParams(Object.entries({ ...options, dark: dark ? "1" : "" }).filter(([, v]) => v));
      return get(`/api/documents/${id}/figure?${query}`);
    });
  }

  show(figure) {
    this.figure = figure;
    return this.paint();
  }

  async paint() {
    const { data, layout } = structuredClone(this.figure);
    this.width = this.place.clientWidth;
    const more = this.options.more?.(this.figure) || [];
    await Plotly.react(this.plot, [...data, ...more], sized(layout, this.width), CONFIG);
    if (!this.listening) {
      this.listening = true;
      this.plot.on("plotly_relayout", () => ticked(this.plot));
      if (this.options.clicked) this.plot.on("plotly_click", (event) => this.options.clicked(event.points[0]));
    }
    this.plot.dataset.drawn = "yes";
  }
}
