// SPDX-License-Identifier: BSD-3-Clause
// A closer look at one recording: its spectrum, whether its noise changes, which terms it supports, and what a filter leaves.

import { h, fill, said } from "./dom.js";
import { fields } from "./form.js";
import { run } from "./progress.js";
import { ResultView } from "./result.js";

const KINDS = {
  spectrum: ["Spectrum", "Power spectral density with intervals; spectral lines"],
  variation: ["Does the noise change?", "Allan deviation over time, and a test for a change"],
  select: ["Which terms?", "Compare sets of noise terms, with the confidence of the choice"],
  filter: ["Filter", "Remove the drift that a noise model predicts, and test the model"],
};

export class AnalysisPanel {
  /** @param {{id: string, read: () => object}} recording */
  constructor(session, recording) {
    this.session = session;
    this.recording = recording;
    this.form = h("div", {});
    this.result = new ResultView();
    this.place = h("div", { hidden: true }, h("section", { "aria-label": "Closer look" },
      h("fieldset", { class: "choices" }, h("legend", { class: "hidden" }, "Look at"), Object.keys(KINDS).map((kind) => this.choice(kind))), this.form), this.result.place);
    this.draw("spectrum");
  }

  close() {
    this.result.close();
  }

  choice(kind) {
    const input = h("input", { type: "radio", name: "analysis-kind", value: kind, checked: kind === "spectrum" });
    input.addEventListener("change", () => this.draw(kind));
    return h("label", { class: "choice" }, input, KINDS[kind][0]);
  }

  draw(kind) {
    const { options, required } = this.session.kinds[kind];
    const own = fields(options, { names: required, required });
    const others = fields(options, { names: Object.keys(options).filter((n) => !required.includes(n)) });
    const doing = h("div", { role: "status" });
    const start = said(async (event) => {
      event.preventDefault();
      const job = await run(doing, { kind, recording: this.recording.id, read: this.recording.read(), options: { ...own.values(), ...others.values() } });
      if (job) await this.result.show(job);
    });
    fill(this.form, h("form", { onsubmit: start }, own.place, h("div", { class: "bar" }, h("button", { class: "main" }, "Look"), h("span", { class: "soft" }, KINDS[kind][1])),
      h("details", {}, h("summary", {}, "Options"), others.place)), doing);
  }
}
