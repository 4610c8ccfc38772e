// SPDX-License-Identifier: BSD-3-Clause
// What channels without a unit measure, asked sensor by sensor with the answers that their numbers allow.

import { h, unique } from "./dom.js";
import { digits } from "./wording.js";

const SENSORS = { gyro: "Gyroscope", accelerometer: "Accelerometer", temperature: "Temperature", "": "Channels" };
const OTHER = "other";
const EXAMPLE = { unit: "µT, or 131 LSB/(deg/s)", scale_factor: "131 LSB/(deg/s), or deg/s" };

const minus = (number) => String(number).replace("-", "−");

/** A scale factor is a quotient by what is counted or measured in its place; all else is a unit. */
const optionOf = (text) => (/LSB|count|\bm?V\b/i.test(text) && text.includes("/") ? "scale_factor" : "unit");

function question({ sensor, channels, keys, option, low, high, answers, likely, reason }) {
  const id = unique("question");
  const counts = option === "scale_factor";
  const facts = counts
    ? `${channels.join(", ")}: whole numbers from ${minus(low)} to ${minus(high)}. How many counts are one ${sensor === "accelerometer" ? "g" : "deg/s"}?`
    : `${channels.join(", ")}: numbers from ${digits(low)} to ${digits(high)}. In which unit?`;
  const words = (a) => (a.words ? `${a.value} (${a.words})` : a.value);
  const select = h("select", { id, "aria-describedby": `${id}-help` },
    h("option", { value: "" }, "not known"), answers.map((a) => h("option", { value: a.value }, words(a))), h("option", { value: OTHER }, "another …"));
  select.value = likely;
  const other = h("input", { type: "text", hidden: true, spellcheck: "false", autocomplete: "off", placeholder: EXAMPLE[option], "aria-label": `Another answer for ${channels.join(", ")}` });
  select.addEventListener("change", () => {
    other.hidden = select.value !== OTHER;
    if (!other.hidden) other.focus();
  });
  const help = likely ? `From gravity: ${reason}.` : counts ? "The data sheet states it for the selected range. Without it, results are in counts." : "Without it, results are in the numbers of the file.";
  const answer = () => (select.value === OTHER ? other.value.trim() : select.value);
  return {
    row: h("div", { class: "field question" }, h("label", { for: id }, SENSORS[sensor], h("span", { class: "name" }, facts)), select, other, h("span", { class: "help", id: `${id}-help` }, help)),
    answers: () => (answer() ? [[optionOf(answer()), Object.fromEntries(keys.map((key) => [key, answer()]))]] : []),
  };
}

/** The questions of a recording; `values()` is unit and scale factor by channel. */
export function questions(all) {
  const made = all.map(question);
  const values = () => {
    const read = {};
    for (const [option, answers] of made.flatMap((q) => q.answers())) read[option] = { ...read[option], ...answers };
    return read;
  };
  return { place: h("div", { class: "fields" }, made.map((q) => q.row)), values };
}
