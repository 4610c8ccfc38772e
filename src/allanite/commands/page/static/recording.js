// SPDX-License-Identifier: BSD-3-Clause
// One recording: its series at once, what is missing is asked in the same place, and its study.

import { AnalysisPanel } from "./analysis.js";
import { post } from "./api.js";
import * as catalogue from "./catalogue.js";
import { h, fill, said } from "./dom.js";
import { findingList } from "./findings.js";
import { fields } from "./form.js";
import { questions } from "./questions.js";
import { lines } from "./lines.js";
import { MeasurePanel } from "./measure.js";
import { followed, progress, run } from "./progress.js";
import { SeriesView } from "./series.js";
import { StudyView } from "./study.js";
import { duration, samples } from "./wording.js";
import * as work from "./work.js";

const readings = new Map(); // what the user said of a recording, for as long as the page is open

/** What was given channel by channel; one text for all of them is replaced by answers. */
const byChannel = (given) => (given && typeof given === "object" ? given : {});

export class RecordingView {
  constructor(session, id, what) {
    this.session = session;
    this.wanted = what === "study"; // is made where there is none
    this.id = id;
    this.found = catalogue.recording(id);
    this.asked = {}; // options of the study that was made last
    this.read = readings.get(id) || this.found?.facts?.read || {};
    this.reading = h("section", { "aria-labelledby": "reading-title" });
    this.series = h("section", { "aria-labelledby": "series-title" });
    this.action = h("section", { "aria-label": "Characterize" });
    this.result = h("div", {});
    this.noise = h("div", {}, this.result);
    this.measure = new MeasurePanel(session, { id, read: () => this.read, again: () => this.shown?.paint(), look: () => this.series.scrollIntoView({ block: "start" }) });
    this.reading.hidden = this.action.hidden = true;
    this.closer = new AnalysisPanel(session, { id, read: () => this.read });
    this.tabs = h("fieldset", { class: "choices tabs", hidden: true }, h("legend", { class: "hidden" }, "What to do with it"), this.tab("noise", "Noise"), this.tab("measure", "Earth rate and north"), this.tab("closer", "A closer look"));
    this.doing = h("div", { role: "status", class: "doing" });
    // A study stands above what it was made from, turns beside the series on which they are marked, and what is to be done next above the pictures: both are seen without scrolling.
    this.place = h("div", {}, h("h1", {}, this.found ? catalogue.shortName(this.found.name) : "Recording"), this.tabs, this.doing, this.noise, this.closer.place, this.measure.place, this.reading, this.action, this.series, this.measure.result.place);
  }

  tab(name, label) {
    const input = h("input", { type: "radio", name: "recording-tab", value: name, checked: name === "noise" });
    input.addEventListener("change", () => {
      this.tabbed = name;
      this.noise.hidden = this.action.hidden = name !== "noise";
      this.measure.place.hidden = this.measure.result.place.hidden = name !== "measure";
      this.closer.place.hidden = name !== "closer";
      this.measuring = name === "measure";
      this.shown?.paint();
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
    if (!this.found) throw new Error("This recording is no longer in the folder.");
    const [study] = catalogue.documents((d) => d.recording === this.id && d.format === "allanite-study");
    const job = work.all().find((j) => j.kind === "characterize" && j.recording === this.id && !work.isOver(j));
    const opened = this.open();
    if (this.wanted && !study && !job) opened.then(() => this.button && !this.closed && this.characterize(this.asked)).catch(() => {});
    await Promise.all([opened, study ? this.showStudy(study) : null, job ? this.finish(followed(this.doing, job)) : null]);
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
        if (job.state !== "done") return this.ask(job.state === "failed" ? job.message : "Opening was canceled.", job.asks);
        answer = await post(`/api/recordings/${this.id}/open`, { read: this.read });
      }
    } catch (error) {
      return this.ask(error.message);
    }
    if (!this.closed) await this.show(answer.series);
  }

  /** What a refusal names is asked for here; a file that cannot be read says so, and can be taken off the list. */
  ask(message, asks = []) {
    fill(this.series);
    this.series.hidden = this.action.hidden = true;
    const asked = [...new Set([...asks, ...Object.keys(this.read)])];
    if (asked.length) {
      this.drawReading(h("div", { class: "banner warning", role: "alert" }, message), asked);
      this.reading.querySelector("input, select")?.focus();
      return;
    }
    fill(this.reading, h("h2", { id: "reading-title" }, "This file cannot be read"),
      h("div", { class: "banner fatal", role: "alert" }, message),
      h("div", { class: "bar" }, catalogue.listing(this.found, false), h("span", { class: "soft" }, "The file stays where it is.")),
      h("details", {}, h("summary", {}, "Read it in another way"), this.readingForm(Object.keys(this.session.reading))));
    this.reading.hidden = false;
    this.action.before(this.reading);
  }

  /** The form of how the file is read: some options first, the others folded away. */
  readingForm(first, before = null, more = () => ({})) {
    const options = this.session.reading;
    const shown = fields(options, { names: first, given: this.read });
    const rest = Object.keys(options).filter((n) => !first.includes(n));
    const others = fields(options, { names: rest, given: this.read });
    const again = said(async (event) => {
      event.preventDefault();
      this.read = { ...shown.values(), ...others.values() };
      for (const [name, answers] of Object.entries(more())) this.read[name] = { ...byChannel(this.read[name]), ...answers };
      readings.set(this.id, this.read);
      await this.open();
    });
    return h("form", { onsubmit: again }, before, shown.place, rest.length ? h("details", {}, h("summary", {}, "More about the file"), others.place) : null,
      h("div", { class: "bar" }, h("button", { class: before || first.length < Object.keys(options).length ? "main" : "" }, "Read the file with this")));
  }

  /** Above what is done with the file while something is open, and below the pictures once nothing is. */
  drawReading(banner, first, asking = null) {
    const options = Object.keys(this.session.reading);
    this.reading.hidden = false;
    if (banner || asking) {
      fill(this.reading, h("h2", { id: "reading-title" }, "What the file does not say"), banner, this.readingForm(first, asking?.place, asking?.values));
      return this.action.before(this.reading);
    }
    fill(this.reading, h("details", { class: "flat" }, h("summary", { id: "reading-title" }, "How the file is read"), this.readingForm(options)));
    this.series.after(this.reading);
  }

  async show(meta) {
    this.shown?.close();
    this.meta = meta;
    const { marks } = this.measure;
    this.shown = new SeriesView(meta, {
      bands: () => (this.measuring ? marks.bands() : []),
      marking: () => this.measuring && marks.on,
      selected: (range) => marks.selected(range),
      dragged: (index, part, seconds) => marks.dragged(index, part, seconds),
      dropped: () => marks.dropped(),
    });
    this.tabs.hidden = false;
    const facts = `${duration(meta.duration)}, ${samples(meta.samples)} samples at ${meta.rate} Hz`;
    fill(this.series, h("h2", { id: "series-title" }, "Time series ", h("span", { class: "soft" }, facts)), this.shown.place);
    this.drawReading(null, [], meta.questions.length ? questions(meta.questions) : null);
    this.drawAction();
    await this.shown.draw();
  }

  // -- the study ---------------------------------------------------------------------------------------------

  drawAction() {
    const { options } = this.session.kinds.characterize;
    const form = fields(options, { names: ["method", "accept", "statistic", "temperature", "warm_up"], given: this.asked });
    const same = h("div", {});
    const preview = said(async () => {
      const body = { kind: "characterize", recording: this.id, read: this.read, options: form.values() };
      fill(same, lines(await post("/api/jobs/preview", body), same.querySelector("details")?.open));
    });
    const button = h("button", { type: "button", class: this.meta.questions.length || this.study ? "" : "main", onclick: said(() => this.characterize(form.values())) }, this.study ? "Characterize again" : "Characterize");
    this.button = button;
    button.disabled = Boolean(this.busy);
    // A study says its findings itself.
    const health = this.found.health && !this.study ? findingList(this.found.health.findings) : null;
    fill(this.action,
      h("div", { class: "bar" }, button, h("span", { class: "soft" }, "Allan curve, noise model with intervals, imu.yaml, report")),
      h("details", {}, h("summary", {}, "Options"), form.place), same, health);
    form.place.addEventListener("change", preview);
    this.action.hidden = (this.tabbed || "noise") !== "noise";
    preview();
  }

  async characterize(options) {
    this.asked = options;
    await this.finish(run(this.doing, { kind: "characterize", recording: this.id, read: this.read, options }));
  }

  /** Its result is what one sees next. */
  async finish(promised) {
    this.busy = true;
    if (this.button) this.button.disabled = true;
    try {
      const job = await promised;
      if (!job || this.closed) return;
      await catalogue.refresh();
      const document = catalogue.documentById(job.document);
      if (!document || this.closed) return;
      const shown = this.showStudy(document);
      this.place.scrollIntoView({ block: "start" });
      await shown;
    } finally {
      this.busy = false;
      if (this.button) this.button.disabled = false;
    }
  }

  async showStudy(document) {
    this.study?.close();
    const subject = { recording: this.id, read: this.read };
    this.study = new StudyView(this.session, document, subject, (options) => this.characterize({ ...this.asked, ...options }));
    const studies = catalogue.documents((d) => d.recording === this.id && d.format === "allanite-study");
    const select = h("select", { "aria-label": "Study" }, studies.map((d) => h("option", { value: d.id }, d.name.replace(/^allanite-results\//, ""))));
    select.value = document.id;
    select.addEventListener("change", said(() => this.showStudy(catalogue.documentById(select.value))));
    fill(this.result, studies.length > 1 ? h("div", { class: "bar" }, h("label", {}, "Study ", select)) : null, this.study.place);
    if (this.button) this.drawAction();
    await this.study.load();
  }
}
