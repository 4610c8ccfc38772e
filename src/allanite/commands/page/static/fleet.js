// SPDX-License-Identifier: BSD-3-Clause
// The table of a fleet: a coefficient of all logs, sorted, filtered and brushed here; a click opens the study of a log.

import { arrow } from "./api.js";
import { arrowTable } from "./arrow.js";
import * as catalogue from "./catalogue.js";
import { h, fill, notice, said } from "./dom.js";
import { VirtualTable } from "./virtual.js";

const BINS = 60;
const SVG = "http://www.w3.org/2000/svg";
const short = (x) => (Number.isFinite(x) ? Number(x.toPrecision(4)).toString() : "–");
const day = (ms) => (Number.isFinite(ms) ? new Date(ms).toISOString().slice(0, 10) : "–");

/** The recording of the folder that a row was made from. */
const recordingOf = (log) => catalogue.recordings().find((r) => log === r.name || log.endsWith(`/${r.name}`) || r.name.endsWith(`/${log}`));

/** Logarithms of the estimates in bins; a stroke over them chooses a range. */
class Brush {
  constructor(changed) {
    this.changed = changed;
    this.place = document.createElementNS(SVG, "svg");
    for (const [name, value] of Object.entries({ class: "brush", viewBox: `0 0 ${BINS} 20`, preserveAspectRatio: "none", "aria-hidden": "true" })) this.place.setAttribute(name, value);
    this.place.addEventListener("pointerdown", (e) => this.begin(e));
    this.place.addEventListener("pointermove", (e) => this.move(e));
    this.place.addEventListener("pointerup", () => this.end());
  }

  draw(values) {
    const logs = values.filter((v) => v > 0).map(Math.log);
    this.from = logs.reduce((a, b) => Math.min(a, b), Infinity);
    this.to = logs.reduce((a, b) => Math.max(a, b), -Infinity);
    if (!(this.to > this.from)) [this.from, this.to] = [this.from - 0.5, this.from + 0.5];
    const bins = new Array(BINS).fill(0);
    for (const x of logs) bins[Math.min(BINS - 1, Math.floor((BINS * (x - this.from)) / (this.to - this.from)))] += 1;
    const most = Math.max(...bins, 1);
    this.band = this.rect(0, 0, 0, 20, "chosen");
    this.place.replaceChildren(this.band, ...bins.map((n, i) => this.rect(i + 0.1, 20 - (19 * n) / most, 0.8, (19 * n) / most, "bin")));
  }

  rect(x, y, width, height, name) {
    const made = document.createElementNS(SVG, "rect");
    for (const [key, value] of Object.entries({ x, y, width, height, class: name })) made.setAttribute(key, value);
    return made;
  }

  at(event) {
    const box = this.place.getBoundingClientRect();
    return Math.min(1, Math.max(0, (event.clientX - box.left) / box.width));
  }

  begin(event) {
    this.place.setPointerCapture(event.pointerId);
    this.start = this.stop = this.at(event);
  }

  move(event) {
    if (this.start === undefined) return;
    this.stop = this.at(event);
    const [a, b] = [Math.min(this.start, this.stop), Math.max(this.start, this.stop)];
    this.band.setAttribute("x", a * BINS);
    this.band.setAttribute("width", (b - a) * BINS);
    this.changed(...[a, b].map((share) => Math.exp(this.from + share * (this.to - this.from))));
  }

  end() {
    if (this.start === this.stop) {
      this.band.setAttribute("width", 0);
      this.changed(null, null);
    }
    this.start = undefined;
  }
}

export class FleetView {
  constructor(session, id) {
    this.id = id;
    this.found = catalogue.recording(id);
    this.brush = new Brush((low, high) => this.between(low, high));
    this.choice = h("select", { "aria-label": "Coefficient", onchange: said(() => this.choose()) });
    const field = (label, type) => h("label", {}, `${label} `, h("input", { type, "aria-label": label, oninput: () => this.filter(), step: "any" }));
    this.search = field("Unit, lot or log", "search");
    this.least = field("From", "number");
    this.most = field("To", "number");
    this.count = h("p", { role: "status", class: "soft" });
    this.list = h("div", {});
    this.place = h("div", {}, h("h1", {}, this.found ? catalogue.shortName(this.found.name) : "Fleet"),
      h("section", { "aria-label": "Filter" }, h("div", { class: "bar" }, h("label", {}, "Coefficient ", this.choice), this.search, this.least, this.most), this.brush.place, this.count),
      h("section", { "aria-label": "Logs" }, this.list));
  }

  async load() {
    if (!this.found) throw new Error("This fleet is not in the folder any more.");
    await this.fetch("");
  }

  close() {
    this.closed = true;
  }

  async choose() {
    const [channel, term] = JSON.parse(this.choice.value);
    await this.fetch(`?channel=${encodeURIComponent(channel)}&term=${encodeURIComponent(term)}`);
  }

  async fetch(asked) {
    const { facts, buffer } = await arrow(`/api/recordings/${this.id}/fleet${asked}`);
    if (this.closed) return;
    this.facts = facts;
    const { rows, columns } = arrowTable(buffer);
    this.rows = rows;
    this.columns = columns;
    fill(this.choice, facts.coefficients.map(([channel, term]) => h("option", { value: JSON.stringify([channel, term]) }, `${term} of ${channel}`)));
    this.choice.value = JSON.stringify(facts.chosen);
    for (const input of [this.least, this.most]) input.querySelector("input").value = "";
    this.brush.draw(Array.from(columns.estimate.values));
    this.table = new VirtualTable(this.shown(), { label: "Logs of the fleet", open: (row, event) => this.open(row, event), link: (row) => this.address(row) });
    fill(this.list, this.table.place);
    this.filter();
    this.place.dataset.drawn = "yes";
  }

  shown() {
    const { columns, facts } = this;
    const words = (name, label) => {
      const { codes, words: all } = columns[name];
      const rank = new Int32Array(all.length);
      all.map((_, i) => i).sort((a, b) => all[a].localeCompare(all[b], undefined, { numeric: true })).forEach((code, place) => (rank[code] = place));
      return { name, label, text: (row) => all[codes[row]] || "–", order: (a, b) => rank[codes[a]] - rank[codes[b]] };
    };
    const numbers = (name, label, text = short) => {
      const { values } = columns[name];
      const key = (row) => (Number.isNaN(values[row]) ? Infinity : values[row]);
      return { name, label, text: (row) => text(values[row]), order: (a, b) => { const [x, y] = [key(a), key(b)]; return x === y ? a - b : x - y; } };
    };
    const unit = ` [${facts.unit}]`;
    return [
      ["unit", words, "Unit"], ["lot", words, "Lot"], ["date", numbers, "Date", day], ["temperature", numbers, "Temperature [°C]"],
      ["estimate", numbers, `Estimate${unit}`], ["lower", numbers, "Lower"], ["upper", numbers, "Upper"], ["status", words, "Status"], ["log", words, "Log"],
    ].filter(([name]) => columns[name]).map(([name, make, ...more]) => make(name, ...more));
  }

  between(low, high) {
    const put = (input, value) => (input.querySelector("input").value = value === null ? "" : Number(value.toPrecision(4)));
    put(this.least, low);
    put(this.most, high);
    this.filter();
  }

  filter() {
    const [text, low, high] = [this.search, this.least, this.most].map((l) => l.querySelector("input").value.trim());
    const searched = ["unit", "lot", "log"].filter((name) => this.columns[name]).map((name) => this.columns[name]);
    const hits = text ? searched.map(({ words }) => words.map((w) => w.toLowerCase().includes(text.toLowerCase()))) : [];
    const { values } = this.columns.estimate;
    const kept = new Uint32Array(this.rows);
    let n = 0;
    for (let row = 0; row < this.rows; row++) {
      if (text && !searched.some(({ codes }, i) => hits[i][codes[row]])) continue;
      if (low !== "" && !(values[row] >= Number(low))) continue;
      if (high !== "" && !(values[row] <= Number(high))) continue;
      kept[n++] = row;
    }
    this.table.show(kept.slice(0, n));
    fill(this.count, `${n} of ${this.rows} logs`);
  }

  log(row) {
    const { codes, words } = this.columns.log;
    return words[codes[row]];
  }

  address(row) {
    const recording = recordingOf(this.log(row));
    return recording ? `#/recording/${recording.id}/study` : location.hash;
  }

  open(row, event) {
    if (recordingOf(this.log(row))) return;
    event.preventDefault();
    notice(`${this.log(row)} is not in the folder of this page: open the page on the folder that holds it.`, "warning");
  }
}
