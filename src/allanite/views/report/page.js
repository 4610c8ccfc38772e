// The report's own script: draws each figure when it comes into view. Colors are those of the style, so a change of
// theme draws nothing again.
(function () {
  "use strict";
  const root = document.documentElement;
  const figures = JSON.parse(document.getElementById("figure-data").textContent);
  const prefersDark = window.matchMedia("(prefers-color-scheme: dark)");
  const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : prefersDark.matches);
  const charts = new Map();

  function draw(place) {
    watcher.unobserve(place);
    if (!charts.has(place)) {
      charts.set(place, new AllaniteChart(place));
      charts.get(place).show(figures[place.id]);
    } else charts.get(place).draw();
    if (place.dataset.drawn) place.style.minHeight = "";
  }

  root.classList.add("js");
  const places = [...document.querySelectorAll(".live")];
  for (const place of places) place.style.minHeight = `${AllaniteChart.roughHeight(figures[place.id], place.clientWidth)}px`;
  const watcher = new IntersectionObserver(
    (entries) => {
      for (const entry of entries) if (entry.isIntersecting) draw(entry.target);
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
    for (const place of places) if (!charts.has(place)) draw(place);
  });

  // What scrolls sideways can be reached and scrolled with the keyboard.
  function reachable() {
    for (const each of document.querySelectorAll(".wide")) {
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
      for (const chart of charts.values()) chart.draw();
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
  });
  prefersDark.addEventListener("change", labelled);
  const print = document.getElementById("print");
  print.hidden = false;
  print.addEventListener("click", () => window.print());
})();
