// SPDX-License-Identifier: BSD-3-Clause
// Turns and positions marked on a series, or typed: a table and bands over the series that hold the same rows.

import { h, fill } from "./dom.js";

const COLUMNS = { turns: ["Start [s]", "Stop [s]"], headings: ["Start [s]", "Stop [s]", "Heading [deg]"] };
const rounded = (v) => Number(v.toFixed(3));

export class Marks {
  /**
   * @param {() => void} changed called when the bands must be drawn again
   * @param {() => void} begun called when marking begins
   */
  constructor(changed, begun) {
    this.changed = changed;
    this.begun = begun;
    this.kind = "turns";
    this.rows = [];
    this.on = false;
    this.place = h("div", {});
    this.draw();
  }

  /** Rows as the server wants them, in order of time. */
  values() {
    return this.rows.map((row) => row.slice(0, COLUMNS[this.kind].length)).sort((a, b) => a[0] - b[0]);
  }

  set(rows) {
    this.rows = rows.map((row) => row.map(rounded));
    this.again();
  }

  as(kind) {
    this.kind = kind;
    this.again();
  }

  again() {
    this.draw();
    this.changed();
  }

  /** Begin or end marking; what is to be marked comes into view. */
  switched() {
    this.on = !this.on;
    this.again();
    if (this.on) this.begun();
  }

  selected([a, b]) {
    if (!this.on) return;
    const before = this.rows.at(-1);
    // Positions mostly follow one another at equal angles: the next heading is a first guess.
    this.rows.push([Math.max(rounded(Math.min(a, b)), 0), rounded(Math.max(a, b)), before ? ((before[2] || 0) + 90) % 360 : 0]);
    this.again();
  }

  /** A band is dragged, by an end or as a whole; drawn once for each picture of the screen. */
  dragged(index, part, seconds) {
    const row = this.rows[index];
    if (!row) return;
    if (part !== "stop") row[0] = Math.max(row[0] + seconds, 0);
    if (part !== "start") row[1] = Math.max(row[1] + seconds, 0);
    this.waiting ??= requestAnimationFrame(() => {
      this.waiting = undefined;
      this.changed();
    });
  }

  /** It was let go. */
  dropped() {
    this.set(this.rows.map(([a, b, ...more]) => [Math.min(a, b), Math.max(a, b), ...more]));
  }

  /** Bands over the series; the order is that of the rows, by which `dragged` finds them. */
  bands() {
    const words = (row) => (this.kind === "headings" ? `${row[2]}°` : "");
    return this.rows.map((row) => ({ start: row[0], stop: row[1], words: words(row) }));
  }

  draw() {
    const word = this.kind === "turns" ? "turn" : "position";
    const mark = h("button", { type: "button", "aria-pressed": String(this.on), onclick: () => this.switched() }, this.on ? "Stop marking" : `Mark ${word}s on the series`);
    const add = h("button", { type: "button", onclick: () => { this.rows.push([0, 0, 0]); this.again(); this.place.querySelector("tbody tr:last-child input").focus(); } }, `Add a ${word}`);
    const clear = this.rows.length ? h("button", { type: "button", onclick: () => this.set([]) }, "Remove all") : null;
    const hint = this.on ? `Draw across the series to mark a ${word}; drag a band or its end to correct it.` : this.rows.length ? `${this.rows.length} ${word}${this.rows.length > 1 ? "s" : ""}` : this.kind === "turns" ? "None given: turns are detected in the record." : "List where the axis pointed, and when.";
    fill(this.place, h("div", { class: "bar" }, mark, add, clear, h("span", { class: "soft" }, hint)), this.rows.length ? this.table(word) : null);
  }

  table(word) {
    const cell = (row, i) => {
      const input = h("input", { type: "number", step: "any", value: row[i] ?? 0, "aria-label": `${COLUMNS[this.kind][i]} of ${word} ${this.rows.indexOf(row) + 1}` });
      input.addEventListener("change", () => {
        row[i] = Number(input.value);
        this.changed();
      });
      return h("td", {}, input);
    };
    const remove = (row) => h("button", { type: "button", class: "quiet", "aria-label": `Remove ${word} ${this.rows.indexOf(row) + 1}`, onclick: () => { this.rows = this.rows.filter((r) => r !== row); this.again(); } }, "Remove");
    return h("div", { class: "wide tall" }, h("table", { class: "marks" },
      h("thead", {}, h("tr", {}, COLUMNS[this.kind].map((c) => h("th", { scope: "col" }, c)), h("th", { scope: "col" }, h("span", { class: "hidden" }, "Action")))),
      h("tbody", {}, this.rows.map((row) => h("tr", {}, COLUMNS[this.kind].map((_, i) => cell(row, i)), h("td", {}, remove(row)))))));
  }
}
