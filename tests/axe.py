# SPDX-License-Identifier: BSD-3-Clause
"""axe-core in a page under test: WCAG as far as a program can tell, contrast in both themes among it."""

from __future__ import annotations

from typing import Any

import pytest

__all__ = ["axe_script", "require_axe", "violations"]

_RUN = """
async () => {
  const root = document.documentElement, wrong = [];
  for (const theme of ["light", "dark"]) {
    root.dataset.theme = theme;
    const only = theme === "dark" ? { runOnly: { type: "rule", values: ["color-contrast"] } } : {};
    const { violations } = await axe.run({ resultTypes: ["violations"], ...only });
    wrong.push(...violations.map((v) => [theme, v.id, v.nodes.slice(0, 3).map((n) => n.html.slice(0, 200))]));
  }
  delete root.dataset.theme;
  return wrong;
}
"""


def axe_script() -> str:
    """The script of axe-core, as a package for Python brings it; "" without it."""
    try:
        from axe_playwright_python.sync_playwright import Axe
    except ImportError:
        return ""
    return str(Axe().axe_script)


def require_axe() -> str:
    """The script; the test skips without it."""
    script = axe_script()
    if not script:
        pytest.skip("axe is not installed: pip install axe-playwright-python")
    return script


def violations(page: Any) -> list[Any]:
    """What axe has against a page into which its script was put."""
    return list(page.evaluate(_RUN))
