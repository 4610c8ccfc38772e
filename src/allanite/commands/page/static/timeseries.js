// SPDX-License-Identifier: BSD-3-Clause
// Panels of series over time, one above the other, as the script of the figures draws them.

const ORDER = ["x", "y", "z", "purple", "orange", "sky"];
const STYLES = ["thin", "dashed", "dotted"];

/** How the channel of a number among those of its kind is drawn. */
export const look = (i) => ({ colour: ORDER[i % ORDER.length], style: STYLES[Math.floor(i / ORDER.length) % STYLES.length] });

/** Ends a little outside all values. */
function around(curves) {
  let low = Infinity, high = -Infinity;
  for (const { y } of curves) {
    for (const value of y) {
      if (value === null) continue;
      if (value < low) low = value;
      if (value > high) high = value;
    }
  }
  if (low > high) return [0, 1];
  const room = 0.05 * (high - low) || 0.05 * Math.abs(low) || 0.05;
  return [low - room, high + room];
}

/**
 * A panel.
 * @param {object[]} curves with their x in seconds, y, label and look
 * @param {{label: string, range: number[], height: number, last: boolean, spans?: object[]}} facts
 */
export function timePanel(curves, { label, range, height, last, spans = [] }) {
  const legend = curves.length > 1 ? curves.map((c) => ({ words: c.label, colour: c.colour, style: c.style, kind: "line" })) : [];
  const x = { label: last ? "Time since the first sample [s]" : "", limits: range };
  return { x, y: { label, limits: around(curves) }, curves, spans, legend, key: "above", height, numbered: last };
}
