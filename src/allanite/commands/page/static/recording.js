// SPDX-License-Identifier: BSD-3-Clause
// One recording: its series at once, what is missing is asked in the same place, and its study.

import { AnalysisPanel } from "./analysis.js";
import { post } from "./api.js";
import * as catalogue from "./catalogue.js";
import { h, fill, said } from "./dom.js";
import { findingList } from "./findings.js";
import { fields } from "./form.js";
import { lines } from "./lines.js";
import { MeasurePanel } from "./measure.js";
import { progress, run } from "./progress.js";
import { SeriesView } from "./series.js";
import { StudyView } from "./study.js";
import { duration, samples } from "./wording.js";
import * as work from "./work.js";

const FIRST = ["unit", "rate"]; // what a log most often does not say
const readings = new Map(); // what the user said of a recording, for as long as the page is open

export class RecordingView {
  constructor(session, id) {
    this.session = session;
    this.id = id;
    this.found = catalogue.recording(id);
    this.asked = {}; // options of the study that was made last
    this.read = readings.get(id) || this.found?.facts?.read || {};
    this.reading = h("section", { "aria-labelledby": "reading-title" });
    this.series = h("section", { "aria-labelledby": "series-title" });
    this.action = h("section", { "aria-label": "Characterize" });
    this.result = h("div", {});
    this.noise = h("div", {}, this.result);
    this.measure = new MeasurePanel(session, { id, read: () => this.read, again: () => this.shown?.paint().catch(() => {}), look: () => this.series.scrollIntoView({ block: "start" }) });
    this.reading.hidden = this.action.hidden = true;
    this.closer = new AnalysisPanel(session, { id, read: () => this.read });
    this.tabs = h("fieldset", { class: "choices tabs", hidden: true }, h("legend", { class: "hidden" }, "What to do with it"), this.tab("noise", "Noise"), this.tab("measure", "Earth rate and north"), this.tab("closer", "A closer look"));
    // What is to be done next stands above the pictures: it is seen without scrolling.
    this.place = h("div", {}, h("h1", {}, this.found ? catalogue.shortName(this.found.name) : "Recording"), this.tabs, this.action, this.reading, this.series, this.noise, this.measure.place, this.closer.place);
  }

  tab(name, label) {
    const input = h("input", { type: "radio", name: "recording-tab", value: name, checked: name === "noise" });
    input.addEventListener("change", () => {
      this.tabbed = name;
      this.noise.hidden = this.action.hidden = name !== "noise";
      this.measure.place.hidden = name !== "measure";
      this.closer.place.hidden = name !== "closer";
      this.measuring = name === "measure";
      this.shown?.paint().catch(() => {});
    });
    return h("label", { class: "choice" }, input, label);
  }

  close() {
    this.closed = true;
    this.shown?.close();
    this.study?.close();
    this.measure.close();
    this.closer.close();
  }

  async load() {
    if (!this.found) throw new Error("This recording is not in the folder any more.");
    const [study] = catalogue.documents((d) => d.recording === this.id && d.format === "allanite-study");
    await Promise.all([this.open(), study ? this.showStudy(study) : null]);
  }

  // -- reading -----------------------------------------------------------------------------------------------

  async open() {
    this.series.hidden = false;
    fill(this.series, h("h2", { id: "series-title" }, "Time series"), h("p", { class: "soft" }, "Opening …"));
    const doing = h("div", {});
    let answer;
    try {
      answer = await post(`/api/recordings/${this.id}/open`, { read: this.read });
      if (!answer.ready) {
        fill(this.series, h("h2", { id: "series-title" }, "Time series"), doing);
        progress(doing, answer.job);
        const job = await work.finished(answer.job, (news) => progress(doing, news));
        if (this.closed) return;
        if (job.state !== "done") return this.ask(job.state === "failed" ? job.message : "Opening was cancelled.", answer.job);
        answer = await post(`/api/recordings/${this.id}/open`, { read: this.read });
      }
    } catch (error) {
      return this.ask(error.message);
    }
    if (!this.closed) await this.show(answer.series);
  }

  /** Something is missing in the file: ask for it here. */
  ask(message) {
    fill(this.series);
    this.series.hidden = true;
    this.drawReading(true, message);
    this.action.hidden = true;
    this.reading.querySelector("input")?.focus();
  }

  drawReading(open, message = "") {
    const options = this.session.reading;
    const first = fields(options, { names: FIRST, given: this.read });
    const others = fields(options, { names: Object.keys(options).filter((n) => !FIRST.includes(n)), given: this.read });
    const again = said(async (event) => {
      event.preventDefault();
      this.read = { ...first.values(), ...others.values() };
      readings.set(this.id, this.read);
      await this.open();
    });
    const form = h("form", { onsubmit: again }, first.place, h("details", {}, h("summary", {}, "More about the file"), others.place), h("div", { class: "bar" }, h("button", { class: open ? "main" : "" }, "Open with this")));
    this.reading.hidden = false;
    fill(this.reading, open
      ? [h("h2", { id: "reading-title" }, "What the file does not say"), h("div", { class: "banner warning", role: "alert" }, message), form]
      : h("details", { class: "flat" }, h("summary", { id: "reading-title" }, "How the file is read"), form));
  }

  async show(meta) {
    this.shown?.close();
    this.meta = meta;
    const { marks } = this.measure;
    this.shown = new SeriesView(meta, {
      shapes: () => (this.measuring ? marks.shapes() : []),
      marking: () => this.measuring && marks.on,
      selected: (range) => marks.selected(range),
      dragged: (index, part, seconds) => marks.dragged(index, part, seconds),
      dropped: () => marks.dropped(),
    });
    this.tabs.hidden = false;
    const facts = `${duration(meta.duration)}, ${samples(meta.samples)} samples at ${meta.rate} Hz`;
    fill(this.series, h("h2", { id: "series-title" }, "Time series ", h("span", { class: "soft" }, facts)), this.shown.place);
    const unknown = meta.channels.filter((c) => c.kind === "unknown").map((c) => c.name);
    this.drawReading(unknown.length > 0, unknown.length ? `The file does not say the unit of ${unknown.slice(0, 6).join(", ")}. Without it the results stay in the numbers of the file.` : "");
    this.drawAction();
    await this.shown.draw();
  }

  // -- the study ---------------------------------------------------------------------------------------------

  drawAction() {
    const { options } = this.session.kinds.characterize;
    const form = fields(options, { names: ["method", "accept", "statistic", "temperature", "warm_up"], given: this.asked });
    const doing = (this.doing = h("div", { role: "status" }));
    const same = h("div", {});
    const preview = said(async () => {
      const body = { kind: "characterize", recording: this.id, read: this.read, options: form.values() };
      fill(same, lines(await post("/api/jobs/preview", body), same.querySelector("details")?.open));
    });
    const button = h("button", { type: "button", class: "main", onclick: said(() => this.characterize(form.values())) }, this.study ? "Characterize again" : "Characterize");
    this.button = button;
    // A study says its findings itself.
    const health = this.found.health && !this.study ? findingList(this.found.health.findings) : null;
    fill(this.action,
      h("div", { class: "bar" }, button, h("span", { class: "soft" }, "Allan curve, noise model with intervals, imu.yaml, report")),
      h("details", {}, h("summary", {}, "Options"), form.place), same, doing, health);
    form.place.addEventListener("change", preview);
    this.action.hidden = (this.tabbed || "noise") !== "noise";
    preview();
  }

  async characterize(options) {
    this.button.disabled = true;
    this.asked = options;
    try {
      const job = await run(this.doing, { kind: "characterize", recording: this.id, read: this.read, options });
      if (!job || this.closed) return;
      await catalogue.refresh();
      const document = catalogue.documentById(job.document);
      if (document && !this.closed) await this.showStudy(document);
    } finally {
      this.button.disabled = false;
    }
  }

  async showStudy(document) {
    this.study?.close();
    const subject = { recording: this.id, read: this.read };
    this.study = new StudyView(this.session, document, subject, (options) => {
      this.action.scrollIntoView({ block: "center" });
      return this.characterize({ ...this.asked, ...options });
    });
    const studies = catalogue.documents((d) => d.recording === this.id && d.format === "allanite-study");
    const select = h("select", { "aria-label": "Study" }, studies.map((d) => h("option", { value: d.id }, d.name.replace(/^allanite-results\//, ""))));
    select.value = document.id;
    select.addEventListener("change", said(() => this.showStudy(catalogue.documentById(select.value))));
    fill(this.result, studies.length > 1 ? h("div", { class: "bar" }, h("label", {}, "Study ", select)) : null, this.study.place);
    if (this.button) this.drawAction();
    await this.study.load();
  }
}
