// SPDX-License-Identifier: BSD-3-Clause
// The page: session, list at the side, and the view that the address names.

import { get } from "./api.js";
import * as catalogue from "./catalogue.js";
import { CompareView } from "./compare.js";
import { h, fill, notice } from "./dom.js";
import { FleetView } from "./fleet.js";
import { jobList } from "./joblist.js";
import { CaptureView, LiveView } from "./live.js";
import { PlanView } from "./plan.js";
import { RecordingView } from "./recording.js";
import { DocumentView, ResultsView } from "./results.js";
import { switchable } from "./theme.js";
import * as work from "./work.js";

// The token has done its work, and should not stay in the history.
history.replaceState(null, "", `/${location.hash}`);

const main = document.getElementById("main-view");
const VIEWS = {
  recording: (session, id, what) => new RecordingView(session, id, what),
  fleet: (session, id) => new FleetView(session, id),
  results: () => new ResultsView(),
  result: (session, id) => new DocumentView(session, id),
  compare: (session) => new CompareView(session),
  plan: () => new PlanView(),
  capture: (session) => new CaptureView(session),
  live: (session, id) => new LiveView(session, id),
};
/** Views that stand in the bar at the top. */
const NAV = [["#/", "Recordings"], ["#/results", "Results"], ["#/compare", "Compare"], ["#/plan", "Plan"], ["#/capture", "Capture"]];

const narrow = window.matchMedia("(max-width: 60rem)");
let view = null;

function welcome(session) {
  return h("section", {},
    h("h1", {}, "Recordings of inertial sensors"),
    h("p", {}, `Choose a recording, or drop a log of a sensor at rest on the page: CSV, NumPy, Parquet, MATLAB, HDF5, ROS bags, flight logs, spreadsheets. It opens immediately; one button gives its noise model, imu.yaml and a report.`),
    h("p", { class: "soft" }, `allanite ${session.version}. Everything stays on this machine. Results go to allanite-results in ${session.folder}.`));
}

let shown = false;

/** A view begins at its top, also for who reads or works without seeing it; on a narrow screen lists stand above it. */
function begun(name) {
  if (name && narrow.matches) main.scrollIntoView({ block: "start" });
  else window.scrollTo(0, 0);
  if (shown) main.focus({ preventScroll: true });
  shown = true;
}

async function show(session) {
  const [, name, id, what] = location.hash.split("/").map(decodeURIComponent);
  view?.close?.();
  view = null;
  notice("");
  for (const link of document.querySelectorAll("#main-nav a")) {
    const of = { recording: "", fleet: "", result: "results", live: "capture" };
    const here = link.getAttribute("href") === `#/${VIEWS[name] ? (of[name] ?? name) : ""}`;
    if (here) link.setAttribute("aria-current", "page");
    else link.removeAttribute("aria-current");
  }
  if (!VIEWS[name]) {
    fill(main, welcome(session));
    return begun(name);
  }
  const mine = (view = VIEWS[name](session, id, what));
  fill(main, mine.place);
  begun(name);
  document.title = `${catalogue.recording(id)?.name || NAV.find(([a]) => a === `#/${name}`)?.[1] || ""} – allanite`;
  try {
    await mine.load();
  } catch (error) {
    if (view === mine) notice(error.message);
  }
}

async function begin() {
  switchable(document.getElementById("theme-switch"));
  fill(document.getElementById("main-nav"), NAV.map(([address, label]) => h("a", { href: address }, label)));
  const session = await get("/api/session");
  await catalogue.refresh();
  catalogue.fileList(document.getElementById("side-files"), session);
  jobList(document.getElementById("side-jobs"));
  work.follow(() => catalogue.refresh().catch(() => {}));
  window.addEventListener("hashchange", () => show(session));
  document.addEventListener("click", (event) => {
    // A link to the view that is open changes no address: it leads to its top.
    if (event.target.closest("a")?.getAttribute("href") === location.hash) begun(location.hash.split("/")[1]);
  });
  await show(session);
}

begin().catch((error) => notice(error.message));
