# SPDX-License-Identifier: BSD-3-Clause
"""Results as plain data for JSON, and out of it."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from enum import Enum
from typing import Any

import numpy as np

from allanite.errors import FormatError, InputError
from allanite.plain_files.limits import DEPTH, DIGITS
from allanite.plain_files.regular_file import read_regular_text

__all__ = ["load_plain", "parse_plain", "plain"]


def plain(value: Any) -> Any:
    """Lists, dictionaries and finite numbers; None for what is not a number; of a result its document."""
    if isinstance(value, (np.ndarray, np.generic)):
        return plain(value.tolist())
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, (tuple, list)):
        return [plain(v) for v in value]
    if isinstance(value, Mapping):
        return {k: plain(v) for k, v in value.items()}
    if hasattr(value, "to_json"):
        made = value.to_json()
        return made if getattr(value, "PLAIN", False) else plain(made)
    if hasattr(value, "__dataclass_fields__"):
        return {name: plain(getattr(value, name)) for name in value.__dataclass_fields__}
    return value


def parse_plain(text: str | bytes) -> Any:
    """The data in a JSON text that anybody may have written: as `json.loads`, within limits.

    Raises
    ------
    ValueError
        Not JSON, more than 64 levels deep, a whole number of more than 40 digits, or a number that is infinite.
    """
    try:
        data = json.loads(text, parse_int=_whole, parse_float=_finite, parse_constant=_constant)
    except RecursionError:
        raise ValueError(f"lists and objects more than {DEPTH} deep") from None
    _refuse_depth(data)
    return data


def _whole(digits: str) -> int:
    if len(digits) > DIGITS:
        raise ValueError(f"a whole number of {len(digits)} digits; at most {DIGITS} are read")
    return int(digits)


def _finite(digits: str) -> float:
    value = float(digits)
    if math.isinf(value):
        raise ValueError(f"{digits[:DIGITS]} is too large for a number in double precision")
    return value


def _constant(word: str) -> float:
    if word != "NaN":
        raise ValueError(f"{word} is not a valid JSON number")
    return math.nan


def _refuse_depth(data: Any) -> None:
    """Level by level, so that depth costs no stack."""
    level = [data]
    for _ in range(DEPTH):
        inner = [list(v.values()) if isinstance(v, dict) else v for v in level if isinstance(v, (dict, list))]
        level = [v for several in inner for v in several]
    if any(isinstance(v, (dict, list)) for v in level):
        raise ValueError(f"lists and objects more than {DEPTH} deep")


def load_plain(path: str | os.PathLike[str], wanted: str) -> Any:
    """The content of a JSON file.

    Parameters
    ----------
    wanted : str
        For messages: which file is expected, and what makes one.

    Raises
    ------
    InputError
        No such file, or no regular one.
    FormatError
        Not JSON.
    """
    try:
        text = read_regular_text(path)
    except FileNotFoundError:
        raise InputError(f"no such file: {path}") from None
    except (OSError, UnicodeDecodeError) as error:
        raise FormatError(f"{path} is not JSON ({error}): expected {wanted}") from None
    try:
        return parse_plain(text)
    except ValueError as error:
        raise FormatError(f"{path} is not JSON ({error}): expected {wanted}") from None
