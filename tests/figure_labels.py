# SPDX-License-Identifier: BSD-3-Clause
"""Words in the drawn figures of a report: whether any stand on one another, or outside their figure."""

from __future__ import annotations

from typing import Any

__all__ = ["draw_all", "misplaced_labels", "unfold"]

_LABELS = ".chart-label, .chart-tick, .chart-name"
_MISPLACED = """
(labels) => {
  const wrong = [], slack = 1.5;
  for (const live of document.querySelectorAll(".live")) if (!live.dataset.drawn) wrong.push([live.id, "not drawn"]);
  for (const live of document.querySelectorAll(".chart-picture")) {
    const frame = live.getBoundingClientRect();
    live.id ||= live.closest(".live").id;
    const boxes = [...live.querySelectorAll(labels)]
      .map((e) => [e.textContent.trim(), e.getBoundingClientRect()])
      .filter(([text, b]) => text && b.width);
    for (const [i, [text, b]] of boxes.entries()) {
      const inside = b.left >= frame.left - slack && b.right <= frame.right + slack
        && b.top >= frame.top - slack && b.bottom <= frame.bottom + slack;
      if (!inside) wrong.push([live.id, "cut", text]);
      for (const [other, o] of boxes.slice(0, i)) {
        const over = b.left < o.right - slack && o.left < b.right - slack
          && b.top < o.bottom - slack && o.top < b.bottom - slack;
        if (over) wrong.push([live.id, "overlap", text, other]);
      }
    }
  }
  return wrong;
}
"""


def unfold(view: Any) -> None:
    """Open whatever is folded away."""
    view.locator("details").evaluate_all("all => all.forEach((each) => (each.open = true))")


def draw_all(view: Any) -> None:
    """Bring every figure that is not folded away into view, and wait until it is drawn."""
    places = view.locator(".live:visible")
    for i in range(places.count()):
        places.nth(i).scroll_into_view_if_needed()
        places.nth(i).locator(".chart-picture").first.wait_for(timeout=10_000)


def misplaced_labels(view: Any) -> list[Any]:
    """Labels that overlap or leave their figure, of all figures, which must be drawn."""
    return list(view.evaluate(_MISPLACED, _LABELS))
