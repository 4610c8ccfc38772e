// SPDX-License-Identifier: BSD-3-Clause
// Earth rate and north from one recording, with turns marked on its series.

import { get } from "./api.js";
import { h, fill, said } from "./dom.js";
import { fields } from "./form.js";
import { Marks } from "./marks.js";
import { run } from "./progress.js";
import { ResultView } from "./result.js";

const FIRST = { "earth-rate": ["latitude", "model", "first", "dead_time"], north: ["latitude", "model", "dead_time", "rotation"] };
const MARKED = { "earth-rate": "turns", north: "headings" };

export class MeasurePanel {
  /** @param {{id: string, read: () => object, again: () => void, look: () => void}} recording whose series is shown, how to draw it again and bring it into view */
  constructor(session, recording) {
    this.session = session;
    this.recording = recording;
    this.kind = "earth-rate";
    this.kept = { turns: [], headings: [] };
    this.marks = new Marks(() => recording.again(), () => recording.look());
    this.form = h("div", {});
    this.result = new ResultView();
    this.place = h("div", { hidden: true }, h("section", { "aria-label": "Measurement" }, this.kinds(), this.form));
    this.result.place.hidden = true;
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
      ? h("section", { "aria-label": "Detected turns" }, h("div", { class: "bar" }, h("button", { type: "button", onclick: () => this.takeOver(turns, rate) }, `Edit the ${turns.length} detected turns`)))
      : null;
    await this.result.show(job, take);
  }

  /** Detected turns become rows and bands, to be corrected by hand. */
  takeOver(turns, rate) {
    this.marks.set(turns.map((t) => [t.start / rate, t.stop / rate, 0]));
    this.recording.look();
  }
}
