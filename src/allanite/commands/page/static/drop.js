// SPDX-License-Identifier: BSD-3-Clause
// Files dropped anywhere on the page, or chosen, become recordings of the folder; the last is opened at once.

import { upload } from "./api.js";
import { h, fill, notice } from "./dom.js";
import { bytes } from "./wording.js";

export function dropZone(limit, refresh) {
  const says = h("span", {});
  const input = h("input", { type: "file", multiple: true, class: "hidden", id: "drop-input" });
  const zone = h("div", { class: "drop" }, h("label", { for: "drop-input", class: "button" }, "Add a log"), input, h("span", { class: "soft" }, " or drop it on the page"), says);

  async function take(files) {
    let last = null;
    for (const file of files) {
      if (file.size > limit) {
        notice(`${file.name} has ${bytes(file.size)}; the page takes at most ${bytes(limit)}. Put it into the folder itself.`);
        continue;
      }
      fill(says, ` Taking ${file.name} …`);
      try {
        last = (await upload(file)).recording;
      } catch (error) {
        notice(`${file.name}: ${error.message}`);
      }
    }
    fill(says);
    if (!last) return;
    await refresh();
    location.hash = `#/recording/${last.id}`;
  }

  input.addEventListener("change", () => {
    take([...input.files]);
    input.value = "";
  });
  // The whole page takes a drop: a file let fall beside a small target would replace the page.
  window.addEventListener("dragover", (event) => {
    event.preventDefault();
    document.body.classList.add("dropping");
  });
  window.addEventListener("dragleave", (event) => {
    if (!event.relatedTarget) document.body.classList.remove("dropping");
  });
  window.addEventListener("drop", (event) => {
    event.preventDefault();
    document.body.classList.remove("dropping");
    take([...event.dataTransfer.files]);
  });
  return zone;
}
