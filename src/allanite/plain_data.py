# SPDX-License-Identifier: BSD-3-Clause
"""Results as plain data for JSON, and out of it."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from allanite.errors import FormatError, InputError

__all__ = ["load_plain", "plain"]


def plain(value: Any) -> Any:
    """Lists, dictionaries and finite numbers; None for what is not a number."""
    if isinstance(value, np.ndarray):
        return [plain(v) for v in value.tolist()]
    if isinstance(value, (float, np.floating)):
        return float(value) if math.isfinite(value) else None
    if isinstance(value, (tuple, list)):
        return [plain(v) for v in value]
    if isinstance(value, Mapping):
        return {k: plain(v) for k, v in value.items()}
    if hasattr(value, "__dataclass_fields__"):
        return {name: plain(getattr(value, name)) for name in value.__dataclass_fields__}
    return value


def load_plain(path: str | os.PathLike[str], wanted: str) -> Any:
    """The content of a JSON file.

    Parameters
    ----------
    wanted : str
        For messages: which file is expected, and what makes one.

    Raises
    ------
    InputError
        No such file.
    FormatError
        Not JSON.
    """
    try:
        return json.loads(Path(path).read_text(encoding="utf-8"))
    except FileNotFoundError:
        raise InputError(f"no such file: {path}") from None
    except (OSError, ValueError, RecursionError) as error:
        raise FormatError(f"{path} is not JSON ({error}): give {wanted}") from None
