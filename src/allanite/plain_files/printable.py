# SPDX-License-Identifier: BSD-3-Clause
"""Text from instruments, files and file names, made safe to show: what commands a terminal becomes an escape.

A name that holds ``ESC ] 0 ;`` sets the title of a window, U+202E turns the rest of a line around, U+009B does what
``ESC [`` does. Shown as escapes they are seen and do nothing.

References
----------
.. [1] Unicode Standard, section 4.5: the categories Cc, Cf, Cs, Zl and Zp.
.. [2] RFC 8259, section 7: the form of the escapes, so that JSON that holds one stays JSON.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Any

__all__ = ["Shielded", "printable"]

#: Categories Cc, Cf, Cs, Zl and Zp up to Unicode 16, and the rest of the two blocks that hold nothing else.
_UNSHOWN = (
    "\x00-\x1f\x7f-\x9f\xad\u0600-\u0605\u061c\u06dd\u070f\u0890\u0891\u08e2\u180e\u200b-\u200f\u2028-\u202e"
    "\u2060-\u206f\ud800-\udfff\ufeff\ufff0-\ufffb\U000110bd\U000110cd\U00013430-\U0001343f"
    "\U0001bca0-\U0001bca3\U0001d173-\U0001d17a\U000e0000-\U000e0fff"
)
_IN_A_LINE = re.compile(f"[{_UNSHOWN}]")
_IN_LINES = re.compile(f"(?![\t\n])[{_UNSHOWN}]")
_SHORT = {"\b": "\\b", "\t": "\\t", "\n": "\\n", "\f": "\\f", "\r": "\\r"}


def printable(text: str, *, lines: bool = False) -> str:
    r"""Text in which nothing is hidden: control and format characters as the escapes of JSON.

    Parameters
    ----------
    lines : bool
        The text has lines of its own: line feeds and tabs stay.

    >>> print(printable("gyro\x1b[31m_x\n"))
    gyro\u001b[31m_x\n
    """
    return (_IN_LINES if lines else _IN_A_LINE).sub(_escape, text)


def _escape(match: re.Match[str]) -> str:
    sign = match[0]
    code = ord(sign)
    if code > 0xFFFF:  # two escapes, as JSON writes it
        return f"\\u{0xD800 + (code - 0x10000 >> 10):04x}\\u{0xDC00 + (code & 0x3FF):04x}"
    return _SHORT.get(sign) or f"\\u{code:04x}"


class Shielded:
    """A text stream that shows what is written to it as `printable` does."""

    def __init__(self, stream: Any) -> None:
        self.bare: Any = stream.bare if isinstance(stream, Shielded) else stream

    def write(self, text: str | bytes) -> int:
        """Write text; the number of its characters. Click has encoded what it gives a shell for completion."""
        words = text if isinstance(text, str) else text.decode("utf-8", "replace")
        self.bare.write(printable(words, lines=True))
        return len(text)

    def writelines(self, lines: Iterable[str]) -> None:
        """Write one after the other."""
        for line in lines:
            self.write(line)

    def __getattr__(self, name: str) -> Any:
        if name == "buffer":  # a way round: click takes it where it does not like the encoding
            raise AttributeError(name)
        return getattr(self.bare, name)
