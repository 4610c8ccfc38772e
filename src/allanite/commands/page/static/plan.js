// SPDX-License-Identifier: BSD-3-Clause
// The planner: how long to measure, for a sensor, a latitude and a way of turning; sliders answer at once.

import { post } from "./api.js";
import { h, fill, notice } from "./dom.js";
import { FigureView } from "./figure.js";
import { lines } from "./lines.js";
import { modelField } from "./modelfield.js";
import { digits, duration } from "./wording.js";

const DEG_H = (180 / Math.PI) * 3600;
const EARTH = 7.292115e-5; // [rad/s]
const PAUSE = 120; // [ms] a slider that moves is not asked at each step

// Of durations the slider moves the logarithm: a minute matters among minutes, not among days.
const SLIDERS = {
  latitude: { label: "Latitude", unit: "deg", low: -89, high: 89, step: 0.5, start: 48, value: (v) => v, says: (v) => `${v} deg` },
  dwell: { label: "Time from turn to turn", low: 0.7, high: 3.3, step: 0.02, start: Math.log10(60), value: (v) => Number((10 ** v).toPrecision(2)), says: duration },
  duration: { label: "Length of the record", low: 2, high: 5.5, step: 0.02, start: Math.log10(1800), value: (v) => Number((10 ** v).toPrecision(2)), says: duration },
  dead_time: { label: "Time lost per turn", low: 0, high: 30, step: 0.5, start: 2, value: (v) => v, says: (v) => `${v} s` },
  goal: { label: "Goal (one sd)", low: 0.5, high: 30, step: 0.5, start: 5, value: (v) => v, says: (v) => `${v} % of the Earth rate` },
};

export class PlanView {
  constructor() {
    this.model = modelField("plan-model", "plan-model-help", { blank: false, given: { words: "N=0.3 deg/√h, K=5 deg/h/√h" } });
    this.model.place.addEventListener("change", () => this.later());
    this.inputs = {};
    this.figure = new FigureView("Expected standard deviation against the length of the record");
    this.says = h("div", { role: "status", "aria-live": "polite" });
    this.same = h("div", {});
    const north = (this.north = h("input", { type: "checkbox", id: "plan-north" }));
    north.addEventListener("change", () => this.switched());
    this.place = h("div", {}, h("h1", {}, "Plan a measurement"),
      h("section", { "aria-label": "Settings" },
        h("div", { class: "field" }, h("label", { for: "plan-model" }, "Noise of the sensor"), this.model.place, h("span", { class: "help", id: "plan-model-help" }, "A study of this folder, or words.")),
        h("label", { class: "tick" }, north, "Search for north in place of the Earth rate"),
        h("div", { class: "sliders" }, Object.entries(SLIDERS).map((entry) => this.slider(...entry)))),
      h("section", { "aria-labelledby": "plan-title" }, h("h2", { id: "plan-title" }, "What to expect"), this.says, this.figure.place, this.same));
  }

  close() {
    clearTimeout(this.waiting);
    this.figure.close();
  }

  load() {
    return this.ask();
  }

  slider(name, { label, low, high, step, start, value, says }) {
    const out = h("output", { for: `plan-${name}` }, says(value(start)));
    const input = h("input", { type: "range", id: `plan-${name}`, min: low, max: high, step });
    input.value = start;
    const speak = () => {
      const text = this.textOf(name);
      out.textContent = text;
      input.setAttribute("aria-valuetext", text);
    };
    input.addEventListener("input", () => {
      speak();
      this.later();
    });
    this.inputs[name] = { input, value: () => value(Number(input.value)), speak };
    return h("div", { class: "slider" }, h("label", { for: `plan-${name}` }, label), out, input);
  }

  /** With north the goal is an angle. */
  textOf(name) {
    const value = this.inputs[name].value();
    return name === "goal" && this.north.checked ? `${digits(value / 10)} deg` : SLIDERS[name].says(value);
  }

  switched() {
    this.inputs.goal.speak();
    this.later();
  }

  later() {
    clearTimeout(this.waiting);
    this.waiting = setTimeout(() => this.ask().catch((error) => notice(error.message)), PAUSE);
  }

  async ask() {
    const at = Object.fromEntries(Object.entries(this.inputs).map(([name, { value }]) => [name, value()]));
    const north = this.north.checked;
    const options = { latitude: at.latitude, dead_time: at.dead_time, goal: north ? at.goal / 10 : at.goal / 100, north };
    const model = this.model.value();
    if (!model) return;
    notice("");
    const number = (this.number = (this.number || 0) + 1);
    const here = north ? null : post("/api/plan", { model, options: { ...options, dwells: [at.dwell], durations: [at.duration] } });
    const whole = await post("/api/plan", { model, options });
    const one = await here;
    if (number !== this.number) return;
    const sd = one?.document.total?.[0]?.[0];
    fill(this.says,
      sd ? h("p", { class: "hero" }, h("span", { class: "amount" }, `${digits(sd * DEG_H, 3)} deg/h`), ` one standard deviation after ${duration(at.duration)}, turned every ${duration(at.dwell)}: ${digits((100 * sd) / EARTH, 2)} % of the Earth rate`) : null,
      one && !sd ? h("p", { class: "soft" }, "No pair of dwells fits into this record.") : null,
      h("p", {}, whole.says), whole.notes.map((n) => h("p", { class: "note" }, n)));
    for (const name of ["dwell", "duration"]) this.inputs[name].input.closest(".slider").hidden = north;
    fill(this.same, lines(whole, this.same.querySelector("details")?.open));
    this.figure.show(whole.figure);
  }
}
