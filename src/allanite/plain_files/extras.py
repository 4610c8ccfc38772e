# SPDX-License-Identifier: BSD-3-Clause
"""Packages that not everybody installs, which an extra of allanite brings: the one sentence of where one is missing."""

from __future__ import annotations

import importlib.util

from allanite.errors import AllaniteError, InputError

__all__ = ["require"]


def require(
    package: str, extra: str, what: str, otherwise: str = "", *, error: type[AllaniteError] = InputError
) -> None:
    """Refuse what cannot be done without a package that is not installed.

    Parameters
    ----------
    package : str
        Its name when it is imported.
    extra : str
        Extra of allanite that installs it.
    what : str
        What needs it, as the subject of the sentence.
    otherwise : str
        What else can be done, with the comma before it.
    error : type
        Error of the room that asks.

    Raises
    ------
    InputError, or `error`
        The package is not installed.
    """
    if importlib.util.find_spec(package) is None:
        raise error(
            f'{what} needs {package}, which is not installed: pip install "allanite[{extra}]"{otherwise}'
        )
