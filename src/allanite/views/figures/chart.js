// SPDX-License-Identifier: BSD-3-Clause
// Figures on screen: panels (panel.js) with a legend that hides and shows, read and zoomed with the pointer and the keys.
(function () {
  "use strict";
  const { PanelPicture, html, ink, number, ordered, scaled, svg, unscaled, wide, words } = globalThis.AllanitePanel;
  const LEAST = 300, NEAR = 32, HOLD = 4; // [px]: width of a panel, from a point to the pointer, a stroke that is a click
  const KEYS = "Arrow keys read the points, plus and minus zoom, Home shows all.";

  /** A value to so many digits. */
  const rounded = (value, digits = 4) => (value === null || value === undefined ? "none" : number(Number(value.toPrecision(digits))));

  class PanelView extends PanelPicture {
    constructor(chart, facts, number) {
      super(facts, `${chart.id}-${number}`);
      this.chart = chart;
      this.key = html("div", { class: "chart-key" });
      this.reading = html("div", { class: "chart-reading", hidden: "" });
      this.sheet.append(this.reading);
      if (facts.title) this.head = html("div", { class: "chart-title" }, html("span", {}, facts.title));
      this.place = html("div", { class: "chart-panel" }, ...(this.head ? [this.head] : []), this.key, this.sheet);
      if (facts.drawing) this.place.classList.add("chart-drawn");
      this.legend();
    }

    draw() {
      this.bands = this.chart.facts.marks || [];
      super.draw();
      this.all.hidden = !this.zoomed;
      const scrolls = this.sheet.scrollWidth > this.sheet.clientWidth + 1; // a drawing with its words
      const reach = { tabindex: 0, role: "group", "aria-label": this.facts.title || "Drawing" };
      for (const [name, value] of Object.entries(reach)) scrolls ? this.sheet.setAttribute(name, value) : this.sheet.removeAttribute(name);
    }

    axes(size) {
      const made = super.axes(size), { title, x, y } = this.facts;
      if (this.chart.options.keys === false) made.setAttribute("aria-hidden", "true");
      else {
        const label = `${title ? `${title}. ` : ""}${y.label || "Values"} against ${x.label || "place"}. ${KEYS}`;
        for (const [name, value] of Object.entries({ tabindex: 0, role: "application", "aria-label": label })) made.setAttribute(name, value);
      }
      this.listen(made);
      return made;
    }

    get zoomed() {
      return ["x", "y"].some((way) => this.range[way] && this.range[way].some((end, i) => end !== this.whole[way][i]));
    }

    // -- legend --

    legend() {
      const entries = this.facts.legend || [], shown = entries.length > 1 || (this.facts.key === "above" && entries.length);
      if (shown) this.key.append(...entries.map((entry) => this.entry(entry)));
      this.tools = html("span", { class: "chart-tools" });
      this.all = html("button", { type: "button", hidden: "" }, "Show all");
      this.all.addEventListener("click", () => this.zoom(this.whole));
      const save = html("button", { type: "button", "aria-label": `Save picture ${this.facts.title || ""}`.trim() }, "Save");
      save.addEventListener("click", () => this.save());
      this.tools.append(this.all, save);
      if (this.chart.options.tools !== false) (this.head || this.key).append(this.tools);
      this.key.hidden = !this.key.children.length;
    }

    entry(entry) {
      const box = html("input", { type: "checkbox" });
      box.checked = true;
      box.value = entry.words;
      box.addEventListener("change", () => {
        this.off[box.checked ? "delete" : "add"](entry.words);
        this.draw();
      });
      const sample = svg("svg", { viewBox: "0 0 24 12", "aria-hidden": "true" }, ...this.sample(entry, 0, 6));
      return html("label", {}, box, sample, entry.words);
    }

    // -- pointer and keys --

    at(event) {
      const { left, top } = this.picture.getBoundingClientRect();
      return [event.clientX - left, event.clientY - top];
    }

    listen(made) {
      made.addEventListener("pointerdown", (event) => this.pressed(event));
      made.addEventListener("pointermove", (event) => !this.drag && this.read(this.nearest(...this.at(event))));
      made.addEventListener("pointerleave", () => this.read(null));
      made.addEventListener("dblclick", () => this.zoom(this.whole));
      if (this.chart.options.keys !== false) {
        made.addEventListener("keydown", (event) => this.pressedKey(event));
        made.addEventListener("blur", () => this.read(null));
      }
    }

    inside(x, y) {
      return x >= this.left - HOLD && x <= this.left + this.across + HOLD && y >= this.top - HOLD && y <= this.top + this.high + HOLD;
    }

    pressed(event) {
      const start = this.at(event), { keys, marking } = this.chart.options;
      if (event.button || !this.inside(...start)) return;
      const mark = marking?.() && event.target.closest(".chart-mark");
      if (mark) return this.grab(event, Number(mark.dataset.index), mark.getBoundingClientRect());
      if (event.pointerType !== "touch") event.preventDefault();
      (keys === false ? this.chart.place : this.picture).focus({ preventScroll: true });
      const pans = event.shiftKey, before = { ...this.range }, frame = svg("rect", { class: "chart-zoom", fill: ink("guide"), "fill-opacity": 0.2, stroke: ink("guide") });
      this.drag = true;
      this.read(null);
      if (!pans) this.picture.append(frame);
      const move = (news) => (pans ? this.pan(before, start, this.at(news)) : this.frame(frame, this.box(start, this.at(news))));
      this.followed(move, (news) => {
        this.drag = false;
        frame.remove();
        if (news.type === "pointercancel") return;
        const end = this.at(news);
        if (pans) this.settle();
        else if (Math.hypot(end[0] - start[0], end[1] - start[1]) < HOLD) this.clicked(this.nearest(...start));
        else this.within(this.box(start, end), marking?.());
      });
    }

    /** Follow the pointer until it is let go. */
    followed(move, end) {
      const over = (news) => {
        window.removeEventListener("pointermove", move);
        for (const name of ["pointerup", "pointercancel"]) window.removeEventListener(name, over);
        end(news);
      };
      window.addEventListener("pointermove", move);
      for (const name of ["pointerup", "pointercancel"]) window.addEventListener(name, over);
    }

    /** A mark is taken by an end or as a whole. */
    grab(event, index, { left, right, width }) {
      event.preventDefault();
      const edge = Math.min(8, width / 3), part = event.clientX < left + edge ? "start" : event.clientX > right - edge ? "stop" : "both";
      const each = (this.range.x[1] - this.range.x[0]) / this.across;
      let before = event.clientX;
      this.followed((news) => {
        this.chart.options.dragged?.(index, part, (news.clientX - before) * each);
        before = news.clientX;
      }, () => this.chart.options.dropped?.());
    }

    /** Left, top, right and bottom of a stroke; one that is flat or steep keeps the other axis. */
    box([x0, y0], [x1, y1]) {
      const clamp = (v, low, size) => Math.min(Math.max(v, low), low + size);
      const xs = ordered([clamp(x0, this.left, this.across), clamp(x1, this.left, this.across)]), ys = ordered([clamp(y0, this.top, this.high), clamp(y1, this.top, this.high)]);
      const only = this.chart.facts.zoom === "x" || ys[1] - ys[0] < 16;
      if (only) return [xs[0], this.top, xs[1], this.top + this.high];
      return xs[1] - xs[0] < 16 ? [this.left, ys[0], this.left + this.across, ys[1]] : [xs[0], ys[0], xs[1], ys[1]];
    }

    frame(rect, [left, top, right, bottom]) {
      for (const [name, value] of Object.entries({ x: left, y: top, width: right - left, height: bottom - top })) rect.setAttribute(name, value);
    }

    within([left, top, right, bottom], marks) {
      const across = left === this.left && right === this.left + this.across, up = top === this.top && bottom === this.top + this.high;
      const x = across ? this.range.x : [this.value("x", left), this.value("x", right)];
      const y = up ? this.range.y : [this.value("y", bottom), this.value("y", top)];
      if (marks) this.chart.options.selected?.(x);
      else this.zoom({ x, y });
    }

    pan(before, [x0, y0], [x1, y1]) {
      const moved = (way, share) => {
        const [a, b] = before[way].map((end) => scaled(this.facts[way], end));
        return [a + share * (b - a), b + share * (b - a)].map((end) => unscaled(this.facts[way], end));
      };
      const range = { x: moved("x", (x0 - x1) / this.across), y: this.chart.facts.zoom === "x" ? before.y : moved("y", (y1 - y0) / this.high) };
      this.chart.turned(this, range, true);
    }

    settle() {
      this.chart.options.ranged?.(this.range.x);
    }

    zoom(range) {
      this.chart.turned(this, range);
    }

    /** A part of what is shown, about its middle: 0.5 is half of it. */
    zoomBy(share, shift = 0) {
      const part = (way) => {
        const [a, b] = this.range[way].map((end) => scaled(this.facts[way], end)), middle = (a + b) / 2 + shift * (b - a);
        return [middle - ((b - a) * share) / 2, middle + ((b - a) * share) / 2].map((end) => unscaled(this.facts[way], end));
      };
      this.zoom({ x: part("x"), y: this.chart.facts.zoom === "x" || shift ? this.range.y : part("y") });
    }

    curves() {
      return (this.facts.curves || []).filter((c) => !this.hidden(c, c.label) && c.x.length && c.x.some((x, i) => x !== null && c.y[i] !== null));
    }

    nearest(x, y) {
      let best = null, least = NEAR;
      if (!this.inside(x, y)) return null;
      for (const curve of this.curves()) {
        const solid = curve.marker || curve.lower ? 0 : 3; // measured points before lines
        for (let i = 0; i < curve.x.length; i++) {
          if (curve.y[i] === null || curve.x[i] === null) continue;
          const away = Math.hypot(this.px(curve.x[i]) - x, this.py(curve.y[i]) - y) + solid;
          if (away < least) [least, best] = [away, { curve, i }];
        }
      }
      return best;
    }

    clicked(point) {
      if (point) this.chart.options.clicked?.({ x: point.curve.x[point.i], y: point.curve.y[point.i] });
    }

    /** Say what a point is, beside it. */
    read(point) {
      this.ring?.remove();
      this.reading.hidden = !point;
      if (!point) return;
      const { curve, i } = point, x = this.px(curve.x[i]), y = this.py(curve.y[i]), f = this.facts;
      this.ring = svg("circle", { cx: x, cy: y, r: 7, stroke: ink("ink"), "stroke-width": 1.5, "pointer-events": "none" });
      this.picture.append(this.ring);
      const name = f.x.names?.find(([at]) => at === curve.x[i])?.[1].replaceAll("\n", " ");
      const lines = [`${f.x.label || "At"}: ${name || rounded(curve.x[i], 7)}`, `${f.y.label || "Value"}: ${rounded(curve.y[i])}`];
      if (curve.lower) lines.push(`[${rounded(curve.lower[i])}, ${rounded(curve.upper[i])}]`);
      this.reading.replaceChildren(...[curve.label || "", ...lines].filter(Boolean).map((line) => html("div", {}, line)));
      const { offsetWidth: w, offsetHeight: h } = this.reading;
      this.reading.style.left = `${Math.min(Math.max(x + 12 + w > this.width ? x - 12 - w : x + 12, 0), Math.max(this.width - w, 0))}px`;
      this.reading.style.top = `${Math.max(y - h - 10, 0)}px`;
      this.current = point;
      return lines;
    }

    pressedKey(event) {
      const ways = {
        "+": () => this.zoomBy(0.5), "=": () => this.zoomBy(0.5), "-": () => this.zoomBy(2), Home: () => this.zoom(this.whole), Escape: () => this.read(null), Enter: () => this.clicked(this.current),
        ArrowRight: () => (event.shiftKey ? this.zoomBy(1, 0.25) : this.step(1)), ArrowLeft: () => (event.shiftKey ? this.zoomBy(1, -0.25) : this.step(-1)),
        ArrowUp: () => this.change(-1), ArrowDown: () => this.change(1),
      };
      if (!ways[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
      event.preventDefault();
      ways[event.key]();
    }

    step(by) {
      const curves = this.curves(), { curve, i } = this.current && curves.includes(this.current.curve) ? this.current : { curve: curves[0], i: by > 0 ? -1 : curves[0]?.x.length };
      if (!curve) return;
      let next = i + by;
      while (next >= 0 && next < curve.x.length && (curve.y[next] === null || !this.inside(this.px(curve.x[next]), this.py(curve.y[next])))) next += by;
      if (next >= 0 && next < curve.x.length) this.tell({ curve, i: next });
    }

    change(by) {
      const curves = this.curves(), at = curves.indexOf(this.current?.curve);
      if (!curves.length) return;
      const curve = curves[(at + by + curves.length) % curves.length], x = this.current?.curve.x[this.current.i] ?? curve.x[0];
      const away = curve.x.map((v) => Math.abs(scaled(this.facts.x, v) - scaled(this.facts.x, x)));
      this.tell({ curve, i: away.indexOf(Math.min(...away.filter(Number.isFinite))) });
    }

    tell(point) {
      const lines = this.read(point);
      this.chart.status.textContent = [point.curve.label, ...lines].filter(Boolean).join(", ");
    }

    // -- a file of the picture, in the colors of the page --

    save() {
      const style = getComputedStyle(this.place), copy = this.picture.cloneNode(true), { width, height } = this.picture.getBoundingClientRect();
      const entries = (this.facts.legend || []).filter((e) => !this.off.has(e.words)), each = Math.max(90, ...entries.map((e) => wide(e.words) + 50));
      const columns = Math.max(1, Math.floor(width / each)), above = 24 + 18 * Math.ceil(entries.length / columns);
      for (const name of ["tabindex", "role"]) copy.removeAttribute(name);
      copy.setAttribute("height", height + above);
      copy.setAttribute("viewBox", `0 ${-above} ${width} ${height + above}`);
      copy.prepend(svg("rect", { x: 0, y: -above, width, height: height + above, fill: ink("paper") }));
      copy.append(words(8, 16 - above, this.facts.title || "", { anchor: "start", bold: true }));
      entries.forEach((entry, i) => {
        const x = 8 + each * (i % columns), y = 32 - above + 18 * Math.floor(i / columns);
        copy.append(...this.sample(entry, x, y), words(x + 30, y + 4, entry.words, { anchor: "start" }));
      });
      const text = new XMLSerializer().serializeToString(copy).replace(/var\(--of-(\w+)\)/g, (_, name) => style.getPropertyValue(`--of-${name}`).trim());
      const address = URL.createObjectURL(new Blob([text], { type: "image/svg+xml" }));
      html("a", { href: address, download: `${(this.facts.title || this.chart.place.id || "figure").replace(/[^\w.-]+/g, "_")}.svg` }).click();
      setTimeout(() => URL.revokeObjectURL(address), 1000);
    }
  }

  // -- all panels of a figure ----------------------------------------------------------------------------------

  let count = 0;

  class Chart {
    /**
     * @param {HTMLElement} place filled with the figure
     * @param {object} options `keys: false` leaves the keys to the page, `tools: false` leaves out the buttons; called:
     *   `clicked({x, y})` a point, `ranged([from, to])` the part of a series that is wanted, in place of the zoom;
     *   while `marking()`: `selected([from, to])` a stroke, `dragged(index, part, by)` and `dropped()` a mark
     */
    constructor(place, options = {}) {
      this.place = place;
      this.options = options;
      this.id = `chart-${++count}`;
      this.panels = [];
      this.status = html("span", { class: "chart-status", role: "status" });
      place.classList.add("chart");
      place.chart = this;
    }

    /** Draw a figure; panels of the same quantities keep their zoom, what is hidden, and the keys. */
    show(facts) {
      const before = this.panels, focused = before.findIndex((panel) => panel.picture && panel.picture === document.activeElement);
      this.facts = facts;
      this.panels = facts.panels.map((panel, i) => new PanelView(this, panel, i));
      this.panels.forEach((panel, i) => this.kept(panel, before[i]));
      this.grid = html("div", { class: "chart-grid" }, ...this.panels.map((panel) => panel.place));
      this.place.replaceChildren(this.grid, this.status);
      this.draw();
      this.panels[focused]?.picture?.focus({ preventScroll: true });
    }

    kept(panel, before) {
      if (!before || this.options.ranged) return;
      const same = (way) => before.facts[way]?.label === panel.facts[way]?.label && before.facts[way]?.log === panel.facts[way]?.log;
      if (before.zoomed && same("x") && same("y")) panel.range = before.range;
      for (const box of panel.key.querySelectorAll("input")) {
        box.checked = !before.off.has(box.value);
        if (!box.checked) panel.off.add(box.value);
      }
    }

    draw() {
      const width = this.place.clientWidth;
      if (!width) return;
      const columns = Math.max(1, Math.min(this.facts.columns || 1, Math.floor(width / LEAST)));
      this.grid.style.gridTemplateColumns = `repeat(${columns}, minmax(0, 1fr))`;
      for (const panel of this.panels) panel.place.style.gridColumnStart = panel.facts.first && columns === this.facts.columns ? 1 : "";
      const plotted = this.panels.filter((panel) => !panel.facts.drawing);
      for (let pass = 0; pass < 2; pass++) { // the margin needs the height, which needs the margin
        const left = Math.max(0, ...plotted.map((panel) => panel.margin()));
        for (const panel of plotted) panel.left = left;
      }
      for (const panel of this.panels) panel.draw();
      this.place.dataset.drawn ||= "yes";
    }

    /** Another part is to be shown: of a panel, and across of those that share its horizontal axis. */
    turned(panel, range, moving = false) {
      if (this.options.ranged && !moving) return this.options.ranged(range.x === panel.whole.x ? null : range.x);
      const axis = JSON.stringify(panel.facts.x), alike = this.panels.filter((other) => other === panel || (!other.facts.drawing && JSON.stringify(other.facts.x) === axis && !panel.facts.x.names));
      for (const other of alike) other.range = { x: range.x, y: other === panel ? range.y : range.x === panel.whole.x ? other.whole.y : other.range.y };
      const focused = this.place.contains(document.activeElement) && document.activeElement === panel.picture;
      this.draw();
      if (focused) panel.picture.focus({ preventScroll: true });
    }

    /** About the height of a figure [px] before it is drawn: what is below it moves little. */
    static roughHeight({ panels, columns = 1 }, width) {
      const across = Math.max(1, Math.min(columns, Math.floor(width / LEAST)));
      const each = panels.map(({ aspect, drawing }) => Math.max((aspect * width) / across, drawing ? 0 : 150) + (drawing ? 30 : 90));
      return each.reduce((sum, height) => sum + height, 0) / across;
    }

    close() {
      this.place.replaceChildren();
      delete this.place.dataset.drawn;
    }
  }

  globalThis.AllaniteChart = Chart;
})();
