// SPDX-License-Identifier: BSD-3-Clause
// The same by command line and in Python, to be copied.

import { h, said } from "./dom.js";

function copyable(title, text) {
  const code = h("code", {}, text);
  const button = h("button", { type: "button", class: "quiet", "aria-label": `Copy the ${title}` }, "Copy");
  button.addEventListener("click", said(async () => {
    await navigator.clipboard.writeText(text);
    button.textContent = "Copied";
    setTimeout(() => (button.textContent = "Copy"), 1500);
  }));
  return h("div", { class: "lines" }, h("span", { class: "soft" }, title), h("pre", { tabindex: 0, role: "group", "aria-label": title }, code), button);
}

export function lines({ command, python }, open = false) {
  return h(
    "details",
    { class: "same", open },
    h("summary", {}, "The same from a terminal, or in Python"),
    command ? copyable("command", command) : null,
    python ? copyable("Python", python.trimEnd()) : null,
  );
}
