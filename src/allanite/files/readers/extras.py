# SPDX-License-Identifier: BSD-3-Clause
"""Formats that are read with a package of others, which an extra of allanite installs."""

from __future__ import annotations

import importlib.util
from pathlib import Path

from allanite.errors import InputError

__all__ = ["require"]


def require(package: str, extra: str, path: Path, what: str, otherwise: str = "") -> None:
    """Refuse a file that cannot be read without a package which is not installed.

    Parameters
    ----------
    package : str
        Its name when it is imported.
    extra : str
        Extra of allanite that installs it.
    path : Path
        The file.
    what : str
        What the file is, with its article.
    otherwise : str
        What else can be done, with the comma before it.

    Raises
    ------
    InputError
        The package is not installed.
    """
    if importlib.util.find_spec(package) is None:
        raise InputError(
            f"{path.name} is {what}; reading it needs one more package: "
            f'pip install "allanite[{extra}]"{otherwise}'
        )
