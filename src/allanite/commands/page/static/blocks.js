// SPDX-License-Identifier: BSD-3-Clause
// What the report of a result says, on the page: each kind of block of a report is one function here.

import { h, unique } from "./dom.js";
import { FigureView } from "./figure.js";
import { findingList } from "./findings.js";
import { mark } from "./wording.js";

const TAGS = ["good", "warning", "fatal"];

const words = (value) => (Array.isArray(value) ? [value[0], h("ul", { class: "verdict" }, value.slice(1).map((v) => h("li", {}, v)))] : value);

function cell(part, first) {
  const text = TAGS.includes(part.look) ? h("span", { class: `tag ${part.look}` }, mark(part.look), " ", part.text) : part.text;
  return h(first ? "th" : "td", { scope: first ? "row" : null, class: part.look || null }, text, part.below ? h("span", { class: "name" }, part.below) : null);
}

// What a table is stands above it, not in it: it stays in view while a narrow screen scrolls the table.
const table = ({ heads, rows, caption }) => [caption ? h("p", { class: "caption" }, caption) : null, h("div", { class: "wide", tabindex: 0, role: "group", "aria-label": caption || heads.join(", ") }, h("table", {},
  h("thead", {}, h("tr", {}, heads.map((t) => (t ? h("th", { scope: "col" }, t) : h("td", {}))))),
  h("tbody", {}, rows.map(([cells, kept]) => h("tr", { class: kept ? "kept" : null }, cells.map((c, i) => cell(c, i === 0)))))))];

const MADE = {
  banner: (b) => h("div", { class: `banner ${b.tone}` }, h("span", {}, h("b", {}, b.head), " ", b.text)),
  hero: (b) => h("div", { class: "hero" }, h("p", { class: "flat" }, h("span", { class: "amount" }, b.value), ` ${b.unit}`), h("p", { class: "flat" }, b.interval), h("p", { class: "note" }, b.beside)),
  numbers: (b) => h("dl", { class: "numbers" }, b.items.map((n) => h("div", {}, h("dt", {}, n.name), h("dd", {}, h("span", { class: "amount" }, n.value), ` ${n.unit}`), h("dd", { class: "note" }, n.beside)))),
  text: (b) => h("p", { class: b.note ? "note" : null }, b.text),
  heading: (b) => h("h3", {}, b.text),
  bullets: (b) => h("ul", { class: "verdict" }, b.items.map((item) => h("li", {}, item))),
  table,
  pairs: (b) => h("dl", { class: "facts" }, b.rows.map(([name, value]) => h("div", {}, h("dt", {}, name), h("dd", {}, words(value))))),
  cards: (b, figure) => h("div", { class: "cards" }, b.items.map(([title, inner]) => h("div", {}, h("h3", {}, title), inner.map((one) => block(one, figure))))),
  details: (b, figure) => h("details", {}, h("summary", {}, b.summary), b.blocks.map((one) => block(one, figure))),
  findings: (b) => findingList(b.rows),
  figure: (b, figure) => h("figure", {}, figure(b), h("figcaption", { class: "note" }, b.caption)),
};

const block = (b, figure) => MADE[b.kind]?.(b, figure) ?? null;

/** The sections of a result, with their figures. */
export class Said {
  /**
   * @param {() => Promise<object>} ask what the server says of the result
   * @param {(blocks: object[]) => object[]} order of the blocks of a section
   */
  constructor(ask, order = (blocks) => blocks) {
    this.ask = ask;
    this.order = order;
    this.figures = [];
    this.place = h("div", {});
  }

  close() {
    for (const { view } of this.figures) view.close();
    this.figures = [];
  }

  async load() {
    const { sections } = await this.ask();
    this.place.replaceChildren(...sections.map((s) => {
      const id = unique("said");
      return h("section", { "aria-labelledby": id }, h("h2", { id }, s.title), this.order(s.blocks).map((b) => block(b, (f) => this.figure(f))));
    }));
    for (const { spec, view } of this.figures) view.show(spec);
  }

  figure({ spec, words: name }) {
    const view = new FigureView(name);
    this.figures.push({ spec, view });
    return view.place;
  }
}
