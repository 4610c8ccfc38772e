// SPDX-License-Identifier: BSD-3-Clause
// Numbers as people read them.

/** Four digits, without an exponent where that is short. */
export function digits(value, count = 4) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (value === 0) return "0";
  const size = Math.abs(value);
  if (size >= 1e5 || size < 1e-3) return value.toExponential(count - 1).replace("e+", "e").replace("-", "−");
  return String(Number(value.toPrecision(count))).replace("-", "−");
}

export function duration(seconds) {
  if (seconds === null || seconds === undefined) return "–";
  const [size, unit] =
    seconds < 120 ? [1, "s"] : seconds < 7200 ? [60, "min"] : seconds < 172800 ? [3600, "h"] : [86400, "d"];
  return `${digits(seconds / size, 3)} ${unit}`;
}

export function bytes(size) {
  const step = Math.min(Math.floor(Math.log10(Math.max(size, 1)) / 3), 4);
  return `${digits(size / 1000 ** step, 3)} ${["B", "kB", "MB", "GB", "TB"][step]}`;
}

export const samples = (count) => count.toLocaleString("en").replace(/,/g, "\u202f");

const SYMBOLS = { good: "✓", info: "i", warning: "!", fatal: "✕" };
/** A mark that tells a severity by its shape as well as by its colour. */
export const mark = (severity) => SYMBOLS[severity] || "·";
