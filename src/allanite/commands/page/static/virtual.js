// SPDX-License-Identifier: BSD-3-Clause
// A table of any number of rows: only those that are seen stand in the page.

import { h, fill } from "./dom.js";

const HEIGHT = 30; // of a row, pixels: as the style has it
const SPARE = 8; // rows drawn above and below what is seen

export class VirtualTable {
  /**
   * columns: [{ name, label, text: (row) => string, order: (a, b) => number }]; `open` is called with a row.
   */
  constructor(columns, { label, open, link }) {
    this.columns = columns;
    this.open = open;
    this.link = link;
    this.rows = new Uint32Array(0);
    this.sorted = { column: null, down: false };
    this.body = h("tbody", {});
    this.head = h("tr", {}, columns.map((c) => h("th", { scope: "col" }, h("button", { type: "button", class: "quiet", onclick: () => this.sort(c) }, c.label))));
    this.table = h("table", { "aria-label": label }, h("thead", {}, this.head), this.body);
    this.place = h("div", { class: "virtual", tabindex: "0", role: "region", "aria-label": label, onscroll: () => this.paint() }, this.table);
  }

  /** The rows that are shown, as numbers; they are put in the order that was chosen. */
  show(rows) {
    this.rows = rows;
    this.table.setAttribute("aria-rowcount", String(rows.length + 1));
    if (this.sorted.column) this.order();
    this.place.scrollTop = 0;
    this.paint(true);
  }

  sort(column) {
    this.sorted = { column, down: this.sorted.column === column && !this.sorted.down };
    [...this.head.children].forEach((cell, i) => {
      if (this.columns[i] === column) cell.setAttribute("aria-sort", this.sorted.down ? "descending" : "ascending");
      else cell.removeAttribute("aria-sort");
    });
    this.order();
    this.place.scrollTop = 0;
    this.paint(true);
  }

  order() {
    const { column, down } = this.sorted;
    this.rows = this.rows.slice().sort(down ? (a, b) => column.order(b, a) : column.order);
  }

  paint(anew = false) {
    const seen = Math.ceil((this.place.clientHeight || 600) / HEIGHT);
    const first = Math.max(0, Math.floor(this.place.scrollTop / HEIGHT) - SPARE);
    const last = Math.min(this.rows.length, first + seen + 2 * SPARE);
    if (!anew && first === this.first && last === this.last) return;
    [this.first, this.last] = [first, last];
    const space = (count) => h("tr", { class: "space", "aria-hidden": "true" }, h("td", { colspan: this.columns.length, style: null }));
    const above = space(), below = space();
    above.firstChild.style.height = `${first * HEIGHT}px`;
    below.firstChild.style.height = `${(this.rows.length - last) * HEIGHT}px`;
    const cells = (row) => this.columns.map((c, i) => (i ? h("td", {}, c.text(row)) : h("th", { scope: "row" }, h("a", { href: this.link(row), onclick: (e) => this.open(row, e) }, c.text(row)))));
    const lines = Array.from({ length: last - first }, (_, i) => h("tr", { "aria-rowindex": first + i + 2 }, cells(this.rows[first + i])));
    fill(this.body, above, lines, below);
  }
}
