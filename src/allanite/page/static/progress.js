// SPDX-License-Identifier: BSD-3-Clause
// A job as it goes: a bar, what is done just now, and a button that ends it.

import { h, fill, said } from "./dom.js";
import * as work from "./work.js";
import { duration } from "./wording.js";

const says = {
  queued: (job) => (job.place ? `waiting, number ${job.place}` : "waiting"),
  running: (job) => job.step || "running",
  done: (job) => (job.lossy ? "done, with loss" : "done"),
  failed: (job) => job.message || "failed",
  cancelled: () => "cancelled",
};

/** One job, drawn anew at each change. */
export function progress(place, job) {
  const over = work.isOver(job);
  const percent = Math.round(100 * job.progress);
  const label = `${job.title}: ${percent} %`;
  const bar = h("progress", { max: 1, value: job.progress, "aria-label": label });
  if (job.state === "queued") bar.removeAttribute("value");
  const cancel = h(
    "button",
    { type: "button", "aria-label": `Cancel ${job.title}`, onclick: said(() => work.cancel(job)) },
    "Cancel",
  );
  fill(
    place,
    h("div", { class: `job ${job.state}` },
      h("span", { class: "job-title" }, job.title),
      h("span", { class: "job-step" }, says[job.state](job), over ? ` (${duration(job.seconds)})` : ""),
      over ? null : bar,
      over ? null : cancel,
    ),
    over ? job.notes.map((note) => h("p", { class: "note" }, note)) : null,
  );
}

/** Start a job, show it in a place, and give it back when it is over; null unless it was done. */
export async function run(place, request) {
  const job = await work.start(request);
  progress(place, job);
  const end = await work.finished(job, (news) => progress(place, news));
  if (end.state === "done" && !end.notes.length) fill(place);
  return end.state === "done" ? end : null;
}
