# SPDX-License-Identifier: BSD-3-Clause
"""Arguments that are probabilities: levels of confidence, chances of a false alarm, shares."""

from __future__ import annotations

import numpy as np

from allanite.errors import InputError

__all__ = ["require_probabilities"]


def require_probabilities(**values: object) -> None:
    """Refuse arguments that do not lie between 0 and 1, by their names.

    Raises
    ------
    InputError
        One of them is no number between 0 and 1, or 0 or 1 itself.
    """
    for name, value in values.items():
        is_number = isinstance(value, (int, float, np.number)) and not isinstance(value, bool)
        if not (is_number and 0 < value < 1):  # type: ignore[operator]  # a number, as was just said
            example = " (0.95 for 95 %)" if name == "confidence" else ""
            raise InputError(f"{name} must lie between 0 and 1{example}, not {value!r}")
