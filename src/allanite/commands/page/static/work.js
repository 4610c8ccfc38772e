// SPDX-License-Identifier: BSD-3-Clause
// Work in progress: one stream of events from the server keeps this table true; views look in it and are told.

import { get, post } from "./api.js";

const jobs = new Map();
const listeners = new Set();
let newResults = () => {};

export const all = () => [...jobs.values()].sort((a, b) => b.created.localeCompare(a.created));
export const byId = (id) => jobs.get(id);
export const isOver = (job) => !["queued", "running"].includes(job.state);

/** Call on every change of a job; returns what ends that. */
export function watch(action) {
  listeners.add(action);
  return () => listeners.delete(action);
}

function changed(job) {
  jobs.set(job.id, job);
  for (const action of listeners) action(job);
}

/** Follow the server's work; `onResults` is called when files appeared. */
export function follow(onResults) {
  newResults = onResults;
  const stream = new EventSource("/api/jobs/events");
  stream.addEventListener("jobs", (event) => JSON.parse(event.data).jobs.forEach(changed));
  stream.addEventListener("job", (event) => changed(JSON.parse(event.data)));
  stream.addEventListener("catalogue", () => newResults());
  window.addEventListener("pagehide", () => stream.close());
}

/** Start a job. */
export async function start(request) {
  const { job } = await post("/api/jobs", request);
  changed(job);
  return job;
}

export async function cancel(job) {
  changed((await post(`/api/jobs/${job.id}/cancel`)).job);
}

/** A job once it is over; `look` sees it on the way. The events may have been faster than the answer, so ask once. */
export function finished(job, look = () => {}) {
  return new Promise((resolve) => {
    const end = watch((news) => {
      if (news.id !== job.id) return;
      look(news);
      if (isOver(news)) {
        end();
        resolve(news);
      }
    });
    get(`/api/jobs/${job.id}`).then((answer) => changed(answer.job), () => {});
  });
}
