// SPDX-License-Identifier: BSD-3-Clause
// Earth rate and north from one recording, with turns marked on its series.

import { get } from "./api.js";
import { h, fill, said } from "./dom.js";
import { fields } from "./form.js";
import { Marks } from "./marks.js";
import { run } from "./progress.js";
import { ResultView } from "./result.js";
import { digits } from "./wording.js";

const FIRST = { "earth-rate": ["latitude", "model", "first", "dead_time"], north: ["latitude", "model", "dead_time", "rotation"] };
const MARKED = { "earth-rate": "turns", north: "headings" };
const DEG_H = (180 / Math.PI) * 3600;
const DEG = 180 / Math.PI;

function table(confidence, rows) {
  return h("div", { class: "wide" }, h("table", {},
    h("thead", {}, h("tr", {}, ["", "Estimate", `${digits(100 * confidence, 3)} % interval`, "One sd", "Unit"].map((t) => h("th", { scope: "col" }, t)))),
    h("tbody", {}, rows.map(([name, value, interval, sd, unit]) => h("tr", {}, h("th", { scope: "row" }, name), h("td", {}, value), h("td", {}, interval), h("td", {}, sd), h("td", {}, unit))))));
}

function estimate(found) {
  const text = (factor) => (value) => (value === null || value === undefined ? "–" : digits(value * factor));
  const between = (pair, f) => (pair && pair[0] !== null ? `${f(pair[0])} to ${f(pair[1])}` : "–");
  if (found.format === "allanite-earth-rate") {
    const f = text(DEG_H);
    return table(found.confidence, [["Earth rate", f(found.rate), between(found.interval, f), f(found.total_sd), "deg/h"], ["Expected", f(found.earth_rate), "", "", "deg/h"]]);
  }
  if (found.format === "allanite-north") {
    const f = text(DEG);
    // An azimuth may lie in several arcs, clockwise from their start to their stop.
    const arcs = found.interval.map((arc) => between([arc.start, arc.stop], f)).join(" or ") || "–";
    return table(found.confidence, [["Azimuth of the mark", f(found.azimuth), arcs, f(found.total_sd ?? found.sd), "deg"]]);
  }
  return null;
}

export class MeasurePanel {
  /** @param {{id: string, read: () => object, again: () => void, look: () => void}} recording whose series is shown, how to draw it again and bring it into view */
  constructor(session, recording) {
    this.session = session;
    this.recording = recording;
    this.kind = "earth-rate";
    this.kept = { turns: [], headings: [] };
    this.marks = new Marks(() => recording.again(), () => recording.look());
    this.form = h("div", {});
    this.result = new ResultView("Earth rate or north");
    this.place = h("div", { hidden: true }, h("section", { "aria-label": "Measurement" }, this.kinds(), this.form), this.result.place);
    this.drawForm();
  }

  close() {
    this.result.close();
  }

  kinds() {
    const radio = (value, label) => {
      const input = h("input", { type: "radio", name: "measure-kind", value, checked: value === this.kind });
      input.addEventListener("change", () => {
        this.kept[MARKED[this.kind]] = this.marks.rows;
        this.kind = value;
        this.marks.rows = this.kept[MARKED[value]];
        this.marks.as(MARKED[value]);
        this.drawForm();
      });
      return h("label", { class: "choice" }, input, label);
    };
    return h("fieldset", { class: "choices" }, h("legend", { class: "hidden" }, "Measure"), radio("earth-rate", "Earth rate"), radio("north", "North"));
  }

  drawForm() {
    const { options, required } = this.session.kinds[this.kind];
    const first = FIRST[this.kind];
    const hidden = [...first, MARKED[this.kind]];
    const own = fields(options, { names: first, required });
    const others = fields(options, { names: Object.keys(options).filter((n) => !hidden.includes(n)), required });
    const doing = h("div", { role: "status" });
    const measure = said(async (event) => {
      event.preventDefault();
      const given = { ...own.values(), ...others.values(), [MARKED[this.kind]]: this.marks.values() };
      await this.measure(doing, given);
    });
    fill(this.form, h("form", { onsubmit: measure }, own.place, this.marks.place,
      h("details", {}, h("summary", {}, "Options"), others.place),
      h("div", { class: "bar" }, h("button", { class: "main" }, "Measure"))), doing);
  }

  async measure(doing, options) {
    const job = await run(doing, { kind: this.kind, recording: this.recording.id, read: this.recording.read(), options });
    if (!job) return;
    const found = await get(`/api/jobs/${job.id}/document`);
    const turns = found.reversals?.turns;
    const rate = found.reversals?.rate;
    const take = turns?.length && this.kind === "earth-rate"
      ? h("button", { type: "button", onclick: () => this.marks.set(turns.map((t) => [t.start / rate, t.stop / rate, 0])) }, `Take over the ${turns.length} turns that were found, to correct them`)
      : null;
    await this.result.show(job, found, [estimate(found), take && h("div", { class: "bar" }, take)]);
  }
}
