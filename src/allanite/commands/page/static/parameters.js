// SPDX-License-Identifier: BSD-3-Clause
// The table of parameters: intervals always, and the unit that the reader wants.

import { h, fill } from "./dom.js";
import { digits } from "./wording.js";

const chosen = new Map(); // unit by symbol and people's unit: a choice holds for all channels of a kind

function amounts(row, unit) {
  const factor = unit.factor;
  const text = (v) => (v === null ? "∞" : digits(v * factor));
  if (row.status === "resolved") return [text(row.value), `${text(row.lower)} to ${text(row.upper)}`];
  if (row.status === "upper limit") return [`< ${text(row.upper)}`, `0 to ${text(row.upper)}`];
  return ["–", "unbounded"];
}

function line(row, redraw) {
  const key = `${row.symbol} ${row.units[0]?.unit}`;
  const unit = row.units.find((u) => u.unit === chosen.get(key)) || row.units[0] || { unit: row.unit, factor: 1 };
  const [value, interval] = amounts(row, unit);
  const select = h("select", { "aria-label": `Unit of ${row.name}` }, row.units.map((u) => h("option", { value: u.unit }, u.unit)));
  select.value = unit.unit;
  select.addEventListener("change", () => {
    chosen.set(key, select.value);
    redraw();
  });
  const state = row.status === "resolved" ? "good" : row.status === "upper limit" ? "limit" : "";
  return h("tr", { class: row.supported ? "" : "limit" },
    h("th", { scope: "row" }, row.symbol, h("span", { class: "name" }, row.name)),
    h("td", { class: "value" }, value),
    h("td", {}, interval),
    h("td", {}, row.units.length > 1 ? select : unit.unit),
    h("td", {}, h("span", { class: `tag ${state}` }, row.status), row.note ? h("span", { class: "name" }, row.note) : null),
  );
}

function table(channel, model, redraw) {
  const caption = `${channel.name}: ${model.verdict}`;
  return [h("p", { class: "caption" }, caption), h("div", { class: "wide", tabindex: 0, role: "group", "aria-label": caption }, h("table", { class: "parameters" },
    h("thead", {}, h("tr", {}, ["Parameter", "Value", "95 % interval", "Unit", "State"].map((t) => h("th", { scope: "col" }, t)))),
    h("tbody", {}, model.rows.map((row) => line(row, redraw))),
  ))];
}

/** Table of one channel; a second model, where the record cannot decide, is folded away. */
export function parameterTable(channel, confidence = 0.95) {
  const place = h("div", {});
  const draw = () => {
    const [first, ...others] = channel.models;
    fill(place, first ? table(channel, first, draw) : h("p", { class: "soft" }, "No model was fitted to this channel."),
      others.map((model) => h("details", {}, h("summary", {}, `Alternative model of the same record: ${model.family.replace("-", " ")}`), table(channel, model, draw))));
    for (const cell of place.querySelectorAll("thead th:nth-child(3)")) cell.textContent = `${digits(100 * confidence, 3)} % interval`;
  };
  draw();
  return place;
}
