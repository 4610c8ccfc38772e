# SPDX-License-Identifier: BSD-3-Clause
"""What counts as equal: text exactly, numbers of a document or a table within a tolerance.

A document becomes lines ``path: value``. A long list of numbers becomes how many there are, its ends, and three
weighted sums as shares of the sum of its absolute values: one number that changes by more than the tolerance times
that sum shows.
"""

from __future__ import annotations

import difflib
import hashlib
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import Any

import numpy as np

__all__ = ["CURVES", "FITTED", "difference", "lines_of", "list_line"]

CURVES, FITTED = 1e-12, 1e-6
_LONG, _ENDS = 16, 3
#: What does not depend on a fit; 15 digits of it are kept, 9 of everything else.
_EXACT = {"tau", "lags", "deviation", "count", "dt", "samples", "n_samples", "density"}
_NUMBER = re.compile(r"(?<![\w.])[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?(?![\w.]*[A-Za-z_])|\bnan\b|-?\binf\b")
_MARK = {True: "=", False: "~"}
#: In plain text numbers of so many digits are compared as numbers, all others as text.
_MANY_DIGITS = re.compile(r"(?<![\w.])-?\d+\.\d{9,}(?:e[-+]\d+)?")


def lines_of(value: Any, path: str = "", exact: bool = False) -> Iterator[str]:
    """Lines of a plain document: ``path = value`` where 1e-12 holds, ``path ~ value`` where 1e-6 does."""
    if isinstance(value, dict):
        for key, inner in value.items():
            yield from lines_of(inner, f"{path}.{key}" if path else str(key), exact)
        if not value:
            yield f"{path} = {{}}"
    elif isinstance(value, list):
        if value and all(_is_number(v) for v in value):
            yield list_line(path, [math.nan if v is None else float(v) for v in value], exact)
        elif len(value) > _LONG and _is_table(value):
            for k, column in enumerate(zip(*value, strict=True)):
                yield from lines_of(list(column), f"{path}[:, {k}]", exact)
        else:
            words = all(isinstance(v, str) for v in value)
            for i, inner in enumerate(value):
                yield from lines_of(inner, f"{path}[]" if words else f"{path}[{i}]", exact)
            if not value:
                yield f"{path} = []"
    elif _is_number(value) and value is not None:
        yield list_line(path, [float(value)], exact)
    else:
        yield f"{path} = {value!r}"


def _is_table(value: list[Any]) -> bool:
    """Whether a list holds rows of numbers of one length."""
    return all(isinstance(row, list) and row and all(_is_number(v) for v in row) for row in value) and (
        len({len(row) for row in value}) == 1
    )


def list_line(path: str, values: Sequence[float], exact: bool = False) -> str:
    """One line for a list of numbers."""
    exact = exact or re.split(r"[.\[\] ]+", path.rstrip("0123456789[]:, "))[-1] in _EXACT
    digits = 15 if exact else 9

    def words(numbers: Sequence[float]) -> str:
        return " ".join(f"{v:.{digits}g}" for v in numbers)

    head = f"{path} {_MARK[exact]} "
    if len(values) <= _LONG:
        return head + words(values)
    x = np.nan_to_num(np.asarray(values), nan=0.0, posinf=0.0, neginf=0.0)
    total, k = float(np.abs(x).sum()), np.arange(x.size)
    weights = (np.ones(x.size), np.sin(1.0 + k), np.cos(0.7 * k * k))
    sums = [float(w @ x) / total if total else 0.0 for w in weights]
    shares = " ".join(f"{round(s, 13) + 0.0:.13f}" for s in sums)
    lost = sum(not math.isfinite(v) for v in values)
    ends = f"{words(values[:_ENDS])} .. {words(values[-_ENDS:])}"
    return f"{head}{len(values)} numbers, {lost} not finite, {ends}, sum {words([total])}, shares {shares}"


def _is_number(value: Any) -> bool:
    return value is None or (isinstance(value, int | float) and not isinstance(value, bool))


def difference(door: str, frozen: str, now: str, fitted: float = FITTED) -> list[str]:
    """A unified diff of the lines that are not equal; none where all are."""
    before, after = frozen.splitlines(), now.splitlines()
    match = difflib.SequenceMatcher(
        None, *([_skeleton(x) for x in side] for side in (before, after)), autojunk=False
    )
    for i, j, n in match.get_matching_blocks():
        for k in range(n):
            if alike(before[i + k], after[j + k], fitted):
                after[j + k] = before[i + k]
    return list(difflib.unified_diff(before, after, f"frozen/{door}", f"now/{door}", lineterm="", n=1))


def _skeleton(line: str) -> str:
    """A line without the numbers that are compared as such."""
    start, numbers, _ = _numbers(line)
    return line[:start] + numbers.sub("#", line[start:])


def _numbers(line: str) -> tuple[int, re.Pattern[str], bool]:
    """Where numbers begin to be compared, which, and whether by the tighter tolerance."""
    mark = re.match(r"(.*?) ([=~]) (?=[-\d.]|nan|inf)", line)
    return (mark.end(), _NUMBER, mark[2] == "=") if mark else (0, _MANY_DIGITS, False)


def alike(a: str, b: str, fitted: float = FITTED) -> bool:
    """Whether two lines say the same."""
    if a == b:
        return True
    if _skeleton(a) != _skeleton(b):
        return False
    start, numbers, exact = _numbers(a)
    parts = zip(a[start:].split(", "), b[start:].split(", "), strict=True)
    return all(
        _close(*(map(float, numbers.findall(p)) for p in pair), exact, fitted, pair[0]) for pair in parts
    )


def _close(x: Iterable[float], y: Iterable[float], exact: bool, fitted: float, part: str) -> bool:
    """Whether numbers agree: each by itself, or beside the largest of them, or, where they are shares, beside one."""
    pairs = list(zip(x, y, strict=True))
    largest = max((abs(v) for pair in pairs for v in pair if math.isfinite(v)), default=0.0)
    scale = 1.0 if part.startswith("shares") else 0.0 if exact else largest
    tolerance = CURVES if exact else fitted
    return all(
        u == v or (u != u and v != v) or abs(u - v) <= tolerance * max(abs(u), abs(v), scale)
        for u, v in pairs
    )


def digest(words: Sequence[str]) -> str:
    """Of texts in a long column."""
    return hashlib.sha256("\n".join(words).encode()).hexdigest()[:16]
