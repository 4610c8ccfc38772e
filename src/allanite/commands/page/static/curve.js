// SPDX-License-Identifier: BSD-3-Clause
// The curve of one channel, or of all: view, terms switched off, averaging times left out by pointing at them.

import { h, fill, said } from "./dom.js";
import { FigureView } from "./figure.js";
import { digits } from "./wording.js";

const TYPES = { quantisation: "Q", white: "N", flicker: "B", "gauss-markov": "G", gauss_markov: "G", "random-walk": "K", random_walk: "K", ramp: "R" };
const NAMES = { Q: "quantisation", N: "white noise", B: "flicker", G: "Gauss-Markov", K: "random walk", R: "ramp", S: "spectral lines" };
const VIEWS = [["groups", "All channels"], ["channels", "One channel"], ["spectrum", "Spectrum"]];
const ALONE = [["channels", "Allan curve"], ["spectrum", "Spectrum"]];

const letters = (channel) => [...new Set(channel.models.flatMap((m) => m.terms).map((t) => TYPES[t.type] || "S"))].sort((a, b) => "QNBGKRS".indexOf(a) - "QNBGKRS".indexOf(b));

/** Neighbouring averaging times become one span; the ends lie a little outside, where no other time is. */
function spansOf(left, taus) {
  const spans = [];
  taus.forEach((tau, i) => {
    if (!left.has(tau)) return;
    const last = spans.at(-1);
    if (last && last.to === i - 1) last.to = i;
    else spans.push({ from: i, to: i });
  });
  const rounded = (v, how) => Number(how(v).toPrecision(5));
  return spans.map(({ from, to }) => [rounded(taus[from], (v) => v * 0.999), rounded(taus[to], (v) => v * 1.001)]);
}

export class CurvePanel {
  constructor(session, document, study, { refit, channel }) {
    this.document = document;
    this.study = study;
    this.told = channel;
    this.refit = refit;
    this.models = null; // id of a fit that is drawn in place of the study's own
    this.views = study.channels.length > 1 ? VIEWS : ALONE;
    this.view = this.views[0][0];
    this.name = study.channels[0].name;
    this.without = new Set();
    this.left = new Set();
    this.figure = new FigureView("Allan deviation with its interval and the fitted model", { more: () => this.crosses(), clicked: (point) => this.pointed(point) });
    this.terms = h("div", { class: "bar" });
    this.leaving = h("div", {});
    this.place = h("div", {}, this.tools(), this.terms, this.figure.place, this.leaving);
    this.draw_tools();
  }

  close() {
    this.figure.close();
  }

  get channel() {
    return this.study.channels.find((c) => c.name === this.name);
  }

  tools() {
    const radio = ([value, label]) => {
      const input = h("input", { type: "radio", name: "curve-view", value, checked: value === this.view });
      input.addEventListener("change", said(() => {
        this.view = value;
        return this.draw();
      }));
      return h("label", { class: "choice" }, input, label);
    };
    const select = h("select", { "aria-label": "Channel", hidden: this.study.channels.length < 2 }, this.study.channels.map((c) => h("option", { value: c.name }, c.name)));
    select.addEventListener("change", said(() => {
      this.name = select.value;
      this.told(this.name);
      if (this.view === "groups") this.turn("channels");
      return this.draw();
    }));
    return h("div", { class: "bar" }, h("fieldset", { class: "choices" }, h("legend", { class: "hidden" }, "View"), this.views.map(radio)), select);
  }

  /** Another view, as if it had been chosen. */
  turn(view) {
    this.view = view;
    this.place.querySelector(`input[name="curve-view"][value="${view}"]`).checked = true;
  }

  draw_tools() {
    const tick = (letter) => {
      const input = h("input", { type: "checkbox", checked: !this.without.has(letter) });
      input.addEventListener("change", said(() => {
        this.without[input.checked ? "delete" : "add"](letter);
        return this.draw();
      }));
      return h("label", { class: "tick" }, input, `${letter} ${NAMES[letter]}`);
    };
    const own = this.view === "channels" ? letters(this.channel) : [];
    fill(this.terms, own.length ? [h("span", { class: "soft" }, "Terms of the model:"), own.map(tick)] : null);
    this.draw_leaving();
  }

  draw() {
    this.draw_tools();
    const options = { view: this.view, without: [...this.without].join(","), models: this.models };
    if (this.view !== "groups") options.channels = this.name;
    return this.figure.document(this.document.id, options);
  }

  // -- averaging times left out ------------------------------------------------------------------------------

  get taus() {
    return this.channel.curve.tau;
  }

  pointed(point) {
    if (this.view !== "channels" || !this.refit) return;
    // The figure rounds to six digits, the study does not.
    const tau = this.taus.find((t) => Math.abs(t / point.x - 1) < 1e-4);
    if (tau === undefined) return;
    this.left[this.left.has(tau) ? "delete" : "add"](tau);
    this.draw_leaving();
    this.figure.paint();
  }

  /** A cross over each point that will be left out: seen without distinguishing colors. */
  crosses() {
    if (this.view !== "channels" || !this.left.size) return [];
    const shown = this.figure.figure.panels[0].curves.find((c) => c.marker && c.lower);
    if (!shown) return [];
    const kept = shown.x.map((x, i) => [x, shown.y[i]]).filter(([x]) => [...this.left].some((t) => Math.abs(t / x - 1) < 1e-4));
    return [{ x: kept.map((p) => p[0]), y: kept.map((p) => p[1]), label: "left out", colour: "ink", style: "none", marker: "cross", size: 7 }];
  }

  draw_leaving() {
    if (this.view !== "channels" || !this.refit) return fill(this.leaving);
    const again = () => {
      this.draw_leaving();
      this.figure.paint();
    };
    const tick = (tau) => {
      const input = h("input", { type: "checkbox", checked: this.left.has(tau) });
      input.addEventListener("change", () => {
        this.left[input.checked ? "add" : "delete"](tau);
        again();
      });
      return h("label", { class: "tick" }, input, `${digits(tau)} s`);
    };
    const opened = this.leaving.querySelector("details")?.open || false;
    const list = h("details", { open: opened }, h("summary", {}, "Leave averaging times out of the fit: point at the curve, or choose here"), h("div", { class: "bar" }, this.taus.map(tick)));
    const count = this.left.size;
    const action = h("div", { class: "bar" },
      h("span", {}, `${count} averaging time${count > 1 ? "s" : ""} will be left out, in all channels.`),
      h("button", { type: "button", class: "main", onclick: said(() => this.refit({ exclude: spansOf(this.left, this.taus) })) }, "Fit again"),
      h("button", { type: "button", onclick: () => { this.left.clear(); again(); } }, "Leave none out"));
    fill(this.leaving, list, count ? action : null);
  }
}
