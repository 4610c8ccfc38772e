// SPDX-License-Identifier: BSD-3-Clause
// A result of a job that is no study: what it says, its figure, its files, and how to get it otherwise.

import { h, fill, said } from "./dom.js";
import { FigureView } from "./figure.js";
import { lines } from "./lines.js";

const GOOD = ["resolved", "found", "no difference seen", "north found"];

export function files(job) {
  return h("div", { class: "bar" }, job.files.map((f) => h("a", { class: f.name === "report.html" ? "button strong" : "button", href: `/api/jobs/${job.id}/files/${f.index}`, download: "" }, f.name === "report.html" ? "Report" : f.name)));
}

/** A place that holds one result at a time. */
export class ResultView {
  constructor(name) {
    this.name = name;
    this.place = h("div", {});
  }

  close() {
    this.figure?.close();
  }

  /**
   * @param {object} job that is done
   * @param {object} document its result
   * @param {Array} more elements between the verdict and the figure
   * @param {Array} views names and labels of views of the figure
   */
  async show(job, document, more = [], views = []) {
    this.close();
    this.figure = new FigureView(`${this.name}: ${document.verdict || ""}`);
    const severity = GOOD.includes(document.verdict) ? "good" : "warning";
    const select = h("select", { "aria-label": "Figure" }, views.map(([v, label]) => h("option", { value: v }, label)));
    const draw = () => this.figure.document(job.document, { view: select.value });
    select.addEventListener("change", said(draw));
    fill(this.place, h("section", { "aria-labelledby": "result-title" },
      h("h2", { id: "result-title" }, "Result"),
      h("div", { class: `banner ${severity}` }, h("span", {}, h("b", {}, document.verdict?.replace(/^./, (c) => c.toUpperCase())), document.reason ? `: ${document.reason}` : "")),
      (document.advice || []).map((a) => h("p", {}, typeof a === "string" ? a : a.text)), more,
      views.length > 1 ? h("div", { class: "bar" }, select) : null, this.figure.place, files(job), lines(job)));
    await draw();
  }
}
