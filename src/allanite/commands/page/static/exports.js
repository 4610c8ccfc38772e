// SPDX-License-Identifier: BSD-3-Clause
// Files for others: imu.yaml, the formats of filters and simulators, the report.

import { h, fill, said } from "./dom.js";
import { fields } from "./form.js";
import { lines } from "./lines.js";
import { run } from "./progress.js";

/** Let the browser save what stands at an address of the server. */
export function save(address) {
  const link = h("a", { href: address, download: "" });
  document.body.append(link);
  link.click();
  link.remove();
}

const nameOf = (consumer) => consumer.name.replace(/_/g, "-");

/** Write a file for another program, and save it. */
async function exported(doing, document, consumer, options) {
  const job = await run(doing, { kind: "export", document: document.id, options: { consumer, ...options } });
  if (!job) return;
  for (const f of job.files) save(`/api/jobs/${job.id}/files/${f.index}`);
  fill(doing, h("p", { class: "note" }, `Saved ${job.files.map((f) => f.name).join(", ")}.`), lines(job));
}

/** What a study has left, at its top: imu.yaml, the report, and the others. Where there is no imu.yaml, asking for it says why. */
export function takeBar(document) {
  const doing = h("div", { role: "status" });
  const address = (f) => `/api/documents/${document.id}/files/${f.index}`;
  const imu = document.files.find((f) => f.name === "imu.yaml");

  async function report() {
    if (document.report) return save(`/api/documents/${document.id}/report`);
    const job = await run(doing, { kind: "report", document: document.id });
    if (job) save(`/api/jobs/${job.id}/files/0`);
  }

  const others = document.files.filter((f) => !["imu.yaml", "report.html"].includes(f.name));
  return h("div", {}, h("div", { class: "bar take", role: "group", "aria-label": "Files" },
    h("button", { type: "button", class: imu ? "main" : null, onclick: said(() => (imu ? save(address(imu)) : exported(doing, document, "kalibr", {}))) }, "imu.yaml"),
    h("button", { type: "button", class: imu ? null : "main", onclick: said(report) }, "Report"),
    others.map((f) => h("a", { class: "button", href: address(f), download: "" }, f.name))), doing);
}

/** A study, or a calibration, for the formats of other programs. */
export function exportBar(session, document) {
  const doing = h("div", { role: "status" });
  const more = h("div", {});
  const kind = document.format === "allanite-study" ? "study" : "calibration";
  const consumers = session.consumers.filter((c) => [kind, "either"].includes(c.takes));
  const select = h("select", { id: "export-consumer", "aria-label": "Format" }, consumers.map((c) => h("option", { value: c.name }, `${nameOf(c)}: ${c.file}`)));
  let form = null;
  const chosen = () => consumers.find((c) => c.name === select.value);
  const draw = () => {
    form = fields(session.kinds.export.options, { names: chosen().options.filter((n) => n !== "model" || kind === "calibration") });
    fill(more, h("p", { class: "note" }, chosen().summary), h("details", {}, h("summary", {}, "Options"), form.place));
  };
  select.addEventListener("change", draw);
  draw();
  return h("section", { "aria-labelledby": "export-title" },
    h("h2", { id: "export-title" }, "For other programs"),
    h("div", { class: "bar" }, h("label", { for: "export-consumer" }, "For"), select,
      h("button", { type: "button", onclick: said(() => exported(doing, document, nameOf(chosen()), form.values())) }, "Export")),
    more, doing,
  );
}
