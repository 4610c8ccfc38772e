// The report's own script: draws each figure when it comes into view, in the colours of the theme.
(function () {
  "use strict";
  const root = document.documentElement;
  const { figures, palettes } = JSON.parse(document.getElementById("figure-data").textContent);
  const prefersDark = window.matchMedia("(prefers-color-scheme: dark)");
  const drawn = new Set();
  const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : prefersDark.matches);

  const alpha = (colour, share) => {
    const part = (i) => parseInt(colour.slice(i, i + 2), 16);
    return `rgba(${part(1)},${part(3)},${part(5)},${share})`;
  };
  const shareOf = (rgba) => (/,([\d.]+)\)$/.exec(rgba) || [0, "0.2"])[1];

  // Colours travel as names (meta of a trace, name of an annotation or shape); this gives them their values.
  function themed(spec) {
    const colours = palettes[isDark() ? "dark" : "light"];
    const { data, layout } = JSON.parse(JSON.stringify(spec));
    for (const trace of data) {
      const colour = colours[trace.meta];
      if (trace.line) trace.line.color = colour;
      if (trace.fillcolor) trace.fillcolor = alpha(colour, shareOf(trace.fillcolor));
      if (trace.marker && trace.marker.line) Object.assign(trace.marker, { color: colours.paper, line: { color: colour, width: 1.5 } });
      else if (trace.marker) trace.marker.color = colour;
    }
    for (const note of layout.annotations) {
      note.font = { ...note.font, color: colours[note.name] };
      note.arrowcolor = colours[note.name];
      if (note.bgcolor) note.bgcolor = alpha(colours.paper, 0.8);
    }
    for (const shape of layout.shapes) {
      if (shape.fillcolor) shape.fillcolor = colours[shape.name];
      shape.line.color = colours[shape.name];
    }
    for (const key of Object.keys(layout).filter((k) => /^[xy]axis/.test(k))) {
      Object.assign(layout[key], { gridcolor: colours.grid, linecolor: colours.guide, tickcolor: colours.guide });
    }
    layout.font.color = colours.ink;
    layout.hoverlabel = { bgcolor: colours.paper, bordercolor: colours.guide, font: { color: colours.ink } };
    layout.modebar = { bgcolor: "rgba(0,0,0,0)", color: colours.guide, activecolor: colours.ink };
    layout.uirevision = "kept"; // a change of theme keeps the zoom
    return { data, layout };
  }

  // The drawing keeps its proportions: one decade up is one decade across at every width.
  function sized(layout, width) {
    const { margin, meta } = layout;
    const wanted = (width - margin.l - margin.r) * meta.aspect;
    layout.width = width;
    layout.height = Math.round(Math.max(wanted, meta.tall || 0, 190) + margin.t + margin.b);
    return layout;
  }

  // So do the words of a drawing.
  function lettered(layout, width) {
    const share = Math.min(width / (layout.meta.drawn_at || width), 1);
    for (const note of layout.annotations) note.font.size *= share;
    return layout;
  }

  // A switch per channel: what a figure shows of each. Its entry in the legend is the switch itself.
  const MARKS = {
    circle: "M8 6a4 4 0 1 0 8 0a4 4 0 1 0-8 0", square: "M8 2h8v8h-8z", triangle: "M12 1.5l4.6 8h-9.2z",
    diamond: "M12 1l5 5l-5 5l-5-5z", down: "M12 10.5l4.6-8h-9.2z", cross: "M8 2l8 8M16 2l-8 8", line: "",
  };
  const hidden = new Map();

  function swatch(colour, marker) {
    const drawing = document.createElementNS("http://www.w3.org/2000/svg", "svg");
    drawing.setAttribute("viewBox", "0 0 24 12");
    drawing.setAttribute("aria-hidden", "true");
    const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
    path.setAttribute("d", `M0 6h24${MARKS[marker] || ""}`);
    path.setAttribute("style", `fill: var(--of-${colour}); stroke: var(--of-${colour}); stroke-width: 2`);
    drawing.append(path);
    return drawing;
  }

  function addSwitches(place) {
    const switches = figures[place.id].layout.meta.switches || [];
    if (!switches.length) return;
    const row = place.parentElement.querySelector(".switches"), off = new Set();
    hidden.set(place, off);
    for (const [group, name, colour, marker] of switches) {
      const label = document.createElement("label"), box = document.createElement("input");
      Object.assign(box, { type: "checkbox", checked: true, value: name });
      box.addEventListener("change", () => {
        off[box.checked ? "delete" : "add"](group);
        draw(place);
      });
      label.append(box, swatch(colour, marker), name);
      row.append(label);
    }
    row.hidden = false;
  }

  function shown(data, place) {
    const off = hidden.get(place);
    if (!off) return;
    const groups = new Set(figures[place.id].layout.meta.switches.map(([group]) => group));
    for (const trace of data.filter((t) => groups.has(t.legendgroup))) {
      trace.visible = !off.has(trace.legendgroup);
      trace.showlegend = false;
    }
  }

  // A title that is longer than its axis takes two lines, and so do words at ticks that would touch; a decade that is
  // too short for its number has none.
  function fitted(layout, width) {
    const height = layout.height - layout.margin.t - layout.margin.b;
    for (const key of Object.keys(layout).filter((k) => /^[xy]axis/.test(k))) {
      const axis = layout[key], [low, high] = axis.domain || [0, 1], text = axis.title?.text || "";
      const room = (high - low) * (key[0] === "y" ? height : width - layout.margin.l - layout.margin.r);
      if (axis.type === "log" && axis.range) axis.dtick = spacing(Math.abs(axis.range[1] - axis.range[0]), room);
      if (key[0] === "x" && axis.ticktext) named(layout, axis, room / axis.ticktext.length);
      if (text.length * 8 < room || !text.includes(" ")) continue;
      const blanks = [...text.matchAll(/ /g)].map((m) => m.index);
      const middle = blanks.reduce((a, b) => (Math.abs(b - text.length / 2) < Math.abs(a - text.length / 2) ? b : a));
      if (key[0] === "y") axis.automargin = true;
      axis.title = { ...axis.title, text: `${text.slice(0, middle)}<br>${text.slice(middle + 1)}` };
      if (key[0] === "x") below(layout, 16);
    }
    return layout;
  }

  function below(layout, more) {
    layout.margin = { ...layout.margin, b: layout.margin.b + more };
    layout.height += more;
  }

  function named(layout, axis, room) {
    const lines = axis.ticktext.flatMap((t) => t.split("<br>"));
    if (Math.max(...lines.map((t) => t.length)) * 7 < room) return;
    axis.ticktext = axis.ticktext.map((t) => t.replaceAll(" ", "<br>"));
    Object.assign(axis, { tickangle: 0, tickfont: { size: 10.5 } });
    below(layout, 16 * (Math.max(...axis.ticktext.map((t) => t.split("<br>").length)) - 1));
  }

  // A legend of many rows takes its room from the page, not from the axes.
  function roomy(place, height) {
    const { h } = place._fullLayout._size, { margin } = place.layout;
    const lost = Math.round(height - margin.t - margin.b - h);
    return Promise.resolve(lost > 4 ? Plotly.relayout(place, { height: height + lost }) : null).then(() => cleared(place));
  }

  // Words stand clear of one another and inside the figure: beside their point on another side, or not at all where
  // there is no room for them. All that they say stands in the tables.
  function cleared(place) {
    const notes = place.layout.annotations || [], frame = place.querySelector(".main-svg").getBoundingClientRect();
    const taken = [...place.querySelectorAll(".legend, .xtick text, .ytick text, .g-xtitle, .g-ytitle")].map((e) => e.getBoundingClientRect());
    const free = (b) => b.left >= frame.left && b.right <= frame.right && b.top >= frame.top && b.bottom <= frame.bottom
      && taken.every((t) => b.right <= t.left || b.left >= t.right || b.bottom <= t.top || b.top >= t.bottom);
    const wanted = {};
    const rank = (note) => (note.textangle ? 2 : note.yref.endsWith("domain") ? 0 : 1);
    const order = notes.map((note, i) => [note, i]).filter(([note]) => note.text).sort(([a], [b]) => rank(a) - rank(b));
    for (const [note, i] of order) {
      const words = place.querySelector(`.annotation[data-index="${i}"] .annotation-text-g`);
      if (!words) continue;
      const box = words.getBoundingClientRect();
      const side = placements(note, box).find((s) => free(s.box));
      if (side) taken.push(side.box);
      for (const [key, value] of Object.entries(side ? side.change : { visible: false })) wanted[`annotations[${i}].${key}`] = value;
    }
    if (Object.keys(wanted).length) Plotly.relayout(place, wanted);
  }

  function placements(note, box) {
    const here = [{ box, change: {} }];
    if (note.textangle || note.yanchor !== "middle" || note.yref.endsWith("domain")) return here;
    const { xshift = 0, yshift = 0, xanchor } = note, wide = box.width, high = box.height;
    const x = (xanchor === "left" ? box.left : xanchor === "right" ? box.right : box.left + wide / 2) - xshift;
    const y = box.top + high / 2 + yshift;
    const across = [["left", 8], ["right", -8], ["center", 0]], up = [yshift, -yshift, 14, -14];
    for (const dy of up) {
      for (const [anchor, dx] of across) {
        if (!dx && !dy) continue;
        const left = x + dx - (anchor === "right" ? wide : anchor === "center" ? wide / 2 : 0), top = y - dy - high / 2;
        here.push({ box: new DOMRect(left, top, wide, high), change: { xanchor: anchor, xshift: dx, yshift: dy } });
      }
    }
    return here;
  }

  function draw(place) {
    if (!place.clientWidth) return;
    const { data, layout } = themed(figures[place.id]);
    shown(data, place);
    const config = {
      displaylogo: false,
      plotlyServerURL: "", // nothing of a report leaves the machine
      modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d", "sendChartToCloud"],
    };
    const width = Math.max(place.clientWidth, layout.meta.least || 0);
    Plotly.react(place, data, fitted(lettered(sized(layout, width), width), width), config).then(() => roomy(place, layout.height));
    if (!drawn.has(place)) place.on("plotly_relayout", () => ticked(place));
    drawn.add(place);
  }

  // Logarithmic axes have a tick per decade; zoomed in to less than two decades they need more.
  function ticked(place) {
    const wanted = {};
    for (const key of Object.keys(place.layout).filter((k) => /^[xy]axis/.test(k))) {
      const axis = place.layout[key];
      if (axis.type !== "log") continue;
      const step = spacing(Math.abs(axis.range[1] - axis.range[0]), place._fullLayout[key]._length);
      if (axis.dtick !== step) wanted[`${key}.dtick`] = step;
    }
    if (Object.keys(wanted).length) Plotly.relayout(place, wanted);
  }
  const spacing = (decades, length) => (decades > 2 ? Math.ceil((34 * decades) / length) : decades > 1 ? "D2" : "D1");

  root.classList.add("js");
  const places = [...document.querySelectorAll(".live")];
  const recolour = () => Object.entries(palettes[isDark() ? "dark" : "light"]).forEach(([name, value]) => root.style.setProperty(`--of-${name}`, value));
  recolour();
  places.forEach(addSwitches);
  for (const place of places) place.style.minHeight = `${sized({ ...figures[place.id].layout }, Math.max(place.clientWidth, figures[place.id].layout.meta.least || 0)).height}px`;
  const watcher = new IntersectionObserver(
    (entries) => {
      for (const entry of entries) {
        if (!entry.isIntersecting) continue;
        watcher.unobserve(entry.target);
        draw(entry.target);
        entry.target.style.minHeight = "";
      }
    },
    { rootMargin: "600px" },
  );
  places.forEach((place) => watcher.observe(place));

  // A link to a part that is folded away unfolds it.
  const unfold = () => {
    const fold = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)))?.querySelector(":scope > details");
    if (fold) fold.open = true;
  };
  unfold();
  document.querySelector("nav").addEventListener("click", () => setTimeout(unfold));

  // Paper has no fold: what nobody opened or scrolled to is there before it is printed.
  let folded = [];
  window.addEventListener("afterprint", () => folded.splice(0).forEach((each) => (each.open = false)));
  window.addEventListener("beforeprint", () => {
    folded = [...document.querySelectorAll("details:not([open])")];
    for (const each of folded) each.open = true;
    for (const place of places) {
      if (drawn.has(place)) continue;
      watcher.unobserve(place);
      draw(place);
      place.style.minHeight = "";
    }
  });

  // What scrolls sideways can be reached and scrolled with the keyboard.
  function reachable() {
    for (const each of document.querySelectorAll(".wide, .live")) {
      if (each.scrollWidth <= each.clientWidth) each.removeAttribute("tabindex");
      else each.tabIndex = 0;
      if (each.tabIndex === 0 && !each.hasAttribute("role")) {
        each.setAttribute("role", "group");
        each.setAttribute("aria-label", each.querySelector("caption")?.textContent || "Table");
      }
    }
  }
  reachable();
  document.addEventListener("toggle", reachable, true);

  let waiting = 0;
  window.addEventListener("resize", () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => {
      drawn.forEach(draw);
      reachable();
    }, 120);
  });

  const theme = document.getElementById("theme");
  const labelled = () => (theme.textContent = isDark() ? "Light" : "Dark");
  theme.hidden = false;
  labelled();
  theme.addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    labelled();
    recolour();
    drawn.forEach(draw);
  });
  prefersDark.addEventListener("change", () => {
    labelled();
    recolour();
    drawn.forEach(draw);
  });
  const print = document.getElementById("print");
  print.hidden = false;
  print.addEventListener("click", () => window.print());
})();
