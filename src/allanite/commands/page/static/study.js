// SPDX-License-Identifier: BSD-3-Clause
// A study: what the record supports, the curve with band and model, the numbers, the findings, the files.

import { get } from "./api.js";
import { Said } from "./blocks.js";
import { CurvePanel } from "./curve.js";
import { h, fill } from "./dom.js";
import { exportBar, takeBar } from "./exports.js";
import { findingList } from "./findings.js";
import { lines } from "./lines.js";
import { otherTerms } from "./otherterms.js";
import { parameterTable } from "./parameters.js";
import * as work from "./work.js";

// The numbers of all axes first, in their tables: without scrolling, which the large ones would need. Then what is to be known.
const FIRST = ["banner", "table"];
const numbersFirst = (blocks) => [...FIRST.flatMap((kind) => blocks.filter((b) => b.kind === kind)), ...blocks.filter((b) => ![...FIRST, "numbers"].includes(b.kind))];

/**
 * Show the study of a document of the catalogue.
 * `subject` is the recording and how it is read, `refit(options)` characterizes it again; null where it is not there.
 */
export class StudyView {
  constructor(session, document, subject = null, refit = null) {
    this.session = session;
    this.subject = subject;
    this.document = document;
    this.refit = refit;
    this.place = h("div", { class: "study" }, h("p", { class: "soft" }, "Reading the study …"));
  }

  close() {
    this.curve?.close();
    this.verdict?.close();
    this.more?.close();
  }

  async load() {
    const id = this.document.id;
    const [study, table] = await Promise.all([get(`/api/documents/${id}`), get(`/api/documents/${id}/parameters`)]);
    // A fit of the samples knows no averaging times: none can be left out.
    const refit = study.channels.some((c) => c.models[0]?.goodness.method === "likelihood") ? null : this.refit;
    this.curve = new CurvePanel(this.session, this.document, study, { refit, channel: (name) => this.channel(name) });
    this.study = study;
    this.parameters = h("div", {});
    this.table = table;
    const drawn = (models) => {
      this.curve.models = models;
      return this.curve.draw();
    };
    this.fit = this.subject && otherTerms(this.session, this.subject, table, drawn, () => this.curve.name);
    this.verdict = this.sections("verdict", numbersFirst);
    // The series of a recording that is at hand says more than the picture of it.
    this.more = this.sections(this.subject ? "environment,longer,spectra" : "environment,longer,record,spectra");
    const job = work.all().find((j) => j.document === id);
    fill(
      this.place,
      takeBar(this.document),
      this.verdict.place,
      h("section", { class: "noise", "aria-labelledby": "curve-title" }, h("h2", { id: "curve-title" }, "Noise"), this.curve.place, this.fit),
      h("section", { "aria-labelledby": "parameters-title" }, h("h2", { id: "parameters-title" }, "Parameters"), this.parameters),
      h("section", { "aria-labelledby": "findings-title" }, h("h2", { id: "findings-title" }, "Findings"), findingList(study.findings)),
      this.more.place,
      exportBar(this.session, this.document),
      lines({ command: job?.command || this.document.command, python: job?.python }),
    );
    this.channel(study.channels[0].name);
    await Promise.all([this.verdict.load(), this.curve.draw()]);
    await this.more.load();
  }

  /** Sections of the report: the same blocks. */
  sections(only, order) {
    return new Said(() => get(`/api/documents/${this.document.id}/said?only=${only}`), order);
  }

  /** The channel that is looked at. */
  channel(name) {
    this.fit?.show();
    const found = this.table.channels.find((c) => c.name === name);
    if (found) fill(this.parameters, parameterTable(found, this.study.channels.find((c) => c.name === name)?.models[0]?.confidence));
  }
}
