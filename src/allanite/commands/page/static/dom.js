// SPDX-License-Identifier: BSD-3-Clause
// Elements. Names, units and messages come from foreign files: they become text, never markup.

/**
 * Make an element: h("button", {class: "main", onclick: f}, "Fit").
 * Properties that begin with "on" are listeners; true and false set and leave out; null children are left out.
 */
export function h(tag, properties = {}, ...children) {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(properties)) {
    if (value === null || value === undefined || value === false) continue;
    if (name.startsWith("on")) made.addEventListener(name.slice(2), value);
    else if (name === "value" || name === "checked" || name === "disabled" || name === "hidden") made[name] = value;
    else made.setAttribute(name, value === true ? "" : String(value));
  }
  made.append(...children.flat(3).filter((child) => child !== null && child !== undefined && child !== false));
  return made;
}

const nameOf = (element) => element.getAttribute("aria-label") || element.getAttribute("href") || element.name || element.textContent;

const folds = (place) => [...place.querySelectorAll("details")];
const titleOf = (fold) => fold.querySelector("summary")?.textContent;

/** Put these in place of what an element holds; who works with the keyboard stays where they are, what is unfolded stays so. */
export function fill(place, ...children) {
  const held = place.contains(document.activeElement) ? document.activeElement : null;
  const alike = () => [...place.querySelectorAll(held.tagName)];
  const number = held ? alike().indexOf(held) : -1;
  const unfolded = folds(place).map((fold) => fold.open && titleOf(fold));
  place.replaceChildren(...children.flat(3).filter((child) => child !== null && child !== undefined && child !== false));
  folds(place).forEach((fold, i) => (fold.open ||= unfolded[i] === titleOf(fold)));
  if (held && held !== place) {
    const found = alike();
    (found.find((e) => nameOf(e) === nameOf(held)) || found[number])?.focus({ preventScroll: true });
  }
  return place;
}

let count = 0;
/** An id that no other element has. */
export const unique = (word) => `${word}-${++count}`;

/** Say something that must not be missed; "" takes it away. */
export function notice(message, kind = "fatal") {
  const place = document.getElementById("main-notice");
  if (!message) return fill(place);
  const close = h("button", { type: "button", class: "quiet", onclick: () => fill(place) }, "Close");
  return fill(place, h("div", { class: `banner ${kind}` }, h("span", {}, message), close));
}

/** A listener whose refusals are said. */
export const said = (action) => async (event) => {
  try {
    await action(event);
  } catch (error) {
    if (error.name !== "AbortError") notice(error.message);
  }
};
