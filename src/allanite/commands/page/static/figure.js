// SPDX-License-Identifier: BSD-3-Clause
// Figures that the server states as data: drawn by the script that the reports have as well.

import { get } from "./api.js";
import { h } from "./dom.js";

/** A place for a figure, drawn again when the width changes. */
export class FigureView {
  /**
   * @param {string} name for those who do not see it
   * @param {{more?: (figure: object) => object[], clicked?: (point: object) => void}} options curves to add to the first panel; what to do with a point
   */
  constructor(name, options = {}) {
    this.options = options;
    this.plot = h("div", { class: "plot", role: "group", "aria-label": name });
    this.place = h("div", {}, this.plot);
    this.chart = new AllaniteChart(this.plot, { clicked: options.clicked });
    this.watcher = new ResizeObserver(() => this.figure && this.plot.clientWidth !== this.width && this.fit());
    this.watcher.observe(this.plot);
  }

  close() {
    this.watcher.disconnect();
    this.chart.close();
  }

  /** Wait for a figure, and draw it; an answer that was overtaken by a later question is dropped. */
  async load(asked) {
    const number = (this.number = (this.number || 0) + 1);
    this.place.classList.add("waiting");
    try {
      const figure = await asked;
      if (number === this.number) this.show(figure);
    } finally {
      if (number === this.number) this.place.classList.remove("waiting");
    }
  }

  /** Draw a figure of a document. */
  document(id, options) {
    const query = new URLSearchParams(Object.entries(options).filter(([, v]) => v));
    return this.load(get(`/api/documents/${id}/figure?${query}`));
  }

  show(figure) {
    this.figure = figure;
    this.paint();
  }

  paint() {
    const [first, ...others] = this.figure.panels, more = this.options.more?.(this.figure) || [];
    this.chart.show({ ...this.figure, panels: [{ ...first, curves: [...(first.curves || []), ...more] }, ...others] });
    this.width = this.plot.clientWidth;
  }

  fit() {
    this.width = this.plot.clientWidth;
    this.chart.draw();
  }
}
