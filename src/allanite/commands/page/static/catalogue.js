// SPDX-License-Identifier: BSD-3-Clause
// What is in the folder, and the list of it at the side of the page.

import { get, post } from "./api.js";
import { h, fill, said } from "./dom.js";
import { dropZone } from "./drop.js";
import { bytes, duration, mark } from "./wording.js";

let known = { recordings: [], documents: [], descriptions: [] };
const listeners = new Set();
const contents = ({ scanned, ...found }) => JSON.stringify(found);

export const recordings = () => known.recordings.filter((r) => r.listed);
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
  return take(await get("/api/catalogue"));
}

function take(news) {
  const before = contents(known);
  known = news;
  if (contents(known) !== before) for (const action of listeners) action(known);
  return known;
}

/** A button that takes a recording off the list, or puts it back; its file stays where it is. */
export function listing(r, listed) {
  const words = listed ? "List again" : "Remove from the list";
  const put = said(async () => {
    take(await post(`/api/recordings/${r.id}/list`, { listed }));
    if (!listed) location.hash = "#/";
  });
  return h("button", { type: "button", "aria-label": `${words}: ${shortName(r.name)}`, onclick: put }, words);
}

const HEALTH = { good: "no problems found", info: "with remarks", warning: "with warnings", fatal: "not usable as it is" };

/** Health of a recording as a small mark with words. */
export function healthTag(recording) {
  const found = recording.health;
  if (recording.status === "recording") return h("span", { class: "tag info" }, "● recording");
  if (!found) {
    if (!recording.refused) return null;
    return recording.asks.length ? h("span", { class: "tag info" }, "? question") : h("span", { class: "tag fatal" }, mark("fatal"), " cannot be read");
  }
  return h("span", { class: `tag ${found.worst}`, title: HEALTH[found.worst] }, mark(found.worst), " ", found.worst);
}

/** Folders that this page made are said in other words. */
export const shortName = (name) => name.replace(/^allanite-(runs|dropped)\//, "").replace(/_(\d{8}T\d{6}Z)$/, " $1");

const facts = (r) => [
  r.facts ? `${duration(r.facts.duration)} at ${r.facts.rate} Hz` : bytes(r.size),
  r.is_run && r.status !== "recording" ? "run" : null,
  documents((d) => d.recording === r.id && d.format === "allanite-study").length ? "characterized" : null,
].filter(Boolean).join(", ");

/** The view of a recording, of a run that grows, or of the table of a fleet. */
const addressOf = (r) => `#/${r.status === "recording" ? "live" : r.is_fleet ? "fleet" : "recording"}/${r.id}`;

export function fileList(place, { writable, upload_limit: limit }) {
  const draw = () => {
    const [listed, removed] = [recordings(), known.recordings.filter((r) => !r.listed)];
    const here = decodeURIComponent(location.hash.split("/")[2] || "");
    const row = (r) => h(
      "li", {},
      h("a", { href: addressOf(r), "aria-current": here === r.id ? "page" : null },
        h("span", { class: "file-name" }, shortName(r.name)), healthTag(r), h("span", { class: "file-facts" }, facts(r))),
    );
    fill(
      place,
      h("h2", { id: "side-files-title" }, "Recordings ", h("span", { class: "soft" }, `in ${known.folder}`)),
      listed.length ? h("ul", { class: "files" }, listed.map(row)) : h("p", { class: "soft" }, "No recordings yet."),
      removed.length ? h("details", {}, h("summary", {}, `Removed from the list: ${removed.length}`), h("ul", { class: "removed" }, removed.map((r) => h("li", {}, shortName(r.name), " ", listing(r, true))))) : null,
      known.truncated ? h("p", { class: "note" }, "The folder contains more than is listed.") : null,
      zone,
    );
  };
  const zone = writable ? dropZone(limit, refresh) : h("p", { class: "note" }, "The folder is read-only: files cannot be added.");
  watch(draw);
  window.addEventListener("hashchange", draw);
  draw();
}
