// SPDX-License-Identifier: BSD-3-Clause
// What health checks found, worst first, with what to do.

import { h } from "./dom.js";
import { mark, samples } from "./wording.js";

const ORDER = ["fatal", "warning", "info"];

export function findingList(findings) {
  if (!findings.length) return h("p", {}, h("span", { class: "tag good" }, mark("good"), " good"), "No problems found.");
  const sorted = [...findings].sort((a, b) => ORDER.indexOf(a.severity) - ORDER.indexOf(b.severity));
  return h("ul", { class: "findings" }, sorted.map((f) => h("li", {},
    h("span", { class: `tag ${f.severity}` }, mark(f.severity), " ", f.severity),
    h("b", {}, f.channel ? `${f.channel}: ` : ""), f.message, " ",
    f.accepted ? h("span", { class: "soft" }, "(accepted) ") : null,
    f.advice ? h("span", { class: "name" }, f.advice) : null,
    f.count ? h("span", { class: "name" }, h("code", {}, f.code), `, ${samples(f.count)} samples`) : h("span", { class: "name" }, h("code", {}, f.code)),
  )));
}
