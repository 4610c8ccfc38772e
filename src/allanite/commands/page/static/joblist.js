// SPDX-License-Identifier: BSD-3-Clause
// The list of work at the side of the page: what runs and waits, and how the last ended.

import { h, fill } from "./dom.js";
import * as work from "./work.js";
import { progress } from "./progress.js";

const ENDED_SHOWN = 4;

export function jobList(place) {
  const rows = new Map();
  let shown = "";
  const rowOf = (job) => {
    if (!rows.has(job.id)) rows.set(job.id, h("div", {}));
    progress(rows.get(job.id), job);
    return rows.get(job.id);
  };
  const draw = () => {
    const jobs = work.all();
    const open = jobs.filter((job) => !work.isOver(job));
    const ended = jobs.filter((job) => work.isOver(job) && job.kind !== "open").slice(0, ENDED_SHOWN);
    place.hidden = !open.length && !ended.length;
    const made = [...open, ...ended].map(rowOf);
    const news = [...open.map((job) => job.id), "", ...ended.map((job) => job.id)].join();
    if (news === shown) return;
    shown = news;
    fill(
      place,
      h("h2", { id: "side-jobs-title" }, "Work", open.length ? h("span", { class: "soft" }, ` ${open.length} open`) : null),
      made,
    );
  };
  work.watch(draw);
  draw();
}
