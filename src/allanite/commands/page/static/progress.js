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

const drawn = new WeakMap(); // by place: what moves while a job goes

/** One job. While it goes, only the bar and the words move: the button can be held, and nothing is read out again. */
export function progress(place, job) {
  const over = work.isOver(job);
  const known = drawn.get(place);
  if (known?.id === job.id && known.state === job.state && place.contains(known.bar)) {
    known.bar.value = job.progress;
    known.step.textContent = says[job.state](job);
    return;
  }
  const bar = h("progress", { max: 1, value: job.progress, "aria-label": job.title });
  if (job.state === "queued") bar.removeAttribute("value");
  const cancel = h(
    "button",
    { type: "button", "aria-label": `Cancel ${job.title}`, onclick: said(() => work.cancel(job)) },
    "Cancel",
  );
  const step = h("span", { class: "job-step", "aria-live": over ? null : "off" }, says[job.state](job), over ? ` (${duration(job.seconds)})` : "");
  drawn.set(place, { id: job.id, state: job.state, bar, step });
  fill(
    place,
    h("div", { class: `job ${job.state}` },
      h("span", { class: "job-title" }, job.title),
      step,
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
