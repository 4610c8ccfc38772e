# SPDX-License-Identifier: BSD-3-Clause
"""What the path of a log says of it: {lot}/{unit}_{date}_{temperature}C.bag."""

from __future__ import annotations

import re
from collections.abc import Mapping
from datetime import UTC, datetime

from allanite.errors import InputError

__all__ = ["PathPattern", "date_of"]

#: Placeholders with a form of their own; any other is text without a slash.
_FORMS = {
    "temperature": r"[-+−]?\d+(?:\.\d+)?",
    "date": r"\d{4}-?\d{2}-?\d{2}(?:[T_ -]?\d{2}[:-]?\d{2}(?:[:-]?\d{2}(?:\.\d+)?)?)?Z?",
}
_TEXT = r"[^/]+?"
_PARTS = re.compile(r"\{([^{}]*)\}|(\*)")


class PathPattern:
    """A pattern that the end of a path is matched with.

    Examples
    --------
    >>> pattern = PathPattern("{lot}/{unit}_{date}_{temperature}C.bag")
    >>> pattern.fields("logs/L7/A-3_2026-10-02_-20C.bag")
    {'lot': 'L7', 'unit': 'A-3', 'date': '2026-10-02', 'temperature': '-20'}
    >>> pattern.fields("logs/readme.txt") is None
    True
    """

    def __init__(self, text: str) -> None:
        self.text = text
        self.names: tuple[str, ...] = ()
        self._matches = re.compile(rf"(?:^|/){self._expression(text)}$")
        if not self.names:
            raise InputError(
                f"the pattern {text!r} has no placeholder: write {{unit}}, as in '{{lot}}/{{unit}}.csv'"
            )

    def _expression(self, text: str) -> str:
        made, end = [], 0
        for part in _PARTS.finditer(text):
            made.append(re.escape(text[end : part.start()]))
            made.append("[^/]*" if part[2] else self._placeholder(part[1]))
            end = part.end()
        return "".join(made) + re.escape(text[end:])

    def _placeholder(self, name: str) -> str:
        if not name.isidentifier():
            raise InputError(
                f"the pattern has a placeholder {{{name}}}: use letters, digits and _ as in {{unit}}"
            )
        if name in self.names:
            return f"(?P={name})"
        self.names = (*self.names, name)
        return f"(?P<{name}>{_FORMS.get(name, _TEXT)})"

    def fields(self, path: str) -> Mapping[str, str] | None:
        """What the placeholders stand for; None where the path does not match."""
        match = self._matches.search(path.replace("\\", "/"))
        return None if match is None else match.groupdict()


def date_of(text: str) -> datetime:
    """A date or a moment: 2026-10-02, 20261002, 2026-10-02T08:30Z; UTC is assumed and dropped.

    Raises
    ------
    ValueError
        No such day.
    """
    match = re.fullmatch(
        r"(\d{4})-?(\d{2})-?(\d{2})(?:[T_ -]?(\d{2})[:-]?(\d{2})(?:[:-]?(\d{2})(\.\d+)?)?)?(Z|[+-]\d{2}:\d{2})?",
        text.strip(),
    )
    if match is None:
        raise ValueError(f"{text!r} is no date: write 2026-10-02 or 2026-10-02T08:30:00")
    year, month, day, hour, minute, second = (int(part or 0) for part in match.groups()[:6])
    moment = datetime(year, month, day, hour, minute, second, int(float(match[7] or 0) * 1e6))
    if match[8] and match[8] != "Z":
        zone = datetime.strptime(match[8], "%z").tzinfo
        return moment.replace(tzinfo=zone).astimezone(UTC).replace(tzinfo=None)
    return moment
