# SPDX-License-Identifier: BSD-3-Clause
"""Numbers with powers as a page of HTML shows them."""

from __future__ import annotations

import re
from collections.abc import Sequence
from urllib.parse import quote

from markupsafe import Markup, escape

from allanite.plain_files.printable import printable

__all__ = ["with_links", "with_powers"]


def with_powers(text: str) -> Markup:
    """Text with exponents as people write them: 1.2e-05 becomes 1.2 × 10 to the minus five.

    An interval whose ends share an exponent gets it once: [1.1, 1.3] × 10 to the minus five.
    """
    safe = _MINUS.sub("−", _SHARED.sub(r"[\1, \3]e\2", printable(str(escape(text)), lines=True)))
    safe = safe.replace("T_b", "<i>T</i><sub>b</sub>").replace("B_equiv", "<i>B</i><sub>equiv</sub>")
    safe = _RAISED.sub(lambda m: f"<sup>{m[1].replace('-', '−')}</sup>", safe)
    return Markup(_POWER.sub(lambda m: f"{m[1]}\u202f×\u202f10<sup>{_exponent(m[2])}</sup>", safe))  # noqa: S704 - escaped above


def with_links(text: Markup, names: Sequence[str]) -> Markup:
    """Text in which the names of files are links to them."""
    links = {str(escape(name)): quote(name) for name in names}
    if not any(name in text for name in links):
        return text
    longest_first = "|".join(map(re.escape, sorted(links, key=len, reverse=True)))
    pattern = re.compile(rf"(?<![\w./-])(?:{longest_first})(?![\w/-]|\.\w)")
    return Markup(pattern.sub(lambda m: f'<a href="{links[m[0]]}">{m[0]}</a>', text))  # noqa: S704 - escaped above


_SHARED = re.compile(r"\[([\d.]+)e([+-]\d+), ([\d.]+)e\2\]")
_MINUS = re.compile(r"(?<![\w.])-(?=\d)")
_RAISED = re.compile(r"(?<=[a-z\d])\^([−-]?\d+(?:\.\d+)?)")
_POWER = re.compile(r"([\d\]])e([+-]\d+)")


def _exponent(digits: str) -> str:
    return str(int(digits)).replace("-", "−")
