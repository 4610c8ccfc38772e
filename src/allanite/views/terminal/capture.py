# SPDX-License-Identifier: BSD-3-Clause
"""A run as text: what happens while it goes, for those who read it later, and what came of it."""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from typing import Any

from allanite.plain_files.counted import plural
from allanite.views.terminal.console import console, is_terminal
from allanite.views.terminal.parts import TONES, say_facts

__all__ = ["journal", "show_captured"]

#: Lines of one kind in so many seconds; the others are counted. Of what lasts, one in an hour.
_LINES, _SPAN = 10, 600.0
_LASTING, _HOUR = frozenset({"disk"}), 3600.0
_NAMED = ("maker", "model", "serial")
_WHOLE = "Nothing is missing"
_ENDED = {"success": " No more samples came before the planned end: {}.", "abort": " Stopped by {}."}


def journal() -> Callable[[str, Mapping[str, Any]], None] | None:
    """Something that writes a line on stderr for what happens in a run; None where stderr is a terminal.

    A terminal has a bar that says it; a journal and a log file have lines: of one kind ten in ten minutes at most.
    """
    return None if is_terminal(sys.stderr) or sys.stderr is None else _Journal().tell


class _Journal:
    """Counts the lines of each kind."""

    def __init__(self) -> None:
        self._said: dict[str, tuple[float, int]] = {}  # since when, and how many

    def tell(self, kind: str, facts: Mapping[str, Any]) -> None:
        if kind == "ended":
            self._end()
            return
        now = time.monotonic()
        most, span = (1, _HOUR) if kind in _LASTING else (_LINES, _SPAN)
        since, lines = self._said.get(kind, (now, 0))
        if now - since >= span:
            if lines > most and kind not in _LASTING:
                self._write(f"{lines - most} more lines like the next one were left out")
            since, lines = now, 0
        self._said[kind] = since, lines + 1
        if lines < most:
            self._write(_WORDS.get(kind, _any)(facts))

    def _end(self) -> None:
        """Count what was left out and no later line has told of."""
        for kind, (_, lines) in self._said.items():
            if lines > _LINES and kind not in _LASTING:
                was = "was" if lines - _LINES == 1 else "were"
                self._write(f"{plural(lines - _LINES, 'more line')} on a {kind} {was} left out")

    @staticmethod
    def _write(words: str) -> None:
        sys.stderr.write(f"allanite: {words}\n")
        sys.stderr.flush()


def _begun(facts: Mapping[str, Any]) -> str:
    return f"recording {' '.join(facts[key] for key in _NAMED if facts[key])} into {facts['folder']}"


def _going(facts: Mapping[str, Any]) -> str:
    share = "" if facts["share"] is None else f", {100 * facts['share']:.1f} % of the planned duration"
    return f"{facts['samples']} samples, {facts['missing']} missing{share}"


def _any(facts: Mapping[str, Any]) -> str:
    return ", ".join(f"{name} {value}" for name, value in facts.items())


_WORDS: Mapping[str, Callable[[Mapping[str, Any]], str]] = {
    "begun": _begun,
    "going": _going,
    "silence": lambda facts: f"the instrument is silent: {facts['reason']}",
    "lost": lambda facts: f"the link is lost, and restored: {facts['reason']}",
    "reconnected": lambda facts: f"the instrument is back, at attempt {facts['attempt']}",
    "remark": lambda facts: str(facts["text"]),
    "gap": lambda facts: (
        f"{plural(facts['samples'], 'sample', 'are missing')} from number {facts['counter']} on: {facts['reason']}"
    ),
    "rate": lambda facts: str(facts["text"]),
    "change": lambda facts: f"{facts['text']}: another part of the run begins",
    "clock": lambda facts: f"{facts['text']}; no interval is affected",
    "disk": lambda facts: str(facts["text"]),
}


def show_captured(document: Mapping[str, Any]) -> None:
    """What was recorded, what is missing, and where it is."""
    from rich.text import Text

    out = console()
    verdict = _verdict(document)
    ended = _ENDED[document["status"]].format(document["reason"]) if document["reason"] else ""
    out.print(Text(f"{verdict}.", TONES["good" if verdict == _WHOLE else "warning"]) + Text(ended))
    named = (document["instrument"][part] for part in _NAMED)
    say_facts(
        out,
        ("instrument", " ".join(part for part in named if part)),
        ("recorded", plural(document["samples"], "sample")),
        ("gaps", _gaps(document)),
        *([("without a value", plural(document["overloads"], "sample"))] if document["overloads"] else []),
        *([("doubtful", plural(document["doubtful"], "sample"))] if document["doubtful"] else []),
        *([("rate", _rate(document))] if document["rate_measured"] else []),
        *([("remarks", _remarks(document))] if document["remarks"] else []),
        ("run", document["folder"]),
    )


def _verdict(document: Mapping[str, Any]) -> str:
    """All that keeps a run from being whole."""
    states = (
        ("missing", "is missing", "are missing"),
        ("overloads", "has no value", "have no value"),
        ("doubtful", "is doubtful", "are doubtful"),
    )
    shortfalls = [f"{n} {one if n == 1 else many}" for key, one, many in states if (n := document[key])]
    if not document["samples"] and not shortfalls:
        return "No sample was recorded"
    if document["rate_measured"]:
        shortfalls.append("the rate is not the stated one")
    if not shortfalls:
        return _WHOLE
    first, rest = shortfalls[0].split(" ", 1)
    if first.isdecimal():
        shortfalls[0] = f"{first} sample{'' if first == '1' else 's'} {rest}"
    listed = " and ".join(part for part in (", ".join(shortfalls[:-1]), shortfalls[-1]) if part)
    return listed if document["missing"] else f"{_WHOLE}, but {listed}"


def _rate(document: Mapping[str, Any]) -> str:
    return f"{document['rate_measured']:.4g} Hz by the host's clock, {document['rate']:.6g} Hz stated"


def _remarks(document: Mapping[str, Any]) -> str:
    """How many, and how many of them have a line in the manifest."""
    count, noted = document["remarks"], document["remarks_noted"]
    return f"{count}, in manifest.jsonl" if noted == count else f"{count}, {noted} of them in manifest.jsonl"


def _gaps(document: Mapping[str, Any]) -> str:
    if not document["gaps"]:
        return "none"
    slow = (
        f", {plural(document['dropped'], 'sample')} because the host was too slow"
        if document["dropped"]
        else ""
    )
    return f"{document['gaps']}{slow}"
