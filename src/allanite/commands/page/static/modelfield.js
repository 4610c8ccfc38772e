// SPDX-License-Identifier: BSD-3-Clause
// Whose noise: a study or model of the folder, or words.

import * as catalogue from "./catalogue.js";
import { h } from "./dom.js";

const FORMATS = ["allanite-study", "models"];
const WORDS = "in words";

/** A chooser of a noise model; `value()` is what the server wants, undefined when nothing is chosen. */
export function modelField(id, help, { blank = true, given = null } = {}) {
  const found = catalogue.documents((d) => FORMATS.includes(d.format));
  const select = h("select", { id, "aria-describedby": help },
    blank ? h("option", { value: "" }, "–") : null,
    found.map((d) => h("option", { value: d.id }, d.name.replace(/^allanite-results\//, ""))),
    h("option", { value: WORDS }, "in words …"));
  const words = h("input", { type: "text", "aria-label": "Model in words", placeholder: "N=0.3 deg/√h, K=5 deg/h/√h", spellcheck: "false", value: given?.words || "" });
  if (given?.words) select.value = WORDS;
  words.hidden = select.value !== WORDS;
  select.addEventListener("change", () => {
    words.hidden = select.value !== WORDS;
    if (!words.hidden) words.focus();
  });
  const value = () => {
    if (!select.value) return undefined;
    if (select.value !== WORDS) return { document: select.value };
    return words.value.trim() ? { words: words.value.trim() } : undefined;
  };
  return { place: h("div", { class: "stack" }, select, words), value };
}
