// SPDX-License-Identifier: BSD-3-Clause
// A job as it goes: a bar, what is done just now and for how long, and a button that ends it.

import { h, fill, said } from "./dom.js";
import * as work from "./work.js";
import { duration } from "./wording.js";

const says = {
  queued: (job) => (job.place > 1 ? `waiting for ${job.place - 1} other${job.place > 2 ? "s" : ""}` : "waiting for its turn"),
  running: (job) => job.step || "starting",
  done: (job) => (job.lossy ? "done, with loss" : "done"),
  failed: (job) => job.message || "failed",
  cancelled: () => "canceled, no result",
};

const drawn = new WeakMap(); // by place: what moves while a job goes
const going = new Set(); // what is on the page and not over

/** Step and bar; without an amount the bar moves by itself. */
function move(known) {
  const { job, step, bar, since } = known;
  const seconds = Math.floor((performance.now() - since) / 1000);
  step.textContent = says[job.state](job) + (job.state === "running" && seconds ? `, ${seconds} s` : "");
  if (job.state === "running" && job.progress) bar.value = job.progress;
}

setInterval(() => {
  for (const known of going) known.bar.isConnected ? move(known) : going.delete(known);
}, 1000);

/** One job. While it goes, only the bar and the words move: the button can be held, and nothing is read out again. */
export function progress(place, job) {
  const over = work.isOver(job);
  const known = drawn.get(place);
  if (known?.job.id === job.id && known.job.state === job.state && place.contains(known.step)) {
    known.job = job;
    if (!over) {
      going.add(known);
      move(known);
    }
    return;
  }
  const bar = h("progress", { max: 1, "aria-label": job.title });
  const cancel = h(
    "button",
    { type: "button", "aria-label": `Cancel ${job.title}`, onclick: said(() => work.cancel(job)) },
    "Cancel",
  );
  const result = job.state === "done" && addressOf(job);
  const step = h("span", { class: "job-step", "aria-live": over ? null : "off" }, over ? `${says[job.state](job)} (${duration(job.seconds)})` : "");
  const made = { job, bar, step, since: performance.now() - 1000 * job.seconds };
  going.delete(known);
  drawn.set(place, made);
  if (!over) {
    going.add(made);
    move(made);
  }
  fill(
    place,
    h("div", { class: `job ${job.state}` },
      result ? h("a", { class: "job-title", href: result }, job.title) : h("span", { class: "job-title" }, job.title),
      step,
      over ? null : bar,
      over ? null : cancel,
    ),
    over ? job.notes.map((note) => h("p", { class: "note" }, note)) : null,
  );
}

/** The view of the result of a job that is done. */
function addressOf(job) {
  if (job.kind === "characterize") return `#/recording/${job.recording}`;
  return job.document && job.kind !== "fit" ? `#/result/${job.document}` : null;
}

/** Show a job in a place until it is over, and give it back; null unless it was done. */
export async function followed(place, job) {
  progress(place, job);
  const end = await work.finished(job, (news) => progress(place, news));
  if (end.state === "done" && !end.notes.length) fill(place);
  return end.state === "done" ? end : null;
}

/** Start a job and follow it; whoever starts one sees it, wherever the button stood. */
export async function run(place, request) {
  const job = await work.start(request);
  progress(place, job);
  place.scrollIntoView({ block: "nearest" });
  return followed(place, job);
}
