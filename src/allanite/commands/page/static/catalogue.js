// SPDX-License-Identifier: BSD-3-Clause
// What is in the folder, and the list of it at the side of the page.

import { get } from "./api.js";
import { h, fill } from "./dom.js";
import { dropZone } from "./drop.js";
import { bytes, duration, mark } from "./wording.js";

let known = { recordings: [], documents: [], descriptions: [] };
const listeners = new Set();
const contents = ({ scanned, ...found }) => JSON.stringify(found);

export const recordings = () => known.recordings;
export const recording = (id) => known.recordings.find((r) => r.id === id);
export const documents = (test = () => true) =>
  known.documents.filter(test).sort((a, b) => b.modified.localeCompare(a.modified));
export const descriptions = () => known.descriptions.map(({ id, name }) => ({ id, title: name }));
export const documentById = (id) => known.documents.find((d) => d.id === id);

/** Call after each look into the folder; returns what ends that. */
export function watch(action) {
  listeners.add(action);
  return () => listeners.delete(action);
}

/** Look into the folder again; who watches is told when something has changed. */
export async function refresh() {
  const before = contents(known);
  known = await get("/api/catalogue");
  if (contents(known) !== before) for (const action of listeners) action(known);
  return known;
}

const HEALTH = { good: "nothing is wrong", info: "with remarks", warning: "with warnings", fatal: "not usable as it is" };

/** Health of a recording as a small mark with words. */
export function healthTag(recording) {
  const found = recording.health;
  if (recording.status === "recording") return h("span", { class: "tag info" }, "● recording");
  if (!found) return recording.refused ? h("span", { class: "tag" }, "? ask") : null;
  return h("span", { class: `tag ${found.worst}`, title: HEALTH[found.worst] }, mark(found.worst), " ", found.worst);
}

/** Folders that this page made are said in other words. */
export const shortName = (name) => name.replace(/^allanite-(runs|dropped)\//, "").replace(/_(\d{8}T\d{6}Z)$/, " $1");

const facts = (r) => [
  r.facts ? `${duration(r.facts.duration)} at ${r.facts.rate} Hz` : bytes(r.size),
  r.is_run && r.status !== "recording" ? "run" : null,
  documents((d) => d.recording === r.id && d.format === "allanite-study").length ? "characterized" : null,
].filter(Boolean).join(", ");

export function fileList(place, { writable, upload_limit: limit }) {
  const draw = () => {
    const here = decodeURIComponent(location.hash.split("/")[2] || "");
    const row = (r) => h(
      "li", {},
      h("a", { href: r.status === "recording" ? `#/live/${r.id}` : `#/recording/${r.id}`, "aria-current": here === r.id ? "page" : null },
        h("span", { class: "file-name" }, shortName(r.name)), healthTag(r), h("span", { class: "file-facts" }, facts(r))),
    );
    fill(
      place,
      h("h2", { id: "side-files-title" }, "Recordings ", h("span", { class: "soft" }, `in ${known.folder}`)),
      known.recordings.length ? h("ul", { class: "files" }, known.recordings.map(row)) : h("p", { class: "soft" }, "No recording is here yet."),
      known.truncated ? h("p", { class: "note" }, "The folder holds more than is listed.") : null,
      zone,
    );
  };
  const zone = writable ? dropZone(limit, refresh) : h("p", { class: "note" }, "The folder cannot be written: nothing can be dropped.");
  watch(draw);
  window.addEventListener("hashchange", draw);
  draw();
}
