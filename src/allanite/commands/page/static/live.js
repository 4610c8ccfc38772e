// SPDX-License-Identifier: BSD-3-Clause
// Captures: start a recorder, watch its series and its Allan curve while it runs, stop it. It runs without the page, too.

import { get, post } from "./api.js";
import * as catalogue from "./catalogue.js";
import { h, fill, said, notice } from "./dom.js";
import { FigureView } from "./figure.js";
import { fields } from "./form.js";
import { lines } from "./lines.js";
import { look, timePanel } from "./timeseries.js";
import { digits, duration, samples } from "./wording.js";

const FIRST = { simulated: ["model", "rate", "unit", "duration"], "3458a": ["resource", "rate", "scale", "duration"], serial: ["port", "format", "duration"] };
const GIVEN = { simulated: { model: { words: "N=0.3 deg/√h, K=5 deg/h/√h" }, rate: 100, unit: "deg/s" } };
const WHERE = { "3458a": "resource", serial: "port" }; // options that name what is attached
const ENOUGH = 4; // averaging times, before a curve is asked for
const CURVE = 4000; // [ms] between figures of the curve

/** A port that the administrator's list gives with the description of its device needs no other. */
function describedByItself(form, attached) {
  const [port, format] = [form.querySelector("select[name=port]"), form.querySelector("select[name=format]")];
  const look = () => (format.disabled = Boolean(attached.find((i) => i.id === port.value)?.described));
  port.addEventListener("change", look);
  look();
}

/** Start captures, and the list of those that run. */
export class CaptureView {
  constructor(session) {
    this.session = session;
    this.list = h("section", { "aria-labelledby": "captures-title" });
    this.form = h("div", {});
    this.note = h("p", { class: "note", role: "status" }, "Looking for instruments …");
    this.listed = { instruments: [], descriptions: [] };
    const again = h("button", { type: "button", onclick: said(() => this.find()) }, "Look again");
    const select = h("select", { id: "capture-instrument" }, Object.entries(session.instruments).map(([name, i]) => h("option", { value: name }, i.title)));
    select.addEventListener("change", () => this.drawForm(select.value));
    this.chosen = () => select.value;
    this.place = h("div", {}, h("h1", {}, "Capture"),
      h("section", { "aria-label": "Start" }, session.writable ? [h("div", { class: "bar" }, h("label", { for: "capture-instrument" }, "Instrument"), select, again), this.note, this.form] : h("p", {}, "The folder is read-only: recording is not possible here.")),
      this.list);
    this.drawForm(select.value);
  }

  close() {
    clearInterval(this.timer);
  }

  async load() {
    await this.look();
    this.find().catch((error) => (this.note.textContent = error.message));
    this.timer = setInterval(() => this.look().catch(() => {}), 3000);
  }

  /** The instruments of the machine and the descriptions in the folder, which the form offers by their ids. */
  async find() {
    if (!this.session.writable) return;
    this.note.textContent = "Looking for instruments …";
    const [{ instruments, note }] = await Promise.all([get("/api/instruments"), catalogue.refresh()]);
    const listed = { instruments, descriptions: catalogue.descriptions() };
    this.note.textContent = note;
    if (JSON.stringify(listed) === JSON.stringify(this.listed)) return;
    this.listed = listed;
    if (WHERE[this.chosen()]) this.drawForm(this.chosen());
  }

  drawForm(name) {
    const { options, required } = this.session.instruments[name];
    const attached = this.listed.instruments.filter((i) => i.kind === name);
    const listed = { [WHERE[name]]: attached, format: this.listed.descriptions };
    const own = fields(options, { names: FIRST[name], required, given: GIVEN[name], listed });
    const others = fields(options, { names: Object.keys(options).filter((n) => !FIRST[name].includes(n)), required });
    const start = said(async (event) => {
      event.preventDefault();
      const { capture } = await post("/api/captures", { instrument: name, options: { ...own.values(), ...others.values() } });
      await this.until(capture.id);
    });
    fill(this.form, h("form", { onsubmit: start }, own.place, h("details", {}, h("summary", {}, "Options"), others.place), h("div", { class: "bar" }, h("button", { class: "main" }, "Start"))));
    if (name === "serial") describedByItself(this.form, attached);
  }

  /** Its folder is there a moment after its start: then it can be watched. */
  async until(id) {
    for (let i = 0; i < 60; i++) {
      const capture = (await this.look()).find((c) => c.id === id);
      if (capture?.run && capture.state === "recording") {
        await catalogue.refresh();
        location.hash = `#/live/${capture.run}`;
        return;
      }
      if (!capture || capture.state === "ended") return notice(capture?.message || "The recorder ended immediately.");
      await new Promise((resolve) => setTimeout(resolve, 250));
    }
  }

  async look() {
    const { captures } = await get("/api/captures");
    const news = JSON.stringify(captures.map(({ id, state, run, exit }) => [id, state, run, exit]));
    if (news === this.shown) return captures;
    this.shown = news;
    fill(this.list, h("h2", { id: "captures-title" }, "Captures"), captures.length ? h("ul", { class: "verdict" }, captures.map((c) => this.row(c))) : h("p", { class: "soft" }, "No recording was started from this page."));
    return captures;
  }

  row(c) {
    const stop = h("button", { type: "button", onclick: said(async () => { await post(`/api/captures/${c.id}/stop`); await this.look(); }) }, "Stop");
    return h("li", {}, h("div", { class: "bar" },
      h("span", { class: `tag ${c.state === "recording" ? "info" : ""}` }, c.state), this.session.instruments[c.instrument]?.title || c.instrument,
      c.run ? h("a", { href: c.state === "ended" ? `#/recording/${c.run}` : `#/live/${c.run}` }, c.state === "ended" ? "Open" : "Watch") : null, c.state === "ended" ? null : stop),
      c.state === "ended" && c.exit ? h("p", { class: "note" }, c.message) : null, lines(c));
  }
}

/** Watch a run that grows. */
export class LiveView {
  constructor(session, run) {
    this.run = run;
    this.state = h("dl", { class: "facts" });
    this.status = h("p", { role: "status", "aria-live": "off" }, "Connecting …");
    this.plot = h("div", { class: "plot", role: "group", "aria-label": "Series so far" });
    this.chart = new AllaniteChart(this.plot, { tools: false });
    this.curve = new FigureView("Allan deviation so far, with its interval");
    this.channel = h("select", { "aria-label": "Channel" });
    this.channel.addEventListener("change", said(() => this.drawCurve()));
    this.stop = h("button", { type: "button", class: "main", hidden: true, onclick: said(() => this.end()) }, "Stop");
    this.open = h("a", { class: "button", href: `#/recording/${run}`, hidden: true }, "Open the recording");
    this.place = h("div", {}, h("h1", {}, catalogue.shortName(catalogue.recording(run)?.name || "Run")),
      h("section", { "aria-label": "State" }, h("div", { class: "bar" }, this.stop, this.open, this.status), this.state),
      h("section", { "aria-labelledby": "live-series" }, h("h2", { id: "live-series" }, "Series so far"), this.plot),
      h("section", { "aria-labelledby": "live-curve" }, h("h2", { id: "live-curve" }, "Allan curve so far"), h("div", { class: "bar" }, this.channel), (this.none = h("p", { class: "soft" }, "It is drawn as soon as there are enough samples.")), this.curve.place));
  }

  close() {
    this.stream?.close();
    this.curve.close();
    this.chart.close();
  }

  async load() {
    this.stream = new EventSource(`/api/runs/${this.run}/events`);
    this.stream.addEventListener("run", (event) => this.news(JSON.parse(event.data)));
    this.stream.addEventListener("ended", (event) => this.over(JSON.parse(event.data).state));
    this.stream.addEventListener("failed", (event) => {
      this.stream.close();
      this.status.textContent = JSON.parse(event.data).message;
    });
    this.stream.onerror = () => (this.status.textContent = "Connection lost; the recorder continues. Reconnecting …");
    const { captures } = await get("/api/captures");
    this.capture = captures.find((c) => c.run === this.run && c.state !== "ended");
    this.stop.hidden = !this.capture;
  }

  async end() {
    this.stop.disabled = true;
    this.status.textContent = "Stopping: the last samples are being stored …";
    await post(`/api/captures/${this.capture.id}/stop`);
  }

  over(state) {
    this.stream.close();
    this.stop.hidden = true;
    this.open.hidden = false;
    if (state) this.facts(state);
    const says = state ? state.says.replace(/^./, (c) => c.toUpperCase()) : "The run is over";
    this.status.textContent = `${says}. What was recorded is kept.`;
    catalogue.refresh().catch(() => {});
  }

  news({ state, series, curves }) {
    this.status.textContent = "";
    this.facts(state);
    if (series) this.draw(series, state.channels);
    if (!curves || !Object.values(curves).some((c) => c.tau.length >= ENOUGH)) return;
    this.none.hidden = true;
    const names = Object.keys(curves);
    if (this.channel.options.length !== names.length) fill(this.channel, names.map((n) => h("option", { value: n }, n)));
    this.channel.hidden = names.length < 2;
    if (!this.asked || performance.now() - this.asked > CURVE) this.drawCurve().catch(() => {});
  }

  drawCurve() {
    this.asked = performance.now();
    return this.curve.load(get(`/api/runs/${this.run}/figure?${new URLSearchParams({ channel: this.channel.value })}`));
  }

  facts(s) {
    const rows = [
      ["State", s.says], ["Samples", samples(s.samples)], ["Recorded", duration(s.samples / s.rate)],
      ["Missing", s.missing ? `${samples(s.missing)} in ${s.gaps} gaps` : "none"], ["Rate", `${digits(s.measured_rate || s.rate, 5)} Hz`],
      ["Planned", s.plan?.seconds ? `${duration(s.plan.seconds)}, ${digits(100 * s.plan.share, 3)} % done` : "until stopped"],
      ["Disk", s.disk?.enough === false ? "not enough for the plan" : "enough"],
    ];
    fill(this.state, rows.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, value))));
  }

  draw({ rate, size, first, low, high }, channels) {
    const height = Math.max(130, 240 / low.length);
    const range = [first / rate, (first + low[0].length * size) / rate];
    const panels = low.map((lows, c) => {
      const x = [], y = [];
      lows.forEach((value, i) => {
        const t = (first + (i + (size > 1 ? 0.5 : 0)) * size) / rate;
        x.push(t, t);
        y.push(value, high[c][i]);
      });
      const { name = String(c), unit } = channels[c] || {};
      return timePanel([{ x, y, label: name, ...look(c), style: "thin" }], { label: `${name} [${unit || "1"}]`, range, height, last: c === low.length - 1 });
    });
    this.chart.show({ panels, zoom: "x" });
  }
}
