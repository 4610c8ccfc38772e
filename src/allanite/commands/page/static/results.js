// SPDX-License-Identifier: BSD-3-Clause
// All results of the folder, also those that commands have left; and one of them.

import * as catalogue from "./catalogue.js";
import { h, fill } from "./dom.js";
import { exportBar } from "./exports.js";
import { ResultView } from "./result.js";
import { StudyView } from "./study.js";

const CALIBRATION = "allanite-calibration-estimate";
const NO_PAGE = ["models"]; // noise models alone, which the planner and others take
const kindOf = (d) => d.format.replace("allanite-", "").replace(/-/g, " ").replace(/^./, (c) => c.toUpperCase());
const when = (d) => new Date(d.modified).toLocaleString([], { dateStyle: "medium", timeStyle: "short" });
const address = (d) => (d.format === "allanite-study" && d.recording ? `#/recording/${d.recording}` : `#/result/${d.id}`);

/** The list. */
export class ResultsView {
  constructor() {
    this.list = h("section", { "aria-label": "Results" });
    this.place = h("div", {}, h("h1", {}, "Results"), this.list);
    this.forget = catalogue.watch(() => this.load());
  }

  close() {
    this.forget();
  }

  load() {
    const row = (d) => h("tr", {},
      h("th", { scope: "row" }, h("a", { href: address(d) }, kindOf(d)), h("span", { class: "name" }, d.name)),
      h("td", {}, d.source || "–"), h("td", {}, when(d)));
    const found = catalogue.documents((d) => !NO_PAGE.includes(d.format));
    fill(this.list, found.length
      ? h("div", { class: "wide" }, h("table", {}, h("thead", {}, h("tr", {}, ["Result", "Made from", "When"].map((t) => h("th", { scope: "col" }, t)))), h("tbody", {}, found.map(row))))
      : h("p", { class: "soft" }, "No results yet. Results from this page and from commands appear here: studies, Earth rates, calibrations, alignments, comparisons, plans and others."));
  }
}

/** One result. */
export class DocumentView {
  constructor(session, id) {
    this.session = session;
    this.found = catalogue.documentById(id);
    this.view = this.found?.format === "allanite-study" ? new StudyView(session, this.found) : new ResultView();
    this.place = h("div", {}, h("h1", {}, this.found ? `${kindOf(this.found)}${this.found.source ? ` of ${this.found.source}` : ""}` : "Result"), this.view.place);
  }

  close() {
    this.view.close();
  }

  load() {
    if (!this.found) throw new Error("This result is no longer in the folder.");
    if (this.view instanceof StudyView) return this.view.load();
    return this.view.showDocument(this.found, this.found.format === CALIBRATION ? exportBar(this.session, this.found) : null);
  }
}
