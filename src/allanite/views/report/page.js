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
    layout.height = Math.round(Math.max(wanted, 160) + margin.t + margin.b);
    return layout;
  }

  // So do the words of a drawing.
  function lettered(layout, width) {
    const share = Math.min(width / (layout.meta.drawn_at || width), 1);
    for (const note of layout.annotations) note.font.size *= share;
    return layout;
  }

  function draw(place) {
    if (!place.clientWidth) return;
    const { data, layout } = themed(figures[place.id]);
    const config = {
      displaylogo: false,
      plotlyServerURL: "", // nothing of a report leaves the machine
      modeBarButtonsToRemove: ["select2d", "lasso2d", "autoScale2d", "sendChartToCloud"],
    };
    const width = Math.max(place.clientWidth, layout.meta.least || 0);
    Plotly.react(place, data, lettered(sized(layout, width), width), config);
    if (!drawn.has(place)) place.on("plotly_relayout", () => ticked(place));
    drawn.add(place);
  }

  // Logarithmic axes have a tick per decade; zoomed in to less than two decades they need more.
  function ticked(place) {
    const wanted = {};
    for (const key of Object.keys(place.layout).filter((k) => /^[xy]axis/.test(k))) {
      const axis = place.layout[key];
      if (axis.type !== "log") continue;
      const step = spacing(Math.abs(axis.range[1] - axis.range[0]));
      if (axis.dtick !== step) wanted[`${key}.dtick`] = step;
    }
    if (Object.keys(wanted).length) Plotly.relayout(place, wanted);
  }
  const spacing = (decades) => (decades > 2 ? 1 : decades > 1 ? "D2" : "D1");

  root.classList.add("js");
  const places = [...document.querySelectorAll(".live")];
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

  // Paper has no fold: what nobody scrolled to is drawn before it is printed.
  window.addEventListener("beforeprint", () => {
    for (const place of places) {
      if (drawn.has(place)) continue;
      watcher.unobserve(place);
      draw(place);
      place.style.minHeight = "";
    }
  });

  let waiting = 0;
  window.addEventListener("resize", () => {
    clearTimeout(waiting);
    waiting = setTimeout(() => drawn.forEach(draw), 120);
  });

  const theme = document.getElementById("theme");
  const named = () => (theme.textContent = isDark() ? "Light" : "Dark");
  theme.hidden = false;
  named();
  theme.addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    named();
    drawn.forEach(draw);
  });
  prefersDark.addEventListener("change", () => {
    named();
    drawn.forEach(draw);
  });
  const print = document.getElementById("print");
  print.hidden = false;
  print.addEventListener("click", () => window.print());
})();
