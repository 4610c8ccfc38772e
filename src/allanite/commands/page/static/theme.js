// SPDX-License-Identifier: BSD-3-Clause
// Light and dark. The server draws figures in one or the other, so views ask and are told of a change.

const root = document.documentElement;
const preferred = window.matchMedia("(prefers-color-scheme: dark)");
const listeners = new Set();

export const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : preferred.matches);

/** Call again when the theme changes; returns what ends that. */
export function onTheme(action) {
  listeners.add(action);
  return () => listeners.delete(action);
}

// As in allanite's figures: told apart by colour-blind eyes, on paper and on a dark ground.
const LIGHT = { x: "#c8442c", y: "#00855f", z: "#0868ac", purple: "#a3578a", orange: "#b97a00", sky: "#3f93c4", ink: "#1b1f24", grid: "#dfe3e8", guide: "#7d858f", paper: "#ffffff", finding: "#d08b00" };
const DARK = { x: "#f0806a", y: "#3cc79b", z: "#64b0ea", purple: "#d291bf", orange: "#e8b04a", sky: "#8cc8ea", ink: "#e6e9ed", grid: "#2c333b", guide: "#929ba6", paper: "#14181d", finding: "#e0a93a" };
export const colours = () => (isDark() ? DARK : LIGHT);

export function switchable(button) {
  const named = () => {
    button.textContent = isDark() ? "Light" : "Dark";
    for (const action of listeners) action();
  };
  button.addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    named();
  });
  preferred.addEventListener("change", named);
  button.textContent = isDark() ? "Light" : "Dark";
}
