# SPDX-License-Identifier: BSD-3-Clause
"""What only the user knows of the set-up, as options give it."""

from __future__ import annotations

from typing import Any

from allanite.quantities.setup_uncertainty import SetupUncertainty

__all__ = ["stated_in"]

_NAMES = {
    "scale_uncertainty": "scale",
    "latitude_uncertainty": "latitude",
    "tilt": "tilt",
    "heading_uncertainty": "heading",
}


def stated_in(options: dict[str, Any]) -> SetupUncertainty:
    """The uncertainties among options, those of `SETUP`; they are taken out of them."""
    given = {field: options.pop(name, None) for name, field in _NAMES.items()}
    return SetupUncertainty(**{field: value for field, value in given.items() if value is not None})
