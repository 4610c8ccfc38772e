// SPDX-License-Identifier: BSD-3-Clause
// Fit again with other terms or another method, drawn over the curve of the study.

import { get } from "./api.js";
import { h, fill, said } from "./dom.js";
import { fields } from "./form.js";
import { lines } from "./lines.js";
import { parameterTable } from "./parameters.js";
import { run } from "./progress.js";

/** A model of a fit as a channel of the table: its units are those that the study offers for the same symbols. */
function asChannel(name, model, table) {
  const known = new Map(table.channels.filter((c) => c.name === name).flatMap((c) => c.models).flatMap((m) => m.rows).map((r) => [r.symbol, r]));
  const rows = model.estimates.filter((e) => known.has(e.symbol)).map((e) => {
    const { name: words, unit, units } = known.get(e.symbol);
    const status = e.supported ? "resolved" : e.upper === null ? "not resolved" : "upper limit";
    return { ...e, name: words, unit, units, status, note: e.note === status ? "" : e.note };
  });
  return { name, models: [{ family: model.family, verdict: model.verdict, rows }] };
}

/**
 * @param {{recording: string, read: object}} subject
 * @param {object} table parameters of the study
 * @param {(document: string|null) => void} drawn draws the models of a fit over the curve, or none
 * @param {() => string} channel the one that is looked at
 */
export function otherTerms(session, subject, table, drawn, channel) {
  const { options, required } = session.kinds.fit;
  const form = fields(options, { names: ["method", "terms", "lines", "accept"], required, given: { method: "likelihood", terms: "NBK" } });
  const doing = h("div", { role: "status" });
  const found = h("div", {});
  const fit = said(async (event) => {
    event.preventDefault();
    const job = await run(doing, { kind: "fit", recording: subject.recording, read: subject.read, options: form.values() });
    if (!job) return;
    const models = await get(`/api/jobs/${job.id}/document`);
    await drawn(job.document);
    const back = h("button", { type: "button", onclick: said(() => { fill(found); return drawn(null); }) }, "Back to the study's model");
    const show = () => {
      const model = models[channel()];
      fill(found, h("h3", {}, "Fitted just now"), model ? parameterTable(asChannel(channel(), model, table), model.confidence) : h("p", { class: "soft" }, "No model was fitted to this channel."), h("div", { class: "bar" }, back), lines(job));
    };
    show();
    place.show = () => found.childElementCount && show();
  });
  const place = h("details", {}, h("summary", {}, "Fit other terms, or with another method"),
    h("form", { onsubmit: fit }, form.place, h("p", { class: "note" }, "Terms apply to likelihood and spectral: Q quantization, N white noise, B flicker, G Gauss-Markov, K random walk, R ramp. Lines apply to likelihood."), h("div", { class: "bar" }, h("button", {}, "Fit"))), doing, found);
  place.show = () => {};
  return place;
}
