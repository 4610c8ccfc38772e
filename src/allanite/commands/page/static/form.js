// SPDX-License-Identifier: BSD-3-Clause
// A form out of the server's own description of options, so that the page and the commands offer the same.

import { h, unique } from "./dom.js";
import { modelField } from "./modelfield.js";

const LABELS = { unit: "Unit of the samples", rate: "Samples per second", scale_factor: "Scale factor", start: "Begin at [s]", stop: "End at [s]", repair: "Repair" };
const UNITS = ["deg/s", "deg/h", "rad/s", "mdeg/s", "m/s^2", "g", "mg", "V", "µT", "gyro=deg/s, acc=g", "gyro=rad/s, acc=m/s^2"];
const NUMBERS = ["number", "integer", "seconds", "degrees", "deg/s", "deg/h", "deg/h/g"];
const SUFFIX = { seconds: " [s]", degrees: " [deg]", "deg/s": " [deg/s]", "deg/h": " [deg/h]", "deg/h/g": " [deg/h/g]" };

export function labelOf(name, option) {
  const words = LABELS[name] || name.replace(/_/g, " ").replace(/^./, (c) => c.toUpperCase());
  return words + (LABELS[name] ? "" : SUFFIX[option.type] || "");
}

/** What a field holds, as the server wants it; undefined when nothing is given. */
function read(option, input) {
  if (input.disabled) return undefined;
  if (option.type === "flag") return input.checked || undefined;
  const text = input.value.trim();
  if (!text) return undefined;
  if (NUMBERS.includes(option.type)) return Number(text);
  if (option.type === "names" || option.type === "texts") return text.split(",").map((t) => t.trim()).filter(Boolean);
  if (option.type === "seconds-list") return text.split(/[,\s]+/).filter(Boolean).map(Number);
  if (option.type === "spans") return text.split(",").map((span) => span.split(":").map(Number));
  if (option.type === "by-channel" && text.includes("=")) {
    return Object.fromEntries(text.split(",").map((part) => part.split("=").map((t) => t.trim())));
  }
  return text;
}

const shown = (value) => {
  if (Array.isArray(value)) return value.join(", ");
  if (value && typeof value === "object") return Object.entries(value).map(([k, v]) => `${k}=${v}`).join(", ");
  return value;
};

function field(name, option, value, note) {
  const id = unique("field");
  const help = h("span", { class: "help", id: `${id}-help` }, option.help);
  const common = { id, name, "aria-describedby": `${id}-help`, required: note.required };
  if (option.type === "model") {
    const model = modelField(id, common["aria-describedby"], { blank: !note.required, given: value });
    return { name, row: h("div", { class: "field" }, h("label", { for: id }, labelOf(name, option)), model.place, help), value: model.value };
  }
  let input, extra = null;
  if (option.type === "flag") {
    input = h("input", { ...common, type: "checkbox", checked: Boolean(value) });
  } else if (option.type === "attached" || option.type === "description") {
    const listed = note.listed || [];
    input = h("select", common, listed.length ? null : h("option", { value: "" }, "none found"), listed.map((c) => h("option", { value: c.id }, c.title)));
  } else if (option.choices) {
    const blank = option.default === undefined ? [h("option", { value: "" }, "–")] : [];
    input = h("select", common, blank, option.choices.map((c) => h("option", { value: c }, c)));
    input.value = value ?? option.default ?? "";
  } else {
    const number = NUMBERS.includes(option.type);
    const list = name === "unit" ? unique("units") : null;
    input = h("input", {
      ...common, type: number ? "number" : "text", step: number ? "any" : null, list,
      placeholder: option.default ?? "", value: shown(value) ?? "",
      spellcheck: "false", autocomplete: "off",
    });
    if (list) extra = h("datalist", { id: list }, UNITS.map((u) => h("option", { value: u })));
  }
  const row = h("div", { class: option.type === "flag" ? "field tick" : "field" }, h("label", { for: id }, labelOf(name, option)), input, extra, help);
  return { name, row, value: () => (option.choices && input.value === option.default ? undefined : read(option, input)) };
}

/**
 * Fields for some options; those of attached things and of files are chosen out of `listed`, by id.
 * @returns {{place: HTMLElement, values: () => object}} values leaves out what was not given
 */
export function fields(options, { names = Object.keys(options), required = [], given = {}, listed = {} } = {}) {
  const made = names.filter((n) => options[n]).map((n) => field(n, options[n], given[n], { required: required.includes(n), listed: listed[n] }));
  const values = () => Object.fromEntries(made.map((f) => [f.name, f.value()]).filter(([, v]) => v !== undefined));
  return { place: h("div", { class: "fields" }, made.map((f) => f.row)), values };
}
