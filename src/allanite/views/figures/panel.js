// SPDX-License-Identifier: BSD-3-Clause
// The picture of a panel on screen, as `allanite.views.figures.screen` states it: an SVG of the pixels that there are.
// Colors are CSS variables (--of-x ...), so a change of theme draws nothing again. Text becomes text, never markup.
(function () {
  "use strict";
  const NS = "http://www.w3.org/2000/svg";
  const FONT = "system-ui, -apple-system, 'Segoe UI', sans-serif";
  const SIZE = 12.5, NAME = 13.5, FAR = 1e5, DRAWN = 828, READABLE = 640; // [px]: of a drawing, the width for which its words are, and the least
  const DASHES = { dashed: "9 4", dotted: "2 3", dashdot: "9 3 2 3" };
  const OUTLINES = { // of half-width 1
    square: [[-0.9, -0.9], [1.8, 0], [0, 1.8], [-1.8, 0]], triangle: [[0, -1.1], [1.05, 1.9], [-2.1, 0]],
    diamond: [[0, -1.25], [1.25, 1.25], [-1.25, 1.25], [-1.25, -1.25]], down: [[0, 1.1], [1.05, -1.9], [-2.1, 0]],
    cross: [[-0.9, -0.9], [1.8, 1.8], [-1.8, 0], [1.8, -1.8]],
  };
  const SHIFTS = { above: [0, -14], below: [0, 14], right: [8, 0], left: [-8, 0] };
  const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";

  // -- elements ------------------------------------------------------------------------------------------------

  const ink = (colour) => `var(--of-${colour})`;

  function svg(tag, facts = {}, ...children) {
    const made = document.createElementNS(NS, tag);
    for (const [name, value] of Object.entries(facts)) if (value !== undefined && value !== null) made.setAttribute(name, value);
    made.append(...children);
    return made;
  }

  function html(tag, facts = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(facts)) made.setAttribute(name, value);
    made.append(...children);
    return made;
  }

  const pen = document.createElement("canvas").getContext("2d");
  function wide(text, size = SIZE, bold = false) {
    pen.font = `${bold ? "bold " : ""}${size}px ${FONT}`;
    return Math.max(...text.split("\n").map((line) => pen.measureText(line).width));
  }

  /** Words whose first line has its foot at y. */
  function words(x, y, text, { colour = "ink", size = SIZE, anchor = "middle", turned = 0, bold = false, halo = false, name = "label" } = {}) {
    const made = svg("text", { class: `chart-${name}`, x: x.toFixed(1), y: y.toFixed(1), fill: ink(colour), "font-size": size, "text-anchor": anchor });
    if (turned) made.setAttribute("transform", `rotate(${turned.toFixed(1)} ${x.toFixed(1)} ${y.toFixed(1)})`);
    if (bold) made.setAttribute("font-weight", "bold");
    if (halo) for (const [key, value] of [["stroke", ink("paper")], ["stroke-width", 3], ["paint-order", "stroke"]]) made.setAttribute(key, value);
    text.split("\n").forEach((line, i) => made.append(i ? svg("tspan", { x: x.toFixed(1), dy: 1.2 * size }, line) : line));
    return made;
  }

  // -- numbers -------------------------------------------------------------------------------------------------

  const raised = (power) => (power < 0 ? "⁻" : "") + [...String(Math.abs(power))].map((d) => RAISED[d]).join("");
  const plain = (value) => String(Number(value.toPrecision(10))).replace("-", "−");
  const powerOfTen = (power) => (Math.abs(power) <= 3 ? plain(10 ** power) : `10${raised(power)}`);

  function number(value, step = 0) {
    if (Math.abs(value) <= 1e-9 * step) value = 0;
    const size = Math.max(Math.abs(value), step);
    if (!value || (size >= 1e-4 && size < 1e5)) return plain(value);
    const power = Math.floor(Math.log10(size) + 1e-12);
    return `${plain(Number((value / 10 ** power).toPrecision(6)))}×10${raised(power)}`;
  }

  // -- axes ----------------------------------------------------------------------------------------------------

  const scaled = (axis, value) => (axis.log ? (value > 0 ? Math.log10(value) : NaN) : value);
  const unscaled = (axis, value) => (axis.log ? 10 ** value : value);
  const ordered = ([a, b]) => [Math.min(a, b), Math.max(a, b)];

  // Named digits of a decade: for fewer decades than so many, with the least distance of two of them in decades.
  const NAMED = [[1, Math.log10(10 / 9), [1, 2, 3, 4, 5, 6, 7, 8, 9]], [2, Math.log10(2), [1, 2, 5]], [Infinity, Infinity, [1]]];
  const CLOSE = 0.6; // of the least distance, that of two digits

  function powers(ends, room, apart) {
    const [low, high] = ordered(ends), decades = Math.log10(high / low);
    const every = Math.max(1, Math.ceil((apart * decades) / room));
    const [, , named] = NAMED.find(([most, gap]) => decades < most && gap * room > CLOSE * apart * decades);
    const major = [], minor = [];
    for (let power = Math.floor(Math.log10(low) - 1e-9); power <= Math.log10(high) + 1; power++) {
      for (let digit = 1; digit < 10; digit++) {
        const at = Number(`${digit}e${power}`);
        if (at < low * (1 - 1e-9) || at > high * (1 + 1e-9)) continue;
        if (named.includes(digit) && power % every === 0) major.push([at, digit === 1 ? powerOfTen(power) : number(at)]);
        else if (digit === 1 || room / decades > 36) minor.push(at);
      }
    }
    return { major, minor };
  }

  function steps(ends, room, apart) {
    const [low, high] = ordered(ends), raw = (high - low) / Math.max(1, Math.floor(room / apart));
    if (!(raw > 0) || !Number.isFinite(raw)) return { major: [[low, number(low)]], minor: [] };
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 2.5, 5, 10].map((s) => s * power).find((s) => s >= raw * (1 - 1e-9));
    const major = [];
    for (let i = Math.ceil(low / step - 1e-9); i <= high / step + 1e-9; i++) major.push([i * step, number(i * step, step)]);
    return { major, minor: [] };
  }

  /** Ticks of an axis; a zoom within a decade needs those of a linear one. */
  function ticks(axis, ends, room, apart) {
    const [low, high] = ordered(ends);
    if (axis.names) return { major: axis.names.filter(([at]) => at >= low && at <= high), minor: [] };
    if (!axis.log || high / low < 2) return steps(ends, room, apart);
    const made = powers(ends, room, apart);
    return made.major.length ? made : steps(ends, room, apart);
  }

  /** Text in two lines or more, broken at blanks, none longer than so many pixels where that is possible. */
  function broken(text, room, size = SIZE) {
    if (wide(text, size) <= room) return text;
    const lines = [""];
    for (const word of text.split(/[ \n]/)) {
      const longer = `${lines.at(-1)} ${word}`.trim();
      if (lines.at(-1) && wide(longer, size) > room) lines.push(word);
      else lines[lines.length - 1] = longer;
    }
    return lines.join("\n");
  }

  /** The outline of a marker, from its middle. */
  function outline(marker, half) {
    if (marker === "circle") return `m${-half},0a${half},${half} 0 1 0 ${2 * half},0a${half},${half} 0 1 0 ${-2 * half},0z`;
    const [first, ...more] = OUTLINES[marker].map((step) => step.map((part) => (part * half).toFixed(2)));
    const steps = more.map((step, i) => (marker === "cross" && i === 1 ? "m" : "l") + step);
    return `m${first}${steps.join("")}${marker === "cross" ? "" : "z"}`;
  }

  const rows = (text) => text.split("\n").length;

  // -- one panel -----------------------------------------------------------------------------------------------

  /** What is drawn of a panel: `facts` of it, `range` of both axes, `off` the words of the legend that are hidden. */
  class PanelPicture {
    constructor(facts, id) {
      this.facts = facts;
      this.id = id;
      this.off = new Set();
      this.bands = [];
      this.whole = { x: facts.x?.limits, y: facts.y?.limits };
      this.range = { ...this.whole };
      this.sheet = html("div", { class: "chart-sheet" });
    }

    /** What an entry of the legend stands for can be hidden: a curve takes its band and all of its channel along. */
    hidden(part, word) {
      const axis = part.axis && (this.facts.legend || []).find((e) => e.axis === part.axis);
      if (axis && this.off.has(axis.words)) return true;
      if (word) return this.off.has(word);
      const alike = (this.facts.legend || []).find((e) => !e.axis && e.kind === "line" && e.colour === part.colour && e.style === (part.style || "solid"));
      return Boolean(alike && part.label !== undefined && this.off.has(alike.words));
    }

    /** The sample of an entry of the legend, 24 px wide, about y. */
    sample({ kind, colour, style, marker, hollow, opacity = 1 }, x, y) {
      const line = { stroke: ink(colour), fill: "none" };
      if (kind === "rug") return [svg("path", { ...line, d: `M${x + 12} ${y - 4}v8` })];
      if (kind === "area") return [svg("rect", { x, y: y - 4, width: 24, height: 8, fill: ink(colour), opacity })];
      if (kind === "hatched") return [svg("path", { ...line, d: `M${x} ${y + 4}l8 -8m0 8l8 -8m0 8l8 -8` })];
      const parts = style === "none" || !style ? [] : [svg("path", { ...line, d: `M${x} ${y}h24`, "stroke-width": style === "thin" ? 1 : 2, "stroke-dasharray": DASHES[style] })];
      if (marker) parts.push(this.marks(marker, [[x + 12, y]], colour, 4, hollow));
      return parts;
    }

    // -- frame --

    get width() {
      return this.sheet.clientWidth;
    }

    /** Room for the labels of the vertical axis. */
    margin() {
      if (this.facts.drawing) return 0;
      const names = this.facts.y.names ? 0.3 * this.width : 90;
      const texts = ticks(this.facts.y, this.range.y, this.height() || 200, 34).major.map(([, text]) => broken(text, names));
      const label = this.facts.y.label ? 20 * rows(this.title()) : 4;
      return Math.ceil(Math.max(0, ...texts.map((text) => wide(text))) + 12 + label);
    }

    /** Height of the axes; a square decade keeps its proportions at every width. */
    height() {
      if (this.facts.height) return this.facts.height;
      const across = Math.max(this.width - (this.left || 60) - 16, 60);
      return this.facts.square ? across * this.facts.aspect : Math.max(across * this.facts.aspect, 150);
    }

    title() {
      return broken(this.facts.y.label || "", Math.max(this.height() + 8, 120), NAME);
    }

    draw() {
      const size = this.width;
      if (!size) return;
      this.picture?.remove();
      this.picture = this.facts.drawing ? this.drawing(Math.max(size, READABLE)) : this.axes(size);
      this.sheet.prepend(this.picture);
    }

    axes(size) {
      const { x, y } = this.facts;
      this.high = this.height();
      this.across = Math.max(size - this.left - 16, 20);
      this.top = x.landmarks ? 24 : 8;
      const [xticks, room] = this.below();
      const whole = this.top + this.high + room;
      const made = this.canvas(size, whole);
      const yticks = ticks(y, this.range.y, this.high, y.names ? 1 : 34);
      this.taken = [];
      made.append(svg("clipPath", { id: this.id }, svg("rect", { x: this.left, y: this.top, width: this.across, height: this.high })));
      made.append(this.grid(xticks, yticks), this.contents());
      made.append(svg("rect", { x: this.left, y: this.top, width: this.across, height: this.high, stroke: ink("guide"), class: "chart-frame" }));
      this.rulers(made, xticks, yticks, whole);
      made.append(this.marked(), ...this.lettering(size, whole));
      return made;
    }

    canvas(width, height) {
      return svg("svg", { class: "chart-picture", width, height, viewBox: `0 0 ${width} ${height}`, "font-family": FONT, fill: "none" });
    }

    px(value) {
      const [a, b] = this.range.x.map((end) => scaled(this.facts.x, end));
      return this.left + this.across * Math.min(Math.max((scaled(this.facts.x, value) - a) / (b - a), -FAR), FAR);
    }

    py(value) {
      const [a, b] = this.range.y.map((end) => scaled(this.facts.y, end));
      return this.top + this.high * (1 - Math.min(Math.max((scaled(this.facts.y, value) - a) / (b - a), -FAR), FAR));
    }

    /** The value of the horizontal or the vertical axis at a pixel. */
    value(way, at) {
      const [a, b] = this.range[way].map((end) => scaled(this.facts[way], end));
      const share = way === "x" ? (at - this.left) / this.across : 1 - (at - this.top) / this.high;
      return unscaled(this.facts[way], a + share * (b - a));
    }

    /** Ticks of the horizontal axis with their words, and the room that they take below it. */
    below() {
      const { x, numbered = true } = this.facts;
      let made = ticks(x, this.range.x, this.across, 60);
      const widest = Math.max(20, ...made.major.map(([, text]) => wide(text)));
      if (!x.names) made = ticks(x, this.range.x, this.across, x.log ? (widest + 8) / CLOSE : widest + 16);
      const each = x.names ? this.across / Math.max(made.major.length, 1) - 6 : Infinity;
      this.small = widest > each ? 10.5 : SIZE;
      made.major = made.major.map(([at, text]) => [at, broken(text, Math.max(each, 30), this.small)]);
      this.lines = Math.max(1, ...made.major.map(([, text]) => rows(text)));
      this.label = broken(x.label || "", this.across + this.left - 8, NAME);
      return [made, numbered ? 14 + 15 * this.lines + (x.label ? 16 * rows(this.label) + 2 : 2) : 6];
    }

    grid(xticks, yticks) {
      const way = (at, upright) => (upright ? `M${this.px(at).toFixed(1)} ${this.top}v${this.high.toFixed(1)}` : `M${this.left} ${this.py(at).toFixed(1)}h${this.across.toFixed(1)}`);
      const lines = (xs, ys) => [...xs.map((at) => way(at, true)), ...ys.map((at) => way(at, false))].join("");
      const minor = lines(xticks.minor, yticks.minor), major = lines(xticks.major.map(([at]) => at), yticks.major.map(([at]) => at));
      return svg("g", { stroke: ink("grid") }, svg("path", { d: minor, opacity: 0.4 }), svg("path", { d: major }));
    }

    rulers(made, xticks, yticks, whole) {
      const foot = this.top + this.high, { x, y, numbered = true } = this.facts;
      const strokes = xticks.major.map(([at]) => `M${this.px(at).toFixed(1)} ${foot}v5`).concat(xticks.minor.map((at) => `M${this.px(at).toFixed(1)} ${foot}v3`));
      strokes.push(...yticks.major.map(([at]) => `M${this.left} ${this.py(at).toFixed(1)}h-5`), ...yticks.minor.map((at) => `M${this.left} ${this.py(at).toFixed(1)}h-3`));
      made.append(svg("path", { d: strokes.join(""), stroke: ink("guide") }));
      const room = y.names ? 0.3 * this.width : 90;
      for (const [at, text] of yticks.major) {
        const lines = broken(text, room), foot = this.py(at) + 4.5 - 7.5 * (rows(lines) - 1);
        this.taken.push([this.left - 8 - wide(lines), foot - 11, this.left - 8, foot + 15 * rows(lines) - 12]);
        made.append(words(this.left - 8, foot, lines, { anchor: "end", name: "tick" }));
      }
      for (const [at, text] of numbered ? xticks.major : []) this.tick(made, this.px(at), foot + 19, text);
      if (numbered && x.label) made.append(words(this.left + this.across / 2, whole - 6 - 16 * (rows(this.label) - 1), this.label, { size: NAME, name: "name" }));
      if (y.label) made.append(words(14, this.top + this.high / 2, this.title(), { size: NAME, turned: -90, name: "name" }));
      for (const [at, text] of x.landmarks || []) this.landmark(made, this.px(at), text);
    }

    /** A label of the horizontal axis: inside the picture, and clear of the one before it. */
    tick(made, at, y, text) {
      const half = wide(text, this.small) / 2, x = Math.min(Math.max(at, half + 1), this.left + this.across + 15 - half);
      const box = [x - half, y - 10, x + half, y + 15 * rows(text) - 12];
      if (this.facts.x.names && !this.free([box[0] + 1, box[1], box[2] - 1, box[3]], Infinity, Infinity)) return;
      this.taken.push(box);
      made.append(words(x, y, text, { size: this.small, name: "tick" }));
    }

    landmark(made, x, text) {
      if (x < this.left - 1 || x > this.left + this.across + 1) return;
      const half = wide(text, 11) / 2, box = [x - half, this.top - 16, x + half, this.top - 3];
      made.append(svg("path", { d: `M${x.toFixed(1)} ${this.top}v5`, stroke: ink("guide") }));
      if (!this.free(box, this.width, Infinity)) return;
      this.taken.push(box);
      made.append(words(x, this.top - 6, text, { colour: "guide", size: 11 }));
    }

    free([left, top, right, bottom], width, height) {
      if (left < 0 || top < 0 || right > width || bottom > height) return false;
      return this.taken.every(([l, t, r, b]) => right <= l || left >= r || bottom <= t || top >= b);
    }

    // -- contents --

    contents() {
      const group = svg("g", { "clip-path": `url(#${this.id})` }), f = this.facts, foot = this.top + this.high;
      for (const span of f.spans || []) if (span.top === 1) group.append(this.span(span));
      for (const { place, x, y, colour } of f.labels || []) {
        if (place === "line") group.append(svg("path", { d: `M${this.px(x).toFixed(1)} ${this.top}V${foot}`, stroke: ink(colour), "stroke-dasharray": "6 4" }));
        if (place === "level") group.append(svg("path", { d: `M${this.left} ${this.py(y).toFixed(1)}h${this.across}`, stroke: ink(colour), "stroke-width": 1.2, "stroke-dasharray": "6 4" }));
      }
      for (const guide of f.guides || []) group.append(svg("path", { d: this.line(guide.x, guide.y), stroke: ink("guide") }));
      for (const limit of f.limits || []) group.append(svg("path", { d: this.line(limit.x, limit.y), stroke: ink("limit"), "stroke-width": 1.5, "stroke-dasharray": DASHES.dotted }));
      for (const e of f.envelopes || []) if (!this.off.has(e.label)) group.append(svg("path", { d: this.area(e.x, e.low, e.high), fill: ink(e.colour), stroke: ink(e.colour), "stroke-width": 0.5, opacity: 0.55 }));
      const shown = (f.curves || []).filter((c) => !this.hidden(c, c.label));
      for (const c of shown) if (c.lower && !c.bars && !(c.band_label && this.off.has(c.band_label))) group.append(svg("path", { d: this.area(c.x, c.lower, c.upper), fill: ink(c.colour), opacity: 0.18 }));
      for (const c of shown) group.append(...this.curve(c));
      for (const rug of f.rugs || []) {
        const strokes = rug.x.map((x) => `M${this.px(x).toFixed(1)} ${foot}v${(-0.06 * this.high).toFixed(1)}`).join("");
        if (!this.off.has(rug.label)) group.append(svg("path", { d: strokes, stroke: ink(rug.colour) }));
      }
      for (const span of f.spans || []) if (span.top < 1) group.append(this.span(span));
      return group;
    }

    curve(c) {
      const made = [];
      if (c.bars && c.lower) {
        const strokes = c.x.map((x, i) => (c.lower[i] === null || c.upper[i] === null ? "" : `M${this.px(x).toFixed(1)} ${this.py(c.lower[i]).toFixed(1)}V${this.py(c.upper[i]).toFixed(1)}`));
        made.push(svg("path", { d: strokes.filter((s) => !s.includes("NaN")).join(""), stroke: ink(c.colour), "stroke-width": 1.2 }));
      }
      const thin = c.style === "thin" || c.x.length > 1500;
      if (c.style !== "none") made.push(svg("path", { d: this.line(c.x, c.y), stroke: ink(c.colour), "stroke-width": thin ? 1 : 2, "stroke-dasharray": DASHES[c.style], "stroke-linejoin": "round" }));
      if (!c.marker || (c.style !== "none" && c.x.length > 120)) return made;
      const at = c.x.map((x, i) => [this.px(x), this.py(c.y[i] ?? NaN), c.hollow?.[i]]).filter(([x, y]) => Number.isFinite(x + y));
      const size = c.size || (c.x.length > 200 ? 2.5 : 3.5);
      const [filled, hollow] = [at.filter(([, , hollow]) => !hollow), at.filter(([, , hollow]) => hollow)];
      if (filled.length) made.push(this.marks(c.marker, filled, c.colour, size));
      if (hollow.length && !this.off.has(c.hollow_label || "not in the fit")) made.push(this.marks(c.marker, hollow, c.colour, size, true));
      return made;
    }

    marks(marker, points, colour, half, hollow = false) {
      const shape = outline(marker, half);
      const look = marker === "cross" ? { stroke: ink(colour), "stroke-width": 1.6 } : { fill: ink(hollow ? "paper" : colour), stroke: ink(colour), "stroke-width": 1.2 };
      return svg("path", { d: points.map(([x, y]) => `M${x.toFixed(1)} ${y.toFixed(1)}${shape}`).join(""), ...look });
    }

    /** The way through points, interrupted where a value is missing. */
    line(xs, ys) {
      let way = "", pen = "M";
      for (let i = 0; i < xs.length; i++) {
        const x = this.px(xs[i]), y = ys[i] === null ? NaN : this.py(ys[i]);
        if (Number.isFinite(x + y)) {
          way += `${pen}${x.toFixed(1)} ${y.toFixed(1)}`;
          pen = "L";
        } else pen = "M";
      }
      return way;
    }

    area(xs, low, high) {
      const parts = [[]];
      xs.forEach((at, i) => {
        const x = this.px(at), a = low[i] === null ? NaN : this.py(low[i]), b = high[i] === null ? NaN : this.py(high[i]);
        if (Number.isFinite(x + a + b)) parts.at(-1).push([x, a, b]);
        else if (parts.at(-1).length) parts.push([]);
      });
      const point = (x, y) => `${x.toFixed(1)} ${y.toFixed(1)}`;
      return parts.filter((p) => p.length).map((p) => `M${p.map(([x, a]) => point(x, a)).join("L")}L${p.reverse().map(([x, , b]) => point(x, b)).join("L")}z`).join("");
    }

    span({ start, stop, colour, opacity, top, hatched, words: name }) {
      const a = this.px(start), b = this.px(stop), foot = this.top + this.high, high = top * this.high;
      if (name && this.off.has(name)) return svg("g");
      if (!hatched) return svg("rect", { x: a, y: foot - high, width: Math.max(b - a, 1.5), height: high, fill: ink(colour), opacity });
      let way = "";
      for (let at = a - high; at < b; at += 12) {
        const left = Math.max(at, a), right = Math.min(at + high, b);
        if (left < right) way += `M${left.toFixed(1)} ${(foot - (left - at)).toFixed(1)}L${right.toFixed(1)} ${(foot - (right - at)).toFixed(1)}`;
      }
      return svg("path", { d: way, stroke: ink(colour), opacity });
    }

    // -- words in the axes: clear of one another and inside the picture, on another side of their point, or not at all;
    //    all that they say is in the tables --

    lettering(size, whole) {
      const f = this.facts, made = [], foot = this.top + this.high;
      const inside = (x, y) => x >= this.left - 1 && x <= this.left + this.across + 1 && y >= this.top - 1 && y <= foot + 1;
      const put = (candidates, text, look) => {
        for (const [x, y, anchor, box] of candidates) {
          if (!this.free(box, size, whole)) continue;
          this.taken.push(box);
          made.push(words(x, y, text, { ...look, anchor }));
          return;
        }
      };
      for (const label of f.labels || []) this.ruled(label, put, foot);
      for (const limit of f.limits || []) {
        const [x, y] = [this.px(limit.at[0]), this.py(limit.at[1])];
        if (!inside(x, y)) continue;
        made.push(svg("path", { d: `M${x} ${y}v18`, stroke: ink("limit"), "stroke-width": 2 }), svg("path", { d: `M${x} ${y + 26}l-4 -9h8z`, fill: ink("limit") }));
        this.taken.push([x - 4, y, x + 4, y + 26]);
        put(this.beside(x, y, limit.text, limit.side || "below right", 8), limit.text, { colour: "limit", size: 12, halo: true });
      }
      for (const label of (f.labels || []).filter((l) => l.place === "point" || !l.place)) {
        const [x, y] = [this.px(label.x), this.py(label.y)];
        if (!inside(x, y)) continue;
        made.push(this.marks("circle", [[x, y]], label.colour, 4, true));
        put(this.beside(x, y, label.text, label.side), label.text, { colour: label.colour, size: 12, halo: true });
      }
      for (const guide of f.guides || []) this.guideName(guide, put, inside);
      return made;
    }

    ruled({ place, x, y, text, colour, side = "" }, put, foot) {
      const long = wide(text, 12);
      if (place === "line") {
        const at = this.px(x);
        if (at >= this.left && at <= this.left + this.across) put([[at - 4, foot - 6, "start", [at - 17, foot - 6 - long, at - 2, foot - 6]]], text, { colour, size: 12, turned: -90 });
      } else if (place === "level") {
        const at = this.py(y), right = this.left + this.across - 4;
        const over = [right, at - 5, "end", [right - long, at - 17, right, at - 2]], under = [right, at + 14, "end", [right - long, at + 3, right, at + 18]];
        if (at >= this.top && at <= foot) put(side.includes("below") ? [under, over] : [over, under], text, { colour, size: 12, halo: true });
      }
    }

    beside(x, y, text, side = "above right", lower = 0) {
      const long = wide(text, 12), [dx, dy] = side.split(" ").map((word) => SHIFTS[word]).reduce(([a, b], [c, d]) => [a + c, b + d], [0, 0]);
      const ups = [dy + (dy > 0 ? lower : 0), -dy, -14, 14, 0, 34], acrosses = [dx, 8, -8, 0];
      return ups.flatMap((up) => acrosses.filter((a) => a || up).map((across) => {
        const anchor = across > 0 ? "start" : across < 0 ? "end" : "middle", left = x + across - (across > 0 ? 0 : across < 0 ? long : long / 2);
        return [x + across, y + up + 4, anchor, [left, y + up - 8, left + long, y + up + 8]];
      }));
    }

    guideName(guide, put, inside) {
      const x = this.px(guide.name_x), y = this.py(guide.y[0] * (guide.name_x / guide.x[0]) ** guide.slope);
      if (!inside(x, y)) return;
      const slope = Math.atan2(this.py(guide.y[1]) - this.py(guide.y[0]), this.px(guide.x[1]) - this.px(guide.x[0]));
      const long = wide(guide.name, 11), w = Math.abs(long * Math.cos(slope)) + Math.abs(14 * Math.sin(slope)), h = Math.abs(long * Math.sin(slope)) + Math.abs(14 * Math.cos(slope));
      const at = [x - 4 * Math.sin(slope), y + 4 * Math.cos(slope)];
      put([[...at, "middle", [x - w / 2, y - h / 2, x + w / 2, y + h / 2]]], guide.name, { colour: "guide", size: 11, turned: (slope * 180) / Math.PI, halo: true });
    }

    // -- drawings --

    drawing(size) {
      const { width, height, parts } = this.facts.drawing, unit = size / width, share = Math.min(size / DRAWN, 1);
      const made = this.canvas(size, height * unit);
      made.setAttribute("aria-hidden", "true");
      for (const part of parts) {
        if (part.text !== undefined) made.append(this.written(part, unit, (height - part.y) * unit, 13 * (part.size ?? 1) * share));
        else made.append(...this.shape(part, unit, height));
      }
      return made;
    }

    shape({ points, closed, colour = "ink", fill, opacity = 1, width = 1, dashed }, unit, height) {
      const d = `M${points.map(([x, y]) => `${(x * unit).toFixed(1)} ${((height - y) * unit).toFixed(1)}`).join("L")}${closed ? "z" : ""}`, made = [];
      if (fill) made.push(svg("path", { d, fill: ink(fill), opacity }));
      if (colour) made.push(svg("path", { d, stroke: ink(colour), "stroke-width": 1.4 * width, "stroke-dasharray": dashed ? "9 4" : undefined, "stroke-linejoin": "round" }));
      return made;
    }

    written(part, unit, y, size) {
      const lines = rows(part.text) - 1, lift = { bottom: -1.2 * lines, middle: 0.35 - 0.6 * lines, top: 0.85 }[part.up || "middle"];
      const anchor = { left: "start", center: "middle", right: "end" }[part.across || "center"];
      return words(part.x * unit, y + lift * size, part.text, { colour: part.colour, size: Number(size.toFixed(1)), anchor, bold: part.bold });
    }

    // -- marks over a series --

    marked() {
      const { top, high } = this, group = svg("g", { "clip-path": `url(#${this.id})` });
      this.bands.forEach((mark, i) => {
        const a = this.px(mark.start), b = this.px(mark.stop);
        group.append(svg("rect", { class: "chart-mark", "data-index": i, x: Math.min(a, b), y: top, width: Math.max(Math.abs(b - a), 1), height: high, fill: ink("finding"), stroke: ink("finding"), "fill-opacity": 0.3 }));
        if (mark.words) group.append(words((a + b) / 2, top + 14, mark.words, { size: 12 }));
      });
      return group;
    }
  }

  globalThis.AllanitePanel = { PanelPicture, FONT, html, ink, number, ordered, scaled, svg, unscaled, wide, words };
})();
