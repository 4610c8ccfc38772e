// SPDX-License-Identifier: BSD-3-Clause
// Several recordings side by side: do they differ, and in what.

import * as catalogue from "./catalogue.js";
import { h, fill, said, notice } from "./dom.js";
import { fields } from "./form.js";
import { run } from "./progress.js";
import { ResultView } from "./result.js";

export class CompareView {
  constructor(session) {
    this.session = session;
    this.chosen = new Set();
    this.result = new ResultView();
    this.list = h("fieldset", { class: "stack plain" });
    const read = fields(session.reading, { names: ["unit", "rate", "channels"] });
    const own = fields(session.kinds.compare.options, { names: ["names", "accept", "level", "confidence"] });
    const doing = h("div", { role: "status" });
    this.button = h("button", { type: "button", class: "main", onclick: said(() => this.compare(doing, read.values(), own.values())) }, "Compare");
    this.place = h("div", {}, h("h1", {}, "Compare recordings"),
      h("section", {}, this.list, h("details", {}, h("summary", {}, "Options"), read.place, own.place), h("div", { class: "bar" }, this.button, h("span", { class: "soft" }, "Two or more, of the same kind of sensor at rest")), doing),
      this.result.place);
    this.forget = catalogue.watch(() => this.draw());
  }

  close() {
    this.forget();
    this.result.close();
  }

  load() {
    this.draw();
  }

  draw() {
    const found = catalogue.recordings().filter((r) => r.status !== "recording");
    const row = (r) => {
      const input = h("input", { type: "checkbox", checked: this.chosen.has(r.id) });
      input.addEventListener("change", () => {
        this.chosen[input.checked ? "add" : "delete"](r.id);
        this.button.disabled = this.chosen.size < 2;
      });
      return h("label", { class: "tick" }, input, r.name, " ", catalogue.healthTag(r));
    };
    this.button.disabled = this.chosen.size < 2;
    fill(this.list, h("legend", { class: "hidden" }, "Recordings"), found.length ? found.map(row) : h("p", { class: "soft" }, "No recordings yet."));
  }

  async compare(doing, read, options) {
    const ids = catalogue.recordings().map((r) => r.id).filter((id) => this.chosen.has(id));
    if (ids.length < 2) return notice("Choose two or more recordings.");
    const job = await run(doing, { kind: "compare", recordings: ids, read, options });
    if (job) await this.result.show(job);
  }
}
