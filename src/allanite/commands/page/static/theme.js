// SPDX-License-Identifier: BSD-3-Clause
// Light and dark. Colors are variables of the style, so nothing is drawn again.

const root = document.documentElement;
const preferred = window.matchMedia("(prefers-color-scheme: dark)");

const isDark = () => (root.dataset.theme ? root.dataset.theme === "dark" : preferred.matches);

export function switchable(button) {
  const named = () => (button.textContent = isDark() ? "Light" : "Dark");
  button.addEventListener("click", () => {
    root.dataset.theme = isDark() ? "light" : "dark";
    named();
  });
  preferred.addEventListener("change", named);
  named();
}
