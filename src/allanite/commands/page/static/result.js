// SPDX-License-Identifier: BSD-3-Clause
// A result that is no study: what its report says, its files, and how to get it otherwise.

import { get } from "./api.js";
import { Said } from "./blocks.js";
import { h, fill, said } from "./dom.js";
import { save } from "./exports.js";
import { lines } from "./lines.js";
import { run } from "./progress.js";

/**
 * Report and files of a result.
 * @param {{document: string, files: object[], address: (file: object) => string}} subject
 */
function files({ document, files: all, address }) {
  const doing = h("div", { role: "status" });
  const report = all.find((f) => f.name === "report.html");
  const make = said(async () => {
    if (report) return save(address(report));
    const job = await run(doing, { kind: "report", document });
    if (job) save(`/api/jobs/${job.id}/files/0`);
  });
  const others = all.filter((f) => f !== report).map((f) => h("a", { class: "button", href: address(f), download: "" }, f.name));
  return [h("div", { class: "bar take", role: "group", "aria-label": "Files" }, h("button", { type: "button", class: "main", onclick: make }, "Report"), others), doing];
}

/** A place that holds one result at a time. */
export class ResultView {
  constructor() {
    this.place = h("div", {});
  }

  close() {
    this.said?.close();
  }

  /** Show the result of a job that is done, and bring it into view; `more` stands below it. */
  async show(job, more = null) {
    await this.draw({ document: job.document, files: job.files, address: (f) => `/api/jobs/${job.id}/files/${f.index}`, same: job }, more);
    this.place.scrollIntoView({ block: "start" });
  }

  /** Show a result of the folder. */
  showDocument(document, more = null) {
    const address = (f) => `/api/documents/${document.id}/files/${f.index}`;
    return this.draw({ document: document.id, files: document.files, address, same: document }, more);
  }

  async draw(subject, more) {
    this.close();
    this.said = new Said(() => get(`/api/documents/${subject.document}/said`));
    fill(this.place, files(subject), this.said.place, more, lines(subject.same));
    await this.said.load();
    this.place.dataset.drawn = "yes";
  }
}
